//! Colours: the sRGB curve and the palettes of all pictures.

use std::sync::LazyLock;

/// Red, green and blue as stored in a picture: bytes on the sRGB curve.
pub type Srgb = [u8; 3];

/// Red, green and blue proportional to light, 0 to 1.
pub type Linear = [f32; 3];

/// White, the background of all pictures.
pub const WHITE: Srgb = [255, 255, 255];

/// The colour of text and scale bars: nearly black.
pub const INK: Srgb = [38, 38, 42];

/// Text that steps back: labels and notes.
pub const FAINT_INK: Srgb = [105, 105, 112];

/// The neutral clay of what is not the thing of interest.
pub const CLAY: Srgb = [206, 199, 190];

/// Eight colours for classes that the colour-blind can tell apart: black, orange, sky blue, bluish
/// green, yellow, blue, vermillion, reddish purple.
///
/// Okabe and Ito, "Color Universal Design" (2008).
pub const OKABE_ITO: [Srgb; 8] = [
    [0, 0, 0],
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
];

/// Stops of the map for amounts, evenly spaced: dark violet over green to yellow, in steps of even
/// lightness (the course of viridis; van der Walt and Smith 2015).
const AMOUNT: [Srgb; 10] = [
    [68, 1, 84],
    [72, 40, 120],
    [62, 73, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [110, 206, 88],
    [181, 222, 43],
    [253, 231, 37],
];

/// Stops of the map for signed numbers: blue for negative, near white for 0, vermillion for positive.
const SIGNED: [Srgb; 5] = [
    [0, 84, 148],
    [92, 164, 212],
    [244, 243, 240],
    [236, 150, 88],
    [184, 66, 0],
];

/// The colour of an amount from 0 to 1; what is outside takes the nearest end, NaN takes 0.
pub fn amount(t: f64) -> Srgb {
    along(&AMOUNT, t)
}

/// The colour of a signed number from -1 to 1; what is outside takes the nearest end, NaN takes -1.
pub fn signed(t: f64) -> Srgb {
    along(&SIGNED, t * 0.5 + 0.5)
}

/// Class `index` in the Okabe-Ito colours without black, going round after seven.
pub fn class(index: usize) -> Srgb {
    OKABE_ITO[1 + index % 7]
}

fn along(stops: &[Srgb], t: f64) -> Srgb {
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    let place = t * (stops.len() - 1) as f64;
    let below = (place as usize).min(stops.len() - 2);
    let part = place - below as f64;
    std::array::from_fn(|c| {
        let (a, b) = (f64::from(stops[below][c]), f64::from(stops[below + 1][c]));
        (a + (b - a) * part).round() as u8
    })
}

/// The colour of `RRGGBB`, with or without `#` before it.
pub fn from_hex(text: &str) -> Option<Srgb> {
    let digits = text.strip_prefix('#').unwrap_or(text);
    let is_six = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
    let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_six)?;
    let [_, colour @ ..] = number.to_be_bytes();
    Some(colour)
}

/// The light of a byte on the sRGB curve (IEC 61966-2-1).
pub fn byte_to_linear(byte: u8) -> f32 {
    let v = f64::from(byte) / 255.0;
    let light = if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    };
    light as f32
}

/// The light of a colour.
pub fn to_linear(colour: Srgb) -> Linear {
    colour.map(byte_to_linear)
}

/// Steps of the table behind [`to_srgb`]; the darkest bytes are then 3 steps apart.
const STEPS: usize = 1 << 14;

static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let byte = |i: usize| {
        let light = i as f64 / STEPS as f64;
        let v = if light <= 0.003_130_8 {
            light * 12.92
        } else {
            1.055 * light.powf(1.0 / 2.4) - 0.055
        };
        (v * 255.0).round() as u8
    };
    (0..=STEPS).map(byte).collect()
});

/// The nearest colour on the sRGB curve; light above 1 is clipped, NaN is black.
pub fn to_srgb(light: Linear) -> Srgb {
    let table = &*BYTES;
    light.map(|v| table[(v.clamp(0.0, 1.0) * STEPS as f32 + 0.5) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_to_light_and_back() {
        for b in 0..=255 {
            assert_eq!(to_srgb(to_linear([b, b, b])), [b, b, b]);
        }
        assert_eq!(to_srgb([-1.0, 2.0, f32::NAN]), [0, 255, 0]);
    }

    #[test]
    fn maps_end_where_they_say() {
        assert_eq!(amount(-3.0), AMOUNT[0]);
        assert_eq!(amount(1.0), AMOUNT[9]);
        assert_eq!(signed(0.0), SIGNED[2]);
        assert_eq!(signed(f64::INFINITY), SIGNED[4]);
        assert_eq!(amount(f64::NAN), AMOUNT[0]);
        assert_eq!(signed(f64::NAN), SIGNED[0]);
        assert_eq!(class(1), OKABE_ITO[2]);
        assert_eq!(class(7), class(0));
    }

    #[test]
    fn amounts_grow_lighter_all_the_way() {
        let lightness = |c: Srgb| {
            let [r, g, b] = to_linear(c);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..100 {
            let (a, b) = (f64::from(i) / 100.0, f64::from(i + 1) / 100.0);
            assert!(lightness(amount(a)) < lightness(amount(b)), "{a}");
        }
    }
}
