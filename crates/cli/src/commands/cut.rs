//! The choice of the tiles of a picture, such that each unit takes a second or so.

use crate::args::PictureArgs;
use linelit_film::Tile;
use linelit_geometry::DVec3;
use linelit_integrator::LightChoice;
use linelit_lights::Light;
use linelit_scene::{SceneDescription, SceneLight};

/// The bounds of the limit on the time of a unit, in seconds of one thread. With the lower one,
/// writing its part takes little in comparison; with the upper one, a kill loses little.
const UNIT_SECONDS: [f64; 2] = [0.25, 2.0];
/// The number of units into which a picture is cut, as long as their time is then within
/// [`UNIT_SECONDS`]. This number suffices for distributing the units equally among threads and
/// machines.
const ENOUGH: f64 = 256.0;
/// The largest side of tiles that is tried; sides are powers of two.
const LARGEST_SIDE: u32 = 1024;
/// The side of tiles below which blocks of camera samples become separate units first.
const SMALL_SIDE: u32 = 8;

/// The way in which a picture is cut into units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// The side of tiles, in pixels. Tiles at the window's right and lower edge may be smaller.
    pub(super) side: u32,
    /// Whether each block of a tile's camera samples is a separate unit.
    pub(super) by_block: bool,
}

impl Cut {
    /// Units that are computed at once and not stored: they are small, so that all threads end at
    /// about the same time.
    pub(super) const AT_ONCE: Self = Self {
        side: 16,
        by_block: false,
    };

    /// Chooses the largest tiles that are short enough, for a window whose pixels take
    /// `pixel_seconds` each; or tiles of the `requested` side. Where tiles of 8 × 8 pixels, or of
    /// the requested side, would take too long, or `by_block` requests it, blocks of samples are
    /// separate units.
    pub(super) fn choose(
        args: &PictureArgs,
        window: Tile,
        pixel_seconds: f64,
        requested: Option<u32>,
        by_block: bool,
    ) -> Self {
        // The limit on the time of a unit.
        let [least, most] = UNIT_SECONDS;
        let seconds = (pixel_seconds * window.area() as f64 / ENOUGH).clamp(least, most);
        let fits = |side: u32, blocks: u32| {
            f64::from(side).powi(2) * pixel_seconds / f64::from(blocks) <= seconds
        };
        // Separate the blocks of samples if even small tiles are too long.
        let blocks = args.blocks();
        let is_long = !fits(requested.unwrap_or(SMALL_SIDE), 1);
        let by_block = blocks > 1 && (by_block || is_long);
        // Take the largest side within the limit.
        let halves =
            std::iter::successors(Some(LARGEST_SIDE), |side| Some(side / 2).filter(|s| *s > 0));
        let mut sides = halves.filter(|side| fits(*side, if by_block { blocks } else { 1 }));
        let side = requested.or_else(|| sides.next()).unwrap_or(1);
        Self { side, by_block }
    }
}

/// Returns an estimate of the seconds of one thread that a pixel takes, within a factor of ten: a
/// microsecond for a camera ray and for each light, half a microsecond for each sample of a light.
pub(super) fn pixel_seconds(scene: &SceneDescription, picture: &PictureArgs) -> f64 {
    let lights = match picture.lights {
        LightChoice::All => lights_in_use(scene) as f64,
        _ => 1.0,
    };
    let light = 1e-6 + 5e-7 * f64::from(picture.samples);
    picture.camera_samples() * (1e-6 + lights * light)
}

/// Counts the lights that can send light to a point of the scene: those that emit, without polygons
/// that face away from all of the scene, which cost next to no time.
fn lights_in_use(scene: &SceneDescription) -> usize {
    let Some((lo, hi)) = scene.bounds() else {
        return scene.lights.len();
    };
    // All of the scene is behind a plane if the corners of its bounding box are.
    let end = |i: u32, low: f64, high: f64| if i.is_multiple_of(2) { low } else { high };
    let corner = |i: u32| {
        let (y, z) = (end(i / 2, lo.y, hi.y), end(i / 4, lo.z, hi.z));
        DVec3::new(end(i, lo.x, hi.x), y, z)
    };
    let is_in_use = |light: &&SceneLight| match &*light.light {
        Light::Area(area) => {
            let is_lit = |i| area.faces(corner(i), 0.0);
            area.emission.radiance != DVec3::ZERO && (0..8).any(is_lit)
        }
        _ => true,
    };
    scene.lights.iter().filter(is_in_use).count()
}
