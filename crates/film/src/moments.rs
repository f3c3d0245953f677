//! Running mean and spread, one value or a whole film.

use crate::{FilmError, Image, Tile, image::area};

/// Count, mean and sum of squared deviations (M2) of colours, per channel.
///
/// **Formula**: Welford's update for single values, Chan, Golub & LeVeque (1979) for merging:
/// `mean = mean_a + δ·n_b/n`, `M2 = M2_a + M2_b + δ²·n_a·n_b/n`, `δ = mean_b − mean_a`.
/// **Units**: those of the values; M2 their square.
/// **Error bound**: relative error of M2 about `n·ε·κ`, `κ² = 1 + mean²/variance` (Chan et al.,
/// table 1), against `n·ε·κ²` of the textbook formula.
///
/// Merging is not associative in floating point: merge in a fixed order to get the same bits.
///
/// ```
/// use linelit_film::Moments;
/// let mut moments = Moments::default();
/// for value in [1.0, 2.0, 3.0] {
///     moments.push([value; 3]);
/// }
/// assert_eq!((moments.count, moments.mean[0], moments.variance()[0]), (3, 2.0, 1.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Number of values.
    pub count: u64,
    /// Their mean.
    pub mean: [f64; 3],
    /// Sum of squared deviations from the mean.
    pub m2: [f64; 3],
}

impl Moments {
    /// Adds one value.
    pub fn push(&mut self, value: [f64; 3]) {
        self.count += 1;
        let count = self.count as f64;
        for ((value, mean), m2) in value.iter().zip(&mut self.mean).zip(&mut self.m2) {
            let delta = value - *mean;
            *mean += delta / count;
            *m2 += delta * (value - *mean);
        }
    }

    /// Adds all values that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let total = self.count + other.count;
        let (ours, theirs, all) = (self.count as f64, other.count as f64, total as f64);
        for channel in 0..3 {
            let delta = other.mean[channel] - self.mean[channel];
            self.mean[channel] += delta * (theirs / all);
            self.m2[channel] += other.m2[channel] + delta * delta * (ours * theirs / all);
        }
        self.count = total;
    }

    /// Count, means and M2 as bits, for files.
    pub(crate) fn bits(&self) -> [u64; 7] {
        let ([a, b, c], [d, e, f]) = (self.mean, self.m2);
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(f64::to_bits);
        [self.count, a, b, c, d, e, f]
    }

    /// The inverse of [`Moments::bits`].
    pub(crate) fn from_bits([count, a, b, c, d, e, f]: [u64; 7]) -> Self {
        Self {
            count,
            mean: [a, b, c].map(f64::from_bits),
            m2: [d, e, f].map(f64::from_bits),
        }
    }

    /// Unbiased variance of one value, M2/(n − 1); NaN below two values, which say nothing of it.
    #[must_use]
    pub fn variance(&self) -> [f64; 3] {
        if self.count < 2 {
            return [f64::NAN; 3];
        }
        let freedom = (self.count - 1) as f64;
        self.m2.map(|m2| m2 / freedom)
    }

    /// Variance of the mean, M2/(n(n − 1)), if the values are independent: use replicates over
    /// seeds, not the samples inside one stratified set. NaN below two values.
    #[must_use]
    pub fn variance_of_mean(&self) -> [f64; 3] {
        let count = self.count as f64;
        self.variance().map(|variance| variance / count)
    }
}

/// [`Moments`] of every pixel, rows from top to bottom.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MomentImage {
    width: u32,
    height: u32,
    pixels: Vec<Moments>,
}

impl MomentImage {
    /// A film that has seen nothing.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            pixels: vec![Moments::default(); area(width, height)],
        }
    }

    /// A film from its pixels; `None` when their number is not `width · height`.
    #[must_use]
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<Moments>) -> Option<Self> {
        (pixels.len() == area(width, height)).then_some(Self {
            width,
            height,
            pixels,
        })
    }

    /// Pixels in a row.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[Moments] {
        &self.pixels
    }

    /// The pixel in column `x` of row `y`, or `None` outside.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> Option<&Moments> {
        if x >= self.width {
            return None;
        }
        self.pixels
            .get(y as usize * self.width as usize + x as usize)
    }

    /// Adds one value to one pixel; values outside of the film fall off.
    pub fn push(&mut self, x: u32, y: u32, value: [f64; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize].push(value);
        }
    }

    /// Merges a film of the same size, pixel by pixel.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the sizes differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmError> {
        if (self.width, self.height) != (other.width, other.height) {
            return Err(FilmError::Size {
                expected: [self.width, self.height],
                found: [other.width, other.height],
            });
        }
        for (ours, theirs) in self.pixels.iter_mut().zip(&other.pixels) {
            ours.merge(theirs);
        }
        Ok(())
    }

    /// Merges the pixels of one tile, given row by row.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the tile leaves the film or the number of pixels is not its area.
    pub fn merge_tile(&mut self, tile: Tile, pixels: &[Moments]) -> Result<(), FilmError> {
        if tile.x1 > self.width || tile.y1 > self.height || pixels.len() != tile.area() {
            return Err(FilmError::Size {
                expected: [self.width, self.height],
                found: [tile.x1, tile.y1],
            });
        }
        for ([x, y], theirs) in tile.pixels().zip(pixels) {
            self.pixels[y as usize * self.width as usize + x as usize].merge(theirs);
        }
        Ok(())
    }

    /// The means, rounded to `f32`.
    #[must_use]
    pub fn mean_image(&self) -> Image {
        self.map(|moments| moments.mean)
    }

    /// The variances of the means ([`Moments::variance_of_mean`]), rounded to `f32`.
    #[must_use]
    pub fn variance_image(&self) -> Image {
        self.map(Moments::variance_of_mean)
    }

    fn map(&self, value: impl Fn(&Moments) -> [f64; 3]) -> Image {
        let rgb = self
            .pixels
            .iter()
            .map(|moments| value(moments).map(to_f32))
            .collect();
        Image {
            width: self.width,
            height: self.height,
            rgb,
        }
    }
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the film stores f32, within 2^-24 relative"
)]
pub(crate) fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn gather(values: &[f64]) -> Moments {
        let mut moments = Moments::default();
        for &value in values {
            moments.push([value, -value, value * 0.5]);
        }
        moments
    }

    /// Exact moments by integer arithmetic: the values are small integers.
    fn exact(values: &[i64]) -> (f64, f64) {
        let n = values.len() as i64;
        let sum: i64 = values.iter().sum();
        let squares: i64 = values.iter().map(|v| v * v).sum();
        (
            sum as f64 / n as f64,
            (n * squares - sum * sum) as f64 / n as f64,
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn merging_any_split_equals_the_exact_moments(
            values in prop::collection::vec(-1000_i64..1000, 2..200),
            offset in -1_000_000_i64..1_000_000,
            cut in 0.0..1.0_f64,
        ) {
            let values: Vec<i64> = values.iter().map(|v| v + offset).collect();
            let floats: Vec<f64> = values.iter().map(|&v| v as f64).collect();
            #[allow(clippy::cast_possible_truncation, reason = "an index into the vector")]
            let cut = (cut * floats.len() as f64) as usize;
            let mut merged = gather(&floats[..cut]);
            merged.merge(&gather(&floats[cut..]));
            let (mean, m2) = exact(&values);
            let n = floats.len() as f64;
            let largest = floats.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            prop_assert_eq!(merged.count, floats.len() as u64);
            // Each step rounds the mean by at most ε·max|v|.
            prop_assert!((merged.mean[0] - mean).abs() <= 2.0 * n * f64::EPSILON * largest);
            // δ is off by that much, and enters linearly with |δ| up to the spread √M2.
            let bound = 8.0 * n * f64::EPSILON * (m2 + largest * m2.sqrt() + largest * largest * f64::EPSILON);
            prop_assert!((merged.m2[0] - m2).abs() <= bound, "{} {}", merged.m2[0], m2);
            prop_assert!(merged.m2[0] >= 0.0);
        }
    }

    #[test]
    fn a_large_offset_does_not_cancel() {
        // The textbook formula loses every digit here: 1e9² needs 60 bits.
        let moments = gather(&[1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0]);
        assert!((moments.variance()[0] - 30.0).abs() < 30.0 * 4.0 * f64::EPSILON * 2e8);
    }

    #[test]
    fn merging_nothing_changes_nothing() {
        let mut moments = gather(&[0.1, 0.2, 0.7]);
        let before = moments;
        moments.merge(&Moments::default());
        assert_eq!(moments, before);
        let mut empty = Moments::default();
        empty.merge(&before);
        assert_eq!(empty, before);
    }

    #[test]
    fn one_value_has_no_variance() {
        assert!(gather(&[3.0]).variance()[0].is_nan());
        assert!(Moments::default().variance_of_mean()[2].is_nan());
    }

    #[test]
    fn tiles_merge_to_the_whole_film() {
        let (width, height) = (13, 9);
        let value = |x: u32, y: u32, k: u32| [f64::from(x * 7 + y * 3 + k).sin(); 3];
        let mut whole = MomentImage::new(width, height);
        let mut pieces = MomentImage::new(width, height);
        let window = Tile::whole(width, height);
        for [x, y] in window.pixels() {
            (0..5).for_each(|k| whole.push(x, y, value(x, y, k)));
        }
        for tile in crate::tiles(window, 4) {
            let pixels: Vec<Moments> = tile
                .pixels()
                .map(|[x, y]| {
                    let mut moments = Moments::default();
                    (0..5).for_each(|k| moments.push(value(x, y, k)));
                    moments
                })
                .collect();
            pieces.merge_tile(tile, &pixels).unwrap();
        }
        assert_eq!(whole, pieces);
        assert!(whole.merge(&MomentImage::new(9, 13)).is_err());
        assert!(
            pieces
                .merge_tile(
                    Tile {
                        x0: 10,
                        y0: 0,
                        x1: 14,
                        y1: 1
                    },
                    &[Moments::default(); 4]
                )
                .is_err()
        );
        assert!(whole.get(13, 0).is_none() && whole.get(0, 9).is_none());
    }
}
