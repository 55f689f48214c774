//! How far two images of one size are from each other.

use crate::error::{Error, Fault, Result};
use crate::image::samples::Image;
use crate::progress::Progress;
use crate::report::Accuracy;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

mod ssim;

/// Samples that [`Image::rgba`] gives for one step of eight bits.
const STEP: f64 = 257.0;

/// How two images differ. Pixels are named by column and row, from 0 at the top left.
///
/// Whatever the files hold, images are compared as red, green, blue and opacity in steps of eight
/// bits: 255 is full; images of 16 bits differ by fractions of a step.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ImageDifference {
    /// Whether no pixel differs.
    pub identical: bool,
    /// Pixels along a row, of both.
    pub width: u64,
    /// Rows, of both.
    pub height: u64,
    /// Samples of a pixel of the first image.
    pub channels_a: u64,
    /// Samples of a pixel of the second image.
    pub channels_b: u64,
    /// Bits of a sample of the first image.
    pub bits_a: u32,
    /// Bits of a sample of the second image.
    pub bits_b: u32,
    /// Pixels of either image.
    pub pixels: u64,
    /// Pixels that differ in any channel.
    pub differing: u64,
    /// `differing / pixels`; 0 where there is none.
    pub share: f64,
    /// The first pixel that differs, rows in order.
    pub first: Option<[u64; 2]>,
    /// The largest difference of a channel, in steps of eight bits.
    pub max: f64,
    /// The first pixel that has it; null where none differs.
    pub max_at: Option<[u64; 2]>,
    /// The channel that has it there: `red`, `green`, `blue` or `opacity`, `grey` where both
    /// images have no colour; null where none differs.
    pub max_channel: Option<String>,
    /// Root mean square of the differences of all pixels and of the channels that one of the
    /// images has, in steps of eight bits.
    pub rms: f64,
    /// Peak signal-to-noise ratio in decibels, `20 log10(255 / rms)`; null where none differs.
    pub psnr_db: Option<f64>,
    /// Structural similarity of the luma, 1 where it is the same; null for images of less than 11
    /// pixels either way.
    pub ssim: Option<f64>,
}

impl ImageDifference {
    /// The largest difference of a channel, as the accuracy of a report.
    pub fn accuracy(&self) -> Accuracy {
        Accuracy {
            measure: "largest channel difference".to_owned(),
            unit: "step of 1/255".to_owned(),
            bound: Some(self.max),
            reached: Some(self.max),
            reference: "every pixel".to_owned(),
            verified: true,
        }
    }
}

/// Bytes held while an image is compared, beside the images themselves.
pub fn room(image: &Image) -> u128 {
    // The luma of both.
    2 * size_of::<f64>() as u128 * image.pixels() as u128
}

/// Compares two images pixel by pixel.
///
/// Differences are exact. The structural similarity is that of luma (ITU-R BT.709 weights of the
/// stored values, opacity left aside) in 11 x 11 Gaussian windows of standard deviation 1.5, over
/// the windows that lie inside the image; K1 = 0.01, K2 = 0.03. Errors when the sizes differ, or an
/// image is not what [`Image::check`] promises. Cost: O(pixels), and 16 bytes held for each.
///
/// Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility to
/// structural similarity" (2004), section III.
pub fn compare(a: &Image, b: &Image, progress: &dyn Progress) -> Result<ImageDifference> {
    for (name, image) in [("A", a), ("B", b)] {
        image.check().map_err(|fault| {
            Error::Geometry(Fault {
                problem: format!("image {name}: {}", fault.problem),
                ..fault
            })
        })?;
    }
    if (a.width, a.height) != (b.width, b.height) {
        let problem = format!(
            "image A has {} x {} pixels, image B has {} x {}",
            a.width, a.height, b.width, b.height
        );
        let hint = "only images of the same size can be compared";
        return Err(Error::Geometry(Fault::whole(problem).with_hint(hint)));
    }
    progress.stage("compare", a.height as u64);
    let rows: Vec<Row> = (0..a.height)
        .into_par_iter()
        .map(|y| compare_row(a, b, y))
        .collect();
    progress.advance(a.height as u64);
    let mut all = Row::default();
    for row in &rows {
        all.then(row);
    }
    let pixels = a.pixels();
    let grey = a.channels < 3 && b.channels < 3;
    let opacity = a.channels.is_multiple_of(2) || b.channels.is_multiple_of(2);
    let channels = if grey { 1 } else { 3 } + usize::from(opacity);
    // Grey differs three times as red, green and blue.
    let squares = if grey { all.colour / 3.0 } else { all.colour } + all.opacity;
    let rms = (squares / (pixels * channels).max(1) as f64).sqrt() / STEP;
    let place = |at: usize| [at % a.width, at / a.width].map(|c| c as u64);
    let names = ["red", "green", "blue", "opacity"];
    let name = |c: usize| if grey && c < 3 { "grey" } else { names[c] };
    progress.stage("structural-similarity", 0);
    Ok(ImageDifference {
        identical: all.differing == 0,
        width: a.width as u64,
        height: a.height as u64,
        channels_a: a.channels as u64,
        channels_b: b.channels as u64,
        bits_a: a.bits(),
        bits_b: b.bits(),
        pixels: pixels as u64,
        differing: all.differing,
        share: all.differing as f64 / pixels.max(1) as f64,
        first: all.first.map(place),
        max: f64::from(all.max) / STEP,
        max_at: all.max_at.map(|(at, _)| place(at)),
        max_channel: all.max_at.map(|(_, channel)| name(channel).to_owned()),
        rms,
        psnr_db: (all.differing > 0).then(|| 20.0 * (255.0 / rms).log10()),
        ssim: ssim::mean(a, b),
    })
}

/// What some rows say. Squares are sums of whole numbers below 2^53 for rows of less than 2^20
/// pixels, so they hardly ever round.
#[derive(Default)]
struct Row {
    differing: u64,
    first: Option<usize>,
    max: u16,
    /// The pixel and the channel.
    max_at: Option<(usize, usize)>,
    colour: f64,
    opacity: f64,
}

impl Row {
    fn then(&mut self, next: &Row) {
        self.differing += next.differing;
        self.first = self.first.or(next.first);
        if next.max > self.max {
            self.max = next.max;
            self.max_at = next.max_at;
        }
        self.colour += next.colour;
        self.opacity += next.opacity;
    }
}

fn compare_row(a: &Image, b: &Image, y: usize) -> Row {
    let mut row = Row::default();
    for at in y * a.width..(y + 1) * a.width {
        let (left, right) = (a.rgba(at), b.rgba(at));
        if left == right {
            continue;
        }
        row.differing += 1;
        row.first = row.first.or(Some(at));
        for channel in 0..4 {
            let gap = left[channel].abs_diff(right[channel]);
            if gap > row.max {
                row.max = gap;
                row.max_at = Some((at, channel));
            }
            let square = f64::from(gap) * f64::from(gap);
            if channel < 3 {
                row.colour += square;
            } else {
                row.opacity += square;
            }
        }
    }
    row
}

#[cfg(test)]
mod tests;
