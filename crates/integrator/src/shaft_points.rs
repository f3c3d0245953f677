//! Point samples that share a shaft: one walk for all shadow rays of a shading point.

use crate::pair::Pair;
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, AreaSampler, SolidAngleSampler};
use linelit_visibility::Shaft;

/// How points that share a shaft are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaftPoints {
    /// Uniform on the light's area.
    Area,
    /// Uniform in the light's solid angle.
    SolidAngle,
}

impl Pair<'_> {
    /// The mean of L f_r V cos θ/p_ω over points of the light, whose visibility V the shaft knows.
    pub(crate) fn points_in_shaft(
        &self,
        area: &AreaLight,
        points: ShaftPoints,
        shaft: &mut Shaft<'_>,
    ) -> DVec3 {
        let normal = area.polygon.normal();
        let position = self.point.position;
        match points {
            ShaftPoints::Area => {
                let sampler = AreaSampler::new(&area.polygon);
                self.mean_in_shaft(area, shaft, |u| {
                    let sample = sampler.sample(u);
                    let to_light = sample.point - position;
                    let square = to_light.length_squared();
                    let w = to_light / square.sqrt();
                    let pdf = sample.pdf.to_solid_angle(square, normal.dot(w));
                    (w, sample.point, pdf.value())
                })
            }
            ShaftPoints::SolidAngle => {
                let sampler = SolidAngleSampler::new(&area.polygon, position);
                self.mean_in_shaft(area, shaft, |u| {
                    let sample = sampler.sample(u);
                    let w = (sample.point - position).normalize_or_zero();
                    (w, sample.point, sample.pdf.value())
                })
            }
        }
    }

    fn mean_in_shaft(
        &self,
        area: &AreaLight,
        shaft: &mut Shaft<'_>,
        sample: impl Fn([f64; 2]) -> (DVec3, DVec3, f64),
    ) -> DVec3 {
        let set = self.samples();
        let mut sum = DVec3::ZERO;
        for i in 0..self.count() {
            let (w, on_light, pdf) = sample(set.get_2d(i));
            let value = self.light.unshadowed(area, self.point, on_light, w);
            if pdf > 0.0 && value != DVec3::ZERO && shaft.point_visible(on_light) {
                sum += value * (1.0 / pdf);
            }
        }
        sum / f64::from(self.count())
    }
}
