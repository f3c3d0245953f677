//! The light of spheres and disks by transformed cosines.

use super::{Fit, Known, differences};
use crate::round::RoundView;
use crate::seen_disk::SeenDisk;
use crate::techniques::points::ltc::DiskLobes;
use crate::{EmissionTexture, Query, SampleBuffers, ShadingPoint};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::DVec3;
use linelit_visibility::Shaft;
use std::f64::consts::FRAC_1_PI;

impl Fit {
    /// ∫ g dω over what is seen of a disk; `None` where the sum over its boundary does not tell.
    fn over_disk(&self, seen: &SeenDisk<'_>) -> Option<DVec3> {
        let frame = &self.frame;
        let mut sum = self.diffuse;
        if sum != DVec3::ZERO {
            sum *= seen.irradiance(|p| p, frame.z)?;
        }
        for (ltc, albedo) in &self.lobes {
            let image = |p| ltc.to_cosine() * frame.to_local(p);
            sum += *albedo * seen.irradiance(image, DVec3::Z)?;
        }
        Some(sum * FRAC_1_PI)
    }
}

/// As [`known`](super::known), of a round light, which is told by a shaft towards the disk that is
/// seen; `None` also where the disk is too small, or seen too flatly, for sums over its boundary.
///
/// What the cosine itself stands for mostly cancels: where there are lobes, points for the
/// difference are to be drawn by those alone, which `cosines` then say.
pub(crate) fn known_of_round<R: Reflection>(
    point: &ShadingPoint<R>,
    view: &RoundView,
    emitted: DVec3,
    cosines: &mut TransformedCosines,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<Known> {
    let SampleBuffers {
        fit,
        penumbra,
        on_disk,
        ..
    } = buffers;
    fit.set(cosines, false);
    let seen = SeenDisk::new(view, point, shaft, penumbra, on_disk)?;
    let integral = fit.over_disk(&seen)?;
    if !cosines.lobes().is_empty() {
        cosines.diffuse = DVec3::ZERO;
    }
    Some(Known {
        emitted,
        integral,
        plane: None,
    })
}

/// As [`visible_light`](super::visible_light), of what is visible of a round light.
pub(crate) fn visible_round_light<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    view: &RoundView,
    emitted: DVec3,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> Option<DVec3> {
    let point = query.point;
    let mut cosines = point.cosines()?;
    let known = known_of_round(point, view, emitted, &mut cosines, shaft, buffers)?;
    let lobes = DiskLobes::new(&view.disk, view.x, &cosines)?;
    let rest = differences(query, view, &lobes, &buffers.fit, shaft);
    Some(emitted * (known.integral + rest))
}
