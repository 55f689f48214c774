use super::*;
use crate::image::samples::Samples;
use crate::progress::Silent;

const WIDTH: usize = 24;
const HEIGHT: usize = 18;

fn image(channels: usize, of: impl Fn(usize, usize) -> [u8; 4]) -> Image {
    let places = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let pixel = |(x, y)| of(x, y).into_iter().take(channels);
    Image {
        width: WIDTH,
        height: HEIGHT,
        channels,
        samples: Samples::Eight(places.flat_map(pixel).collect()),
    }
}

fn pattern(x: usize, y: usize) -> [u8; 4] {
    [x * 7 + y * 3, x * x + y * 5, x * y + 40, 255].map(|v| (v % 256) as u8)
}

fn disturbed(x: usize, y: usize) -> [u8; 4] {
    let mut pixel = pattern(x, y);
    if (x + 2 * y).is_multiple_of(5) {
        pixel[0] ^= 12;
    }
    if (x * y) % 7 == 3 {
        pixel[2] = pixel[2].wrapping_add(30);
    }
    pixel
}

fn difference(a: &Image, b: &Image) -> ImageDifference {
    compare(a, b, &Silent).expect("images of one size")
}

fn assert_near(found: Option<f64>, wanted: f64) {
    let found = found.expect("a figure");
    assert!(
        (found - wanted).abs() < 1e-9 * wanted,
        "{found}, not {wanted}"
    );
}

/// The figures of scikit-image 0.26: `peak_signal_noise_ratio`, and `structural_similarity` with
/// Gaussian weights of 1.5 and without sample covariance.
#[test]
fn figures_are_those_of_scikit_image() {
    let colour = difference(&image(3, pattern), &image(3, disturbed));
    assert_near(colour.psnr_db, 27.43133766152868);
    assert_near(colour.ssim, 0.9988708771784464);
    let green = |x, y| [pattern(x, y)[1], 0, 0, 0];
    let lighter = |x: usize, y| [pattern(x, y)[1].saturating_add((x % 4) as u8), 0, 0, 0];
    let grey = difference(&image(1, green), &image(1, lighter));
    assert_near(grey.psnr_db, 42.718941750146726);
    assert_near(grey.ssim, 0.9993114991472544);
    assert_eq!(grey.max_channel.as_deref(), Some("grey"));
}

#[test]
fn equal_images_have_no_ratio_and_full_similarity() {
    let same = difference(&image(4, pattern), &image(3, pattern));
    assert!(same.identical && same.differing == 0 && same.max == 0.0 && same.rms == 0.0);
    assert_eq!((same.first, same.max_at, same.psnr_db), (None, None, None));
    assert_near(same.ssim, 1.0);
}

#[test]
fn the_largest_difference_is_named_with_its_place() {
    let a = image(4, pattern);
    let b = image(4, |x, y| {
        let mut pixel = pattern(x, y);
        match (x, y) {
            (3, 2) => pixel[1] = pixel[1].wrapping_add(5),
            (7, 9) => pixel[3] = 55,
            _ => {}
        }
        pixel
    });
    let found = difference(&a, &b);
    assert_eq!((found.differing, found.first), (2, Some([3, 2])));
    assert_eq!((found.max, found.max_at), (200.0, Some([7, 9])));
    assert_eq!(found.max_channel.as_deref(), Some("opacity"));
    let squares = 25.0 + 40_000.0;
    assert!((found.rms - f64::sqrt(squares / (24.0 * 18.0 * 4.0))).abs() < 1e-12);
    let back = difference(&b, &a);
    assert_eq!((found.rms, found.ssim), (back.rms, back.ssim));
}

#[test]
fn sixteen_bits_are_finer_steps_of_the_same_range() {
    let eight = image(1, pattern);
    let Samples::Eight(bytes) = &eight.samples else {
        unreachable!("made of bytes");
    };
    let mut words: Vec<u16> = bytes.iter().map(|v| u16::from(*v) * 257).collect();
    let wide = |words: &[u16]| Image {
        samples: Samples::Sixteen(words.to_vec()),
        ..eight.clone()
    };
    let same = difference(&eight, &wide(&words));
    assert!(same.identical && (same.bits_a, same.bits_b) == (8, 16));
    words[5] += 1;
    let finer = difference(&eight, &wide(&words));
    assert_eq!((finer.differing, finer.max), (1, 1.0 / 257.0));
}

#[test]
fn small_images_have_no_similarity_and_other_sizes_are_refused() {
    let small = Image {
        width: 2,
        height: 1,
        channels: 1,
        samples: Samples::Eight(vec![0, 255]),
    };
    let other = Image {
        samples: Samples::Eight(vec![255, 255]),
        ..small.clone()
    };
    let found = difference(&small, &other);
    assert_eq!((found.ssim, found.max, found.share), (None, 255.0, 0.5));
    let message = compare(&small, &image(1, pattern), &Silent).map_err(|e| e.to_string());
    let wanted = "image A has 2 x 1 pixels, image B has 24 x 18";
    assert_eq!(message.err().as_deref(), Some(wanted));
    let broken = Image { width: 3, ..small };
    assert!(compare(&broken, &broken, &Silent).is_err());
}
