//! [`Image`], a picture in linear radiance.

use crate::FilmError;

/// A picture of linear radiance, in W/(m²·sr) for each channel, with rows from top to bottom.
///
/// Values are stored as `f32`, within half an ulp (a relative error of 2⁻²⁴ ≈ 6e-8) of the computed
/// value. `rgb` has `width · height` pixels; functions that write files check this, and functions
/// that read files guarantee it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// The number of pixels in a row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// The pixels row by row: red, green and blue.
    pub rgb: Vec<[f32; 3]>,
}

impl Image {
    /// Creates a black picture.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![[0.0; 3]; area(width, height)],
        }
    }

    /// Creates a picture whose pixels are a function of the column and the row.
    ///
    /// ```
    /// use linelit_film::Image;
    /// let ramp = Image::from_fn(4, 1, |x, _| [x as f32; 3]);
    /// assert_eq!(ramp.get(3, 0), [3.0; 3]);
    /// ```
    #[must_use]
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> [f32; 3]) -> Self {
        let mut rgb = Vec::with_capacity(area(width, height));
        for y in 0..height {
            for x in 0..width {
                rgb.push(pixel(x, y));
            }
        }
        Self { width, height, rgb }
    }

    /// Returns the pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// If the pixel is outside of the picture.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> [f32; 3] {
        self.rgb[self.index(x, y)]
    }

    /// Sets the pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// If the pixel is outside of the picture.
    pub fn set(&mut self, x: u32, y: u32, value: [f32; 3]) {
        let index = self.index(x, y);
        self.rgb[index] = value;
    }

    /// Returns the index in `rgb` of the pixel in column `x` of row `y`.
    fn index(&self, x: u32, y: u32) -> usize {
        assert!(
            x < self.width && y < self.height,
            "pixel ({x}, {y}) of {} × {}",
            self.width,
            self.height
        );
        y as usize * self.width as usize + x as usize
    }

    /// Returns the mean over all pixels, summed in `f64` in storage order; zero for an empty
    /// picture.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in &self.rgb {
            for (total, value) in sum.iter_mut().zip(pixel) {
                *total += f64::from(*value);
            }
        }
        let count = self.rgb.len().max(1) as f64;
        sum.map(|total| total / count)
    }

    /// Refuses a picture without pixels, or with a number of pixels that does not fit its size.
    pub(crate) fn check(&self) -> Result<(), FilmError> {
        if self.rgb.is_empty() || self.rgb.len() != area(self.width, self.height) {
            return Err(FilmError::Invalid(format!(
                "{} × {} pixels were announced, {} are there",
                self.width,
                self.height,
                self.rgb.len()
            )));
        }
        Ok(())
    }
}

/// Returns the number of pixels of a picture.
pub(crate) fn area(width: u32, height: u32) -> usize {
    width as usize * height as usize
}
