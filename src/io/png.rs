//! PNG images.

use super::refusal::{RAISE, Refusal, expect_room};
use super::source::Source;
use crate::error::Fault;
use crate::image::samples::{Image, Samples};
use png::{
    BitDepth, ColorType, Decoder, DecodingError, DeflateCompression, Encoder, EncodingError,
    Filter, Limits, Transformations,
};
use std::io::{self, Cursor, Write};

/// The first bytes of every PNG file.
pub(super) const MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Pixels of pictures that are packed as well as may be.
const LARGE: usize = 1 << 20;

/// A byte of deflate stands for at most this many: 258 for two bits.
const MOST_PACKED: u128 = 1032;

/// Reads a PNG image; samples of 16 bits stay so.
///
/// Palettes become colours, samples of less than 8 bits are widened to 8, and a transparent colour
/// becomes a channel of opacity. Errors when the data is damaged or ends early, the image is an
/// animation, has more pixels than the file's bytes can stand for, or takes more than the source's
/// limit.
pub fn read(source: &Source) -> Result<Image, Refusal> {
    let bytes = usize::try_from(source.limit()).unwrap_or(usize::MAX);
    let mut decoder = Decoder::new_with_limits(Cursor::new(source.bytes()), Limits { bytes });
    // By the header alone: what it claims is not made room for before.
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (header.width, header.height);
    // A palette or a transparent colour may stand for four samples of a byte.
    let depth = if header.bit_depth == BitDepth::Sixteen {
        2
    } else {
        1
    };
    let needed = u128::from(width) * u128::from(height) * 4 * depth;
    if needed > isize::MAX as u128 {
        return Err(Fault::whole(format!(
            "an image of {width} x {height} pixels is larger than memory can be"
        ))
        .into());
    }
    let packed = source.bytes().len();
    let unpacked =
        u128::from(height) * (u128::from(width) * header.bits_per_pixel() as u128).div_ceil(8);
    if unpacked > MOST_PACKED * packed as u128 {
        return Err(Fault::whole(format!(
            "an image of {width} x {height} pixels holds {unpacked} bytes, which the file's {packed} cannot stand for"
        ))
        .into());
    }
    let what = || format!("an image of {width} x {height} pixels");
    expect_room(what, needed, source.limit(), RAISE)?;
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(damaged)?;
    if let Some(animation) = reader.info().animation_control {
        return Err(Fault::whole(format!(
            "an animation of {} frames; only single images are read",
            animation.num_frames
        ))
        .into());
    }
    let size = reader.output_buffer_size();
    let size = size.ok_or_else(|| Fault::whole("the image is larger than memory can be"))?;
    let mut bytes = vec![0; size];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    reader.finish().map_err(damaged)?;
    let (colour, depth) = reader.output_color_type();
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => {
            return Err(Fault::whole("the palette's colours are missing").into());
        }
    };
    let samples = if depth == BitDepth::Sixteen {
        let (pairs, _) = bytes.as_chunks();
        Samples::Sixteen(pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect())
    } else {
        Samples::Eight(bytes)
    };
    Ok(Image {
        width: width as usize,
        height: height as usize,
        channels,
        samples,
    })
}

/// Writes an image with its own channels and bits, lossless.
///
/// Errs as its target does, and for sides that are 0 or above 2^32 - 1, which the format cannot hold.
pub fn write(image: &Image, out: &mut dyn Write) -> io::Result<()> {
    let side = |side: usize| u32::try_from(side).unwrap_or(0);
    let mut encoder = Encoder::new(out, side(image.width), side(image.height));
    encoder.set_color(match image.channels {
        1 => ColorType::Grayscale,
        2 => ColorType::GrayscaleAlpha,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    });
    // The last tenth of a large picture's bytes takes longer than all the rest.
    let level = if image.pixels() > LARGE { 3 } else { 9 };
    encoder.set_deflate_compression(DeflateCompression::Level(level));
    encoder.set_filter(Filter::Adaptive);
    let swapped;
    let bytes = match &image.samples {
        Samples::Eight(bytes) => {
            encoder.set_depth(BitDepth::Eight);
            bytes
        }
        Samples::Sixteen(words) => {
            encoder.set_depth(BitDepth::Sixteen);
            swapped = words.iter().flat_map(|w| w.to_be_bytes()).collect();
            &swapped
        }
    };
    let mut writer = encoder.write_header().map_err(broken)?;
    writer.write_image_data(bytes).map_err(broken)?;
    writer.finish().map_err(broken)
}

fn broken(e: EncodingError) -> io::Error {
    match e {
        EncodingError::IoError(error) => error,
        other => io::Error::new(io::ErrorKind::InvalidInput, other.to_string()),
    }
}

fn damaged(e: DecodingError) -> Fault {
    let said = e.to_string();
    let problem = if said.starts_with("CRC error") {
        // The decoder shows its own types here.
        "the checksum of a chunk does not match its bytes".to_owned()
    } else {
        let mut letters = said.trim_end_matches('.').chars();
        let first = letters.next().map(|c| c.to_ascii_lowercase());
        first.into_iter().chain(letters).collect()
    };
    Fault::whole(format!("the PNG data is damaged: {problem}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(colour: ColorType, depth: BitDepth, palette: Option<&[u8]>, data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 2, 2);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette.to_vec());
        }
        let mut writer = encoder.write_header().expect("a vector takes all");
        writer.write_image_data(data).expect("as many bytes");
        writer.finish().expect("a vector takes all");
        out
    }

    fn decoded(bytes: Vec<u8>) -> Result<Image, Fault> {
        let image = read(&Source::from_bytes("test.png", bytes).expect("no gzip layer"))
            .map_err(Refusal::fault)?;
        image.check()?;
        Ok(image)
    }

    #[test]
    fn all_kinds_of_samples_are_read_as_they_are() {
        let data: Vec<u8> = (1..=32).collect();
        let kinds = [
            (ColorType::Grayscale, 1),
            (ColorType::GrayscaleAlpha, 2),
            (ColorType::Rgb, 3),
            (ColorType::Rgba, 4),
        ];
        for (colour, channels) in kinds {
            let image = decoded(encoded(
                colour,
                BitDepth::Eight,
                None,
                &data[..4 * channels],
            ));
            let image = image.expect("a sound image");
            assert_eq!(
                (image.width, image.height, image.channels),
                (2, 2, channels)
            );
            assert_eq!(image.samples, Samples::Eight(data[..4 * channels].to_vec()));
            let image = decoded(encoded(
                colour,
                BitDepth::Sixteen,
                None,
                &data[..8 * channels],
            ));
            let Samples::Sixteen(words) = image.expect("a sound image").samples else {
                panic!("16 bits became 8");
            };
            assert_eq!((words.len(), words[1]), (4 * channels, 0x0304));
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        for channels in 1..=4 {
            let count = 3 * 2 * channels as u16;
            let eight = (0..count).map(|i| (i * 7) as u8).collect();
            let sixteen = (0..count).map(|i| i * 2731).collect();
            for samples in [Samples::Eight(eight), Samples::Sixteen(sixteen)] {
                let image = Image {
                    width: 3,
                    height: 2,
                    channels,
                    samples,
                };
                let mut bytes = Vec::new();
                write(&image, &mut bytes).expect("a vector takes all");
                assert_eq!(decoded(bytes), Ok(image));
            }
        }
    }

    #[test]
    fn palettes_and_single_bits_become_bytes() {
        let palette = [9, 8, 7, 250, 251, 252];
        let bits = [0b0100_0000, 0b1000_0000];
        let image = decoded(encoded(
            ColorType::Indexed,
            BitDepth::One,
            Some(&palette),
            &bits,
        ));
        let image = image.expect("a sound image");
        let [dark, light] = [&palette[..3], &palette[3..]];
        let wanted = [dark, light, light, dark].concat();
        assert_eq!((image.channels, image.samples), (3, Samples::Eight(wanted)));
        let image = decoded(encoded(ColorType::Grayscale, BitDepth::One, None, &bits));
        let wanted = Samples::Eight(vec![0, 255, 255, 0]);
        assert_eq!(image.expect("a sound image").samples, wanted);
    }

    #[test]
    fn a_header_that_claims_more_than_the_data_can_hold_is_refused() {
        let claimed = |side: u32, data: &[u8]| {
            let mut out = Vec::new();
            let mut writer = Encoder::new(&mut out, side, side)
                .write_header()
                .expect("a vector takes all");
            writer
                .write_chunk(png::chunk::IDAT, data)
                .expect("a vector takes all");
            drop(writer);
            let packed = out.len();
            let problem = decoded(out).expect_err("a few bytes are no image");
            (problem.problem, packed)
        };
        let (problem, packed) = claimed(60_000, &[0; 250]);
        assert_eq!(
            problem,
            format!(
                "an image of 60000 x 60000 pixels holds 3600000000 bytes, which the file's {packed} cannot stand for"
            )
        );
        // What the bytes could stand for is looked into, and found damaged.
        let (problem, _) = claimed(100, &[0; 250]);
        assert!(problem.starts_with("the PNG data is damaged"), "{problem}");
    }

    #[test]
    fn one_colour_packs_as_far_as_deflate_goes() {
        let image = Image {
            width: 4096,
            height: 2048,
            channels: 1,
            samples: Samples::Eight(vec![9; 4096 * 2048]),
        };
        let mut bytes = Vec::new();
        write(&image, &mut bytes).expect("a vector takes all");
        assert!(bytes.len() < 4096 * 2048 / 600, "{}", bytes.len());
        assert_eq!(decoded(bytes), Ok(image));
    }

    #[test]
    fn no_cut_and_no_changed_byte_panics() {
        let whole = encoded(ColorType::Rgb, BitDepth::Eight, None, &[77; 12]);
        for end in 0..whole.len() {
            assert!(
                decoded(whole[..end].to_vec()).is_err(),
                "{end} bytes are enough"
            );
        }
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut changed = whole.clone();
                changed[at] ^= 1 << bit;
                if let Ok(image) = decoded(changed) {
                    assert!(image.pixels() <= 1 << 20);
                }
            }
        }
    }
}
