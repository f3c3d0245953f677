//! The comparison of our picture with another renderer's, pixel by pixel, and the known reasons for
//! which pixels may differ.
//!
//! A pixel differs if the difference is significant given the noise of both pictures. Pixels that
//! differ because a ray passes an edge, because the light is between two horizons, or by rounding
//! of bright pixels are left out; a few others are decided by brute force.

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

/// The number of lines of the brute-force estimate that decides between two renderers.
const BRUTE_LINES: u32 = 256;
/// The largest number of pixels that brute force decides. If there are more, the other renderer is
/// taken to be right.
const BRUTE_PIXELS: usize = 60;
/// The significance level of the comparison of one image, over all its pixels and channels
/// together.
const ALPHA: f64 = 0.01;
/// The fraction of an image's pixels that must not differ for the comparison to pass, as in
/// Mitsuba's render tests.
const PASS_SHARE: f64 = 0.9975;

/// A row of the table: the result of the comparison with one reference.
#[derive(Debug, Default, serde::Serialize)]
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) estimator: &'static str,
    pub(super) pixels: usize,
    pub(super) mean: f64,
    pub(super) reference_mean: f64,
    /// The ratio of the means over the pixels that are not left out.
    pub(super) mean_ratio: f64,
    /// The standard error of `mean_ratio`, from the noise of both pictures.
    pub(super) ratio_error: f64,
    /// The ratio of the means over all pixels.
    pub(super) mean_ratio_of_all: f64,
    pub(super) mrse: f64,
    pub(super) passing: f64,
    /// The pixels that differ for none of the reasons of the other lists of this row.
    pub(super) unexplained: Vec<[u32; 2]>,
    /// The pixels where rays a hundredth of a pixel apart meet different surfaces.
    pub(super) edges: Vec<[u32; 2]>,
    /// The pixels where the light lies between the horizons of the surface and of its shading
    /// normal: pbrt-v3 takes the absolute cosine there, we take zero.
    pub(super) horizon: Vec<[u32; 2]>,
    /// The pixels that show the light itself, where a sum of thousands of equal `f32` is rounded.
    pub(super) lights: Vec<[u32; 2]>,
    /// The pixels where a brute-force estimate agrees with our value and not with theirs.
    pub(super) wrong: Vec<[u32; 2]>,
    pub(super) ok: bool,
}

/// Compares all pixels with the reference. `ours` has our replicates; `theirs` has replicates by
/// the other renderer's technique, which give the noise of the reference.
pub(super) fn judge(
    entry: &Entry,
    renderer: &Renderer<'_>,
    reference: &Image,
    ours: &Replicated,
    theirs: &Replicated,
) -> Row {
    // Take the pixels of the grid that is compared.
    let (width, stride) = (reference.width as usize, entry.stride as usize);
    let coordinates = |p: usize| [p % width, p / width];
    let on_grid = |p: &usize| coordinates(*p).iter().all(|c| c.is_multiple_of(stride));
    let mut pixels: Vec<usize> = (0..reference.rgb.len()).filter(on_grid).collect();
    let total = pixels.len();
    let value = |p: usize| DVec3::from_array(reference.rgb[p].map(f64::from));
    // The noise of the reference is the noise of its own technique at fewer samples, scaled by the
    // order that stratified points have where the light is partly hidden (a variance of N^-1.5, the
    // slowest).
    let noise = (theirs.samples / entry.samples).powf(1.5);
    // Correct for the number of pixels and channels (Šidák). The spread is estimated from the
    // replicates of the points, so that the score follows Student's distribution.
    let confidence = (1.0 - ALPHA).powf(1.0 / (3.0 * total as f64));
    let t = quantile(confidence, NOISE_REPLICATES - 1);
    let variance = |p: usize| ours.variance[p] / ours.replicates + theirs.variance[p] * noise;
    let differs = |p: &usize| {
        // Both pictures have f32 geometry and pixels: at a grazing cosine, their rounding amounts
        // to 1e-5 of the value.
        let allowed = variance(*p).map(f64::sqrt) * t + value(*p).abs() * 1e-5 + DVec3::splat(1e-7);
        (ours.mean[*p] - value(*p)).abs().cmpgt(allowed).any()
    };
    // Find the pixels that differ, and the ratio of the means.
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
    // Look for a reason at each of these pixels.
    let mut to_decide = Vec::new();
    for &p in &outliers {
        let gap = (ours.mean[p] - value(p)).abs();
        // A sum of N equal f32 numbers is rounded by at most half a unit in the last place of the
        // sum at each addition.
        let rounded = gap.cmple(value(p) * (entry.samples * 2f64.powi(-25))).all();
        match row.reason(renderer, coordinates(p), rounded) {
            Some(pixels) => pixels.push(coordinates(p)),
            None => to_decide.push(p),
        }
    }
    // Decide the others by brute force, if there are few.
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
    // Leave out the pixels with a reason, and summarize the others.
    let left_out = |p: &usize| outliers.contains(p) && !row.unexplained.contains(&coordinates(*p));
    pixels.retain(|p| !left_out(p));
    // Channels see the same samples, so that their errors add up.
    let square = |&p: &usize| variance(p).map(f64::sqrt).element_sum().powi(2);
    let total_variance: f64 = pixels.iter().map(square).sum();
    let sum: f64 = pixels.iter().map(|&p| value(p).element_sum()).sum();
    row.ratio_error = total_variance.sqrt() / sum;
    row.mean_ratio = ratio(&pixels);
    row.finish(pixels.iter().map(|&p| [ours.mean[p], value(p)]).collect())
}

impl Row {
    /// Fills in the means, the MRSE and whether the row passes, from our values and theirs at the
    /// pixels that are not left out.
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

    /// Returns the list of the reason for which this pixel differs, if the scene itself shows one.
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

/// Returns whether rays a hundredth of a pixel from the centre meet other surfaces than the ray
/// through the centre. There, renderers may differ by the rounding of their cameras.
fn straddles_edge(renderer: &Renderer<'_>, pixel: [u32; 2]) -> bool {
    let (scene, mut scratch) = (renderer.scene(), Scratch::new());
    // Find the mesh and the normal that a ray through a pixel meets.
    let mut surface_at = |dx: f64, dy: f64| {
        let [x, y] = pixel.map(|c| f64::from(c) + 0.5);
        let CameraRay { origin, direction } = scene.camera.ray(x + dx, y + dy);
        let ray = Ray::new(origin, direction);
        let hit = renderer.occluders().closest_hit(&ray, &mut scratch)?;
        let surface = scene.surface(hit.triangle, hit.barycentric, direction);
        Some((scene.mesh_of(hit.triangle), surface.geometric_normal))
    };
    let centre = surface_at(0.0, 0.0);
    // Compare the centre with its eight neighbours.
    let mut differs = |[i, j]: [i32; 2]| {
        let other = surface_at(0.01 * f64::from(i), 0.01 * f64::from(j));
        match (centre, other) {
            (Some((a, n)), Some((b, m))) => a != b || !(n.dot(m) > 0.999),
            (a, b) => a.is_some() != b.is_some(),
        }
    };
    (-1..2).any(|i| (-1..2).any(|j| differs([i, j])))
}

/// Returns whether a part of a light is above the surface and below the horizon of the shading
/// normal, or the reverse.
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

/// Returns whether brute-force estimates in f64, without hierarchy or kernels, agree with our value
/// and not with theirs: then the reference is wrong.
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
    // Estimate all lights twice, with different seeds.
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
    // Compare both values with the mean, within its error.
    let brute = emitted + 0.5 * (a + b);
    let allowed = spread * 5.0 + (a - b).abs() * 2.0 + brute.abs() * 1e-3;
    let agrees = |value: DVec3| (brute - value).abs().cmple(allowed).all();
    agrees(ours) && !agrees(theirs)
}
