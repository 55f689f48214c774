//! Rasters of light and pictures of bytes.

use super::colour::{Linear, Srgb, to_srgb};
use rayon::prelude::*;

/// Linear light, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    width: usize,
    pixels: Vec<Linear>,
}

impl Raster {
    /// A raster from its rows, top first; `pixels` is cut to whole rows of `width`, at least 1.
    pub fn from_pixels(width: usize, mut pixels: Vec<Linear>) -> Self {
        let width = width.max(1);
        pixels.truncate(pixels.len() / width * width);
        Raster { width, pixels }
    }

    /// Pixels along a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// All pixels, rows in order.
    pub fn pixels(&self) -> &[Linear] {
        &self.pixels
    }

    /// The raster at half its size, each pixel the mean of the 4 x 4 around it with weights 1 3 3 1.
    ///
    /// The tent is wider than a pixel: silhouettes get sixteen steps of grey rather than five.
    pub fn halved(&self) -> Raster {
        let (width, height) = (self.width / 2, self.height() / 2);
        let taps = |at: usize, size: usize| {
            [(2 * at).saturating_sub(1), 2 * at, 2 * at + 1, 2 * at + 2].map(|i| i.min(size - 1))
        };
        const WEIGHTS: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
        let mut pixels = vec![[0.0; 3]; width * height];
        pixels
            .par_chunks_mut(width.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                let ys = taps(y, self.height());
                for (x, pixel) in row.iter_mut().enumerate() {
                    let xs = taps(x, self.width);
                    for (j, wy) in ys.into_iter().zip(WEIGHTS) {
                        for (i, wx) in xs.into_iter().zip(WEIGHTS) {
                            let from = self.pixels[j * self.width + i];
                            for c in 0..3 {
                                pixel[c] += wx * wy * from[c];
                            }
                        }
                    }
                }
            });
        Raster::from_pixels(width, pixels)
    }
}

/// sRGB bytes, row by row from the top left; at least one pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<Srgb>,
}

impl Picture {
    /// A picture of one colour, at least 1 x 1.
    pub fn new(width: usize, height: usize, colour: Srgb) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Picture {
            width,
            height,
            pixels: vec![colour; width * height],
        }
    }

    /// Pixels along a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, rows in order.
    pub fn pixels(&self) -> &[Srgb] {
        &self.pixels
    }

    /// The pixel in column `x` and row `y`.
    pub fn get(&self, x: usize, y: usize) -> Srgb {
        self.pixels[y * self.width + x]
    }

    /// Lays `coverage` (0 to 1) of a colour over a pixel; outside the picture nothing happens.
    ///
    /// Bytes are mixed, not light: dark letters on white keep their weight that way.
    pub fn blend(&mut self, x: isize, y: isize, colour: Srgb, coverage: f64) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x >= self.width || y >= self.height {
            return;
        }
        let coverage = coverage.clamp(0.0, 1.0);
        let pixel = &mut self.pixels[y * self.width + x];
        for c in 0..3 {
            let (old, new) = (f64::from(pixel[c]), f64::from(colour[c]));
            pixel[c] = (old + (new - old) * coverage).round() as u8;
        }
    }

    /// Fills the rectangle between two corners given in pixels, with smooth edges where a corner
    /// falls inside a pixel.
    pub fn fill(&mut self, from: [f64; 2], to: [f64; 2], colour: Srgb) {
        let cover = |at: isize, lo: f64, hi: f64| ((at + 1) as f64).min(hi) - (at as f64).max(lo);
        let end = |v: f64, size: usize| v.ceil().clamp(0.0, size as f64) as isize;
        let start = |v: f64| v.floor().max(0.0) as isize;
        for y in start(from[1])..end(to[1], self.height) {
            for x in start(from[0])..end(to[0], self.width) {
                let part = cover(x, from[0], to[0]).max(0.0) * cover(y, from[1], to[1]).max(0.0);
                self.blend(x, y, colour, part);
            }
        }
    }

    /// Puts a raster with its top left corner at column `x`, row `y`; what reaches past is cut off.
    pub fn paste(&mut self, raster: &Raster, x: usize, y: usize) {
        if x >= self.width {
            return;
        }
        let width = raster.width().min(self.width - x);
        for (j, from) in raster.pixels().chunks(raster.width()).enumerate() {
            if y + j >= self.height {
                break;
            }
            let at = (y + j) * self.width + x;
            for (to, light) in self.pixels[at..at + width].iter_mut().zip(from) {
                *to = to_srgb(*light);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_keeps_a_constant_and_the_mean() {
        let flat = Raster::from_pixels(6, vec![[0.25; 3]; 24]).halved();
        assert_eq!((flat.width(), flat.height()), (3, 2));
        assert!(flat.pixels().iter().all(|p| (p[0] - 0.25).abs() < 1e-6));
        let mut pixels = vec![[0.0; 3]; 64];
        pixels[3 * 8 + 4] = [1.0; 3];
        let sum: f32 = Raster::from_pixels(8, pixels)
            .halved()
            .pixels()
            .iter()
            .map(|p| p[1])
            .sum();
        assert!((sum - 0.25).abs() < 1e-6);
    }

    #[test]
    fn a_rectangle_covers_its_area_and_nothing_outside() {
        let mut picture = Picture::new(8, 8, [255; 3]);
        picture.fill([1.5, 2.0], [4.0, 3.0], [0; 3]);
        assert_eq!(picture.get(1, 2), [128; 3]);
        assert_eq!(picture.get(2, 2), [0; 3]);
        assert_eq!(picture.get(3, 2), [0; 3]);
        assert_eq!(picture.get(4, 2), [255; 3]);
        assert_eq!(picture.get(2, 3), [255; 3]);
        picture.fill([-5.0, -5.0], [100.0, 100.0], [9; 3]);
        assert!(picture.pixels().iter().all(|p| *p == [9; 3]));
    }

    #[test]
    fn a_raster_pasted_over_the_edge_is_cut() {
        let mut picture = Picture::new(3, 3, [255; 3]);
        picture.paste(&Raster::from_pixels(2, vec![[0.0; 3]; 4]), 2, 2);
        assert_eq!(picture.get(2, 2), [0; 3]);
        assert_eq!(picture.get(1, 1), [255; 3]);
        picture.paste(&Raster::from_pixels(2, vec![[0.0; 3]; 4]), 7, 0);
    }
}
