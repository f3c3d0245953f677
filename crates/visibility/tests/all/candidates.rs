//! The triangles that a shaft names are those that matter: all of them, each once.

use crate::common::{InSpace, Mesh, chord, light, soup};
use linelit_geometry::{DVec3, Margins, Segment, intervals::Interval};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    LightCorners, Occluders, Scratch, ShaftClass, ShaftQuery, VisibleLines, brute,
};
use std::ops::Range;

/// Of the stream 11 in the run 20261121.
const FOUND: u64 = 0x8c77_4ee7_c48c_46d0;

#[test]
fn candidates_are_all_that_hides_anything() {
    candidates(linelit_testkit::cases::seed(11));
}

/// Among these, one in which the sweep is off by 1.2e-9 and brute force by 2e-15: at 1e5 from the
/// origin, past a side nearly along the lines.
#[test]
fn candidates_far_from_the_origin() {
    candidates(FOUND);
}

/// Candidates are named once, in any order, and their corners have the bits that were given, also
/// far from the origin.
fn are_given(mesh: &Mesh, exclude: &Range<u32>, ids: &[u32], corners: &[[DVec3; 3]]) {
    assert_eq!(ids.len(), corners.len());
    for (&id, corners) in ids.iter().zip(corners) {
        assert!(!exclude.contains(&id));
        let given = mesh.corners(id as usize);
        assert!(
            corners.iter().all(|v| given.contains(v)),
            "{given:?} {corners:?}"
        );
    }
    let mut once = ids.to_vec();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), ids.len());
}

fn length(parts: &[Interval]) -> f64 {
    parts.iter().map(|i| i.hi - i.lo).sum()
}

/// The number of ends of intervals that rounding may move.
#[allow(clippy::cast_precision_loss, reason = "a few")]
fn ends(parts: &[Interval]) -> f64 {
    (2 * parts.len() + 2) as f64
}

/// How much rounding may change the visible fraction of a line.
///
/// The sweep takes lines to lie in the plane of the light's corners, which rounded ends do to four
/// roundings of their largest coordinate: each may move by so much, and the fraction by its
/// gradient; and where on its image in the plane a place of the line is, changes by a quarter of
/// the difference of the ends' heights over the plane, relative to the shading point's. Sides may
/// reach 4096 lengths of the light beyond it, where they are cut, and are rounded there.
fn rounding(mesh: &Mesh, few: &[[u32; 3]], point: DVec3, light: &[DVec3], line: &Segment) -> f64 {
    let visible = |line: &Segment| {
        brute::visible(&mesh.positions, few, point, line, &(0..0), Margins::DEFAULT)
    };
    let parts = visible(line);
    let step = 4.0 * f64::EPSILON * line.p0.abs().max(line.p1.abs()).max_element();
    let moved: f64 = (0..6)
        .map(|k| {
            let mut other = *line;
            let end = if k < 3 { &mut other.p0 } else { &mut other.p1 };
            end[k % 3] += step;
            (length(&visible(&other)) - length(&parts)).abs()
        })
        .sum();
    let ends = ends(&parts);
    let tilt = if light.len() > 2 {
        let n = (light[1] - light[0]).cross(light[2] - light[0]).normalize();
        let height = n.dot(light[0] - point).abs();
        0.25 * ends * (2.0 * 3f64.sqrt() * step) / height
    } else {
        0.0
    };
    4.0 * 4096.0 * f64::EPSILON * ends + moved + tilt
}

#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn candidates(seed: u64) {
    let mut rng = SplitMix64::new(seed);
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let (mut seen, mut judged) = ([0; 4], 0);
    for case in 0..600 {
        let centre = [DVec3::ZERO, DVec3::splat(1e5)][case % 2];
        let mesh = soup(&mut rng, [20, 150, 900][case % 3], 0.2, centre, 1.0);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let at = centre + rng.in_cube(1.5);
        let light = light(&mut rng, [3, 4, 5, 2][case % 4], at, 0.4);
        let point = centre + rng.in_cube(1.2);
        let lines: Vec<_> = (0..12)
            .map(|_| chord(&mut rng, &light, Some(0.4)))
            .collect();
        let exclude = 0..2;
        let query =
            ShaftQuery::new(point, LightCorners::new(&light).unwrap()).excluding(exclude.clone());
        let mut shaft = occluders.shaft(query, &mut scratch);
        assert_eq!(shaft.is_dense(), shaft.candidate_triangles().is_none());
        let (Some(ids), Some(corners)) = (shaft.candidate_triangles(), shaft.candidate_corners())
        else {
            seen[0] += 1;
            continue;
        };
        let ids: Vec<u32> = ids.collect();
        are_given(&mesh, &exclude, &ids, &corners.collect::<Vec<_>>());
        assert!(ids.len() <= shaft.candidates());
        match shaft.class() {
            ShaftClass::Partial => {
                seen[1] += 1;
                assert!(!ids.is_empty());
            }
            ShaftClass::Empty => {
                seen[2] += 1;
                assert!(ids.is_empty());
            }
            ShaftClass::Blocked => {
                seen[3] += 1;
                assert!(ids.is_empty());
                continue;
            }
        }
        // Nothing but the candidates hides any of the lines.
        shaft.visible(&lines, &mut out);
        let few: Vec<[u32; 3]> = ids.iter().map(|&i| mesh.triangles[i as usize]).collect();
        for (i, line) in lines.iter().enumerate() {
            let all = brute::visible(
                &mesh.positions,
                &mesh.triangles,
                point,
                line,
                &exclude,
                Margins::DEFAULT,
            );
            let some = brute::visible(
                &mesh.positions,
                &few,
                point,
                line,
                &(0..0),
                Margins::DEFAULT,
            );
            let ends = ends(&some);
            assert!((length(&all) - length(&some)).abs() <= 1e-12 * ends);
            let allowed = rounding(&mesh, &few, point, &light, line);
            let off = (length(&some) - out.fraction(i)).abs();
            assert!(off <= allowed, "case {case} line {i}: {off:e} {allowed:e}");
            if off > 1e-11 {
                // Numbers of 77 digits decide which of the two is off: brute force is right to
                // twelve digits.
                let exact = length(&exact::visible(&mesh.positions, &few, point, line));
                assert!(
                    (length(&some) - exact).abs() <= 1e-12 * ends,
                    "case {case} line {i}"
                );
                judged += 1;
            }
        }
    }
    // Some thirty shafts are blocked on average; fewer than five occur once in 1e8 seeds.
    assert!(
        seen.iter().skip(1).all(|&n| n >= 5) && judged > 0,
        "{seen:?} {judged}"
    );
}

/// A shaft with thousands of triangles stores none of them.
#[test]
fn dense_shafts_name_nothing() {
    let mut rng = linelit_testkit::cases::rng(12);
    let mesh = soup(&mut rng, 6000, 0.1, DVec3::ZERO, 1.0);
    let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
    // A light as wide as the set of triangles, for any seed.
    let light =
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 1.5));
    let mut scratch = Scratch::new();
    let query = ShaftQuery::new(DVec3::Z * -1.4, &light);
    let shaft = occluders.shaft(query, &mut scratch);
    assert!(shaft.is_dense());
    assert!(shaft.candidate_triangles().is_none());
    assert!(shaft.candidate_corners().is_none());
    assert!(shaft.candidates() > 200);
}

/// The same in numbers of 77 digits.
mod exact {
    use linelit_geometry::intervals::{Interval, IntervalTree, VisibleSet};
    use linelit_geometry::{DVec3, Margins, Segment};
    use linelit_testkit::precise::Precise;
    use linelit_testkit::real::{self, Real};

    type V = [Precise; 3];

    fn v(p: DVec3) -> V {
        real::vector(p.to_array())
    }

    pub(crate) fn visible(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        point: DVec3,
        line: &Segment,
    ) -> Vec<Interval> {
        let x = v(point);
        let (p0, p1) = (real::sub(&v(line.p0), &x), real::sub(&v(line.p1), &x));
        let n = real::cross(&p0, &p1);
        let square = real::dot(&n, &n);
        let (d0, d1) = (real::cross(&p1, &n), real::cross(&n, &p0));
        let mut set = IntervalTree::full();
        for t in triangles {
            let c: Vec<[Precise; 3]> = t
                .iter()
                .map(|i| {
                    let p = positions[*i as usize].map(f64::from);
                    let a = real::sub(&v(DVec3::from(p)), &x);
                    [
                        real::dot(&n, &a),
                        real::dot(&d0, &a) / square.clone(),
                        real::dot(&d1, &a) / square.clone(),
                    ]
                })
                .collect();
            if let Some((lo, hi)) = blocked(&c) {
                set.clip(lo, hi);
            }
        }
        let mut out = Vec::new();
        set.for_each(|i| out.push(i));
        out
    }

    fn blocked(c: &[[Precise; 3]]) -> Option<(f64, f64)> {
        let zero = Precise::new(0.0);
        let mut chord: Vec<[Precise; 2]> = Vec::new();
        for i in 0..3 {
            let (a, b) = (&c[i], &c[(i + 1) % 3]);
            if (a[0] >= zero) != (b[0] >= zero) {
                let d = b[0].clone() - a[0].clone();
                chord.push([1, 2].map(|k| {
                    (a[k].clone() * b[0].clone() - b[k].clone() * a[0].clone()) / d.clone()
                }));
            }
        }
        let mut ends = [chord.first()?.clone(), chord.get(1)?.clone()];
        let bounds: [fn(&[Precise; 2]) -> Precise; 4] = [
            |c| c[0].clone(),
            |c| c[1].clone(),
            |c| c[0].clone() + c[1].clone() - Precise::new(Margins::DEFAULT.point),
            |c| Precise::new(Margins::DEFAULT.end()) - c[0].clone() - c[1].clone(),
        ];
        for f in bounds {
            let (fa, fb) = (f(&ends[0]), f(&ends[1]));
            let between = || {
                let d = fb.clone() - fa.clone();
                [0, 1].map(|k| {
                    (ends[0][k].clone() * fb.clone() - ends[1][k].clone() * fa.clone()) / d.clone()
                })
            };
            match (fa >= zero, fb >= zero) {
                (true, true) => {}
                (true, false) => ends[1] = between(),
                (false, true) => ends[0] = between(),
                (false, false) => return None,
            }
        }
        let [a, b] = ends.map(|c| (c[1].clone() / (c[0].clone() + c[1].clone())).to_f64());
        (a.min(b) < a.max(b)).then(|| (a.min(b), a.max(b)))
    }
}
