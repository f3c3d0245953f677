//! These tests use lights with a corner, an edge or an end so near to the shading point that the
//! squares of such distances underflow, while the light does not.

use crate::accuracy::{flat_shape, from_its_plane};
use crate::polygons_by_quadrature::facets;
use linelit_geometry::{DVec3, Frame};
use linelit_shading::quadrature::{self, Model};
use linelit_shading::{cylinder, phong, polygon, ribbon, solid_angle};
use linelit_shading::{ltc::Ltc, spherical_gaussian};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;

/// A polygon in a plane at 10 to a power from −300 to −7, and a normal, with the foot of the
/// shading point on the first corner or in the middle of the first edge, to the last bit; and the
/// axis that the plane is perpendicular to.
fn over_its_border(rng: &mut SplitMix64, on_edge: bool) -> (Vec<DVec3>, DVec3, usize) {
    let (corners, n) = flat_shape(-300.0, -7.0, rng);
    let height = (0..3)
        .find(|&i| {
            corners
                .iter()
                .all(|p| p[i].to_bits() == corners[0][i].to_bits())
        })
        .expect("the plane of three equal coordinates");
    let flat = |mut p: DVec3| {
        p[height] = 0.0;
        p
    };
    let half = 0.5 * (flat(corners[1]) - flat(corners[0]));
    let foot = flat(corners[0]) + half;
    let place = |(i, p): (usize, &DVec3)| {
        let mut q = match (on_edge, i) {
            (true, 0) => -half,
            (true, 1) => half,
            (true, _) => flat(*p) - foot,
            (false, _) => flat(*p) - flat(corners[0]),
        };
        q[height] = p[height];
        q
    };
    (corners.iter().enumerate().map(place).collect(), n, height)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(64), ..ProptestConfig::default() })]

    /// Compared with Lambert's sum of up to 690 digits, by the goals of docs/accuracy.md. In sums
    /// over edges, a clipped end has an error of 50 ε, which rotates the plane of an edge by this
    /// over the sine of its angle. Next to the light's plane the smallest sine is the sine of the
    /// angle between the horizon and this plane.
    #[test]
    fn a_foot_on_the_border_keeps_the_light(seed in any::<u64>(), on_edge in any::<bool>()) {
        let (corners, n, up) = over_its_border(&mut SplitMix64::new(seed), on_edge);
        let arrays: Vec<[f64; 3]> = corners.iter().map(|v| v.to_array()).collect();
        let [light, solid] = from_its_plane(&arrays, n.to_array());
        let story = format!("{corners:?} {n}");
        // Below, digits are lost to the range of numbers.
        prop_assume!(light > 1e-280);
        assert_close!(polygon::irradiance(&corners, n), light, rel = 1e-12, "{story}");
        assert_close!(solid_angle::polygon(&corners), solid, rel = 1e-12, "{story}");
        let slope = (1.0 - n[up] * n[up]).sqrt().max(1e-16);
        let absolute = 50.0 * f64::EPSILON / slope * 3.15 * (corners.len() + 2) as f64;
        assert_close!(polygon::irradiance_by_edges(&corners, n), light, absolute, "{story}");
    }
}

/// Wrong before: .4323356, and for the edge .9992.
#[test]
fn a_corner_at_the_foot_does_not_vanish() {
    let n = DVec3::new(0.36, 0.48, -0.8);
    for height in [1e-20, 1e-158, 1e-165, 1e-300] {
        let at = |x, y| DVec3::new(x, y, height);
        let corner = [at(0.0, 0.0), at(1.0, 0.25), at(0.25, 1.0)];
        let got = polygon::irradiance(&corner, n);
        assert_close!(
            got,
            0.188_438_925_298_293_54,
            rel = 1e-12,
            "corner {height:e}"
        );
        let edge = [at(-1.0, 0.0), at(1.0, 0.0), at(0.25, 1.0)];
        let got = polygon::irradiance(&edge, n);
        assert_close!(
            got,
            0.296_469_010_667_101_74,
            rel = 1e-12,
            "edge {height:e}"
        );
        // Mapped: the frame's rounding of far corners turns them by ε towards the plane, not more.
        let frame = Frame::from_normal(n);
        let lobe = facets(0.5, 0.5);
        let near = |height: f64| corner.map(|p| DVec3::new(p.x, p.y, height));
        let want = lobe.polygon(&frame, &near(1e-20));
        assert_close!(
            lobe.polygon(&frame, &corner),
            want,
            rel = 1e-11,
            "mapped {height:e}"
        );
        let got = lobe.polygon_by_edges(&frame, &corner);
        assert_close!(got, want, 1e-11, "mapped, by edges {height:e}");
    }
}

/// What a line of light gives, times the power of the distance that it is proportional to.
type Form = (&'static str, fn(DVec3, DVec3, DVec3) -> f64);

/// All grow as one over the distance, up to the range of numbers.
fn forms() -> Vec<Form> {
    vec![
        ("cylinder", cylinder::irradiance),
        ("cylinder::solid_angle", |a, b, _| {
            cylinder::solid_angle(a, b)
        }),
        ("phong::cylinder", |a, b, n| {
            phong::cylinder(a, b, n, DVec3::Z, 3.5)
        }),
        ("spherical_gaussian::cylinder", |a, b, n| {
            spherical_gaussian::cylinder(a, b, n, DVec3::Z, 3.5)
        }),
        ("quadrature::line", |a, b, n| {
            let one = |_| DVec3::ONE;
            quadrature::line(a, b, n, Model::Cylinder, one, 1e-12, 10_000)
                .value
                .x
        }),
        ("Ltc::line", |a, b, n| {
            lobe().line(&Frame::from_normal(n), a, b)
        }),
    ]
}

fn lobe() -> Ltc {
    facets(0.7, 0.9)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(200), max_global_rejects: u32::MAX, ..ProptestConfig::default() })]

    /// A line with an end at the distance d of the shading point, or that passes there, shines on
    /// it as 1/d and the ribbon as 1/d²: all but a share d of that is from next to the point, so
    /// that from 1e-30 on the ratio is exact. Held to the sum of two errors of 1e-11.
    #[test]
    fn lines_grow_as_they_come_nearer(near in unit_vector(), far in unit_vector(), n in unit_vector(),
        far_end in 0.1..3.0f64, through in any::<bool>(), is_level in any::<bool>(), exponent in 100.0..300.0f64) {
        let [near, far, n] = [near, far, n].map(DVec3::from_array);
        let near = if near.z < 0.0 { -near } else { near };
        // All of a line through the point is above the horizon only where that is along it.
        let is_level = is_level && through;
        let n = if is_level { DVec3::new(0.0, n.y, n.z).normalize_or(DVec3::Z) } else { n };
        let n = if n.dot(near) < 0.0 { -n } else { n };
        // To the last bit, a line passes at the distance d along an axis alone.
        let far = if through { DVec3::X } else { far } * far_end;
        let ends = |d: f64| if through { [near * d - far, near * d + far] } else { [near * d, near * d + far] };
        // Above the horizon, or cut by it: not next to it, where rounding turns all.
        prop_assume!(n.dot(near) > 0.05 && near.cross(far).length() > 0.05);
        prop_assume!(is_level || n.dot(far).abs() > 0.05);
        prop_assume!(near.z > 0.05);
        let (first, d) = (1e-30, 10f64.powf(-exponent));
        for (name, form) in forms() {
            let at = |d: f64| { let [a, b] = ends(d); form(a, b, n) };
            let want = at(first) * first;
            // In two steps: the product may be beyond the range of numbers.
            let got = at(d) * d;
            assert_close!(got, want, rel = 2e-11, "{name} at {d:e}: {near} {far} {n}");
        }
        let [a, b] = ends(d);
        let wide = ribbon::line_integral(a, b, n);
        let [a, b] = ends(first);
        let want = ribbon::line_integral(a, b, n) * first * first;
        if exponent < 150.0 {
            assert_close!(wide * d * d, want, rel = 2e-11, "ribbon at {d:e}: {near} {far} {n}");
        } else if exponent > 160.0 {
            assert_eq!(wide.to_bits(), f64::MAX.to_bits(), "ribbon at {d:e}: beyond the range");
        }
    }
}
