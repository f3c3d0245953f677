//! Triangles with holes, compared with tests of every triangle one by one in `f64`.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, soup};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_testkit::{cases::cases, rng::SplitMix64};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Fan, InstructionSet, LightCorners,
    Occluders, Ray, Scratch, ShaftQuery, SharedFilter,
};
use proptest::prelude::*;
use std::sync::Arc;

/// A scene from one list of triangles: solid ones before index `solid`, those with holes after it.
struct World {
    scene: Occluders,
    mesh: Mesh,
    solid: usize,
    filter: SharedFilter,
}

/// Random texels, wrapped, looked up and cut off in any way, over random texture coordinates.
fn mask(rng: &mut SplitMix64, triangles: usize) -> SharedFilter {
    let [w, h] = [(); 2].map(|()| 1 + rng.index(6));
    #[allow(clippy::cast_possible_truncation, reason = "a few")]
    let texels = (0..w * h)
        .map(|_| [0.0, 0.25, 0.5, 1.0][rng.index(4)])
        .collect();
    let wraps = [
        AlphaWrap::Repeat,
        AlphaWrap::Mirror,
        AlphaWrap::Clamp,
        AlphaWrap::Zero,
    ];
    let [w, h] = [w, h].map(|n| u32::try_from(n).unwrap());
    let texels = AlphaTexels::new(w, h, texels)
        .unwrap()
        .with_wrap([wraps[rng.index(4)], wraps[rng.index(4)]])
        .with_lookup([AlphaLookup::Nearest, AlphaLookup::Bilinear][rng.index(2)])
        .with_cutoff([AlphaCutoff::Above(0.0), AlphaCutoff::AtLeast(0.5)][rng.index(2)]);
    let uv = |rng: &mut SplitMix64| [rng.in_range(-1.0, 2.0), rng.in_range(-1.0, 2.0)];
    let uv = (0..triangles)
        .map(|_| [uv(rng), uv(rng), uv(rng)])
        .collect();
    Arc::new(AlphaMask::new(Arc::new(texels), uv).unwrap())
}

/// Some solid triangles, or none, and others with holes.
fn world(rng: &mut SplitMix64) -> World {
    let mut mesh = match rng.index(3) {
        0 => Mesh::default(),
        _ => soup(rng, 12, 0.5, DVec3::ZERO, 1.5),
    };
    let solid = mesh.triangles.len();
    for _ in 0..1 + rng.index(12) {
        let centre = rng.in_cube(1.0);
        let holed = match rng.index(2) {
            0 => soup(rng, 10, 0.6, centre, 0.5),
            _ => closed(rng, 8, 6, 0.7, centre, 0.4),
        };
        for k in 0..holed.triangles.len() {
            let [a, b, c] = holed.corners(k);
            mesh.triangle(a, b, c);
        }
    }
    // Corners without a position are left out, so that both lists use the same numbers.
    const NONE: [u32; 3] = [u32::MAX; 3];
    let [mut own, mut holed] = [mesh.triangles.clone(), mesh.triangles.clone()];
    own[solid..].fill(NONE);
    holed[..solid].fill(NONE);
    let filter = mask(rng, mesh.triangles.len());
    let [own, holed] = [own, holed].map(|list| Occluders::build(&mesh.positions, &list));
    World {
        scene: own.with_holes(holed, filter.clone()),
        mesh,
        solid,
        filter,
    }
}

/// The hit of a ray with a triangle, by determinants: t and the barycentric coordinates; `None` if
/// it passes an edge within rounding.
fn meets(ray: &Ray, corners: [DVec3; 3]) -> Option<Option<(f64, [f64; 2])>> {
    let [a, b, c] = corners.map(|v| v - ray.origin);
    let d = ray.direction;
    let size = a.length().max(b.length()).max(c.length());
    let sides = [(b, c), (c, a), (a, b)].map(|(v, w)| d.dot(v.cross(w)));
    if sides
        .iter()
        .any(|s| s.abs() <= 1e-9 * d.length() * size * size)
    {
        return None;
    }
    let inside = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
    Some(inside.then(|| {
        let sum: f64 = sides.iter().sum();
        (a.dot(b.cross(c)) / sum, [sides[1] / sum, sides[2] / sum])
    }))
}

impl World {
    /// The closest hit of a ray, with the number of the triangle; `None` if rounding may decide it.
    fn nearest(&self, ray: &Ray) -> Option<Option<(f64, usize)>> {
        let mut nearest: Option<(f64, usize)> = None;
        for k in 0..self.mesh.triangles.len() {
            let Some((t, place)) = meets(ray, self.mesh.corners(k))? else {
                continue;
            };
            if k >= self.solid && !self.filter.hides(u32::try_from(k).unwrap(), place) {
                continue;
            }
            let within = t >= ray.t_min && t <= ray.t_max;
            if within && nearest.is_none_or(|(best, _)| t < best) {
                nearest = Some((t, k));
            }
        }
        Some(nearest)
    }
}

/// Rays of all kinds, single and in fans.
fn rays_agree(world: &World, rng: &mut SplitMix64) -> Result<u32, TestCaseError> {
    let (scene, mut scratch) = (&world.scene, Scratch::new());
    let origin = rng.in_cube(2.5);
    let directions: Vec<_> = (0..24).map(|_| rng.in_cube(2.5) - origin).collect();
    let fan = Fan {
        origin,
        directions: &directions,
        t_min: 0.0,
        t_max: 1.5,
    };
    let mut hits = Vec::new();
    scene.closest_hits(&fan, &mut hits, &mut scratch);
    let any = scene.any_hits(&fan, &NONE, &mut scratch);
    let ray = |direction: &DVec3| Ray {
        t_max: 1.5,
        ..Ray::new(origin, *direction)
    };
    let mut met = 0;
    for (i, direction) in directions.iter().enumerate() {
        let ray = &ray(direction);
        let hit = scene.closest_hit(ray, &mut scratch);
        prop_assert_eq!(hit, hits[i]);
        prop_assert_eq!(any >> i & 1 == 1, hit.is_some());
        prop_assert_eq!(scene.any_hit(ray, &NONE, &mut scratch), hit.is_some());
        let Some(expected) = world.nearest(ray) else {
            continue;
        };
        prop_assert_eq!(hit.is_some(), expected.is_some(), "{:?}", ray);
        if let (Some(hit), Some((t, triangle))) = (hit, expected) {
            met += 1;
            // Signed volumes are at least 1e-9 of their terms, so t is known to some 1e-15 over
            // that.
            prop_assert!((hit.t - t).abs() < 1e-4 * t.abs().max(1.0), "{} {t}", hit.t);
            prop_assert_eq!(hit.triangle as usize, triangle);
        }
    }
    Ok(met)
}

/// Whether a parameter is in one of the intervals; `None` next to an end.
fn is_in(parts: &[Interval], s: f64) -> Option<bool> {
    let next_to = |x: f64| (x - s).abs() < 1e-7;
    if parts.iter().any(|p| next_to(p.lo) || next_to(p.hi)) {
        return None;
    }
    Some(parts.iter().any(|p| p.lo <= s && s <= p.hi))
}

/// For lines on a light, and points of them: a ray to each point agrees with the intervals.
fn lines_agree(world: &World, rng: &mut SplitMix64) -> Result<u32, TestCaseError> {
    let (scene, mut scratch) = (&world.scene, Scratch::new());
    let (point, at, corners) = (rng.in_cube(2.5), rng.in_cube(2.5), 2 + rng.index(4));
    let lamp = light(rng, corners, at, 0.6);
    let lines: Vec<Segment> = (0..5).map(|_| chord(rng, &lamp, Some(0.7))).collect();
    let (_, parts) = ask(scene, point, (&lamp, &lines), &NONE, &mut scratch);
    let query = ShaftQuery::new(point, LightCorners::new(&lamp).unwrap());
    let mut shaft = scene.shaft(query, &mut scratch);
    let mut partial = 0;
    for (i, line) in lines.iter().enumerate() {
        let visible = parts.fraction(i);
        partial += u32::from(visible > 1e-6 && visible < 1.0 - 1e-6);
        for k in 0..40 {
            let s = (f64::from(k) + rng.next_f64()) / 40.0;
            let ray = Ray {
                t_max: 1.0 - 1e-6,
                ..Ray::new(point, line.at(s) - point)
            };
            let (Some(seen), Some(met)) = (is_in(parts.line(i), s), world.nearest(&ray)) else {
                continue;
            };
            prop_assert_eq!(
                seen,
                met.is_none(),
                "line {} at {}: {:?}",
                i,
                s,
                parts.line(i)
            );
            prop_assert_eq!(
                shaft.point_visible(line.at(s)),
                met.is_none(),
                "{} at {}",
                i,
                s
            );
        }
    }
    Ok(partial)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(480), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn holes_answer_as_triangle_by_triangle(seed in any::<u64>()) {
        let mut rng = SplitMix64::new(seed);
        let world = world(&mut rng);
        rays_agree(&world, &mut rng)?;
        lines_agree(&world, &mut rng)?;
    }
}

/// Checks that the property above tests something: in scenes of its kind, many lines are partly
/// hidden, and many rays hit triangles.
#[test]
fn what_is_tried_is_hidden_in_part() {
    let mut rng = SplitMix64::new(5);
    let (mut partial, mut met) = (0, 0);
    for _ in 0..60 {
        let world = world(&mut rng);
        partial += lines_agree(&world, &mut rng).unwrap();
        met += rays_agree(&world, &mut rng).unwrap();
    }
    assert!(partial > 20 && met > 50, "{partial} lines, {met} rays");
}

/// A square of 8 × 8 texels lets the same light through as two triangles with a mask and as two
/// solid triangles for each texel that hides: the ends are on the same straight borders, within
/// 1e-12.
#[test]
fn masks_hide_as_cut_out_triangles() {
    let mut rng = linelit_testkit::cases::rng(29);
    let (mut scratch, mut partial) = (Scratch::new(), 0);
    for _ in 0..cases(60) {
        let texels: Vec<f32> = (0..64).map(|_| [0.0, 1.0][rng.index(2)]).collect();
        let square = |mesh: &mut Mesh, lo: [f64; 2], hi: [f64; 2]| {
            let corner = |x, y| DVec3::new(x, y, 1.0);
            let [a, b] = [corner(lo[0], lo[1]), corner(hi[0], lo[1])];
            let [c, d] = [corner(hi[0], hi[1]), corner(lo[0], hi[1])];
            mesh.triangle(a, b, c);
            mesh.triangle(a, c, d);
        };
        let (mut whole, mut cut) = (Mesh::default(), Mesh::default());
        square(&mut whole, [0.0; 2], [8.0; 2]);
        for (k, hides) in (0_u32..).zip(&texels) {
            let [i, j] = [k % 8, k / 8].map(f64::from);
            if *hides > 0.0 {
                square(&mut cut, [i, j], [i + 1.0, j + 1.0]);
            }
        }
        let texels = AlphaTexels::new(8, 8, texels).unwrap();
        let texels = Arc::new(texels.with_lookup(AlphaLookup::Nearest));
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mask = AlphaMask::new(texels, vec![[a, b, c], [a, c, d]]).unwrap();
        let of = |mesh: &Mesh| Occluders::build(&mesh.positions, &mesh.triangles);
        let masked = Occluders::default().with_holes(of(&whole), Arc::new(mask));
        let cut = of(&cut);
        let point = DVec3::new(4.0, 4.0, -1.0) + rng.in_cube(1.5);
        let centre = DVec3::new(4.0, 4.0, 3.0) + rng.in_cube(0.5);
        let lamp = light(&mut rng, 4, centre, 5.0);
        let lines: Vec<_> = (0..8).map(|_| chord(&mut rng, &lamp, None)).collect();
        let (_, a) = ask(&masked, point, (&lamp, &lines), &NONE, &mut scratch);
        let (_, b) = ask(&cut, point, (&lamp, &lines), &NONE, &mut scratch);
        for (i, line) in lines.iter().enumerate() {
            partial += u32::from(b.line(i).len() > 1);
            assert!((a.fraction(i) - b.fraction(i)).abs() < 1e-12 * 16.0);
            for s in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let ray = Ray::new(point, line.at(s) - point);
                let hits = [&masked, &cut].map(|o| o.closest_hit(&ray, &mut scratch));
                assert_eq!(hits[0].is_some(), hits[1].is_some());
            }
        }
    }
    assert!(partial > 100, "{partial}");
}

/// Intervals, hits and counters are the same on every instruction set.
#[test]
fn holes_have_the_same_bits_on_all_sets() {
    for seed in 0..u64::from(cases(24)) {
        let answers = [
            InstructionSet::Scalar,
            InstructionSet::Avx2,
            InstructionSet::Avx512,
        ]
        .map(|set| {
            let mut rng = SplitMix64::new(seed);
            let scene = world(&mut rng).scene.limited_to(set);
            let mut scratch = Scratch::new();
            let lamp = light(&mut rng, 4, DVec3::new(0.3, 0.2, 2.5), 0.8);
            let lines: Vec<_> = (0..6).map(|_| chord(&mut rng, &lamp, Some(0.2))).collect();
            let point = rng.in_cube(1.0) - DVec3::Z * 2.0;
            let (class, parts) = ask(&scene, point, (&lamp, &lines), &NONE, &mut scratch);
            let parts: Vec<_> = (0..6).flat_map(|i| parts.line(i).to_vec()).collect();
            let ray = |_| Ray::new(point, rng.direction());
            let rays: Vec<_> = (0..20).map(ray).collect();
            let hit = |ray: &Ray| scene.closest_hit(ray, &mut scratch);
            let hits: Vec<_> = rays.iter().map(hit).collect();
            (class, parts, hits, scratch.counters)
        });
        assert_eq!(answers[0], answers[1]);
        assert_eq!(answers[0], answers[2]);
    }
}
