//! Parallel lines on a light by what transformed cosines take of each.

use super::Fit;
use linelit_elementary::atan2;
use linelit_geometry::finite::below_one;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, ParallelLines};
use linelit_lights::{AngularLines, LineSample, LineTechnique, Pdf};

/// Lobes that lines are drawn by, the first the cosine itself, then those that take the most of the
/// light; what others reflect counts as the first's.
const KEPT: usize = 3;

/// The least share of the cosine itself in all albedos, for lines where lobes are zero and what
/// they stand for is not.
const LEAST_FLAT: f64 = 0.01;

/// Parallel lines on a light, drawn by the transformed cosines g of a reflection.
///
/// Offsets of each lobe are in proportion to ∫ g cos'/r² along the whole line: where nothing is in
/// between, a reflection of one lobe has no noise.
pub(super) struct CosineLines {
    lines: ParallelLines,
    /// With their shares.
    lobes: [Option<(LobeLines, f64)>; KEPT],
}

impl CosineLines {
    /// Lines at an angle from the light's first edge; `None` if no lobe reaches the light, or
    /// rounding leaves nothing of its image in the space of the cosine itself.
    pub(super) fn new(fit: &Fit, light: &ConvexPolygon, x: DVec3, angle: f64) -> Option<Self> {
        let lines = ParallelLines::new(light, angle);
        let on = |map: DMat3| LobeLines::new(&lines, light, x, map * fit.to_local());
        let flat = on(DMat3::IDENTITY)?;
        let mut rest = fit.diffuse.element_sum();
        let mut kept: [Option<Candidate>; KEPT] = [const { None }; KEPT];
        for (ltc, albedo) in &fit.lobes {
            let albedo = albedo.element_sum();
            let mut next = on(ltc.to_cosine()).map(|lobe| Candidate { lobe, albedo });
            if next.is_none() {
                rest += albedo;
            }
            for slot in &mut kept[1..] {
                if Candidate::part(&next) > Candidate::part(slot) {
                    std::mem::swap(slot, &mut next);
                }
            }
            rest += next.map_or(0.0, |candidate| candidate.albedo);
        }
        let all: f64 = fit.albedos().map(DVec3::element_sum).sum();
        kept[0] = Some(Candidate {
            lobe: flat,
            albedo: rest.max(LEAST_FLAT * all),
        });
        // By the root of what each takes of the unshadowed light: nobody knows how much of that is
        // hidden, and a bright lobe behind things must not leave the others without lines.
        let mut lobes = kept.map(|slot| {
            let root = Candidate::part(&slot).sqrt();
            slot.filter(|_| root > 0.0).map(|kept| (kept.lobe, root))
        });
        let sum: f64 = lobes.iter().flatten().map(|(_, root)| root).sum();
        lobes
            .iter_mut()
            .flatten()
            .for_each(|(_, root)| *root /= sum);
        (sum > 0.0 && sum.is_finite()).then_some(Self { lines, lobes })
    }

    /// A line from one random number; `None` where there is none.
    pub(super) fn sample(&self, mut u: f64) -> Option<LineSample> {
        let mut chosen = None;
        for (lobe, share) in self.lobes.iter().flatten() {
            chosen = Some((lobe, below_one(u / share)));
            if u < *share {
                break;
            }
            u -= share;
        }
        let (lobe, u) = chosen?;
        let (first, last) = self.lines.range();
        let offset = lobe.sample(u)?.clamp(first, last);
        let lobes = self.lobes.iter().flatten();
        let density: f64 = lobes.map(|(l, share)| share * l.density(offset)).sum();
        let segment = self.lines.segment(offset)?;
        (density > 0.0 && density.is_finite()).then_some(LineSample {
            segment,
            offset,
            pdf: Pdf::new(density),
        })
    }
}

/// A lobe that lines may be drawn by.
struct Candidate {
    lobe: LobeLines,
    /// The sum over the channels.
    albedo: f64,
}

impl Candidate {
    /// What it takes of the light; zero of none.
    fn part(slot: &Option<Self>) -> f64 {
        slot.as_ref()
            .map_or(0.0, |c| c.albedo * c.lobe.image.total())
    }
}

/// Lines of one lobe: those of a direction on the image of a light in the cosine's space, by
/// projected solid angle there.
struct LobeLines {
    image: AngularLines,
    /// Offsets on the image are `origin` + `step` × those on the light.
    origin: f64,
    step: f64,
}

impl LobeLines {
    /// With the map to the cosine's space; `None` if the image is no polygon.
    fn new(lines: &ParallelLines, light: &ConvexPolygon, x: DVec3, map: DMat3) -> Option<Self> {
        let image = light.mapped(map, x)?;
        let (axes, along) = (image.plane_frame().axes, map * lines.direction());
        let angle = atan2(along.dot(axes.y), along.dot(axes.x));
        let image = AngularLines::by_projected_solid_angle(&image, angle, DVec3::ZERO, DVec3::Z);
        let on_image = image.lines();
        let (origin, _) = on_image.coordinates(map * (lines.frame().origin - x));
        let step = on_image.across().dot(map * lines.across());
        (step.abs() > 0.0 && step.is_finite()).then_some(Self {
            image,
            origin,
            step,
        })
    }

    /// An offset on the light.
    fn sample(&self, u: f64) -> Option<f64> {
        let line = self.image.sample(u);
        let offset = (line.offset - self.origin) / self.step;
        (line.pdf.is_positive() && offset.is_finite()).then_some(offset)
    }

    /// The density of an offset on the light.
    fn density(&self, offset: f64) -> f64 {
        let on_image = self.origin + self.step * offset;
        self.image.pdf(on_image).value() * self.step.abs()
    }
}
