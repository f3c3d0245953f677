//! The comparison of two pictures of one scene: both under a slider, magnified details, and a map
//! of the error of each.

use super::{Picture, scientific};
use crate::plots::seconds;
use linelit_film::{Exposure, FilmError, HeatMap, Image};

/// A comparison of two pictures of the same scene with each other and with the true picture.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The sentence that says what is shown.
    pub lead: String,
    /// The pictures under the slider, the left and the right one, of equal size.
    pub sides: [Picture; 2],
    /// Magnified details: the left, the right and the true picture of each.
    pub details: Vec<[Picture; 3]>,
    /// The true picture.
    pub truth: Picture,
    /// Maps of the distance of the left and of the right picture from the true one, on the same
    /// scale.
    pub errors: [Picture; 2],
}

/// A picture with its name and cost.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// The picture in linear radiance.
    pub image: &'a Image,
    /// The name in captions, a few words.
    pub name: &'a str,
    /// The processor seconds that the picture took.
    pub seconds: f64,
}

/// The ratio of the longer side of the picture to the side of a detail.
const DETAIL: u32 = 8;

/// The number of details of a picture.
const DETAILS: usize = 2;

/// The fraction of the pixels whose error is below the upper end of the map's scale; larger errors
/// have the brightest colour.
const SHOWN: f64 = 0.999;

/// The ratio of the lower end of the error maps' logarithmic scale to its upper end.
const SPAN: f64 = 1e-3;

impl Comparison {
    /// Compares two pictures with the true one; all have one size and are shown with one exposure.
    /// The details are where the left picture is most wrong relative to the brightness, as in
    /// penumbrae.
    ///
    /// # Errors
    /// [`FilmError::Invalid`] for pictures without pixels or of different sizes.
    pub fn new(left: Named<'_>, right: Named<'_>, truth: Named<'_>) -> Result<Self, FilmError> {
        let [width, height] = [truth.image.width, truth.image.height];
        let other = |p: &Named<'_>| [p.image.width, p.image.height] != [width, height];
        if [left, right].iter().any(other) {
            let message = "pictures of different sizes cannot be compared";
            return Err(FilmError::Invalid(message.to_owned()));
        }
        // Expose all pictures alike. A tenth of the pixels are white, so that a light in the
        // picture does not make the others dark.
        let exposure = Exposure::fitting(truth.image, 0.9);
        let shown = |p: Named<'_>| Picture::exposed(p.image, exposure, p.name);
        // Cut out the details where the left picture is most wrong.
        let side = (width.max(height) / DETAIL).clamp(1, width.min(height).max(1));
        let detail = |[x, y]: [u32; 2]| -> Result<[Picture; 3], FilmError> {
            let one = |p: Named<'_>| {
                let part = Image::from_fn(side, side, |u, v| p.image.get(x + u, y + v));
                Picture::exposed(&part, exposure, p.name)
            };
            Ok([one(left)?, one(right)?, one(truth)?])
        };
        let wrong = [left, right].map(|p| distances(p.image, truth.image));
        let places = most_wrong(&relative(&wrong[0], truth.image), [width, height], side);
        // Map both errors on the scale of the left picture's.
        let scale = scale(&wrong[0]);
        let map = |p: Named<'_>, values: &[f32]| {
            let caption = format!("{}: RMSE {}", p.name, scientific(rms(values)));
            Picture::of_scalars(width, height, values, scale, &caption)
        };
        let in_time = |one: Named<'_>| format!("{} in {}", one.name, seconds(one.seconds));
        Ok(Self {
            lead: format!(
                "Left of the slider {}, right of it {}; the reference is {}.",
                in_time(left),
                in_time(right),
                in_time(truth)
            ),
            sides: [shown(left)?, shown(right)?],
            truth: shown(truth)?,
            details: places.into_iter().map(detail).collect::<Result<_, _>>()?,
            errors: [map(left, &wrong[0])?, map(right, &wrong[1])?],
        })
    }
}

/// Returns, for each pixel, the root mean square over channels of the difference of two pictures.
fn distances(image: &Image, truth: &Image) -> Vec<f32> {
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
        let square: f32 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
        (square / 3.0).sqrt()
    };
    image.rgb.iter().zip(&truth.rgb).map(distance).collect()
}

/// Returns errors relative to the brightness of the true picture, to which a tenth of its mean
/// brightness is added so that dark pixels do not dominate.
fn relative(wrong: &[f32], truth: &Image) -> Vec<f32> {
    let black = Image::new(truth.width, truth.height);
    let bright = distances(truth, &black);
    #[allow(clippy::cast_possible_truncation, reason = "a weight")]
    let least = (0.1 * rms(&bright)).max(f64::from(f32::MIN_POSITIVE)) as f32;
    wrong
        .iter()
        .zip(bright)
        .map(|(w, b)| w / (b + least))
        .collect()
}

/// Returns the root mean square of values.
fn rms(values: &[f32]) -> f64 {
    let sum: f64 = values.iter().map(|v| f64::from(*v).powi(2)).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// Returns a logarithmic scale from [`SPAN`] times a value to that value, which nearly all pixels
/// stay below.
fn scale(values: &[f32]) -> HeatMap {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| *v > 0.0).collect();
    sorted.sort_by(f32::total_cmp);
    #[allow(
        clippy::cast_possible_truncation,
        reason = "an index, below the length"
    )]
    let index = (SHOWN * sorted.len().saturating_sub(1) as f64).round() as usize;
    let high = sorted.get(index).map_or(1.0, |v| f64::from(*v));
    HeatMap {
        low: SPAN * high,
        high,
        logarithmic: true,
    }
}

/// Returns the corners of the squares of this side that contain the most squared error and are at
/// least a side away from each other.
fn most_wrong(wrong: &[f32], [width, height]: [u32; 2], side: u32) -> Vec<[u32; 2]> {
    let step = (side / 2).max(1);
    let ends = |length: u32| (0..=length - side).step_by(step as usize);
    let at = |x: u32, y: u32| f64::from(wrong[(y * width + x) as usize]).powi(2);
    let sum = |[x, y]: [u32; 2]| -> f64 {
        let row = |v| (x..x + side).map(move |u| at(u, v)).sum::<f64>();
        (y..y + side).map(row).sum()
    };
    // Sum the squared error over squares at steps of half a side.
    let places = ends(height).flat_map(|y| ends(width).map(move |x| [x, y]));
    let mut found: Vec<([u32; 2], f64)> = places.map(|place| (place, sum(place))).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    // Take the worst squares that are not close to one taken before.
    let mut kept: Vec<[u32; 2]> = Vec::new();
    for (place, _) in found {
        let apart = |k: &[u32; 2]| (0..2).any(|a| k[a].abs_diff(place[a]) >= 2 * side);
        if kept.iter().all(apart) {
            kept.push(place);
        }
        if kept.len() == DETAILS {
            break;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_are_where_the_left_picture_is_most_wrong() {
        let truth = Image::from_fn(64, 32, |_, _| [0.5; 3]);
        let spoilt = |spots: &[[u32; 2]]| {
            Image::from_fn(64, 32, |x, y| {
                let near = |s: &[u32; 2]| s[0].abs_diff(x) < 2 && s[1].abs_diff(y) < 2;
                if spots.iter().any(near) {
                    [0.9; 3]
                } else {
                    [0.5; 3]
                }
            })
        };
        let (left, right) = (spoilt(&[[40, 20], [10, 6]]), spoilt(&[[3, 3]]));
        let wrong = distances(&left, &truth);
        let places = most_wrong(&wrong, [64, 32], 8);
        let holds = |spot: [u32; 2]| {
            let inside = |p: &[u32; 2]| (0..2).all(|a| (p[a]..p[a] + 8).contains(&spot[a]));
            places.iter().any(inside)
        };
        assert!(
            places.len() == 2 && holds([40, 20]) && holds([10, 6]),
            "{places:?}"
        );
        let named = |image, name| Named {
            image,
            name,
            seconds: 0.25,
        };
        let (left, right) = (named(&left, "points"), named(&right, "lines"));
        let found = Comparison::new(left, right, named(&truth, "exact")).unwrap();
        assert_eq!(found.details.len(), 2);
        assert_eq!(
            found.lead,
            "Left of the slider points in 250 ms, right of it lines in 250 ms; the reference is exact \
             in 250 ms."
        );
        // 18 of 2048 pixels are .4 too bright: .4 √(18/2048) = .0375.
        assert_eq!(found.errors[0].caption, "points: RMSE 3.75·10⁻²");
        assert_eq!(found.errors[0].scale, found.errors[1].scale);
        let small = Image::from_fn(2, 2, |_, _| [0.0; 3]);
        assert!(Comparison::new(left, right, named(&small, "exact")).is_err());
    }

    #[test]
    fn pictures_of_a_pixel_can_be_compared() {
        let black = Image::from_fn(1, 1, |_, _| [0.0; 3]);
        let one = Named {
            image: &black,
            name: "",
            seconds: 0.0,
        };
        assert_eq!(Comparison::new(one, one, one).unwrap().details.len(), 1);
    }
}
