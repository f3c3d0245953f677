//! Cylinders: closed forms, thin cylinders, facets instead of a cylinder, horizons, and triangles
//! that reach into one.

use crate::linear_lights::reflections;
use crate::round::{Rectangle, WIDE, estimates, glossy, matte, nothing, rectangles};
use linelit_bsdf::Bsdf;
use linelit_estimators::ShadingPoint;
use linelit_geometry::{ConvexPolygon, DVec3, Segment};
use linelit_lights::{AreaLight, Cylinder, CylinderLight, Emission, Light, LinearLight};
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{critical_z, z_score_two};
use std::f64::consts::TAU;

fn cylinder(p0: [f64; 3], p1: [f64; 3], radius: f64) -> Light {
    let axis = Segment::new(p0.into(), p1.into());
    Light::Cylinder(CylinderLight {
        cylinder: Cylinder { axis, radius },
        radiance: DVec3::ONE,
    })
}

const VIEW: DVec3 = DVec3::new(-0.6, 0.0, 0.8);

/// A diffuse surface that sees all of a cylinder takes no samples, and has the mean of points.
#[test]
fn whole_cylinders_are_in_closed_form() {
    let lights = [
        cylinder([-0.5, 0.3, 1.5], [0.7, 0.4, 1.6], 0.2),
        cylinder([0.8, 0.3, 0.3], [0.9, 0.4, 2.6], 0.25),
        cylinder([0.8, 0.3, 0.5], [0.3, 0.4, 2.6], 0.002),
    ];
    let bound = critical_z(sidak(1e-4, lights.len()));
    for light in &lights {
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, Bsdf::Lambert(matte()));
        let (closed, buffers) = estimates(&nothing(), light, &point, "line-analytic", 4, 0..8);
        assert_eq!(buffers.counts.plan.closed_form, 8, "{light:?}");
        assert!(
            closed.variance() == 0.0 && closed.mean() > 1e-4,
            "{light:?}"
        );
        let (points, _) = estimates(&nothing(), light, &point, "point-area", 1024, 0..128);
        let z = z_score_two(&points, &closed);
        assert!(z.abs() < bound, "{light:?}: {z}, {closed:?} for {points:?}");
    }
}

/// The closed forms of a cylinder of this radius about the axis, and of this many flat facets
/// instead.
fn light_of(radius: f64, facets: Option<u32>) -> f64 {
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, Bsdf::Lambert(matte()));
    let of = |light| {
        estimates(&nothing(), &light, &point, "exact", 1, 0..1)
            .0
            .mean()
    };
    let axis = Segment::new([-0.5, 0.3, 1.5].into(), [0.7, 0.4, 1.6].into());
    let Some(facets) = facets else {
        return of(cylinder(axis.p0.to_array(), axis.p1.to_array(), radius));
    };
    let frame = linelit_geometry::Frame::from_normal(axis.direction());
    let at = |k: u32| {
        let (s, c) = (TAU * f64::from(k) / f64::from(facets)).sin_cos();
        axis.p0 + (frame.x * c + frame.y * s) * radius
    };
    let facet = |k: u32| {
        let (a, b) = (at(k), at(k + 1));
        let polygon = ConvexPolygon::parallelogram(a, b - a, axis.vector()).expect("flat");
        assert!(polygon.normal().dot(a - axis.p0) > 0.0, "outwards");
        let emission = Emission::one_sided(DVec3::ONE);
        of(Light::Area(AreaLight { polygon, emission }))
    };
    (0..facets).map(facet).sum()
}

/// The light of facets, by the closed form of polygons, converges to the light of the cylinder with
/// the square of their number.
#[test]
fn facets_tend_to_the_cylinder() {
    let want = light_of(0.3, None);
    let error = |n| (light_of(0.3, Some(n)) / want - 1.0).abs();
    let [few, more, most] = [64, 256, 2048].map(error);
    // A chord is nearer to the axis by 1 − cos(π/n) of the radius, which is (π/n)²/2, seen from a
    // distance of four radii. The error is at most twice that, and each step of four reduces it
    // sixteen times, to a third of that factor, since facets edge-on appear and disappear.
    for (n, error) in [(64.0, few), (256.0, more), (2048.0, most)] {
        assert!(error < 10.0 / (n * n), "{n}: {error}");
    }
    assert!(most < 3e-6 && most > 0.0, "{few} {more} {most}");
}

/// As the radius goes to zero, a cylinder becomes a linear light of the same power.
#[test]
fn thin_cylinders_are_linear_lights() {
    let segment = Segment::new([-0.5, 0.3, 1.5].into(), [0.7, 0.4, 1.6].into());
    let rough_diffuse = &reflections()[..2];
    for bsdf in [Bsdf::Lambert(matte()), glossy()]
        .iter()
        .chain(rough_diffuse)
    {
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, bsdf.clone());
        let mut last = f64::INFINITY;
        for radius in [1e-1, 1e-2, 1e-3, 1e-4] {
            let line = Light::Linear(LinearLight {
                segment,
                radiance_radius: DVec3::splat(radius),
            });
            let round = cylinder(segment.p0.to_array(), segment.p1.to_array(), radius);
            assert!((round.power() / line.power() - 1.0).abs() < 1e-14);
            let [(want, _), (got, _)] =
                [&line, &round].map(|l| estimates(&nothing(), l, &point, "exact", 64, 0..16));
            let error = (got.mean() / want.mean() - 1.0).abs();
            // The visible side is nearer by up to R/ρ, and its middle more than its rim.
            assert!(error < radius && error < last, "{radius}: {error}");
            last = error;
        }
        assert!(last < 1e-4);
    }
}

const TEXTS: [&str; 13] = [
    "line-area",
    "line-solid-angle",
    "line-projected",
    "line-warped",
    "line-analytic",
    "exact",
    "hybrid",
    "point-solid-angle",
    "point-solid-angle[visibility=shaft]",
    "point-solid-angle+point-bsdf",
    "line-solid-angle+point-bsdf",
    "line-area[orientation=spread:2]+point-bsdf[mis=smooth]",
    "line-area+point-projected-solid-angle[mis=optimal]",
];

/// Occluders in front of or in a cylinder 1.5 above along y, with the radius 0.5, and whether one
/// shaft can answer for it. The outline of the cylinder is at 1.333, and its nearest line at 1.
const INTRUDERS: [(&str, &[Rectangle], bool); 7] = [
    ("before it", &[([0.1, 3.0], WIDE, 0.75)], true),
    (
        "inside, before the outline",
        &[([-0.2, 0.2], [-0.2, 0.2], 1.2)],
        false,
    ),
    (
        "across half of it, before the outline",
        &[([-3.0, 3.0], [0.1, 3.0], 1.2)],
        false,
    ),
    (
        "cuts in before the outline",
        &[([-3.0, 0.05], WIDE, 1.25)],
        false,
    ),
    ("a plane through it", &[(WIDE, WIDE, 1.2)], false),
    ("hides it at its nearest line", &[(WIDE, WIDE, 0.9)], true),
    (
        "inside, and one before it",
        &[([-0.2, 0.2], [-0.2, 0.2], 1.25), ([0.05, 3.0], WIDE, 0.5)],
        false,
    ),
];

/// No matter which triangles are inside a cylinder or cut into it, every estimator gives the light
/// of points by area with a ray each.
#[test]
fn what_reaches_into_a_cylinder_hides_as_rays_say() {
    let light = cylinder([0.1, -0.8, 1.5], [0.1, 0.6, 1.5], 0.5);
    let bound = critical_z(sidak(1e-4, INTRUDERS.len() * TEXTS.len() * 2));
    for (name, occluders, by_outline) in INTRUDERS {
        let occluders = rectangles(occluders);
        for bsdf in [Bsdf::Lambert(matte()), glossy()] {
            let x = DVec3::new(0.05, 0.1, 0.0);
            let point = ShadingPoint::new(x, DVec3::Z, VIEW, bsdf);
            let (want, _) = estimates(&occluders, &light, &point, "point-area", 1024, 1000..1128);
            for text in TEXTS {
                let (got, buffers) = estimates(&occluders, &light, &point, text, 32, 0..128);
                let plan = &buffers.counts.plan;
                let looked = text != "point-solid-angle" && want.mean() > 0.0;
                assert_eq!(
                    plan.cylinders_by_rays > 0,
                    looked && !by_outline,
                    "{name}, {text}: {plan}"
                );
                if want.mean() == 0.0 {
                    assert!(got.mean() == 0.0, "{name}, {text}: {got:?}");
                    continue;
                }
                let z = z_score_two(&got, &want);
                assert!(
                    z.abs() < bound,
                    "{name}, {text}: z {z}, {got:?} for {want:?}"
                );
            }
        }
    }
}

/// The horizon cuts cylinders along and across their axes; and the point is inside an endless one.
#[test]
fn horizons_cut_cylinders() {
    let tilted = DVec3::new(0.5, 0.0, 0.8).normalize();
    let lights = [
        cylinder([0.8, -0.6, 0.1], [0.9, 0.7, 0.05], 0.5),
        cylinder([1.2, 0.1, -0.5], [1.0, 0.2, 0.7], 0.3),
        cylinder([0.6, 0.1, -1.5], [0.65, 0.2, 0.2], 0.5),
    ];
    let bound = critical_z(sidak(1e-4, TEXTS.len() * lights.len()));
    for light in &lights {
        let mut point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, glossy());
        point.normal = tilted;
        let (want, _) = estimates(&nothing(), light, &point, "point-area", 1024, 1000..1256);
        assert!(want.mean() > 1e-3);
        for text in TEXTS {
            let (got, _) = estimates(&nothing(), light, &point, text, 32, 0..256);
            let z = z_score_two(&got, &want);
            assert!(
                z.abs() < bound,
                "{text}: z {z}, {got:?} for {want:?} of {light:?}"
            );
        }
    }
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, VIEW, glossy());
    for light in [
        cylinder([0.1, 0.0, 0.5], [0.1, 0.1, 1.5], 0.5),
        cylinder([0.6, -1.0, -0.7], [0.6, 1.0, -0.6], 0.5),
    ] {
        for text in TEXTS {
            let (got, _) = estimates(&nothing(), &light, &point, text, 4, 0..4);
            assert!(got.mean() == 0.0, "{text}: {got:?} of {light:?}");
        }
    }
}
