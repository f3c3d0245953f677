//! This module samples points of a light in proportion to the reflection: as a mixture of linearly
//! transformed cosines (LTCs) that approximate the BSDF, restricted to the light, and a uniform
//! density.

use crate::surface::draw::Draw;
use crate::{
    Disk, LightPoint, Pdf, PointTechnique, RegionSampler, SolidAngle, SolidAngleSampler, Surface,
    TransformedCone, TransformedSampler,
};
use linelit_geometry::finite::below_one;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_shading::ltc::LtcMixture;
use linelit_shading::polygon;
use std::f64::consts::FRAC_1_PI;

/// The largest number of LTCs that a mixture samples: the ones that reflect the most of the light.
/// The other LTCs count as diffuse.
const KEPT: usize = 2;

/// The smallest fraction of samples that is uniform in the solid angle. It bounds the samples'
/// weights in directions in which the reflection is larger than its LTCs, which may be zero there.
const LEAST_UNIFORM: f64 = 0.1;

/// The fraction of an LTC's integral that a disk has to cover for uniform samples to be mixed with
/// the LTC's. A disk that covers a smaller fraction is sampled by the LTC only: over such a disk
/// the LTC's density is everywhere above a hundredth of its largest value.
const TAIL: f64 = 0.9;

/// A mixture of the LTCs of a reflection over one light, and a uniform density, as one technique.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<U, L> {
    /// The uniform technique, and the fraction of the samples that it draws.
    uniform: (U, f64),
    lobes: [Option<(L, f64)>; KEPT],
}

/// A technique that samples a polygon by the LTCs of a reflection and uniformly in solid angle.
pub type Lobes = Mixture<SolidAngleSampler, TransformedSampler>;

/// A technique that samples the visible region of a polygon by the LTCs of a reflection and
/// uniformly in area.
pub type VisiblePolygonLtc<'r> = Mixture<&'r RegionSampler, TransformedSampler>;

/// A technique that samples a disk by the LTCs of a reflection. In place of a uniform density it
/// has the clamped cosine; `None` where that is not needed.
pub type DiskLtc = Mixture<Option<TransformedCone>, TransformedCone>;

impl<U, L: Copy> Mixture<U, L> {
    /// Divides the samples between the lobes in proportion to the light that each reflects.
    ///
    /// `rest` is the light that the diffuse part reflects. `sampler` takes the index of a lobe and
    /// its map to the world, and returns the technique of this lobe and the light that it reflects.
    /// `least` returns the smallest fraction of samples that has to be uniform when a given lobe is
    /// one of the mixture. `uniform` makes the uniform technique, given its fraction.
    fn shared(
        cosines: &LtcMixture,
        mut rest: f64,
        sampler: impl Fn(usize, DMat3) -> Option<(L, f64)>,
        least: impl Fn(&L) -> f64,
        uniform: impl FnOnce(f64) -> U,
    ) -> Self {
        let frame = &cosines.frame;
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        let size = |slot: &Option<(L, f64)>| slot.map_or(0.0, |(_, part)| part);
        let mut lobes = [None; KEPT];
        // Keep the lobes that reflect most, by insertion; the light of all others goes to the rest.
        for (k, lobe) in cosines.lobes().iter().enumerate() {
            let mut next = sampler(k, to_world * lobe.map).filter(|(_, part)| *part > 0.0);
            for slot in &mut lobes {
                if size(&next) > size(slot) {
                    std::mem::swap(slot, &mut next);
                }
            }
            rest += size(&next);
        }
        // The uniform technique gets the fraction of the rest, and at least what the lobes demand.
        let sum: f64 = lobes.iter().flatten().map(|(_, part)| part).sum();
        let least = lobes.iter().flatten().map(|(lobe, _)| least(lobe));
        let mut share = least.fold(rest / (rest + sum), f64::max);
        // A sum that overflows, or whose reciprocal does, leaves all samples to the uniform
        // technique.
        if !((f64::MIN_POSITIVE..=f64::MAX).contains(&sum) && share <= 1.0) {
            (share, lobes) = (1.0, [None; KEPT]);
        }
        for (_, part) in lobes.iter_mut().flatten() {
            *part *= (1.0 - share) / sum;
        }
        Self {
            uniform: (uniform(share), share),
            lobes,
        }
    }

    /// Chooses a lobe (`Ok`) or the uniform technique (`Err`) by `u[0]`, and rescales `u[0]` for
    /// the sample that follows.
    fn pick(&self, [mut a, b]: [f64; 2]) -> (Result<&L, &U>, [f64; 2]) {
        for (lobe, share) in self.lobes.iter().flatten() {
            if a < *share {
                return (Ok(lobe), [below_one(a / share), b]);
            }
            a -= share;
        }
        let (uniform, share) = &self.uniform;
        (Err(uniform), [below_one(a / share), b])
    }

    /// Returns the density of the mixture at a point, from its density by each lobe and the uniform
    /// density.
    fn pdf(&self, by_lobe: impl Fn(&L) -> Pdf<SolidAngle>, uniformly: Pdf<SolidAngle>) -> f64 {
        let lobes = self.lobes.iter().flatten();
        let densities = lobes.map(|(lobe, share)| share * by_lobe(lobe).value());
        densities.sum::<f64>() + self.uniform.1 * uniformly.value()
    }
}

impl Lobes {
    /// Sets up the technique that samples the polygon `light`, as the shading point `x` sees it, by
    /// the LTCs `cosines` of the reflection at `x`.
    #[must_use]
    pub fn new(light: &ConvexPolygon, x: DVec3, cosines: &LtcMixture) -> Self {
        // Integrate the diffuse part over the light, in closed form.
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        let seen = light.relative_to(x, &mut relative);
        let flat = polygon::irradiance_by_edges(seen, cosines.frame.z);
        let rest = cosines.diffuse.element_sum() * FRAC_1_PI * flat;
        // Integrate each lobe over the light, in closed form, too.
        let sampler = |k: usize, map| {
            let sampler = TransformedSampler::new(light, x, map)?;
            let integral = polygon::irradiance_by_edges(sampler.image().vertices(), DVec3::Z);
            let albedo = cosines.lobes()[k].albedo.element_sum();
            Some((sampler, albedo * FRAC_1_PI * integral))
        };
        let uniform = |_| SolidAngleSampler::new(light, x);
        Self::shared(cosines, rest, sampler, |_| LEAST_UNIFORM, uniform)
    }
}

impl Draw for Lobes {
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        let sample = match self.pick(u) {
            (Ok(lobe), u) => lobe.sample(u),
            (Err(all), u) => all.sample(u),
        };
        let at = LightPoint::new(sample.point, x, surface);
        Some((at, self.density(&at)))
    }

    fn density(&self, at: &LightPoint) -> f64 {
        self.pdf(|lobe| lobe.pdf(at.point), self.uniform.0.pdf(at.point))
    }
}

impl<'r> VisiblePolygonLtc<'r> {
    /// Sets up the technique that samples the visible region of a light by the LTCs of the
    /// reflection. `reflected` holds the light that the diffuse part reflects of this region, and
    /// then the light that each lobe reflects.
    #[must_use]
    pub fn within(
        visible: &'r RegionSampler,
        light: &ConvexPolygon,
        x: DVec3,
        cosines: &LtcMixture,
        reflected: &[f64],
    ) -> Self {
        let rest = reflected[0].max(0.0);
        let sampler =
            |k: usize, map| Some((TransformedSampler::new(light, x, map)?, reflected[k + 1]));
        Self::shared(cosines, rest, sampler, |_| LEAST_UNIFORM, |_| visible)
    }

    /// Returns a visible point and the density per solid angle there; `None` where a lobe leads to
    /// a point that is hidden.
    pub fn draw(&self, u: [f64; 2], light: &ConvexPolygon, x: DVec3) -> Option<(LightPoint, f64)> {
        let visible = self.uniform.0;
        let point = match self.pick(u) {
            (Ok(lobe), u) => Some(lobe.sample(u).point).filter(|point| visible.holds(*point)),
            (Err(_), u) => {
                let sample = visible.sample(u);
                sample.pdf.is_positive().then_some(sample.point)
            }
        }?;
        let at = LightPoint::new(point, x, &Surface::Polygon(light));
        let uniformly = visible.density().to_solid_angle(at.square, at.cos_light);
        Some((at, self.pdf(|lobe| lobe.pdf(point), uniformly)))
    }
}

impl DiskLtc {
    /// Sets up the technique that samples a disk, as the shading point `x` sees it, by the LTCs
    /// `cosines` of the reflection at `x`; `None` where no cone of directions represents the disk
    /// well: `x` is in the disk's plane, or the disk is very small.
    #[must_use]
    pub fn new(disk: &Disk, x: DVec3, cosines: &LtcMixture) -> Option<Self> {
        let Frame { x: e, y: f, z } = cosines.frame;
        // Integrate each lobe, and the diffuse part, approximately over the disk.
        let sampler = |k: usize, map| {
            let sampler = TransformedCone::new(disk, x, map)?;
            let albedo = cosines.lobes()[k].albedo.element_sum();
            Some((sampler, albedo * sampler.about_integral()))
        };
        let flat = || TransformedCone::new(disk, x, DMat3::from_cols(e, f, z));
        let diffuse = cosines.diffuse.element_sum();
        let rest = match diffuse > 0.0 {
            true => diffuse * flat()?.about_integral(),
            false => 0.0,
        };
        // Lobes that the disk truncates little need uniform samples for the lobe's tail.
        let least = |lobe: &TransformedCone| match lobe.coverage() > TAIL {
            true => LEAST_UNIFORM,
            false => 0.0,
        };
        let uniform = |share| if share > 0.0 { flat() } else { None };
        let mixture = Self::shared(cosines, rest, sampler, least, uniform);
        let (uniform, share) = &mixture.uniform;
        (*share <= 0.0 || uniform.is_some()).then_some(mixture)
    }
}

impl Draw for DiskLtc {
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        let (direction, _) = match self.pick(u) {
            (Ok(cone), u) => cone.sample(u),
            (Err(uniform), u) => uniform.as_ref()?.sample(u),
        };
        let on_light = surface.meets(x, direction)?;
        let at = LightPoint::towards(on_light, on_light - x, direction, surface);
        Some((at, self.density(&at)))
    }

    fn density(&self, at: &LightPoint) -> f64 {
        let pdf = |cone: &TransformedCone| cone.pdf(at.direction);
        self.pdf(pdf, self.uniform.0.as_ref().map_or(Pdf::ZERO, pdf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_shading::ltc::LtcLobe;
    use linelit_testkit::assert_close;

    /// A lobe whose directions all meet the light gets its whole albedo as its part of the samples,
    /// wherever on the light it lies: in the space of a narrow lobe's cosine the light is so wide
    /// that the cosine at its centre says little.
    #[test]
    fn narrow_lobes_on_the_light_get_their_share() {
        let frame = Frame::from_normal(DVec3::new(0.3, -0.2, 0.9).normalize());
        let corner = frame.z + frame.x * 0.1 - frame.y * 0.4;
        let light = ConvexPolygon::parallelogram(corner, frame.x * 0.8, frame.y * 1.3).unwrap();
        let flat = 0.3 * FRAC_1_PI * polygon::irradiance(light.vertices(), frame.z);
        for (u, v) in [(0.5, 0.5), (0.1, 0.2), (0.9, 0.1), (0.95, 0.97)] {
            let to = frame.to_local(corner + frame.x * (0.8 * u) + frame.y * (1.3 * v));
            let lobe = Frame::from_normal(to.normalize());
            let map = DMat3::from_cols(lobe.x * 1e-4, lobe.y * 1e-4, lobe.z);
            let mut cosines = LtcMixture::new(frame, DVec3::splat(0.3));
            let albedo = DVec3::splat(0.04);
            cosines.add(LtcLobe { map, albedo });
            let lobes = Lobes::new(&light, DVec3::ZERO, &cosines);
            // Of a cosine lobe, (1e-4/.04)² is further from its axis than .04 of light around.
            let want = (0.04 / (0.04 + flat)).min(1.0 - LEAST_UNIFORM);
            assert_close!(lobes.lobes[0].unwrap().1, want, rel = 1e-5, "({u}, {v})");
        }
    }
}
