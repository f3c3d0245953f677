//! Scenes and random numbers for the tests.

use linelit_geometry::{DVec3, Margins, Segment, intervals::Interval};
use linelit_scenes::VisibilityScene;
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    InstructionSet, LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery, VisibleLines,
    brute,
};
use std::ops::Range;

/// Where the camera's rays hit the scene, offset from the surface towards the eye, except for hits
/// in the plane of a light: the scene shows its lights.
pub(crate) fn shading_points(
    occluders: &Occluders,
    scene: &VisibilityScene,
    [width, height]: [u32; 2],
) -> Vec<DVec3> {
    let mut scratch = Scratch::new();
    let meet = |&[origin, direction]: &[DVec3; 2]| {
        let ray = Ray {
            origin,
            direction,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let hit = occluders.closest_hit(&ray, &mut scratch)?;
        Some(origin + direction * (hit.t - 2e-5))
    };
    let in_plane = |p: &DVec3| {
        scene.lights.iter().any(|(_, light)| {
            let normal = (light[1] - light[0]).cross(light[2] - light[0]);
            normal.dot(*p - light[0]).abs() <= 1e-4 * normal.length()
        })
    };
    let view = scene.view(width, height);
    let points = view.iter().filter_map(meet);
    points.filter(|p| !in_plane(p)).collect()
}

/// A source of random points, directions and indices.
pub(crate) trait InSpace {
    /// A point in the cube with this half side around the origin.
    fn in_cube(&mut self, half: f64) -> DVec3;
    /// A unit vector.
    fn direction(&mut self) -> DVec3;
    /// A number below `n`.
    fn index(&mut self, n: usize) -> usize;
}

impl InSpace for SplitMix64 {
    fn in_cube(&mut self, half: f64) -> DVec3 {
        DVec3::from([(); 3].map(|()| self.in_range(-half, half)))
    }

    // Not `unit_vector` and `below` of the generator, since tests refer to seeds of what they have
    // found.
    fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube(1.0);
            if v.length_squared() <= 1.0 && v.length_squared() > 1e-4 {
                return v.normalize();
            }
        }
    }

    fn index(&mut self, n: usize) -> usize {
        usize::try_from(self.next_u64() % n as u64).unwrap()
    }
}

/// The answers of a shaft about lines on a light: its class, and the visible part of each line.
pub(crate) fn ask(
    occluders: &Occluders,
    point: DVec3,
    (light, lines): (&[DVec3], &[Segment]),
    exclude: &Range<u32>,
    scratch: &mut Scratch,
) -> (ShaftClass, VisibleLines) {
    let mut out = VisibleLines::new();
    let query =
        ShaftQuery::new(point, LightCorners::new(light).unwrap()).excluding(exclude.clone());
    let mut shaft = occluders.shaft(query, scratch);
    shaft.visible(lines, &mut out);
    assert_eq!(out.len(), lines.len());
    (shaft.class(), out)
}

/// The visible parts of a line past every triangle except some, tested one by one in `f64`.
pub(crate) fn past_all(
    mesh: &Mesh,
    point: DVec3,
    line: &Segment,
    exclude: &Range<u32>,
) -> Vec<Interval> {
    let (positions, triangles) = (&mesh.positions, &mesh.triangles);
    brute::visible(positions, triangles, point, line, exclude, Margins::DEFAULT)
}

/// The visible fraction of a line past every triangle, tested one by one in `f64`.
pub(crate) fn by_hand(mesh: &Mesh, point: DVec3, line: &Segment) -> f64 {
    let parts = past_all(mesh, point, line, &NONE);
    parts.iter().map(|part| part.hi - part.lo).sum()
}

/// Where a ray hits the nearest triangle, by determinants in `f64`; `None` for a ray that passes an
/// edge within rounding.
pub(crate) fn nearest(mesh: &Mesh, ray: &Ray) -> Option<Option<f64>> {
    let d = ray.direction;
    let mut nearest: Option<f64> = None;
    for k in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(k).map(|v| v - ray.origin);
        let mut sides = [0.0; 3];
        for (side, (v, w)) in sides.iter_mut().zip([(a, b), (b, c), (c, a)]) {
            *side = d.dot(v.cross(w));
            if side.abs() <= 16.0 * f64::EPSILON * d.length() * v.length() * w.length() {
                return None;
            }
        }
        if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
            let t = a.dot(b.cross(c)) / sides.iter().sum::<f64>();
            if t >= 0.0 && nearest.is_none_or(|n| t < n) {
                nearest = Some(t);
            }
        }
    }
    Some(nearest)
}

/// Triangles with their positions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "f32 geometry, small meshes"
    )]
    pub(crate) fn vertex(&mut self, p: DVec3) -> u32 {
        self.positions.push([p.x as f32, p.y as f32, p.z as f32]);
        self.positions.len() as u32 - 1
    }

    pub(crate) fn triangle(&mut self, a: DVec3, b: DVec3, c: DVec3) {
        let t = [self.vertex(a), self.vertex(b), self.vertex(c)];
        self.triangles.push(t);
    }

    pub(crate) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| {
            let p = self.positions[i as usize];
            DVec3::new(p[0].into(), p[1].into(), p[2].into())
        })
    }
}

/// `n` random triangles of size up to `size` in a cube of half side one around `centre`, scaled.
pub(crate) fn soup(rng: &mut SplitMix64, n: usize, size: f64, centre: DVec3, scale: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..n {
        let c = rng.in_cube(1.0);
        let v = [0; 3].map(|_| centre + (c + rng.in_cube(size)) * scale);
        mesh.triangle(v[0], v[1], v[2]);
    }
    mesh
}

/// A closed surface around the origin of its own coordinates, its radius bumpy, its vertices
/// shared; squashed by `squash` along a random axis, rotated and moved to `centre`.
pub(crate) fn closed(
    rng: &mut SplitMix64,
    nu: u32,
    nv: u32,
    squash: f64,
    centre: DVec3,
    scale: f64,
) -> Mesh {
    let mut mesh = Mesh::default();
    let x = rng.direction();
    let y = x.cross(rng.direction()).normalize();
    let z = x.cross(y);
    let mut place = |rng: &mut SplitMix64, u: f64, v: f64| {
        let (su, cu) = u.sin_cos();
        let (sv, cv) = v.sin_cos();
        let r = scale * rng.in_range(0.8, 1.2);
        mesh.vertex(centre + (x * (sv * cu) + y * (sv * su * squash) + z * cv) * r)
    };
    let north = place(rng, 0.0, 0.0);
    let mut rows = Vec::new();
    for j in 1..nv {
        let v = std::f64::consts::PI * f64::from(j) / f64::from(nv);
        let row: Vec<u32> = (0..nu)
            .map(|i| place(rng, std::f64::consts::TAU * f64::from(i) / f64::from(nu), v))
            .collect();
        rows.push(row);
    }
    let south = place(rng, 0.0, std::f64::consts::PI);
    let n = nu as usize;
    for i in 0..n {
        let k = (i + 1) % n;
        mesh.triangles.push([north, rows[0][i], rows[0][k]]);
        mesh.triangles
            .push([south, rows[rows.len() - 1][k], rows[rows.len() - 1][i]]);
        for pair in rows.windows(2) {
            let (a, b, c, d) = (pair[0][i], pair[0][k], pair[1][i], pair[1][k]);
            mesh.triangles.push([a, c, d]);
            mesh.triangles.push([a, d, b]);
        }
    }
    mesh
}

/// The light's polygon, or the two ends of a linear light.
pub(crate) fn light(rng: &mut SplitMix64, corners: usize, centre: DVec3, size: f64) -> Vec<DVec3> {
    let x = rng.direction();
    let y = x.cross(rng.direction()).normalize();
    match corners {
        2 => vec![centre - x * size, centre + x * size],
        4 => {
            let e2 = y * size * rng.in_range(0.2, 1.0) + x * size * rng.in_range(-0.5, 0.5);
            let o = centre - x * size;
            vec![o, o + x * size * 2.0, o + x * size * 2.0 + e2, o + e2]
        }
        n => {
            #[allow(clippy::cast_precision_loss, reason = "small")]
            let step = std::f64::consts::TAU / n as f64;
            let turn = rng.in_range(0.0, step);
            let squash = rng.in_range(0.2, 1.0);
            #[allow(clippy::cast_precision_loss, reason = "small")]
            let corner = |i: usize| {
                let (s, c) = (turn + step * i as f64).sin_cos();
                centre + x * (size * c) + y * (size * squash * s)
            };
            (0..n).map(corner).collect()
        }
    }
}

/// A chord of the light, either parallel to a direction given by an angle or a random one.
pub(crate) fn chord(rng: &mut SplitMix64, light: &[DVec3], angle: Option<f64>) -> Segment {
    if light.len() == 2 {
        return Segment::new(light[0], light[1]);
    }
    let n = (light[1] - light[0]).cross(light[2] - light[0]).normalize();
    let x = (light[1] - light[0]).normalize();
    let angle = angle.unwrap_or_else(|| rng.in_range(0.0, std::f64::consts::PI));
    let along = x * angle.cos() + n.cross(x) * angle.sin();
    let across = n.cross(along);
    let offsets: Vec<f64> = light.iter().map(|v| v.dot(across)).collect();
    let lo = offsets.iter().copied().fold(f64::INFINITY, f64::min);
    let hi = offsets.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let u = rng.in_range(lo, hi);
    let mut ends = Vec::new();
    for i in 0..light.len() {
        let j = (i + 1) % light.len();
        if (offsets[i] <= u) != (offsets[j] <= u) {
            let t = (u - offsets[i]) / (offsets[j] - offsets[i]);
            ends.push(light[i] + (light[j] - light[i]) * t);
        }
    }
    if (ends[1] - ends[0]).dot(along) < 0.0 {
        ends.swap(0, 1);
    }
    Segment::new(ends[0], ends[1])
}

/// No excluded triangles.
pub(crate) const NONE: Range<u32> = 0..0;

/// The occluders of a mesh for each instruction set.
pub(crate) fn on_all_sets(mesh: &Mesh) -> Vec<Occluders> {
    let sets = [
        InstructionSet::Scalar,
        InstructionSet::Avx2,
        InstructionSet::Avx512,
    ];
    let build = || Occluders::build(&mesh.positions, &mesh.triangles);
    sets.map(|set| build().limited_to(set)).into()
}
