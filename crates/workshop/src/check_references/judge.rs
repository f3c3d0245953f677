//! Pixel against pixel, and why some differ.

use super::{Entry, NOISE_REPLICATES, Replicated};
use linelit_estimators::{Query, RandomNumbers, brute_force};
use linelit_film::Image;
use linelit_geometry::{DVec3, Margins};
use linelit_integrator::{Estimator, Renderer, ShadingPoint, Spheres, Workspace};
use linelit_lights::Light;
use linelit_samplers::SamplerKind;
use linelit_scene::CameraRay;
use linelit_study::stats::student::quantile;
use linelit_visibility::{Ray, Scratch};

/// Lines of the brute-force estimate that decides between two renderers.
const BRUTE_LINES: u32 = 256;
/// The largest number of pixels that brute force decides; with more, the other renderer is right.
const BRUTE_PIXELS: usize = 60;
/// The significance level over all pixels and channels of one image.
const ALPHA: f64 = 0.01;
/// The share of pixels that must pass, as in Mitsuba's render tests.
const PASS_SHARE: f64 = 0.9975;

/// One row of the table.
#[derive(Debug, Default, serde::Serialize)]
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) estimator: &'static str,
    pub(super) pixels: usize,
    pub(super) mean: f64,
    pub(super) reference_mean: f64,
    /// The ratio of the means without the pixels left out.
    pub(super) mean_ratio: f64,
    /// The standard error of that ratio, by the noise of both.
    pub(super) ratio_error: f64,
    /// The ratio of the means with the pixels left out.
    pub(super) mean_ratio_of_all: f64,
    pub(super) mrse: f64,
    pub(super) passing: f64,
    /// Pixels that differ for none of the reasons below.
    pub(super) unexplained: Vec<[u32; 2]>,
    /// Rays a hundredth of a pixel apart meet other surfaces.
    pub(super) edges: Vec<[u32; 2]>,
    /// The light lies between the horizons of the surface and of its smooth normal: pbrt-v3 takes
    /// the absolute cosine there, we take zero.
    pub(super) horizon: Vec<[u32; 2]>,
    /// The light itself, seen: sums of thousands of equal `f32` round it off.
    pub(super) lights: Vec<[u32; 2]>,
    /// A brute-force estimate gives our value and not theirs.
    pub(super) wrong: Vec<[u32; 2]>,
    pub(super) ok: bool,
}

/// Compares all pixels.
pub(super) fn judge(
    entry: &Entry,
    renderer: &Renderer<'_>,
    reference: &Image,
    ours: &Replicated,
    theirs: &Replicated,
) -> Row {
    let (width, stride) = (reference.width as usize, entry.stride as usize);
    let coordinates = |p: usize| [p % width, p / width];
    let on_grid = |p: &usize| coordinates(*p).iter().all(|c| c.is_multiple_of(stride));
    let mut pixels: Vec<usize> = (0..reference.rgb.len()).filter(on_grid).collect();
    let total = pixels.len();
    let value = |p: usize| DVec3::from_array(reference.rgb[p].map(f64::from));
    // How noisy the reference is: its own technique at fewer samples, scaled by the order that
    // stratified points have where the light is partly hidden (variance N^-1.5, the slowest).
    let noise = (theirs.samples / entry.samples).powf(1.5);
    // Sidak over pixels and channels. The spread is estimated from the replicates of the points,
    // so the score follows Student's distribution.
    let confidence = (1.0 - ALPHA).powf(1.0 / (3.0 * total as f64));
    let t = quantile(confidence, NOISE_REPLICATES - 1);
    let variance = |p: usize| ours.variance[p] / ours.replicates + theirs.variance[p] * noise;
    let differs = |p: &usize| {
        // Both hold f32 geometry and pixels: 1e-5 of the value is what a grazing cosine makes of
        // their rounding.
        let allowed = variance(*p).map(f64::sqrt) * t + value(*p).abs() * 1e-5 + DVec3::splat(1e-7);
        (ours.mean[*p] - value(*p)).abs().cmpgt(allowed).any()
    };
    let outliers: Vec<usize> = pixels.iter().copied().filter(differs).collect();
    let coordinates = |p: usize| coordinates(p).map(|c| u32::try_from(c).unwrap_or(0));
    let ratio = |pixels: &[usize]| {
        let sums = pixels.iter().fold([0.0; 2], |[a, b], &p| {
            [a + ours.mean[p].element_sum(), b + value(p).element_sum()]
        });
        sums[0] / sums[1]
    };
    let mut row = Row {
        name: entry.name,
        estimator: entry.ours.estimator,
        pixels: total,
        mean_ratio_of_all: ratio(&pixels),
        ..Row::default()
    };
    let mut to_decide = Vec::new();
    for &p in &outliers {
        let gap = (ours.mean[p] - value(p)).abs();
        // A sum of N equal numbers in f32 rounds by half a unit of the sum at most, each time.
        let rounded = gap.cmple(value(p) * (entry.samples * 2f64.powi(-25))).all();
        match row.reason(renderer, coordinates(p), rounded) {
            Some(pixels) => pixels.push(coordinates(p)),
            None => to_decide.push(p),
        }
    }
    let decide = to_decide.len() <= BRUTE_PIXELS;
    for p in to_decide {
        let spread = (ours.variance[p] / ours.replicates).map(f64::sqrt);
        let (pixel, values) = (coordinates(p), [ours.mean[p], value(p)]);
        if decide && brute_force_decides(renderer, entry, pixel, values, spread) {
            row.wrong.push(pixel);
        } else {
            row.unexplained.push(pixel);
        }
    }
    let left_out = |p: &usize| outliers.contains(p) && !row.unexplained.contains(&coordinates(*p));
    pixels.retain(|p| !left_out(p));
    // Channels see the same samples: their errors add up.
    let square = |&p: &usize| variance(p).map(f64::sqrt).element_sum().powi(2);
    let total_variance: f64 = pixels.iter().map(square).sum();
    let sum: f64 = pixels.iter().map(|&p| value(p).element_sum()).sum();
    row.ratio_error = total_variance.sqrt() / sum;
    row.mean_ratio = ratio(&pixels);
    row.finish(pixels.iter().map(|&p| [ours.mean[p], value(p)]).collect())
}

impl Row {
    /// Fills in what the values of the pixels that are not left out say, ours and theirs.
    fn finish(mut self, values: Vec<[DVec3; 2]>) -> Self {
        let count = 3.0 * values.len() as f64;
        for [got, want] in values {
            self.mean += got.element_sum() / count;
            self.reference_mean += want.element_sum() / count;
            self.mrse += ((got - want) * (got - want) / (want * want + 1e-6)).element_sum() / count;
        }
        self.passing = 1.0 - self.unexplained.len() as f64 / self.pixels as f64;
        let allowed = 2e-4_f64.max(3.0 * self.ratio_error);
        self.ok = self.passing >= PASS_SHARE && (self.mean_ratio - 1.0).abs() < allowed;
        self
    }

    /// The pixels that differ for the reason that the scene shows by itself at this one, if any.
    fn reason(
        &mut self,
        renderer: &Renderer<'_>,
        pixel: [u32; 2],
        rounded: bool,
    ) -> Option<&mut Vec<[u32; 2]>> {
        if straddles_edge(renderer, pixel) {
            return Some(&mut self.edges);
        }
        let point = renderer.shading_point(pixel, &mut Workspace::new())?;
        if rounded && point.emitted != DVec3::ZERO {
            return Some(&mut self.lights);
        }
        let between = renderer.scene().lights.iter().any(|l| match &*l.light {
            Light::Area(area) => between_horizons(&point, area.polygon.vertices()),
            _ => false,
        });
        between.then_some(&mut self.horizon)
    }
}

/// Whether rays a hundredth of a pixel beside the centre of one meet other surfaces than the ray
/// through it: there, renderers may differ by the rounding of their cameras.
fn straddles_edge(renderer: &Renderer<'_>, pixel: [u32; 2]) -> bool {
    let (scene, mut scratch) = (renderer.scene(), Scratch::new());
    let mut surface_at = |dx: f64, dy: f64| {
        let [x, y] = pixel.map(|c| f64::from(c) + 0.5);
        let CameraRay { origin, direction } = scene.camera.ray(x + dx, y + dy);
        let ray = Ray::new(origin, direction);
        let hit = renderer.occluders().closest_hit(&ray, &mut scratch)?;
        let surface = scene.surface(hit.triangle, hit.barycentric, direction);
        Some((scene.mesh_of(hit.triangle), surface.geometric_normal))
    };
    let centre = surface_at(0.0, 0.0);
    let mut differs = |[i, j]: [i32; 2]| {
        let other = surface_at(0.01 * f64::from(i), 0.01 * f64::from(j));
        match (centre, other) {
            (Some((a, n)), Some((b, m))) => a != b || !(n.dot(m) > 0.999),
            (a, b) => a.is_some() != b.is_some(),
        }
    };
    (-1..2).any(|i| (-1..2).any(|j| differs([i, j])))
}

/// Whether part of a light is above the surface and below the shading normal's horizon, or the
/// reverse.
fn between_horizons(point: &ShadingPoint, light: &[DVec3]) -> bool {
    if point.normal == point.geometric_normal {
        return false;
    }
    let above = |n: DVec3| {
        light
            .iter()
            .filter(|v| n.dot(**v - point.position) > 0.0)
            .count()
    };
    let (surface, smooth) = (above(point.geometric_normal), above(point.normal));
    let cut = |count: usize| (1..light.len()).contains(&count);
    surface != smooth || cut(surface) || cut(smooth)
}

/// Whether brute-force estimates in f64, without hierarchy or kernels, give our value and not
/// theirs: then it is the reference that is wrong.
fn brute_force_decides(
    renderer: &Renderer<'_>,
    entry: &Entry,
    pixel: [u32; 2],
    [ours, theirs]: [DVec3; 2],
    spread: DVec3,
) -> bool {
    let mut workspace = Workspace::new();
    let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
        return ours == DVec3::ZERO;
    };
    let emitted = if entry.hide_lights {
        DVec3::ZERO
    } else {
        point.emitted
    };
    let (scene, estimator) = (renderer.scene(), Estimator::analytic());
    let vertices = (0_u32..).zip(&scene.positions);
    let positions: Vec<_> = vertices
        .map(|(i, _)| scene.vertex(i).as_vec3().to_array())
        .collect();
    let [a, b] = [4711, 4712].map(|seed| {
        let mut sum = DVec3::ZERO;
        for light in renderer.plan().lights_of(Spheres::Facets) {
            if let Light::Area(area) = &*light.light {
                let source = light.source();
                let numbers = RandomNumbers::new(SamplerKind::Auto, seed, pixel, light.index);
                let occluders = renderer.occluders();
                let mut query =
                    Query::new(occluders, &source, &point, &estimator, numbers, BRUTE_LINES);
                query.margins = Margins::DEFAULT;
                sum += brute_force(&query, area, &positions, &scene.triangles);
            }
        }
        sum
    });
    let brute = emitted + 0.5 * (a + b);
    let allowed = spread * 5.0 + (a - b).abs() * 2.0 + brute.abs() * 1e-3;
    let agrees = |value: DVec3| (brute - value).abs().cmple(allowed).all();
    agrees(ours) && !agrees(theirs)
}
