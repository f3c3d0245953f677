//! Metrics of pictures: how far one picture is from another.

use super::slopes::moments;
use linelit_film::{FilmError, Image};
use serde::Serialize;

/// The constant ε in the mean relative squared error Σ(p − r)²/(r² + ε)/n, in (W/(m²·sr))²: it
/// avoids a division by zero where the reference r is black (Salesin & Jarosz 2019, section 6).
pub const MRSE_EPSILON: f64 = 1e-6;

/// A mean with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanError {
    /// The mean; NaN if there are no values.
    pub mean: f64,
    /// The standard error of the mean, from the spread; NaN for fewer than two values.
    pub stderr: f64,
}

impl MeanError {
    /// Returns the mean and the standard error of independent values, √(Σ(v − mean)²/(n(n − 1))),
    /// in two passes.
    ///
    /// ```
    /// let m = linelit_study::stats::metrics::MeanError::of(&[1.0, 3.0]);
    /// assert_eq!((m.mean, m.stderr, m.z()), (2.0, 1.0, 2.0));
    /// ```
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let (mean, square) = moments(values);
        let stderr = square.sqrt();
        Self { mean, stderr }
    }

    /// Returns the number of standard errors between the mean and zero; zero if the mean and its
    /// standard error are both zero.
    #[must_use]
    pub fn z(&self) -> f64 {
        if self.mean.abs() <= 0.0 {
            0.0
        } else {
            self.mean / self.stderr
        }
    }
}

/// Errors of a picture against a reference, over all pixels and channels.
///
/// With p the values of the picture, r the values of the reference, and n their number:
/// MSE = Σ(p − r)²/n, RMSE = √MSE, MRSE = Σ(p − r)²/(r² + ε)/n with [`MRSE_EPSILON`] (Salesin &
/// Jarosz 2019, section 6), bias = Σ(p − r)/n. All values are in linear radiance, never
/// tone-mapped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImageMetrics {
    /// The number of pixels that were compared.
    pub pixels: usize,
    /// The number of pixels that were left out because a value is not finite in one of the
    /// pictures.
    pub skipped: usize,
    /// The mean squared error.
    pub mse: f64,
    /// The root of the mean squared error.
    pub rmse: f64,
    /// The mean relative squared error.
    pub mrse: f64,
    /// The mean difference.
    pub bias: f64,
    /// The standard error of the bias from its spread over pixels, as if the errors of pixels were
    /// independent (they are if each pixel has its own random numbers).
    pub bias_stderr: f64,
    /// The bias over its standard error; zero for equal pictures.
    pub bias_z: f64,
    /// The largest absolute difference.
    pub largest: f64,
    /// The column and row of the largest difference.
    pub largest_at: [u32; 2],
    /// The mean of the picture.
    pub mean: f64,
    /// The mean of the reference.
    pub reference_mean: f64,
}

impl ImageMetrics {
    /// Computes the errors of `picture` against `reference`, which must have the same size.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the sizes differ.
    ///
    /// ```
    /// use linelit_study::film::Image;
    /// use linelit_study::stats::metrics::ImageMetrics;
    /// let reference = Image::from_fn(2, 1, |_, _| [1.0; 3]);
    /// let picture = Image::from_fn(2, 1, |x, _| [1.0 + x as f32; 3]);
    /// let m = ImageMetrics::compare(&picture, &reference)?;
    /// assert_eq!((m.mse, m.bias, m.bias_stderr, m.largest_at), (0.5, 0.5, 0.5, [1, 0]));
    /// # Ok::<(), linelit_study::film::FilmError>(())
    /// ```
    pub fn compare(picture: &Image, reference: &Image) -> Result<Self, FilmError> {
        if (picture.width, picture.height) != (reference.width, reference.height) {
            return Err(FilmError::Size {
                expected: [reference.width, reference.height],
                found: [picture.width, picture.height],
            });
        }
        // Sum squared and relative errors over channels, and average the error of each pixel.
        let (mut m, mut differences) = (Self::default(), Vec::new());
        for (index, (p, r)) in (0..).zip(picture.rgb.iter().zip(&reference.rgb)) {
            if p.iter().chain(r).any(|value| !value.is_finite()) {
                m.skipped += 1;
                continue;
            }
            let mut mean_difference = 0.0;
            for (p, r) in p.map(f64::from).into_iter().zip(r.map(f64::from)) {
                let difference = p - r;
                m.mse += difference * difference;
                m.mrse += difference * difference / (r * r + MRSE_EPSILON);
                mean_difference += difference / 3.0;
                if difference.abs() > m.largest {
                    m.largest = difference.abs();
                    m.largest_at = [index % reference.width, index / reference.width];
                }
                m.mean += p;
                m.reference_mean += r;
            }
            // The channels of a pixel share their random numbers, so that a pixel is one
            // observation.
            differences.push(mean_difference);
        }
        // Divide the sums by the number of values, and take the bias from the mean errors of
        // pixels.
        let values = 3.0 * differences.len() as f64;
        for sum in [&mut m.mse, &mut m.mrse, &mut m.mean, &mut m.reference_mean] {
            *sum /= values;
        }
        let bias = MeanError::of(&differences);
        Ok(Self {
            pixels: differences.len(),
            rmse: m.mse.sqrt(),
            bias: bias.mean,
            bias_stderr: bias.stderr,
            bias_z: bias.z(),
            ..m
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::normal;
    use rand::SeedableRng as _;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn equal_pictures_have_no_error() {
        let image = Image::from_fn(5, 4, |x, y| [x as f32, y as f32, 0.0]);
        let m = ImageMetrics::compare(&image, &image).unwrap();
        assert!(m.mse <= 0.0 && m.bias_z <= 0.0 && m.largest <= 0.0);
        assert_eq!(m.pixels, 20);
        assert!(ImageMetrics::compare(&image, &Image::new(4, 5)).is_err());
    }

    #[test]
    fn mrse_weighs_by_the_reference() {
        let two = |values: [f32; 2]| Image::from_fn(2, 1, |x, _| [values[x as usize]; 3]);
        let (picture, reference) = (two([2.5, 0.001]), two([2.0, 0.0]));
        let m = ImageMetrics::compare(&picture, &reference).unwrap();
        let small = f64::from(0.001_f32) * f64::from(0.001_f32);
        let want = 0.5 * (0.25 / (4.0 + 1e-6) + small / 1e-6);
        assert!(
            (m.mrse - want).abs() < 8.0 * f64::EPSILON * want,
            "{} {want}",
            m.mrse
        );
    }

    #[test]
    fn values_that_are_not_numbers_are_counted_not_summed() {
        let reference = Image::new(2, 1);
        let picture = Image::from_fn(2, 1, |x, _| [if x == 0 { f32::NAN } else { 1.0 }; 3]);
        let m = ImageMetrics::compare(&picture, &reference).unwrap();
        assert_eq!((m.pixels, m.skipped), (1, 1));
        assert!((m.mse - 1.0).abs() < 1e-15 && m.bias_stderr.is_nan());
    }

    #[test]
    fn the_z_score_of_unbiased_noise_is_standard_normal() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let flat = Image::from_fn(32, 32, |_, _| [0.0; 3]);
        let mut squares = 0.0;
        for _ in 0..400 {
            #[allow(clippy::cast_possible_truncation, reason = "film")]
            let mut value = |_| normal(&mut random) as f32;
            let noise = Image::from_fn(32, 32, |_, _| [0; 3].map(&mut value));
            squares += ImageMetrics::compare(&noise, &flat).unwrap().bias_z.powi(2);
        }
        // Mean of 400 χ²₁ has standard error √(2/400) = 0.071; 4.5 of them: α ≈ 7e-6.
        assert!(
            (squares / 400.0 - 1.0).abs() < 4.5 * 0.071,
            "{}",
            squares / 400.0
        );
    }
}
