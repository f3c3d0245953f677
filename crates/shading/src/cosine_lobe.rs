//! Generalised cosine lobes (Lafortune): sums of them stand for glossy, retro-reflective and
//! off-specular surfaces, and each is a Phong integral about a stretched axis.

use crate::{phong, phong_polygon};
use linelit_elementary::pow;
use linelit_geometry::finite::nonnegative_vector;
use linelit_geometry::{DVec3, Frame};

/// One lobe: `f(ω_i, ω_o) = weight · max(0, C_x ω_ix ω_ox + C_y ω_iy ω_oy + C_z ω_iz ω_oz)ᵏ`, in
/// the local frame of the surface, 1/sr.
///
/// C = (−1, −1, 1) mirrors (Phong), (1, 1, 1) reflects back; the length of C scales the lobe.
///
/// **Source**: Lafortune, Foo, Torrance & Greenberg 1997.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosineLobe {
    /// C, by component.
    pub stretch: DVec3,
    /// k ≥ 0, any real number.
    pub exponent: f64,
    /// By channel, 1/sr.
    pub weight: DVec3,
}

impl CosineLobe {
    /// The lobe's axis C ω_o in world space (not of unit length) for the unit direction `wo` to the
    /// viewer: `f = weight · max(0, axis·ω_i)ᵏ`.
    #[must_use]
    pub fn axis(&self, frame: &Frame, wo: DVec3) -> DVec3 {
        frame.to_world(self.stretch * frame.to_local(wo))
    }

    /// f(ω_i, ω_o), 1/sr, for unit directions in world space; zero below the surface.
    #[must_use]
    pub fn value(&self, frame: &Frame, wi: DVec3, wo: DVec3) -> DVec3 {
        if frame.z.dot(wi) <= 0.0 || frame.z.dot(wo) <= 0.0 {
            return DVec3::ZERO;
        }
        let cosine = self.axis(frame, wo).dot(wi);
        if cosine > 0.0 {
            nonnegative_vector(self.weight * pow(cosine, self.exponent))
        } else {
            DVec3::ZERO
        }
    }

    /// The radiance of a ribbon, for each unit of radiance, width and emitter's height, 1/length².
    ///
    /// **Error**: as [`phong::ribbon`], to which it is a call.
    #[must_use]
    pub fn ribbon(&self, frame: &Frame, wo: DVec3, p0: DVec3, p1: DVec3) -> DVec3 {
        let axis = self.axis(frame, wo);
        nonnegative_vector(self.weight * phong::ribbon(p0, p1, frame.z, axis, self.exponent))
    }

    /// The radiance of a thin cylinder, for each unit of radiance × radius, 1/length.
    #[must_use]
    pub fn cylinder(&self, frame: &Frame, wo: DVec3, p0: DVec3, p1: DVec3) -> DVec3 {
        let axis = self.axis(frame, wo);
        nonnegative_vector(self.weight * phong::cylinder(p0, p1, frame.z, axis, self.exponent))
    }

    /// The radiance of a polygon, for each unit of radiance.
    #[must_use]
    pub fn polygon(&self, frame: &Frame, wo: DVec3, vertices: &[DVec3]) -> DVec3 {
        let axis = self.axis(frame, wo);
        nonnegative_vector(
            self.weight * phong_polygon::irradiance(vertices, frame.z, axis, self.exponent),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::{Model, line};
    use linelit_testkit::{assert_close, rng::SplitMix64};

    /// The closed forms against adaptive quadrature of the value itself.
    #[test]
    fn integrals_are_those_of_the_value() {
        let mut rng = SplitMix64::new(21);
        for case in 0..200 {
            let mut v = |a: f64, b: f64| rng.in_range(a, b);
            let frame = Frame::from_normal(DVec3::new(v(-0.5, 0.5), v(-0.5, 0.5), 1.0).normalize());
            let wo = frame.to_world(DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), 1.0).normalize());
            let lobe = CosineLobe {
                stretch: DVec3::new(v(-1.2, -0.6), v(-1.2, -0.6), v(0.6, 1.1)),
                exponent: v(0.0, 200.0).floor(),
                weight: DVec3::new(1.0, 0.5, 0.25),
            };
            let p0 = frame.to_world(DVec3::new(v(-2.0, 2.0), v(-2.0, 2.0), v(-0.5, 2.0)));
            let p1 = frame.to_world(DVec3::new(v(-2.0, 2.0), v(-2.0, 2.0), v(-0.5, 2.0)));
            let value = |w: DVec3| lobe.value(&frame, w, wo);
            for (model, got) in [
                (Model::Ribbon, lobe.ribbon(&frame, wo, p0, p1)),
                (Model::Cylinder, lobe.cylinder(&frame, wo, p0, p1)),
            ] {
                let want = line(p0, p1, frame.z, model, value, 1e-11, 200_000);
                // The estimate's own error bound, and what a peak seen by no node may hide.
                let tolerance = want.error + 1e-9 * want.value.x + 1e-30;
                assert_close!(got.x, want.value.x, tolerance, "case {case}: {lobe:?}");
            }
        }
    }
}
