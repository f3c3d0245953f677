//! Instances, filters and masks, held to every triangle where it stands, one by one, in `f64`.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, soup};
use linelit_geometry::{DMat3, DVec3, Segment, intervals::Interval};
use linelit_testkit::{cases::cases, rng::SplitMix64};
use linelit_visibility::{
    AlphaCutoff, AlphaLookup, AlphaMask, AlphaTexels, AlphaWrap, Fan, Instance, InstanceError,
    InstructionSet, LightCorners, Occluders, Ray, Scratch, ShaftQuery, SharedFilter,
};
use proptest::prelude::*;
use std::sync::Arc;

/// A triangle where it stands: its corners, the instance and its number there.
struct Standing {
    corners: [DVec3; 3],
    instance: Option<u32>,
    triangle: u32,
}

/// A scene, and all that stands in it.
struct World {
    scene: Occluders,
    standing: Vec<Standing>,
    filters: Vec<Option<SharedFilter>>,
    masks: Vec<u32>,
}

/// An affine map: powers of two along axes that may be mirrored, or anything of a condition below
/// a hundred or so, also sheared and mirrored.
fn map(rng: &mut SplitMix64, exact: bool) -> [DVec3; 4] {
    let power = |rng: &mut SplitMix64| [0.5, 1.0, 2.0, -0.5, -1.0, -2.0][rng.index(6)];
    let shift = |rng: &mut SplitMix64| (rng.in_cube(1.5) * 1024.0).round() / 1024.0;
    if exact {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        return [x * power(rng), y * power(rng), z * power(rng), shift(rng)];
    }
    loop {
        let axes = [(); 3].map(|()| rng.direction() * rng.in_range(0.2, 2.0));
        if DMat3::from_cols(axes[0], axes[1], axes[2])
            .determinant()
            .abs()
            > 0.1
        {
            return [axes[0], axes[1], axes[2], rng.in_cube(1.5)];
        }
    }
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

/// Own triangles, and up to `most` instances of one or two meshes.
fn world(rng: &mut SplitMix64, most: usize, exact: bool) -> World {
    let own = match rng.index(3) {
        0 => Mesh::default(),
        _ => soup(rng, 12, 0.5, DVec3::ZERO, 1.5),
    };
    let meshes = [
        soup(rng, 10, 0.6, DVec3::ZERO, 0.5),
        closed(rng, 8, 6, 0.7, DVec3::ZERO, 0.4),
    ];
    let of = |mesh: &Mesh| Arc::new(Occluders::build(&mesh.positions, &mesh.triangles));
    let shared = meshes.each_ref().map(of);
    let mut world = World {
        scene: Occluders::build(&own.positions, &own.triangles),
        standing: Vec::new(),
        filters: Vec::new(),
        masks: Vec::new(),
    };
    let number = |k: usize| u32::try_from(k).unwrap();
    for k in 0..own.triangles.len() {
        world.standing.push(Standing {
            corners: own.corners(k),
            instance: None,
            triangle: number(k),
        });
    }
    let mut list = Vec::new();
    for i in 0..1 + rng.index(most) {
        let which = rng.index(2);
        let columns = map(rng, exact);
        let count = meshes[which].triangles.len();
        let filter = (rng.index(2) == 0).then(|| mask(rng, count));
        let mut instance = Instance::new(shared[which].clone(), columns).unwrap();
        world.masks.push(1 << rng.index(3));
        instance = instance.with_mask(world.masks[i]);
        if let Some(filter) = &filter {
            instance = instance.with_filter(filter.clone());
        }
        world.filters.push(filter);
        list.push(instance);
        let [x, y, z, origin] = columns;
        let linear = DMat3::from_cols(x, y, z);
        for k in 0..count {
            world.standing.push(Standing {
                corners: meshes[which].corners(k).map(|v| linear * v + origin),
                instance: Some(number(i)),
                triangle: number(k),
            });
        }
    }
    world.scene = world.scene.with_instances(list);
    world
}

/// What a ray meets, by determinants: t and the barycentric coordinates; `None` if it passes an
/// edge within rounding.
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
    /// What a ray of this mask meets first; `None` if rounding may tell.
    fn nearest(&self, ray: &Ray, mask: u32) -> Option<Option<(f64, &Standing)>> {
        let mut nearest: Option<(f64, &Standing)> = None;
        for standing in &self.standing {
            let Some((t, place)) = meets(ray, standing.corners)? else {
                continue;
            };
            if let Some(i) = standing.instance {
                let filter = &self.filters[i as usize];
                let hides = |f: &SharedFilter| f.hides(standing.triangle, place);
                if self.masks[i as usize] & mask == 0 || !filter.as_ref().is_none_or(hides) {
                    continue;
                }
            }
            let within = t >= ray.t_min && t <= ray.t_max;
            if within && nearest.is_none_or(|(best, _)| t < best) {
                nearest = Some((t, standing));
            }
        }
        Some(nearest)
    }
}

/// Rays of all kinds, single, in fans and in streams.
fn rays_agree(
    world: &World,
    scene: &Occluders,
    mask: u32,
    rng: &mut SplitMix64,
) -> Result<u32, TestCaseError> {
    let mut scratch = Scratch::new();
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
    let rays: Vec<_> = directions.iter().map(|d| (ray(d), NONE)).collect();
    let mut hidden = vec![false; rays.len()];
    scene.any_hit_stream(&rays, &mut hidden, &mut scratch);
    let mut met = 0;
    for (i, (ray, _)) in rays.iter().enumerate() {
        let hit = scene.closest_hit(ray, &mut scratch);
        prop_assert_eq!(hit, hits[i]);
        prop_assert_eq!(any >> i & 1 == 1, hit.is_some());
        prop_assert_eq!(hidden[i], hit.is_some());
        prop_assert_eq!(scene.any_hit(ray, &NONE, &mut scratch), hit.is_some());
        let Some(expected) = world.nearest(ray, mask) else {
            continue;
        };
        prop_assert_eq!(hit.is_some(), expected.is_some(), "{:?}", ray);
        if let (Some(hit), Some((t, standing))) = (hit, expected) {
            met += 1;
            // Sides of at least 1e-9 of their terms: t to some 1e-15 over that, times κ < 100.
            prop_assert!((hit.t - t).abs() < 1e-4 * t.abs().max(1.0), "{} {t}", hit.t);
            prop_assert_eq!(
                (hit.instance, hit.triangle),
                (standing.instance, standing.triangle)
            );
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

/// Lines on a light, and points of it: what a ray to each point says is what the intervals say.
fn lines_agree(
    world: &World,
    scene: &Occluders,
    mask: u32,
    rng: &mut SplitMix64,
) -> Result<u32, TestCaseError> {
    let mut scratch = Scratch::new();
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
            let (Some(seen), Some(met)) = (is_in(parts.line(i), s), world.nearest(&ray, mask))
            else {
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
    #![proptest_config(ProptestConfig { cases: cases(160), failure_persistence: None, ..ProptestConfig::default() })]

    /// With more instances in a shaft than are kept, too.
    #[test]
    fn instances_answer_as_what_stands_there(seed in any::<u64>(), most in 1usize..40) {
        let mut rng = SplitMix64::new(seed);
        let world = world(&mut rng, most, false);
        for mask in [u32::MAX, 0b11, 0b100] {
            let scene = world.scene.with_mask(mask);
            rays_agree(&world, &scene, mask, &mut rng)?;
            lines_agree(&world, &scene, mask, &mut rng)?;
        }
    }
}

/// That the property above asks something: of its kind of scenes, many lines are partly hidden and
/// many rays meet instances.
#[test]
fn what_is_tried_is_hidden_in_part() {
    let mut rng = SplitMix64::new(5);
    let (mut partial, mut met) = (0, 0);
    for _ in 0..20 {
        let world = world(&mut rng, 12, false);
        partial += lines_agree(&world, &world.scene, u32::MAX, &mut rng).unwrap();
        met += rays_agree(&world, &world.scene, u32::MAX, &mut rng).unwrap();
    }
    assert!(partial > 20 && met > 50, "{partial} lines, {met} rays");
}

/// Where there are none to be met, occluders are what they were; by the mask 0, nothing is.
#[test]
fn masks_choose_instances() {
    let positions = [[0.0, -1.0, 1.0], [3.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let leaf = Arc::new(Occluders::build(&positions, &[[0, 1, 2]]));
    let here = Instance::new(leaf.clone(), Instance::HERE).unwrap();
    let scene = Occluders::default().with_instances(vec![here.with_mask(0b10)]);
    let mut scratch = Scratch::new();
    let ray = Ray::new([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let mut meets = |scene: &Occluders| scene.any_hit(&ray, &NONE, &mut scratch);
    assert!(meets(&scene) && meets(&scene.with_mask(0b110)));
    assert!(!meets(&scene.with_mask(0b101)) && !meets(&scene.with_mask(0b10).with_mask(1)));
    assert!(meets(&leaf.with_mask(1)) && !meets(&leaf.with_mask(0)));
}

/// Maps without an inverse, numbers that are none, instances of instances.
#[test]
fn what_cannot_stand_is_refused() {
    let leaf = Arc::new(Occluders::default());
    let of = |columns: [[f64; 3]; 4]| Instance::new(leaf.clone(), columns).err();
    let mut columns = Instance::HERE;
    columns[1] = [2.0, 0.0, 0.0];
    assert_eq!(of(columns), Some(InstanceError::Singular));
    columns[1] = [1.0, 1e-9, 0.0];
    assert_eq!(of(columns), Some(InstanceError::Singular));
    columns[1] = [0.0, f64::NAN, 0.0];
    assert_eq!(of(columns), Some(InstanceError::NotFinite));
    columns[1] = [0.0, 1.0, 0.0];
    columns[3] = [f64::INFINITY, 0.0, 0.0];
    assert_eq!(of(columns), Some(InstanceError::NotFinite));
    let one = Instance::new(leaf.clone(), Instance::HERE).unwrap();
    let nested = Arc::new(Occluders::default().with_instances(vec![one]));
    let error = Instance::new(nested, Instance::HERE).unwrap_err();
    assert_eq!(error, InstanceError::Nested);
    assert_eq!(error.to_string(), "an instance has instances itself");
}

/// Copies that maps of powers of two and shifts put on a grid, where no vertex is rounded: each
/// mesh's triangles again and again in one hierarchy.
fn copies(rng: &mut SplitMix64) -> (Occluders, Mesh) {
    let mut mesh = soup(rng, 20, 0.6, DVec3::ZERO, 1.0);
    for v in mesh.positions.as_flattened_mut() {
        *v = (*v * 256.0).round() / 256.0;
    }
    let shared = Arc::new(Occluders::build(&mesh.positions, &mesh.triangles));
    let mut flattened = Mesh::default();
    let mut instances = Vec::new();
    for _ in 0..6 {
        let scale = [0.5, 1.0, 2.0][rng.index(3)];
        let origin = (rng.in_cube(2.0) * 256.0).round() / 256.0;
        let columns = [DVec3::X * scale, DVec3::Y * scale, DVec3::Z * scale, origin];
        instances.push(Instance::new(shared.clone(), columns).unwrap());
        for k in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(k).map(|v| v * scale + origin);
            flattened.triangle(a, b, c);
        }
    }
    (Occluders::default().with_instances(instances), flattened)
}

/// Scaling by powers of two rounds nothing: rays meet the same triangles at the same t, to the bit,
/// and lines have the same ends but for where those of several instances meet, which drop what is
/// shorter than rounding.
#[test]
fn copies_answer_as_their_triangles_in_one_hierarchy() {
    let mut rng = linelit_testkit::cases::rng(23);
    let (mut scratch, mut partial) = (Scratch::new(), 0);
    let on_grid = |v: DVec3| (v * 256.0).round() / 256.0;
    for _ in 0..cases(60) {
        let (copies, mesh) = copies(&mut rng);
        let one = Occluders::build(&mesh.positions, &mesh.triangles);
        let point = on_grid(rng.in_cube(3.0));
        for _ in 0..40 {
            let ray = Ray::new(point, on_grid(rng.in_cube(3.0)) - point);
            let [a, b] = [&copies, &one].map(|o| o.closest_hit(&ray, &mut scratch));
            let name = |hit: linelit_visibility::Hit| hit.instance.unwrap() * 20 + hit.triangle;
            assert_eq!(
                a.map(|hit| (name(hit), hit.t)),
                b.map(|hit| (hit.triangle, hit.t))
            );
        }
        let corner = on_grid(rng.in_cube(3.0));
        let sides = [(); 2].map(|()| on_grid(rng.in_cube(0.5)) + DVec3::X / 256.0);
        let lamp = [
            corner,
            corner + sides[0],
            corner + sides[0] + sides[1],
            corner + sides[1],
        ];
        let lines: Vec<_> = (0..8)
            .map(|k| {
                let from = corner + sides[1] * (f64::from(k) / 8.0);
                Segment::new(from, from + sides[0])
            })
            .collect();
        let (_, a) = ask(&copies, point, (&lamp, &lines), &NONE, &mut scratch);
        let (_, b) = ask(&one, point, (&lamp, &lines), &NONE, &mut scratch);
        for i in 0..lines.len() {
            let visible = b.fraction(i);
            partial += u32::from(visible > 0.0 && visible < 1.0);
            assert_eq!(a.line(i).len(), b.line(i).len());
            for (p, q) in a.line(i).iter().zip(b.line(i)) {
                // The same operations on numbers scaled by two's powers; sides across and along are
                // found from the light's place, whose differences are exact: some ε at most.
                let off = (p.lo - q.lo).abs().max((p.hi - q.hi).abs());
                assert!(off <= 16.0 * f64::EPSILON, "{p:?} {q:?}");
            }
        }
    }
    assert!(partial > 50, "{partial}");
}

/// A square of 8 × 8 texels, as two triangles with a mask and as two triangles for each texel that
/// hides, lets the same through: both ends are of the same straight borders, within 1e-12.
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
        let square = Instance::new(Arc::new(of(&whole)), Instance::HERE).unwrap();
        let masked = Occluders::default().with_instances(vec![square.with_filter(Arc::new(mask))]);
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
fn instances_have_the_same_bits_on_all_sets() {
    for seed in 0..u64::from(cases(24)) {
        let answers = [
            InstructionSet::Scalar,
            InstructionSet::Avx2,
            InstructionSet::Avx512,
        ]
        .map(|set| {
            let mut rng = SplitMix64::new(seed);
            let scene = world(&mut rng, 20, false).scene.limited_to(set);
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

/// What moves is given anew, and answers from where it is; so does a clone of what it was.
#[test]
fn moved_instances_answer_from_where_they_are() {
    let positions = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    let leaf = Arc::new(Occluders::build(&positions, &[[0, 1, 2]]));
    let at = |z: f64| {
        let mut columns = Instance::HERE;
        columns[3][2] = z;
        vec![Instance::new(leaf.clone(), columns).unwrap()]
    };
    let mut scene = Occluders::default().with_instances(at(1.0));
    let before = scene.clone();
    scene.set_instances(at(2.5));
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let t = |scene: &Occluders| {
        scene
            .closest_hit(&ray, &mut Scratch::new())
            .map(|hit| hit.t)
    };
    assert_eq!([t(&before), t(&scene)], [Some(1.0), Some(2.5)]);
    scene.set_instances(Vec::new());
    assert_eq!((t(&scene), scene.instances().len()), (None, 0));
}

/// A thousand instances take the memory of one mesh, and less than 600 bytes each.
#[test]
#[allow(clippy::print_stdout, reason = "the figures, by --nocapture")]
fn a_thousand_instances_share_their_mesh() {
    let mut rng = SplitMix64::new(3);
    let mesh = soup(&mut rng, 20_000, 0.05, DVec3::ZERO, 1.0);
    let one = Arc::new(Occluders::build(&mesh.positions, &mesh.triangles));
    let instance = |_| Instance::new(one.clone(), map(&mut rng, false)).unwrap();
    let scene = Occluders::default().with_instances((0..1000).map(instance).collect());
    let more = scene.memory() - one.memory();
    println!("{more} bytes beside the mesh's {}", one.memory());
    assert!(more > 100_000 && more < 600_000, "{more} bytes more");
}
