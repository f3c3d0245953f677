//! These tests check the choice for any lights and any point: one light for each random number,
//! probabilities that add up to one, and zero only for lights that cannot contribute.

use linelit_geometry::{ConvexPolygon, DVec3, Frame, Segment};
use linelit_lights::{
    AreaLight, Cylinder, CylinderLight, Disk, DiskLight, DistantLight, Emission, Light,
    LinearLight, PointLight, Sky, SkyEmission, Sphere, SphereLight,
};
use linelit_selection::{Discrete, Estimated, LightRanges, LightTree, can_contribute, diffuse};
use linelit_testkit::cases::cases;
use linelit_testkit::strategies::{finite, unit_interval, unit_vector};
use proptest::prelude::*;
use std::cell::Cell;

/// A light of the kind, `None` where a polygon is refused.
fn light(
    kind: u8,
    at: DVec3,
    normal: DVec3,
    size: f64,
    radiance: f64,
    two_sided: bool,
) -> Option<Light> {
    let radiance = DVec3::splat(radiance);
    let emission = Emission {
        radiance,
        two_sided,
    };
    let frame = Frame::from_normal(normal);
    Some(match kind {
        0 | 1 => {
            let (a, b) = (size * frame.x, size * frame.y);
            let polygon = if kind == 0 {
                ConvexPolygon::parallelogram(at, a, b)
            } else {
                ConvexPolygon::triangle(at, at + a, at + b)
            };
            Light::Area(AreaLight {
                polygon: polygon.ok()?,
                emission,
            })
        }
        2 => Light::Linear(LinearLight {
            segment: Segment::new(at, at + size * normal),
            radiance_radius: radiance,
        }),
        3 => Light::Sphere(SphereLight {
            sphere: Sphere {
                center: at,
                radius: size,
            },
            radiance,
        }),
        4 => Light::Cylinder(CylinderLight {
            cylinder: Cylinder {
                axis: Segment::new(at, at + 2.0 * size * normal),
                radius: size,
            },
            radiance,
        }),
        5 => Light::Disk(DiskLight {
            disk: Disk {
                center: at,
                normal,
                radius: size,
            },
            emission,
        }),
        _ => return Some(without_size(kind, at, normal, size, radiance)),
    })
}

/// A point, parallel light, or a sky about a ball.
fn without_size(kind: u8, at: DVec3, normal: DVec3, size: f64, radiance: DVec3) -> Light {
    let scene = Sphere {
        center: at,
        radius: size,
    };
    match kind {
        6 => Light::Point(PointLight {
            position: at,
            intensity: radiance,
            profile: None,
        }),
        7 => Light::Distant(DistantLight {
            direction: normal,
            irradiance: radiance,
            scene,
        }),
        _ => Light::Sky(Sky {
            emission: SkyEmission::Constant(radiance),
            portal: None,
            scene,
        }),
    }
}

/// Places on a lattice, so that lights and points lie in one plane and on one another, or anywhere.
fn place() -> impl Strategy<Value = DVec3> {
    let coordinate = prop_oneof![
        2 => (-2i8..=2).prop_map(f64::from),
        2 => -2.0..2.0f64,
        1 => (-12i32..0, -1.0..1.0f64).prop_map(|(e, m)| m * 10f64.powi(e)),
    ];
    prop::array::uniform3(coordinate).prop_map(DVec3::from)
}

/// Unit vectors, of which some are along an axis or the same or opposite.
fn direction() -> impl Strategy<Value = DVec3> {
    let slanted = DVec3::new(0.36, 0.48, 0.8);
    prop_oneof![
        2 => unit_vector().prop_map(DVec3::from),
        1 => prop::sample::select(vec![DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z]),
        1 => prop::sample::select(vec![slanted, -slanted]),
    ]
}

prop_compose! {
    fn lamp()(
        kind in 0u8..9,
        at in place(),
        normal in direction(),
        size in (-6..=0i32).prop_map(|e| 4f64.powi(e)),
        radiance in (-3..=3i32).prop_map(|e| 10f64.powi(e)),
        two_sided in prop::bool::weighted(0.3),
    ) -> Option<Light> {
        light(kind, at, normal, size, radiance, two_sided)
    }
}

fn lamps() -> impl Strategy<Value = Vec<Light>> {
    prop::collection::vec(lamp(), 1..40).prop_map(|all| all.into_iter().flatten().collect())
}

/// Lights of any magnitude, some of which overflow in any product.
fn hostile() -> impl Strategy<Value = Vec<Light>> {
    let magnitude = || {
        prop_oneof![
            3 => Just(1.0),
            2 => (-308..308i32).prop_map(|e| 10f64.powi(e)),
            1 => prop::sample::select(vec![f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e-160, 1e155]),
        ]
    };
    let one = (
        0u8..9,
        place(),
        direction(),
        (magnitude(), magnitude(), magnitude()),
        any::<bool>(),
    )
        .prop_map(|(kind, at, normal, (scale, size, radiance), two_sided)| {
            light(kind, at * scale, normal, size, radiance, two_sided)
        });
    prop::collection::vec(one, 1..24).prop_map(|all| all.into_iter().flatten().collect())
}

/// What holds for a tree at a point; `numbers` to pick with.
fn holds(lights: &[Light], (x, n): (DVec3, DVec3), numbers: &[f64]) -> Result<(), TestCaseError> {
    let tree = LightTree::new(lights);
    let light = |i: usize| &lights[i];
    let mut sum = 0.0;
    let mut any = false;
    for (i, l) in lights.iter().enumerate() {
        let p = tree.probability(light, &diffuse(x, n), i);
        let possible = l.power() > 0.0 && can_contribute(l, x, n);
        prop_assert_eq!(p > 0.0, possible, "{} of {:?}", p, l);
        any |= possible;
        sum += p;
    }
    for &u in numbers {
        let picked = tree.pick(light, &diffuse(x, n), u);
        prop_assert_eq!(picked.is_some(), any, "{:?}", u);
        if let Some(picked) = picked {
            let again = tree.probability(light, &diffuse(x, n), picked.index);
            prop_assert_eq!(picked.probability.to_bits(), again.to_bits());
            prop_assert!((0.0..1.0).contains(&picked.rest));
        }
    }
    // 2 (D + 1) ε for the walks, 64 levels at most; ½ ε a light for each of the two sums, of groups
    // and here.
    let tolerance = (130.0 + lights.len() as f64) * f64::EPSILON;
    let want = if any { 1.0 } else { 0.0 };
    prop_assert!(
        (sum - want).abs() <= tolerance,
        "sum {sum} of {} lights",
        lights.len()
    );
    Ok(())
}

/// The length of a vector whose squares overflow is no number; heights over the plane are.
#[test]
fn a_normal_too_long_to_square_still_tells_sides() {
    let (p0, p1) = (DVec3::X, DVec3::new(1.72, 0.96, 1.6));
    let round = [
        Light::Cylinder(CylinderLight {
            cylinder: Cylinder {
                axis: Segment::new(p0, p1),
                radius: 1.0,
            },
            radiance: DVec3::ONE,
        }),
        Light::Disk(DiskLight {
            disk: Disk {
                center: p0,
                normal: DVec3::new(-0.6, 0.8, 0.0),
                radius: 0.5,
            },
            emission: Emission::one_sided(DVec3::ONE),
        }),
    ];
    for light in &round {
        assert!(can_contribute(light, DVec3::ZERO, DVec3::X * 5e301));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(1000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn trees_lose_nothing(
        lights in lamps(),
        x in place(),
        n in direction(),
        numbers in prop::collection::vec(unit_interval(), 8),
    ) {
        holds(&lights, (x, n), &numbers)?;
    }

    #[test]
    fn groups_left_out_hold_no_light_that_can_contribute(
        lamps in prop_oneof![lamps(), hostile()],
        x in place(),
        normals in [direction(), direction()],
    ) {
        let found: Vec<usize> =
            LightRanges::new(&lamps).lighting(x, normals).flatten().collect();
        prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
        for (i, lamp) in lamps.iter().enumerate() {
            let contributes = normals.iter().all(|n| can_contribute(lamp, x, *n));
            let is_lit = contributes && lamp.power() > 0.0;
            prop_assert!(!is_lit || found.contains(&i), "{i} of {found:?}: {lamp:?}");
        }
    }

    #[test]
    fn trees_of_hostile_lights_lose_nothing(
        lights in hostile(),
        x in place(),
        far in (-308..308i32).prop_map(|e| 10f64.powi(e)),
        n in direction(),
        numbers in prop::collection::vec(unit_interval(), 8),
    ) {
        holds(&lights, (x, n), &numbers)?;
        holds(&lights, (x * far, n), &numbers)?;
    }

    /// Points, normals and numbers that are none: no panic, a light or none, never the density
    /// zero.
    #[test]
    fn questions_may_be_nonsense(
        lights in hostile(),
        raw in prop::array::uniform7(prop_oneof![
            3 => finite(),
            1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1.0]),
        ]),
    ) {
        let [a, b, c, d, e, f, u] = raw;
        let (x, n) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        let tree = LightTree::new(&lights);
        if let Some(p) = tree.pick(|i| &lights[i], &diffuse(x, n), u) {
            prop_assert!(p.probability > 0.0 && p.probability <= 1.0 && (0.0..1.0).contains(&p.rest));
            prop_assert!(can_contribute(&lights[p.index], x, n));
        }
    }

    #[test]
    fn tables_lose_nothing(
        weights in prop::collection::vec(
            prop_oneof![
                1 => Just(0.0),
                3 => 0.0..1.0f64,
                2 => finite().prop_map(f64::abs),
                1 => Just(f64::MAX),
            ],
            1..40,
        ),
        numbers in prop::collection::vec(prop_oneof![4 => unit_interval(), 1 => Just(1.0)], 8),
    ) {
        let positive = weights.iter().any(|w| *w > 0.0);
        let table = Discrete::new(&weights);
        prop_assert_eq!(table.is_some(), positive);
        let tolerance = 2.0 * weights.len() as f64 * f64::EPSILON;
        if let Some(table) = table {
            let sum: f64 = (0..weights.len()).map(|i| table.probability(i)).sum();
            prop_assert!((sum - 1.0).abs() <= tolerance, "{}", sum);
            for (i, w) in weights.iter().enumerate() {
                prop_assert_eq!(table.probability(i) > 0.0, *w > 0.0);
            }
            for &u in &numbers {
                let picked = table.pick(u).expect("a light");
                prop_assert_eq!(picked.probability.to_bits(), table.probability(picked.index).to_bits());
                prop_assert!(picked.probability > 0.0 && (0.0..1.0).contains(&picked.rest));
            }
        }
        // The same as estimates, some of which are no numbers; every third light cannot contribute.
        let mut buffer = vec![0.0; weights.len()];
        let asked = Cell::new(0);
        let estimate = |i: usize| {
            asked.set(asked.get() + 1);
            if i.is_multiple_of(7) { f64::NAN } else { weights[i] * 4.0 }
        };
        let possible = |i: usize| i % 3 != 2;
        let alpha = Estimated::new(&mut buffer, estimate, possible);
        prop_assert_eq!(asked.get(), (0..weights.len()).filter(|i| possible(*i)).count());
        let sum: f64 = (0..weights.len()).map(|i| alpha.probability(i)).sum();
        prop_assert!((sum - 1.0).abs() <= tolerance, "{}", sum);
        for i in 0..weights.len() {
            prop_assert_eq!(alpha.probability(i) > 0.0, possible(i));
        }
        for &u in &numbers {
            let picked = alpha.pick(u).expect("a light");
            prop_assert!(possible(picked.index) && (0.0..1.0).contains(&picked.rest));
            prop_assert_eq!(picked.probability.to_bits(), alpha.probability(picked.index).to_bits());
        }
    }
}
