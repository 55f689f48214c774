//! Axes: from numbers to pixels, and the ticks.

use super::scene::Words;
use super::{Axis, Scale};

/// Pixels of the lane of zeros, from the end of the logarithmic part to the plot's edge.
const LANE: f64 = 34.0;

/// White kept between the outermost points and the ends, as a share of the span.
const MARGIN: f64 = 0.05;

/// The largest power of ten, either way, that is written as a decimal number.
const DECIMAL: i32 = 3;

/// The most decades that have a tick each.
const MOST_DECADES: usize = 40;

/// An axis laid over its pixels.
pub(super) struct Fitted {
    scale: Scale,
    /// The ends, as logarithms where the scale is one.
    ends: [f64; 2],
    /// The pixels of the ends.
    pixels: [f64; 2],
    /// The pixel of the lane of zeros.
    pub zero: Option<f64>,
}

pub(super) struct Tick {
    /// The pixel.
    pub at: f64,
    /// What stands there; a tick without words is a small one.
    pub words: Words,
}

impl Tick {
    fn at(axis: &Fitted, place: f64, words: Words) -> Self {
        let at = axis.pixel(place);
        Tick { at, words }
    }
}

/// Whether a number has a place on a scale.
pub(super) fn has_place(scale: Scale, v: f64) -> bool {
    v.is_finite() && (scale == Scale::Linear || v >= 0.0)
}

/// The axis over its numbers, those without a place left aside, between two pixels.
pub(super) fn fit(axis: &Axis, numbers: &[f64], pixels: [f64; 2]) -> Fitted {
    let scale = axis.scale;
    let reach = axis.reach.into_iter().flatten();
    let numbers: Vec<f64> = numbers.iter().copied().chain(reach).collect();
    let numbers = numbers.iter().filter(|v| has_place(scale, **v));
    let zeros = scale != Scale::Linear && numbers.clone().any(|v| *v == 0.0);
    let places = numbers
        .filter(|v| scale == Scale::Linear || **v > 0.0)
        .map(|v| to_place(scale, *v));
    let (mut low, mut high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
        (lo.min(p), hi.max(p))
    });
    if low > high {
        // Nothing to show but perhaps zeros: any range will do.
        (low, high) = if scale == Scale::Linear {
            (0.0, 1.0)
        } else {
            (-1.0, 1.0)
        };
    }
    let ends = widened(scale, low, high);
    let lane = if zeros {
        LANE * (pixels[1] - pixels[0]).signum()
    } else {
        0.0
    };
    Fitted {
        scale,
        ends,
        pixels: [pixels[0] + lane, pixels[1]],
        zero: zeros.then(|| pixels[0] + lane * 0.45),
    }
}

/// The ends moved apart: a margin, and a span that ticks fit into.
fn widened(scale: Scale, low: f64, high: f64) -> [f64; 2] {
    let least = match scale {
        // Sixteen units in the last place, or something to see around zero.
        Scale::Linear => (low.abs().max(high.abs()) * 16.0 * f64::EPSILON).max(1e-300),
        // Where the numbers themselves end, only powers of ten can be ticks.
        Scale::Log if low < -300.0 || high > 300.0 => 3.4,
        Scale::Log => 0.2,
        Scale::Log2 => 2.2,
    };
    // Halves first: the span of two huge numbers may be no number.
    let half = (high * 0.5 - low * 0.5) * (1.0 + 2.0 * MARGIN);
    let half = if scale == Scale::Linear && half == 0.0 {
        (low.abs() * 0.05).max(least)
    } else {
        half.max(least * 0.5)
    };
    let middle = low * 0.5 + high * 0.5;
    [(middle - half).max(f64::MIN), (middle + half).min(f64::MAX)]
}

fn to_place(scale: Scale, v: f64) -> f64 {
    match scale {
        Scale::Linear => v,
        Scale::Log => v.log10(),
        Scale::Log2 => v.log2(),
    }
}

impl Fitted {
    /// The pixel of a number; `None` where it has no place.
    pub fn place(&self, v: f64) -> Option<f64> {
        if !has_place(self.scale, v) {
            return None;
        }
        if self.scale != Scale::Linear && v == 0.0 {
            return self.zero;
        }
        Some(self.pixel(to_place(self.scale, v)))
    }

    /// The pixel of a bound: below all numbers of a logarithmic axis lies its lower end.
    pub fn place_bound(&self, v: f64) -> f64 {
        self.place(v).unwrap_or(match v {
            v if v > 0.0 => self.pixels[1],
            _ => self.zero.unwrap_or(self.pixels[0]),
        })
    }

    /// Where the lane of zeros ends.
    pub fn start(&self) -> f64 {
        self.pixels[0]
    }

    fn pixel(&self, place: f64) -> f64 {
        let [low, high] = self.ends;
        // Quarters: neither span nor distance of two huge numbers overflows.
        let part = (place * 0.25 - low * 0.25) / (high * 0.25 - low * 0.25);
        self.pixels[0] + part.clamp(0.0, 1.0) * (self.pixels[1] - self.pixels[0])
    }

    /// The ticks in order, the lane of zeros first; at most `most` with words, plus the zero.
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        let most = most.max(3);
        let mut ticks = match self.scale {
            Scale::Linear => self.linear_ticks(most),
            Scale::Log => self.decade_ticks(most),
            Scale::Log2 => self.octave_ticks(most),
        };
        if let Some(at) = self.zero {
            let words = Words::plain("0");
            ticks.insert(0, Tick { at, words });
        }
        ticks
    }

    /// Multiples of 1, 2 or 5 times a power of ten, of numbers rather than logarithms.
    fn linear_ticks(&self, most: usize) -> Vec<Tick> {
        let ends = match self.scale {
            Scale::Linear => self.ends,
            Scale::Log => self.ends.map(|e| 10f64.powf(e)),
            Scale::Log2 => self.ends.map(f64::exp2),
        };
        let values = round_steps(ends, most);
        let largest = values.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let words = |v: f64| number(v, values.step, largest);
        let place = |v: f64| to_place(self.scale, v);
        let all = values.values.iter();
        all.map(|v| Tick::at(self, place(*v), words(*v))).collect()
    }

    fn decade_ticks(&self, most: usize) -> Vec<Tick> {
        let [low, high] = self.ends;
        let decades = low.ceil() as i32..=high.floor() as i32;
        if decades.clone().count() >= 3 {
            let (stride, first) = strides(&[1, 2, 3, 5, 10, 20, 50, 100], &decades, most);
            let labelled: Vec<i32> = (first..=*decades.end()).step_by(stride).collect();
            let decimal = labelled.iter().all(|k| k.abs() <= DECIMAL);
            let words = |k: i32| match (labelled.contains(&k), decimal) {
                (false, _) => Words::default(),
                (true, true) => decimal_number(1, k),
                (true, false) => power("10", k),
            };
            let mut ticks: Vec<Tick> = decades
                .clone()
                .filter(|k| labelled.contains(k) || labelled.len() * stride <= MOST_DECADES)
                .map(|k| Tick::at(self, f64::from(k), words(k)))
                .collect();
            if stride == 1 && decades.count() <= 8 {
                ticks.extend(self.multiples(&[2, 3, 4, 5, 6, 7, 8, 9], |_, _| Words::default()));
            }
            return ticks;
        }
        let labelled = self.multiples(&[1, 2, 5], |m, k| {
            if k.abs() <= DECIMAL {
                return decimal_number(m, k);
            }
            match m {
                1 => power("10", k),
                m => power(&format!("{m}×10"), k),
            }
        });
        if labelled.len() < 3 {
            return self.linear_ticks(most);
        }
        let small = self.multiples(&[3, 4, 6, 7, 8, 9], |_, _| Words::default());
        labelled.into_iter().chain(small).collect()
    }

    /// Ticks at these multiples of all powers of ten between the ends.
    fn multiples(&self, of: &[i32], words: impl Fn(i32, i32) -> Words) -> Vec<Tick> {
        let [low, high] = self.ends;
        (low.floor() as i32..=high.ceil() as i32)
            .flat_map(|k| of.iter().map(move |m| (*m, k)))
            .map(|(m, k)| (f64::from(m).log10() + f64::from(k), words(m, k)))
            .filter(|(place, _)| (low..=high).contains(place))
            .map(|(place, words)| Tick::at(self, place, words))
            .collect()
    }

    fn octave_ticks(&self, most: usize) -> Vec<Tick> {
        let octaves = self.ends[0].ceil() as i32..=self.ends[1].floor() as i32;
        let (stride, first) = strides(&[1, 2, 5, 10, 20, 25, 50, 100, 200, 500], &octaves, most);
        (first..=*octaves.end())
            .step_by(stride)
            .map(|k| Tick::at(self, f64::from(k), power("2", k)))
            .collect()
    }
}

/// The smallest of the strides with which multiples of it in a range are at most `most`, and the
/// first multiple.
fn strides(of: &[i32], range: &std::ops::RangeInclusive<i32>, most: usize) -> (usize, i32) {
    let first = |s: i32| -(-range.start()).div_euclid(s) * s;
    let count = |s: i32| ((range.end() - first(s)).div_euclid(s) + 1).max(0) as usize;
    let largest = of[of.len() - 1];
    let stride = of.iter().copied().find(|s| count(*s) <= most);
    let stride = stride.unwrap_or(largest);
    (stride as usize, first(stride))
}

struct Steps {
    values: Vec<f64>,
    /// The power of ten of the last digit that all values need.
    step: i32,
}

/// At most `most` multiples of 1, 2 or 5 times a power of ten between two numbers.
fn round_steps([low, high]: [f64; 2], most: usize) -> Steps {
    let raw = (high * 0.25 - low * 0.25) / (most as f64) * 4.0;
    let power = raw.log10().floor() as i32;
    let (step, digit) = [(1, 0), (2, 0), (5, 0), (1, 1)]
        .into_iter()
        .map(|(m, up)| (decimal(m, power + up), power + up))
        .find(|(step, _)| *step >= raw)
        .unwrap_or((raw, power));
    let first = (low / step).ceil();
    let values = (0..=most)
        .map(|i| (first + i as f64) * step)
        .filter(|v| *v <= high && v.is_finite())
        // Not minus zero.
        .map(|v| v + 0.0)
        .collect();
    Steps {
        values,
        step: digit,
    }
}

/// `m` times ten to the `k`, as near as a number can be.
fn decimal(m: i32, k: i32) -> f64 {
    format!("{m}e{k}").parse().unwrap_or(f64::NAN)
}

/// A number whose last digit is the `digit`-th power of ten, among numbers up to `largest`.
fn number(v: f64, digit: i32, largest: f64) -> Words {
    if v == 0.0 {
        return Words::plain("0");
    }
    let magnitude = if largest > 0.0 {
        largest.log10().floor() as i32
    } else {
        0
    };
    let places = |k: i32| usize::try_from(k).unwrap_or(0).min(17);
    if (-4..6).contains(&magnitude) {
        let text = format!("{v:.*}", places(-digit));
        return Words::plain(text.replace('-', "−"));
    }
    // Whole numbers where they stay short: 2 to 10 times 10^6 rather than 0.2 to 1.0 times 10^7.
    let whole = largest / decimal(1, digit) <= 10.5;
    let exponent = if whole { digit } else { magnitude };
    let mantissa = format!("{:.*}", places(exponent - digit), v / decimal(1, exponent));
    power(&format!("{}×10", mantissa.replace('-', "−")), exponent)
}

/// `m` times ten to the `k`, written out.
fn decimal_number(m: i32, k: i32) -> Words {
    let places = usize::try_from(-k).unwrap_or(0);
    Words::plain(format!("{:.places$}", decimal(m, k)))
}

fn power(base: &str, k: i32) -> Words {
    Words {
        base: base.to_owned(),
        power: k.to_string().replace('-', "−"),
    }
}
