//! Light from a square lamp on the floor below, by solid angle and by projected solid angle: the
//! latter is exact.
#![expect(clippy::print_stdout, reason = "an example prints")]

use linelit_geometry::{ConvexPolygon, DVec3, PolygonError};
use linelit_lights::{AngularLines, PointTechnique, SolidAngleSampler};

fn main() -> Result<(), PolygonError> {
    let lamp = ConvexPolygon::parallelogram(DVec3::new(0.5, 0.0, 2.0), DVec3::X, DVec3::Y)?;
    let by_angle = SolidAngleSampler::new(&lamp, DVec3::ZERO);
    let mean = (0..64)
        .map(|i| {
            by_angle.sample([
                f64::from(i % 8) / 8.0 + 0.0625,
                f64::from(i / 8) / 8.0 + 0.0625,
            ])
        })
        .map(|s| s.point.normalize().z / s.pdf.value() / 64.0)
        .sum::<f64>();
    let exact = AngularLines::by_projected_solid_angle(&lamp, 0.0, DVec3::ZERO, DVec3::Z).total();
    println!("irradiance per radiance: {mean:.6} from 64 stratified points, {exact:.6} exactly");
    Ok(())
}
