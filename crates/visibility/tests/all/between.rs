//! Triangles that another hierarchy finds between a point and a light give the same answers as all
//! triangles.

use crate::common::{InSpace, Mesh, NONE, ask, chord, closed, light, soup};
use linelit_geometry::{DVec3, Segment};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{LightCorners, Occluders, Ray, Scratch, SpaceBetween};

/// A simple binary hierarchy, in place of a caller's own: triangles in a leaf, or two halves, split
/// along one axis after the other.
enum Tree {
    Leaf([[f32; 3]; 3]),
    Halves(Box<[Boxed; 2]>),
}

struct Boxed {
    lo: [f32; 3],
    hi: [f32; 3],
    tree: Tree,
}

impl Boxed {
    fn new(triangles: &mut [[[f32; 3]; 3]], axis: usize) -> Self {
        let corner = |pick: fn(f32, f32) -> f32, k: usize| {
            let all = triangles.as_flattened().iter().map(|v| v[k]);
            all.reduce(pick).unwrap()
        };
        let lo = std::array::from_fn(|k| corner(f32::min, k));
        let hi = std::array::from_fn(|k| corner(f32::max, k));
        let tree = match triangles {
            [one] => Tree::Leaf(*one),
            many => {
                many.sort_by(|a, b| a[0][axis].total_cmp(&b[0][axis]));
                let (left, right) = many.split_at_mut(many.len() / 2);
                let halves = [left, right].map(|half| Self::new(half, (axis + 1) % 3));
                Tree::Halves(Box::new(halves))
            }
        };
        Self { lo, hi, tree }
    }

    fn find(&self, between: &SpaceBetween, found: &mut Vec<[[f32; 3]; 3]>) {
        if between.may_meet(self.lo, self.hi) {
            match &self.tree {
                Tree::Leaf(triangle) => found.push(*triangle),
                Tree::Halves(two) => two.iter().for_each(|half| half.find(between, found)),
            }
        }
    }
}

fn tree(mesh: &Mesh) -> Boxed {
    let corners = mesh.triangles.iter();
    let mut all: Vec<_> = corners
        .map(|t| t.map(|v| mesh.positions[v as usize]))
        .collect();
    Boxed::new(&mut all, 0)
}

/// Lines and rays from many points to lights of every kind, by a hierarchy over the whole scene and
/// by triangles that another has gathered. The ends of intervals are those of the same triangles,
/// in coordinates of another origin: each is within 1e-9 of the line of brute force, as the crate
/// says, so both are within 2e-9 of each other, and a line's sum over its ends.
#[test]
fn gathered_triangles_hide_the_same() {
    let mut rng = linelit_testkit::cases::rng(17);
    let mut scratch = Scratch::new();
    let (mut partial, mut kept) = (0, 0.0);
    for round in 0..linelit_testkit::cases::cases(240) {
        let mesh = match round % 3 {
            0 => closed(&mut rng, 12, 8, 0.5, DVec3::ZERO, 1.0),
            1 => soup(&mut rng, 600, 0.2, DVec3::ZERO, 1.0),
            _ => soup(&mut rng, 40, 0.6, DVec3::new(3.0, 5.0, -2.0), 1.0),
        };
        let centre = mesh.corners(0)[0];
        let (own, mine) = (
            Occluders::build(&mesh.positions, &mesh.triangles),
            tree(&mesh),
        );
        let corners = 2 + rng.index(5);
        let middle = centre + rng.direction() * 2.5;
        let lamp = light(&mut rng, corners, middle, 0.4);
        for _ in 0..8 {
            let x = centre + rng.direction() * rng.in_range(0.5, 3.0);
            let between = SpaceBetween::new(x, LightCorners::new(&lamp).unwrap());
            let mut found = Vec::new();
            mine.find(&between, &mut found);
            let few = &Occluders::from_triangles(found);
            kept += f64::from(u32::try_from(few.triangle_count()).unwrap())
                / f64::from(u32::try_from(mesh.triangles.len()).unwrap());
            let lines: Vec<_> = (0..6).map(|_| chord(&mut rng, &lamp, Some(0.7))).collect();
            let asked = (&lamp[..], &lines[..]);
            let (_, want) = ask(&own, x, asked, &NONE, &mut Scratch::new());
            let (_, got) = ask(few, x, asked, &NONE, &mut scratch);
            for (i, line) in lines.iter().enumerate() {
                let ends = f64::from(u32::try_from(2 * want.line(i).len() + 2).unwrap());
                let (want, got) = (want.fraction(i), got.fraction(i));
                assert!((got - want).abs() < 2e-9 * ends, "{round}: {got} {want}");
                partial += u32::from(want > 0.01 && want < 0.99);
                rays_agree(&mut rng, (&own, few), x, line, &mut scratch);
            }
        }
    }
    // Count lines that are partly hidden, and triangles that were not gathered.
    assert!(partial > 500, "{partial}");
    assert!(
        kept < 0.35 * 8.0 * f64::from(linelit_testkit::cases::cases(240)),
        "{kept}"
    );
}

/// The same test of the same triangles: rays to a light meet the same, but within rounding of
/// edges, which random rays do not pass.
fn rays_agree(
    rng: &mut SplitMix64,
    (own, few): (&Occluders, &Occluders),
    x: DVec3,
    line: &Segment,
    scratch: &mut Scratch,
) {
    let to_light = line.at(rng.next_f64()) - x;
    let ray = Ray {
        t_max: 1.0,
        ..Ray::new(x, to_light)
    };
    let [want, got] = [own, few].map(|by| by.any_hit(&ray, &NONE, scratch));
    assert_eq!(want, got, "{ray:?}");
}

/// The differences of all pairs of points.
fn edges(points: &[DVec3]) -> Vec<DVec3> {
    let others = |(i, &a): (usize, &DVec3)| {
        let others: Vec<_> = points[i + 1..].iter().map(|&b| b - a).collect();
        others
    };
    points.iter().enumerate().flat_map(others).collect()
}

/// Whether the convex hulls of two sets of points overlap: no axis perpendicular to two of their
/// edges separates them (separating axis theorem; more axes than it requires do no harm).
fn hulls_meet(a: &[DVec3], b: &[DVec3]) -> bool {
    let (of_a, of_b) = (edges(a), edges(b));
    let all: Vec<_> = of_a.iter().chain(&of_b).copied().collect();
    let extent = |points: &[DVec3], axis: DVec3| {
        let along = points.iter().map(|p| p.dot(axis));
        along.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
    };
    let pairs = all
        .iter()
        .flat_map(|&p| all.iter().map(move |&q| p.cross(q)));
    // A cross product of parallel edges is zero or rounding, which separates nothing.
    let mut axes = pairs.filter(|axis| axis.length() > 1e-9);
    !axes.any(|axis| {
        let ((low_a, high_a), (low_b, high_b)) = (extent(a, axis), extent(b, axis));
        low_a > high_b || low_b > high_a
    })
}

#[test]
fn triangles_between_are_those_whose_hull_meets_the_space() {
    let mut rng = linelit_testkit::cases::rng(19);
    let (mut inside, mut outside) = (0, 0);
    for round in 0..linelit_testkit::cases::cases(120) {
        let mesh = soup(&mut rng, 150, 0.5, DVec3::new(1.0, -2.0, 0.5), 1.0);
        let own = Occluders::build(&mesh.positions, &mesh.triangles);
        let centre = mesh.corners(0)[0];
        let (corners, middle) = (2 + rng.index(5), centre + rng.direction() * 1.5);
        let lamp = light(&mut rng, corners, middle, 0.4);
        let x = centre + rng.direction() * rng.in_range(0.5, 2.0);
        let found = own.between(x, LightCorners::new(&lamp).unwrap());
        let space: Vec<_> = lamp.iter().copied().chain([x]).collect();
        let numbers = 0..mesh.triangles.len();
        let want: Vec<_> = numbers
            .filter(|&i| hulls_meet(&mesh.corners(i), &space))
            .collect();
        let found: Vec<_> = found.iter().map(|&i| i as usize).collect();
        assert_eq!(found, want, "{round}");
        inside += want.len();
        outside += mesh.triangles.len() - want.len();
    }
    assert!(inside > 300 && outside > 300, "{inside} {outside}");
    // No triangle, a point in the light's plane, and a triangle that touches the light.
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let lamp = square.map(|[x, y]| DVec3::new(x, y, 1.0));
    assert!(Occluders::default().between([0.0; 3], &lamp).is_empty());
    let touching = [[0.5, 0.5, 1.0], [0.5, 0.5, 2.0], [0.7, 0.5, 2.0]];
    let beyond = touching.map(|[x, y, z]| [x, y, z + 0.1_f32]);
    let own = Occluders::from_triangles([beyond, touching]);
    assert_eq!(own.between([0.3, 0.4, 0.0], &lamp), [1]);
    assert_eq!(own.between([-1.0, 0.5, 1.0], &lamp), [1]);
}

/// With any numbers nothing panics, and NaN separates nothing.
#[test]
fn hostile_numbers_are_gathered() {
    let awkward = [
        0.0,
        1.0,
        -1e30,
        f32::MAX,
        f32::MIN_POSITIVE,
        f32::NAN,
        f32::INFINITY,
    ];
    let mut rng = linelit_testkit::cases::rng(18);
    let mut scratch = Scratch::new();
    for _ in 0..linelit_testkit::cases::cases(2_000) {
        let mut vector = || [(); 3].map(|()| awkward[rng.index(awkward.len())]);
        let lamp = [(); 3].map(|()| DVec3::from(vector().map(f64::from)));
        let x = vector();
        let between = SpaceBetween::new(x, &lamp);
        let triangles: [_; 9] = std::array::from_fn(|_| [vector(), vector(), vector()]);
        let nothing = [f32::NAN; 3];
        assert!(between.may_meet(nothing, nothing));
        let few = &Occluders::from_triangles(triangles);
        assert_eq!(few.triangle_count() + few.left_out(), triangles.len());
        let line = Segment::new(lamp[0], lamp[1]);
        let x = DVec3::from(x.map(f64::from));
        let (_, visible) = ask(few, x, (&lamp, &[line]), &NONE, &mut scratch);
        assert!((0.0..=1.0).contains(&visible.fraction(0)));
    }
}
