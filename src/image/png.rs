//! Pictures to PNG bytes.

use super::colour::Srgb;
use super::raster::Picture;
use png::{BitDepth, ColorType, DeflateCompression, Encoder, Filter};
use rayon::prelude::*;

/// The largest picture for a first page, in bytes.
pub const README_LIMIT: usize = 200_000;

/// The picture as a PNG file, lossless.
///
/// Equal pictures give equal bytes. Cost: linear in the pixels.
pub fn encode(picture: &Picture) -> Vec<u8> {
    let bytes: Vec<u8> = picture.pixels().iter().flatten().copied().collect();
    pack(picture, &bytes, None, Filter::Adaptive)
}

/// The picture as a PNG file of at most `limit` bytes where that can be had.
///
/// Colours are reduced to 256, and while the file is too large to 192, 128, 96, 64, 48, 32 and 16;
/// what is still too large then is returned as it is. A rendered picture of one or two materials
/// is a few ramps of one colour each, on which 256 steps do not show. Equal pictures give equal
/// bytes. Cost: up to eight rounds over the pixels, one for a picture that fits at once.
pub fn encode_within(picture: &Picture, limit: usize) -> Vec<u8> {
    let histogram = Histogram::new(picture);
    let mut best = Vec::new();
    for count in [256, 192, 128, 96, 64, 48, 32, 16] {
        let palette = histogram.palette(count);
        let indices = histogram.indices(picture, &palette);
        let filters = [Filter::NoFilter, Filter::Sub, Filter::Paeth];
        let packed: Vec<Vec<u8>> = filters
            .par_iter()
            .map(|filter| pack(picture, &indices, Some(&palette), *filter))
            .collect();
        if let Some(smallest) = packed.into_iter().min_by_key(Vec::len) {
            best = smallest;
        }
        if best.len() <= limit || palette.len() < count {
            break;
        }
    }
    best
}

fn pack(picture: &Picture, bytes: &[u8], palette: Option<&[Srgb]>, filter: Filter) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, picture.width() as u32, picture.height() as u32);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_color(ColorType::Rgb);
    if let Some(palette) = palette {
        encoder.set_color(ColorType::Indexed);
        encoder.set_palette(palette.concat());
    }
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_deflate_compression(DeflateCompression::Level(9));
    encoder.set_filter(filter);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(bytes))
        .expect("a vector takes all bytes, and a picture has pixels and as many bytes as it says");
    out
}

/// The colours of a picture and how many pixels have each, sorted by colour.
struct Histogram {
    colours: Vec<(Srgb, u32)>,
}

impl Histogram {
    fn new(picture: &Picture) -> Self {
        let mut all = picture.pixels().to_vec();
        all.par_sort_unstable();
        let colours = all
            .chunk_by(|a, b| a == b)
            .map(|run| (run[0], run.len() as u32))
            .collect();
        Histogram { colours }
    }

    /// At most `count` colours that stand for all, from dark to light; all, if there are no more.
    ///
    /// Boxes of colours are split at the mean of their widest channel, the one with the largest
    /// squared error first (after Heckbert 1982), and two rounds of Lloyd's method settle them.
    fn palette(&self, count: usize) -> Vec<Srgb> {
        let mut colours = self.colours.clone();
        let mut boxes = vec![Span::new(&colours, 0, colours.len())];
        while boxes.len() < count {
            let worst = (0..boxes.len()).max_by(|a, b| {
                let by_error = boxes[*a].error.total_cmp(&boxes[*b].error);
                by_error.then(b.cmp(a))
            });
            let Some(worst) = worst.filter(|w| boxes[*w].error > 0.0) else {
                break;
            };
            let span = boxes[worst];
            let part = &mut colours[span.from..span.to];
            part.sort_unstable_by_key(|(c, _)| (c[span.channel], *c));
            let below = part.partition_point(|(c, _)| f64::from(c[span.channel]) <= span.mean);
            let middle = span.from + below.clamp(1, part.len() - 1);
            boxes[worst] = Span::new(&colours, span.from, middle);
            boxes.push(Span::new(&colours, middle, span.to));
        }
        let mut palette: Vec<Srgb> = boxes
            .iter()
            .map(|b| mean(colours[b.from..b.to].iter().copied()))
            .collect();
        for _ in 0..2 {
            let nearest = self.nearest(&palette);
            let mut members = vec![Vec::new(); palette.len()];
            for (pair, at) in self.colours.iter().zip(nearest) {
                members[at as usize].push(*pair);
            }
            for (colour, members) in palette.iter_mut().zip(members) {
                if !members.is_empty() {
                    *colour = mean(members.into_iter());
                }
            }
        }
        // The background must stay white.
        if let Some((last, _)) = self.colours.last().filter(|(c, _)| *c == [255; 3]) {
            let nearest = nearest_in(&palette, *last);
            palette[nearest as usize] = *last;
        }
        // Neighbours in the picture are then neighbours in the list, which filters make small.
        palette.sort_unstable_by_key(|c| {
            let lightness = 2 * u32::from(c[0]) + 5 * u32::from(c[1]) + u32::from(c[2]);
            (lightness, *c)
        });
        palette.dedup();
        palette
    }

    fn nearest(&self, palette: &[Srgb]) -> Vec<u8> {
        self.colours
            .par_iter()
            .map(|(c, _)| nearest_in(palette, *c))
            .collect()
    }

    /// The picture as indices into the palette.
    fn indices(&self, picture: &Picture, palette: &[Srgb]) -> Vec<u8> {
        let nearest = self.nearest(palette);
        let index = |c: &Srgb| {
            let at = self.colours.binary_search_by_key(c, |(colour, _)| *colour);
            nearest[at.expect("the histogram has every colour of its picture")]
        };
        picture.pixels().par_iter().map(index).collect()
    }
}

/// The index of the nearest colour, the first of equals.
fn nearest_in(palette: &[Srgb], colour: Srgb) -> u8 {
    let apart = |c: &Srgb| -> i32 {
        (0..3)
            .map(|a| (i32::from(c[a]) - i32::from(colour[a])).pow(2))
            .sum()
    };
    let nearest = (0..palette.len()).min_by_key(|i| apart(&palette[*i]));
    nearest.unwrap_or(0) as u8
}

fn mean(colours: impl Iterator<Item = (Srgb, u32)>) -> Srgb {
    let (sum, count) = colours.fold(([0u64; 3], 0u64), |(sum, count), (c, n)| {
        let n = u64::from(n);
        (
            std::array::from_fn(|a| sum[a] + u64::from(c[a]) * n),
            count + n,
        )
    });
    let count = count.max(1);
    sum.map(|s| ((s + count / 2) / count) as u8)
}

/// Colours `from..to` of a list, as a box to be split.
#[derive(Clone, Copy)]
struct Span {
    from: usize,
    to: usize,
    /// Sum over its pixels of the squared distance from the mean.
    error: f64,
    channel: usize,
    /// Mean in that channel.
    mean: f64,
}

impl Span {
    fn new(colours: &[(Srgb, u32)], from: usize, to: usize) -> Self {
        let mut count = 0.0;
        let (mut sum, mut square) = ([0.0; 3], [0.0; 3]);
        for (colour, n) in &colours[from..to] {
            let n = f64::from(*n);
            count += n;
            for a in 0..3 {
                let v = f64::from(colour[a]);
                sum[a] += n * v;
                square[a] += n * v * v;
            }
        }
        let count = f64::max(count, 1.0);
        let spread: [f64; 3] = std::array::from_fn(|a| square[a] - sum[a] * sum[a] / count);
        let channel = (0..3).fold(1, |c, a| if spread[a] > spread[c] { a } else { c });
        Span {
            from,
            to,
            error: if to - from > 1 {
                spread.iter().sum()
            } else {
                0.0
            },
            channel,
            mean: sum[channel] / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8]) -> (Vec<u8>, png::OutputInfo) {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("a header");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut pixels).expect("a frame");
        (pixels, info)
    }

    fn ramps() -> Picture {
        let mut picture = Picture::new(300, 90, [255; 3]);
        for y in 10..80 {
            for x in 20..280 {
                let level = ((x * 37 + y * y) % 251) as u8;
                let colour = if y < 40 {
                    [level; 3]
                } else {
                    [level / 2, level / 3, level]
                };
                picture.blend(x as isize, y as isize, colour, 1.0);
            }
        }
        picture
    }

    #[test]
    fn lossless_is_lossless() {
        let picture = ramps();
        let (pixels, info) = decode(&encode(&picture));
        assert_eq!((info.width, info.height), (300, 90));
        assert_eq!(pixels, picture.pixels().concat());
    }

    #[test]
    fn few_colours_are_kept_exactly_and_white_always() {
        let mut picture = Picture::new(40, 30, [255; 3]);
        picture.fill([3.0, 3.0], [20.0, 20.0], [86, 180, 233]);
        let (pixels, _) = decode(&encode_within(&picture, README_LIMIT));
        assert_eq!(pixels, picture.pixels().concat());
        let (pixels, _) = decode(&encode_within(&ramps(), README_LIMIT));
        assert_eq!(&pixels[..3], &[255; 3]);
    }

    #[test]
    fn reduced_colours_are_near() {
        let picture = ramps();
        let (pixels, _) = decode(&encode_within(&picture, README_LIMIT));
        let wanted = picture.pixels().concat();
        let worst = pixels
            .iter()
            .zip(&wanted)
            .map(|(a, b)| a.abs_diff(*b))
            .max();
        assert!(worst <= Some(4), "{worst:?}");
    }

    #[test]
    fn a_limit_is_met_by_fewer_colours() {
        let full = encode_within(&ramps(), README_LIMIT).len();
        let half = encode_within(&ramps(), full * 2 / 3).len();
        assert!(half <= full * 2 / 3, "{half} of {full}");
    }
}
