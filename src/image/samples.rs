//! Images as files hold them: whole numbers of 8 or 16 bits, with or without colour and opacity.

use super::colour::to_srgb;
use super::raster::Raster;
use crate::error::Fault;
use crate::report::Content;

/// Samples of an image, row by row from the top left, the channels of a pixel together.
///
/// One channel is grey, two are grey and opacity, three are red, green and blue, four have opacity
/// last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples of a pixel, 1 to 4.
    pub channels: usize,
    /// Their numbers.
    pub samples: Samples,
}

/// The numbers of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// 0 to 255.
    Eight(Vec<u8>),
    /// 0 to 65535.
    Sixteen(Vec<u16>),
}

impl Image {
    /// The nearest bytes on the sRGB curve to some light.
    pub fn from_light(light: &Raster) -> Image {
        let bytes = light.pixels().iter().flat_map(|pixel| to_srgb(*pixel));
        Image {
            width: light.width(),
            height: light.height(),
            channels: 3,
            samples: Samples::Eight(bytes.collect()),
        }
    }

    /// Bits of a sample: 8 or 16.
    pub fn bits(&self) -> u32 {
        match self.samples {
            Samples::Eight(_) => 8,
            Samples::Sixteen(_) => 16,
        }
    }

    /// Pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// What it holds, for a report.
    pub fn content(&self) -> Content {
        Content {
            pixels: Some([self.width as u64, self.height as u64]),
            channels: Some(self.channels as u64),
            bits: Some(self.bits()),
            ..Content::default()
        }
    }

    /// Errors unless there are 1 to 4 channels and as many samples as the sizes say.
    pub fn check(&self) -> Result<(), Fault> {
        let (width, height, channels) = (self.width, self.height, self.channels);
        let found = match &self.samples {
            Samples::Eight(samples) => samples.len(),
            Samples::Sixteen(samples) => samples.len(),
        };
        let wanted = width.checked_mul(height);
        let wanted = wanted.and_then(|pixels| pixels.checked_mul(channels));
        if !(1..=4).contains(&channels) || wanted != Some(found) {
            return Err(Fault::whole(format!(
                "an image of {width} x {height} pixels with {channels} channels has {found} samples"
            )));
        }
        Ok(())
    }

    /// A pixel as red, green, blue and opacity, 0 to 65535 whatever its bits: 255 of eight bits
    /// is 65535. Grey is three equal colours, and what has no opacity is opaque.
    pub fn rgba(&self, pixel: usize) -> [u16; 4] {
        let sample = |channel: usize| {
            let at = pixel * self.channels + channel;
            match &self.samples {
                Samples::Eight(samples) => u16::from(samples[at]) * 257,
                Samples::Sixteen(samples) => samples[at],
            }
        };
        match self.channels {
            1 | 2 => {
                let grey = sample(0);
                let opacity = if self.channels == 2 {
                    sample(1)
                } else {
                    u16::MAX
                };
                [grey, grey, grey, opacity]
            }
            _ => {
                let opacity = if self.channels == 4 {
                    sample(3)
                } else {
                    u16::MAX
                };
                [sample(0), sample(1), sample(2), opacity]
            }
        }
    }
}
