//! FLIP: the difference that one sees when two pictures alternate (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström, Fairchild 2020, *FLIP: A Difference Evaluator for Alternating
//! Images*, HPG), written from the paper's definition of it for pictures on a screen (LDR-FLIP).
//!
//! All its filters are products of a function of x and one of y, so that each is two passes; at the
//! border the outermost pixels go on.

use crate::display::unit;
use crate::{FilmError, Image};
use linelit_elementary::{cbrt, exp, hypot, pow};
use std::f64::consts::PI;

/// The seen difference of pictures on a screen, from 0 (none) to 1.
///
/// ```
/// use linelit_film::{Flip, Image};
/// let [black, white] = [0.0, 1.0].map(|v| Image::from_fn(8, 8, |_, _| [v; 3]));
/// let map = Flip::default().map(&white, &black)?;
/// assert!((Flip::mean(&map) - 0.967).abs() < 1e-3);
/// assert_eq!(Flip::mean(&Flip::default().map(&white, &white)?), 0.0);
/// # Ok::<(), linelit_film::FilmError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    /// Pixels that the viewer sees within a degree, between 1 and 16,384: what is beyond is taken
    /// as the nearer end, NaN as 1.
    pub pixels_per_degree: f64,
}

impl Default for Flip {
    /// The paper's: 3840 pixels over a screen 0.7 m wide, 0.7 m away, which is 67.02.
    fn default() -> Self {
        Self {
            pixels_per_degree: 0.7 * 3840.0 / 0.7 * (PI / 180.0),
        }
    }
}

/// The difference that pictures of the largest contrast of colours, green and blue, have in place
/// of 1 where the map begins to be pressed together (p_c, p_t), and the exponents q_c, q_f.
const KNEE: [f64; 2] = [0.4, 0.95];
const COLOUR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
/// Width of the detector of edges and points, degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Contrast sensitivity of luminance, red–green, blue–yellow: sums of a √(π/b) e^(−π² x²/b), x in
/// degrees (the paper's Table 1).
const SENSITIVITY: [&[[f64; 2]]; 3] = [
    &[[1.0, 0.0047]],
    &[[1.0, 0.0053]],
    &[[34.1, 0.04], [13.5, 0.025]],
];
/// The widest of them, which says where all end.
const WIDEST: f64 = 0.04;

impl Flip {
    /// The difference at each pixel, row by row. Pictures are linear, of Rec. 709's primaries, as a
    /// screen shows them: values are clamped to [0, 1], and NaN is black.
    ///
    /// Against the authors' program, which is in single precision: within 3.3e-4 where there is no
    /// feature, within 1e-5 elsewhere.
    ///
    /// # Errors
    /// [`FilmError::Size`] when the sizes differ, [`FilmError::Invalid`] for pictures without
    /// pixels.
    pub fn map(&self, picture: &Image, reference: &Image) -> Result<Vec<f32>, FilmError> {
        picture.check()?;
        reference.check()?;
        let size = [reference.width, reference.height];
        if [picture.width, picture.height] != size {
            return Err(FilmError::Size {
                expected: size,
                found: [picture.width, picture.height],
            });
        }
        let density = match self.pixels_per_degree {
            density if density > 1.0 => density.min(16_384.0),
            _ => 1.0,
        };
        let [seen, wanted] = [picture, reference].map(|image| Seen::of(image, density));
        let farthest = pow(
            hyab(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0])),
            COLOUR_EXPONENT,
        );
        let difference = |k: usize| {
            let colour = pow(hyab(seen.colours[k], wanted.colours[k]), COLOUR_EXPONENT);
            let colour = pressed(colour, farthest).min(1.0);
            let [edges, points] =
                [0, 1].map(|f| (seen.features[k][f] - wanted.features[k][f]).abs());
            let feature = pow(edges.max(points) / 2f64.sqrt(), FEATURE_EXPONENT);
            pow(colour, 1.0 - feature.min(1.0))
        };
        #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1")]
        let map = (0..picture.rgb.len()).map(|k| difference(k) as f32);
        Ok(map.collect())
    }

    /// The mean of a map: FLIP as one number.
    #[must_use]
    pub fn mean(map: &[f32]) -> f64 {
        map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len().max(1) as f64
    }
}

/// The lower differences of colour over [0, p_t], the others over the rest.
fn pressed(colour: f64, farthest: f64) -> f64 {
    let [at, to] = KNEE;
    let knee = at * farthest;
    if colour < knee {
        to / knee * colour
    } else {
        to + (colour - knee) / (farthest - knee) * (1.0 - to)
    }
}

/// A picture as a viewer perceives it.
struct Seen {
    /// Filtered by contrast sensitivity: lightness and Hunt's chromaticities.
    colours: Vec<[f64; 3]>,
    /// Strength of edges and of points in luminance.
    features: Vec<[f64; 2]>,
}

impl Seen {
    fn of(image: &Image, density: f64) -> Self {
        let size = [image.width as usize, image.height as usize];
        let linear = image.rgb.iter().map(|rgb| rgb.map(|v| unit(f64::from(v))));
        let opponent: Vec<[f64; 3]> = linear.map(opponent).collect();
        let channel = |c: usize| -> Vec<f64> { opponent.iter().map(|pixel| pixel[c]).collect() };
        let filtered = [0, 1, 2].map(|c| sensed(&channel(c), size, SENSITIVITY[c], density));
        let colour = |k: usize| {
            let rgb = from_opponent([0, 1, 2].map(|c: usize| filtered[c][k]));
            hunt(rgb.map(unit))
        };
        let luminance: Vec<f64> = opponent.iter().map(|[y, ..]| (y + 16.0) / 116.0).collect();
        Self {
            colours: (0..opponent.len()).map(colour).collect(),
            features: features(&luminance, size, density),
        }
    }
}

/// Linear RGB to CIE XYZ, as the paper's program has it: rationals of the primaries of Rec. 709
/// and its white, so that white has Y = 1.
const TO_XYZ: [[f64; 3]; 3] = [
    over(24_577_794.0, [10_135_552.0, 8_788_810.0, 4_435_075.0]),
    over(12_288_897.0, [2_613_072.0, 8_788_810.0, 887_015.0]),
    over(73_733_382.0, [1_425_312.0, 8_788_810.0, 70_074_185.0]),
];

const fn over(denominator: f64, [a, b, c]: [f64; 3]) -> [f64; 3] {
    [a / denominator, b / denominator, c / denominator]
}

/// The inverse of that matrix.
const FROM_XYZ: [[f64; 3]; 3] = [
    [
        3.241_003_232_976_358_3,
        -1.537_398_969_488_785_3,
        -0.498_615_881_996_362_8,
    ],
    [
        -0.969_224_252_202_516_3,
        1.875_929_983_695_175_7,
        0.041_554_226_340_084_7,
    ],
    [
        0.055_639_419_851_975_4,
        -0.204_011_206_123_909_9,
        1.057_148_977_187_533_3,
    ],
];

fn times(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ relative to those of white.
fn relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (times(&TO_XYZ, rgb), times(&TO_XYZ, [1.0; 3]));
    [0, 1, 2].map(|k| xyz[k] / white[k])
}

/// Linear RGB to YCxCz, a linear relative of CIELAB.
fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([luminance, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (luminance + 16.0) / 116.0;
    let (relative, white) = (
        [y + cx / 500.0, y, y - cz / 200.0],
        times(&TO_XYZ, [1.0; 3]),
    );
    times(&FROM_XYZ, [0, 1, 2].map(|k| relative[k] * white[k]))
}

/// CIELAB of linear RGB, with chromaticities that grow with lightness (Hunt).
fn hunt(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb).map(|t| {
        if t > DELTA * DELTA * DELTA {
            cbrt(t)
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    let scale = 0.01 * lightness;
    [lightness, scale * 500.0 * (x - y), scale * 200.0 * (y - z)]
}

/// City block between lightnesses and chromaticities, Euclid among chromaticities.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + hypot(a[1] - b[1], a[2] - b[2])
}

/// A channel as the eye resolves it: a sum of Gaussians whose weights sum to one.
fn sensed(channel: &[f64], size: [usize; 2], terms: &[[f64; 2]], density: f64) -> Vec<f64> {
    let radius = reach(3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * density);
    let kernels = terms.iter().map(|[a, b]| {
        let kernel = sampled(radius, |x| {
            let degrees = x / density;
            exp(-PI * PI * degrees * degrees / b)
        });
        // The factor of both passes.
        (a * (PI / b).sqrt(), kernel)
    });
    let kernels: Vec<(f64, Vec<f64>)> = kernels.collect();
    let weight = |(factor, kernel): &(f64, Vec<f64>)| factor * kernel.iter().sum::<f64>().powi(2);
    let total: f64 = kernels.iter().map(weight).sum();
    let mut sum = vec![0.0; channel.len()];
    for (factor, kernel) in &kernels {
        let filtered = filter(channel, size, [kernel, kernel]);
        for (sum, value) in sum.iter_mut().zip(filtered) {
            *sum += factor / total * value;
        }
    }
    sum
}

/// Returns the strength of edges and points: lengths of the first and second derivatives of a
/// Gaussian, whose positive and negative weights sum to one each.
fn features(luminance: &[f64], size: [usize; 2], density: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * density;
    let radius = reach(3.0 * deviation);
    let gauss = |x: f64| exp(-x * x / (2.0 * deviation * deviation));
    let smooth = sampled(radius, gauss);
    // Whatever the sum across, a weight's sign is that of the factor along.
    let across: f64 = smooth.iter().sum();
    let balanced = |kernel: Vec<f64>| -> Vec<f64> {
        let of_sign = |sign: f64| kernel.iter().map(|w| (w * sign).max(0.0)).sum::<f64>() * across;
        let (positive, negative) = (of_sign(1.0), of_sign(-1.0));
        let scaled = |w: &f64| w / if *w < 0.0 { negative } else { positive };
        kernel.iter().map(scaled).collect()
    };
    let edge = balanced(sampled(radius, |x| -x * gauss(x)));
    let point = balanced(sampled(radius, |x| {
        (x * x / (deviation * deviation) - 1.0) * gauss(x)
    }));
    let [edges, points] = [edge, point].map(|along| {
        let [x, y] = [[&along, &smooth], [&smooth, &along]].map(|k| filter(luminance, size, k));
        x.into_iter().zip(y).map(|(x, y)| hypot(x, y))
    });
    edges.zip(points).map(<[f64; 2]>::from).collect()
}

/// Pixels to either side, at least the next: below one there is nothing to compare with.
fn reach(radius: f64) -> i32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "pixels per degree are bounded"
    )]
    let whole = radius.ceil() as i32;
    whole.max(1)
}

/// A function at −radius, …, radius.
fn sampled(radius: i32, value: impl Fn(f64) -> f64) -> Vec<f64> {
    (-radius..=radius).map(|x| value(f64::from(x))).collect()
}

/// Correlation with a product of kernels along x and along y.
fn filter(values: &[f64], [width, height]: [usize; 2], [x, y]: [&Vec<f64>; 2]) -> Vec<f64> {
    // Pixel k of a row or column that begins at a place and goes on by a stride.
    let weighted = |from: &[f64], kernel: &[f64], k: usize, [count, start, stride]: [usize; 3]| {
        let taps = kernel.iter().enumerate().map(|(tap, weight)| {
            let at = (k + tap).saturating_sub(kernel.len() / 2).min(count - 1);
            weight * from[start + at * stride]
        });
        taps.sum()
    };
    let all = 0..values.len();
    let across = |i: usize| weighted(values, x, i % width, [width, i - i % width, 1]);
    let rows: Vec<f64> = all.clone().map(across).collect();
    let down = |i: usize| weighted(&rows, y, i / width, [height, i % width, width]);
    all.map(down).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [48, 32];
    /// See below.
    const SINGLE: f64 = 3.3e-4;

    fn picture(pixel: impl Fn(f32, f32) -> [f32; 3]) -> Image {
        Image::from_fn(SIZE[0], SIZE[1], |x, y| pixel(x as f32, y as f32))
    }

    /// Values of the authors' program (flip-evaluator 1.7 of the Python package index, `evaluate`
    /// of the same pictures as linear numbers): means, and the map at four pixels. It computes in
    /// single precision: of a flat picture, whose features are none, 19 products leave up to
    /// 19 × 2⁻²⁴, of which the square root is the exponent's error f = 9e-4; and x^(1 − f) is off
    /// by f x |ln x|, f/e at most.
    #[test]
    fn it_is_what_the_authors_program_says() {
        let stripes =
            |x: f32, y: f32, shift: f32| (x * 5.0 + y * 3.0 + shift).rem_euclid(16.0) / 15.0;
        let wanted = picture(|x, y| [x / 47.0, y / 31.0, stripes(x, y, 0.0)]);
        let seen = picture(|x, y| {
            let red = x / 47.0 + 0.1 * (x + y).rem_euclid(2.0);
            [red, y / 31.0 * 0.8, stripes(x, y, 2.0)]
        });
        let step = |at: f32| {
            picture(move |x, _| {
                if x < at {
                    [0.02, 0.03, 0.05]
                } else {
                    [0.8, 0.7, 0.6]
                }
            })
        };
        let flat = |rgb: [f32; 3]| picture(move |_, _| rgb);
        let cases = [
            (
                wanted,
                seen,
                0.396_215_48,
                [0.239_648_04, 0.437_847_02, 0.523_079_69, 0.233_674_57],
            ),
            (
                step(24.0),
                step(27.0),
                0.145_124_76,
                [0.0, 0.950_385_21, 0.0, 0.971_236_23],
            ),
            (flat([0.0, 1.0, 0.0]), flat([0.0, 0.0, 1.0]), 1.0, [1.0; 4]),
            (
                flat([0.0; 3]),
                flat([1.0; 3]),
                0.967_388_33,
                [0.967_388_33; 4],
            ),
            (
                flat([0.2; 3]),
                flat([0.25; 3]),
                0.183_435_78,
                [0.183_435_78; 4],
            ),
        ];
        for (k, (reference, picture, mean, at)) in cases.into_iter().enumerate() {
            let map = Flip::default().map(&picture, &reference).unwrap();
            let found = Flip::mean(&map);
            assert!((found - mean).abs() < SINGLE, "{k}: {found}, not {mean}");
            for ([x, y], want) in [[0, 0], [25, 16], [47, 31], [24, 5]].into_iter().zip(at) {
                let found = f64::from(map[y * 48 + x]);
                assert!(
                    (found - want).abs() < SINGLE,
                    "{k}: {found}, not {want} at {x},{y}"
                );
            }
        }
    }

    #[test]
    fn kernels_sum_to_one_and_transforms_invert() {
        // A flat channel stays what it is; it has neither edges nor points.
        let flat = [0.7; 48 * 32];
        let size = SIZE.map(|n| n as usize);
        for terms in SENSITIVITY {
            let seen = sensed(&flat, size, terms, 67.0);
            assert!(seen.iter().all(|v| (v - 0.7).abs() < 1e-14));
        }
        let features = features(&flat, size, 67.0);
        assert!(features.iter().flatten().all(|v| *v < 1e-14));
        for rgb in [[0.2, 0.5, 0.9], [1.0, 0.0, 0.0], [0.0; 3], [1.0; 3]] {
            let back = from_opponent(opponent(rgb));
            // A few roundings of numbers of the size of 500 over 500.
            assert!((0..3).all(|k| (back[k] - rgb[k]).abs() < 1e-13), "{back:?}");
        }
        let [lightness, a, b] = hunt([1.0; 3]);
        assert!((lightness - 100.0).abs() < 1e-12 && a.hypot(b) < 1e-12);
    }

    #[test]
    fn it_answers_whatever_it_is_given() {
        let odd = picture(|x, y| [f32::NAN, x - y, if x > y { f32::INFINITY } else { -1.0 }]);
        let grey = picture(|_, _| [0.5; 3]);
        for pixels_per_degree in [0.0, -1.0, 1e-9, 1.0, 500.0, f64::NAN, f64::INFINITY] {
            let one = Image::new(1, 1);
            let (flip, density) = (Flip { pixels_per_degree }, pixels_per_degree);
            for (a, b) in [(&odd, &grey), (&grey, &odd), (&one, &one)] {
                if density.is_finite() || a.width == 1 {
                    let map = flip.map(a, b).unwrap();
                    assert!(map.iter().all(|v| (0.0..=1.0).contains(v)), "{density}");
                }
            }
        }
        assert!(Flip::default().map(&grey, &Image::new(2, 2)).is_err());
        let none = Image::default();
        assert!(Flip::default().map(&none, &none).is_err());
    }
}
