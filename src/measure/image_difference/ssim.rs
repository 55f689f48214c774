//! The structural similarity of two images.

use crate::image::samples::Image;
use rayon::prelude::*;

/// Pixels of a window either way.
const WINDOW: usize = 11;

/// Standard deviation of the window's weights, in pixels.
const SIGMA: f64 = 1.5;

/// Keep the ratio steady where means and deviations are near 0 (Wang et al. 2004, equations 7 and
/// 9), for values from 0 to 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// The mean over all windows inside; `None` where there is none. The images have the same size.
pub(super) fn mean(a: &Image, b: &Image) -> Option<f64> {
    let (width, height) = (a.width, a.height);
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let (luma_a, luma_b) = (luma(a), luma(b));
    let weights = weights();
    let rows: Vec<f64> = (0..=height - WINDOW)
        .into_par_iter()
        .map(|y| {
            let from = y * width..(y + WINDOW) * width;
            row([&luma_a[from.clone()], &luma_b[from]], width, &weights)
        })
        .collect();
    let windows = rows.len() * (width - WINDOW + 1);
    Some(rows.iter().sum::<f64>() / windows as f64)
}

fn luma(image: &Image) -> Vec<f64> {
    let of = |pixel: usize| {
        let [r, g, b, _] = image.rgba(pixel).map(|v| f64::from(v) / 65535.0);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    (0..image.pixels()).into_par_iter().map(of).collect()
}

fn weights() -> [f64; WINDOW] {
    let middle = (WINDOW / 2) as f64;
    let at = |i: usize| (-(i as f64 - middle).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    let sum: f64 = (0..WINDOW).map(at).sum();
    std::array::from_fn(|i| at(i) / sum)
}

/// The sum over the windows of one row: 11 rows of luma of each image.
fn row(luma: [&[f64]; 2], width: usize, weights: &[f64; WINDOW]) -> f64 {
    // Weighted down the columns first: the two means, the two means of squares, that of products.
    let columns: Vec<[f64; 5]> = (0..width)
        .map(|x| {
            let mut sums = [0.0; 5];
            for (j, weight) in weights.iter().enumerate() {
                let [a, b] = luma.map(|l| l[j * width + x]);
                let terms = [a, b, a * a, b * b, a * b];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += weight * term;
                }
            }
            sums
        })
        .collect();
    let similarity = |window: &[[f64; 5]]| {
        let mut sums = [0.0; 5];
        for (column, weight) in window.iter().zip(weights) {
            for (sum, term) in sums.iter_mut().zip(column) {
                *sum += weight * term;
            }
        }
        let [a, b, aa, bb, ab] = sums;
        let (square_a, square_b, cross) = (aa - a * a, bb - b * b, ab - a * b);
        (2.0 * a * b + C1) * (2.0 * cross + C2)
            / ((a * a + b * b + C1) * (square_a + square_b + C2))
    };
    columns.windows(WINDOW).map(similarity).sum()
}
