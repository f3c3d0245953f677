//! Lobes over polygons to a tolerance, against the careful form.

use linelit_geometry::DVec3;
use linelit_shading::phong_polygon::{irradiance, irradiance_to};
use linelit_shading::polygon::irradiance as diffuse;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;

fn unit() -> impl Strategy<Value = DVec3> {
    unit_vector().prop_map(DVec3::from_array)
}

/// Convex polygons on a plane at any tilt, edge-on too, of sizes from specks to what fills the
/// view.
fn polygon() -> impl Strategy<Value = Vec<DVec3>> {
    let angles = prop::collection::vec(0.0..std::f64::consts::TAU, 3..8);
    (unit(), unit(), unit(), -6.0..0.5f64, -3.0..0.0f64, angles).prop_map(
        |(centre, a, b, size, flat, mut angles)| {
            angles.sort_unstable_by(f64::total_cmp);
            let (u, v) = (a, a.cross(b).normalize_or(DVec3::X) * 10f64.powf(flat));
            let corner = |t: &f64| centre + (u * t.cos() + v * t.sin()) * 10f64.powf(size);
            angles.iter().map(corner).collect()
        },
    )
}

proptest! {
    /// The careful form is good to 1e-10.
    #[test]
    fn tolerances_are_kept(
        polygon in polygon(),
        (n, w) in (unit(), unit()),
        k in prop_oneof![0.0..10.0f64, (1.0..5.0f64).prop_map(|e| 10f64.powf(e))],
        tolerance in (-12.0..-3.0f64).prop_map(|e| 10f64.powf(e)),
    ) {
        let exact = irradiance(&polygon, n, w, k);
        let quick = irradiance_to(&polygon, n, w, k, tolerance);
        let most = diffuse(&polygon, n);
        prop_assert!(
            (quick - exact).abs() <= tolerance * most + 1e-10 * exact,
            "{quick:e} {exact:e}: {:e}", quick / exact - 1.0
        );
    }
}
