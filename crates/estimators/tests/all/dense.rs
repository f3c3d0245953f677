//! The visible part of a light past thousands of triangles is compared with a computation by all of
//! them.

use crate::penumbrae::rough;
use linelit_bsdf::{Bsdf, Lambert};
use linelit_estimators::{Buffers, LightSource, NoTexture, Query, RandomNumbers};
use linelit_estimators::{ShadingPoint, estimate};
use linelit_geometry::{ConvexPolygon, DVec3, Margins};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_penumbra::{BoundaryEdge, Penumbra, Point};
use linelit_samplers::SamplerKind;
use linelit_shading::polygon;
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z, z_score_two};
use linelit_testkit::{cases, rng::SplitMix64};
use linelit_visibility::{InstructionSet, LightCorners, Occluders, Scratch, ShaftQuery};
use std::f64::consts::{PI, TAU};

/// Positions and triangles.
#[derive(Clone, Debug, Default)]
struct Mesh(Vec<[f32; 3]>, Vec<[u32; 3]>);

impl Mesh {
    fn vertex(&mut self, at: DVec3) -> u32 {
        self.0.push(at.as_vec3().to_array());
        u32::try_from(self.0.len() - 1).expect("few vertices")
    }

    fn triangle(&mut self, corners: [DVec3; 3]) {
        let corners = corners.map(|at| self.vertex(at));
        self.1.push(corners);
    }

    /// The quads of a grid of points.
    fn grid(&mut self, [rows, columns]: [u32; 2], at: impl Fn(u32, u32) -> DVec3) {
        let places: Vec<Vec<u32>> = (0..=rows)
            .map(|i| (0..=columns).map(|j| self.vertex(at(i, j))).collect())
            .collect();
        for pair in places.windows(2) {
            for j in 0..columns as usize {
                let [a, b, c, d] = [pair[0][j], pair[0][j + 1], pair[1][j], pair[1][j + 1]];
                self.1.extend([[a, b, d], [a, d, c]]);
            }
        }
    }

    /// A bumpy sphere, closed but for rounding where its ends meet.
    fn ball(&mut self, centre: DVec3, radius: f64, rows: u32) {
        let columns = 2 * rows;
        self.grid([rows, columns], |i, j| {
            let v = 0.5 * TAU * f64::from(i) / f64::from(rows);
            let u = TAU * f64::from(j % columns) / f64::from(columns);
            let at = DVec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos());
            centre + at * (radius * (1.0 + 0.1 * (9.0 * at.x).sin() * (8.0 * at.y).cos()))
        });
    }

    /// A wavy sheet across the shaft, with a gap of this width in its middle.
    fn curtain(&mut self, height: f64, gap: f64, cells: u32) {
        for side in [-1.0, 1.0] {
            self.grid([cells, cells], |i, j| {
                let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(cells));
                let x = side * (0.5 * gap + 0.6 * s);
                DVec3::new(x, 1.2 * t - 0.6, height + 0.05 * (20.0 * s + 3.0 * t).sin())
            });
        }
    }

    /// Slats across the shaft, with gaps of a fraction of their width.
    fn blinds(&mut self, height: f64, slats: u32, gap: f64) {
        let pitch = 1.2 / f64::from(slats);
        for k in 0..slats {
            let y = pitch * f64::from(k) - 0.6;
            self.grid([1, 4], |i, j| {
                let x = 0.3 * f64::from(j) - 0.6;
                DVec3::new(x, y + (1.0 - gap) * pitch * f64::from(i), height)
            });
        }
    }

    fn leaves(&mut self, rng: &mut SplitMix64, count: u32, size: f64) {
        let mut vector = |size: f64| DVec3::from_array([(); 3].map(|()| rng.in_range(-size, size)));
        for _ in 0..count {
            let at = DVec3::Z + vector(0.4);
            let corners = [(); 3].map(|()| at + vector(size));
            self.triangle(corners);
        }
    }
}

fn mesh(make: &mut dyn FnMut(&mut Mesh)) -> Mesh {
    let mut mesh = Mesh::default();
    make(&mut mesh);
    mesh
}

/// Meshes of which silhouettes are used, alone and among other triangles.
fn fine_meshes(rng: &mut SplitMix64) -> Vec<(&'static str, Mesh)> {
    let mut all = Vec::new();
    let mut add = |what, make: &mut dyn FnMut(&mut Mesh)| all.push((what, mesh(make)));
    add("balls", &mut |m| {
        m.ball(DVec3::new(0.1, 0.2, 1.2), 0.35, 40);
        m.ball(DVec3::new(-0.3, -0.1, 0.8), 0.25, 30);
    });
    add("balls behind and before blinds and leaves", &mut |m| {
        m.ball(DVec3::new(0.1, 0.2, 1.2), 0.35, 50);
        m.ball(DVec3::new(-0.3, -0.1, 0.7), 0.2, 40);
        m.blinds(0.9, 90, 0.4);
        m.leaves(rng, 400, 0.05);
    });
    add(
        "balls through the light's plane and the points'",
        &mut |m| {
            m.ball(DVec3::new(0.4, 0.2, 1.9), 0.3, 40);
            m.ball(DVec3::new(0.3, 0.1, 0.0), 0.25, 40);
        },
    );
    add("a ball twice, and another through it", &mut |m| {
        for _ in 0..2 {
            m.ball(DVec3::new(0.1, 0.0, 1.0), 0.3, 24);
        }
        m.ball(DVec3::new(0.25, 0.1, 1.1), 0.3, 24);
    });
    add("a ball without some of its triangles", &mut |m| {
        m.ball(DVec3::new(0.0, 0.1, 1.0), 0.4, 30);
        let mut k = 0;
        m.1.retain(|_| {
            k += 1;
            k % 17 != 0
        });
    });
    all
}

/// Meshes that are open, closed, cut or branching, that occur twice at one position or in one
/// plane, or that intersect each other.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut rng = cases::rng(16);
    let mut all = fine_meshes(&mut rng);
    let mut add = |what, make: &mut dyn FnMut(&mut Mesh)| all.push((what, mesh(make)));
    add("curtains", &mut |m| {
        m.curtain(1.0, 0.05, 30);
        m.curtain(1.3, 0.4, 20);
    });
    add("a curtain that closes, and one behind it", &mut |m| {
        m.curtain(0.9, 0.0, 24);
        m.curtain(1.4, 0.3, 24);
    });
    add("blinds", &mut |m| m.blinds(1.2, 90, 0.004));
    add("blinds of all but nothing", &mut |m| {
        m.blinds(1.2, 90, 1e-5)
    });
    add("crossed blinds, thrice on one plane", &mut |m| {
        m.blinds(1.0, 50, 0.3);
        m.blinds(1.0, 50, 0.3);
        m.blinds(1.0, 37, 0.6);
    });
    add("leaves", &mut |m| m.leaves(&mut rng, 1500, 0.05));
    add("large leaves", &mut |m| m.leaves(&mut rng, 700, 0.2));
    add("fins on every edge of a sheet", &mut |m| {
        m.curtain(1.0, 0.3, 18);
        for k in 0..m.1.len() {
            let [a, b, _] = m.1[k].map(|i| DVec3::from(m.0[i as usize].map(f64::from)));
            m.triangle([a, b, 0.5 * (a + b) + DVec3::Z * 0.1]);
        }
    });
    add("coarse leaves of one grid", &mut |m| {
        let mut place = || f64::from(u32::try_from(rng.below(13)).expect("below 13")) / 8.0 - 0.75;
        for k in 0..500 {
            let z = 1.0 + f64::from(k % 3) / 4.0;
            let corners = [(); 3].map(|()| DVec3::new(place(), place(), z));
            m.triangle(corners);
        }
    });
    all
}

/// A square light above the origin, a triangle and a hexagon.
fn lights() -> Vec<Vec<DVec3>> {
    let at = |x: f64, y: f64| DVec3::new(x, y, 2.0);
    let hexagon = (0..6).map(|k| {
        let (s, c) = (TAU * f64::from(k) / 6.0).sin_cos();
        at(0.6 * c, 0.5 * s)
    });
    vec![
        vec![at(-0.5, -0.5), at(-0.5, 0.5), at(0.5, 0.5), at(0.5, -0.5)],
        vec![at(-0.5, -0.6), at(-0.3, 0.7), at(0.6, 0.1)],
        hexagon.rev().collect(),
    ]
}

/// A corner as its height on the way to the light's plane, as a fraction, and the point of that
/// plane that it hides, in coordinates of our own along x and y.
fn images(mesh: &Mesh, point: DVec3) -> Vec<[Point; 3]> {
    let height = 2.0 - point.z;
    let mut out = Vec::new();
    for corners in &mesh.1 {
        let mut piece: Vec<DVec3> = corners
            .map(|i| DVec3::from(mesh.0[i as usize].map(f64::from)) - point)
            .to_vec();
        for (sign, offset) in [
            (1.0, -Margins::DEFAULT.point),
            (-1.0, Margins::DEFAULT.end()),
        ] {
            let above = |v: &DVec3| sign * v.z / height + offset;
            let whole = std::mem::take(&mut piece);
            for (i, &a) in whole.iter().enumerate() {
                let b = whole[(i + 1) % whole.len()];
                let (ha, hb) = (above(&a), above(&b));
                if ha >= 0.0 {
                    piece.push(a);
                }
                if (ha >= 0.0) != (hb >= 0.0) {
                    // Begin at the same end for both triangles of an edge.
                    let (a, b, ha, hb) = if ha >= 0.0 {
                        (a, b, ha, hb)
                    } else {
                        (b, a, hb, ha)
                    };
                    piece.push(a + (b - a) * (ha / (ha - hb)));
                }
            }
            if piece.is_empty() {
                break;
            }
        }
        let place = |v: DVec3| [v.x * (height / v.z), v.y * (height / v.z)];
        for i in 2..piece.len() {
            out.push([piece[0], piece[i - 1], piece[i]].map(place));
        }
    }
    out
}

/// The light within a boundary relative to the point, for a radiance and an albedo of one.
fn irradiance(pieces: &[BoundaryEdge], height: f64) -> f64 {
    let plane = [DVec3::Z * height, DVec3::X, DVec3::Y];
    let edges = pieces.iter().map(|edge| [edge.from, edge.to]);
    polygon::boundary_irradiance(edges, &plane, DVec3::Z)
}

fn sets() -> Vec<InstructionSet> {
    let all = [
        InstructionSet::Scalar,
        InstructionSet::Avx2,
        InstructionSet::Avx512,
    ];
    all.into_iter().filter(|set| set.is_available()).collect()
}

/// Estimates a light by `exact` at a white point that looks up, past each of the occluders. All
/// must be integrated in closed form, with the same bits.
fn exact(what: &str, sets: &[Occluders], light: &Light, x: DVec3, buffers: &mut Buffers) -> f64 {
    let bsdf = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    let point = ShadingPoint::new(x, DVec3::Z, DVec3::Z, bsdf);
    let source = LightSource::new(light);
    let estimator = "exact".parse().expect("one");
    let mut values = sets.iter().map(|occluders| {
        let numbers = RandomNumbers::new(SamplerKind::Sobol, 0, [0, 0], 0);
        let query = Query::<_, NoTexture>::new(occluders, &source, &point, &estimator, numbers, 1);
        let before = buffers.counts.plan.exact_fallbacks;
        let value = estimate(&query, buffers).x;
        assert_eq!(buffers.counts.plan.exact_fallbacks, before, "{what}");
        value
    });
    let first = values.next().expect("scalar");
    for other in values {
        assert_eq!(first.to_bits(), other.to_bits(), "{what}: {first} {other}");
    }
    first
}

/// The occluders of a mesh on each instruction set.
fn occluders(mesh: &Mesh) -> Vec<Occluders> {
    let build = |set| Occluders::build(&mesh.0, &mesh.1).limited_to(set);
    sets().into_iter().map(build).collect()
}

/// The difference between `exact` and the light past the images of all triangles by plain `f64`, in
/// units of the unshadowed light, together with that light; `None` if the shaft is not dense.
fn error_at(
    (what, mesh, sets): (&str, &Mesh, &[Occluders]),
    corners: &[DVec3],
    x: DVec3,
    buffers: &mut Buffers,
) -> Option<(f64, f64)> {
    let light = LightCorners::new(corners).expect("few corners");
    let query = ShaftQuery::new(x, light);
    if !sets[0].shaft(query, &mut Scratch::new()).is_dense() {
        return None;
    }
    let polygon = ConvexPolygon::new(corners).expect("a light");
    let emission = Emission::one_sided(DVec3::ONE);
    let area = Light::Area(AreaLight { polygon, emission });
    let got = exact(what, sets, &area, x, buffers);
    let flat: Vec<Point> = corners.iter().map(|v| [v.x - x.x, v.y - x.y]).collect();
    let mut all = Penumbra::default();
    let whole = irradiance(all.boundary(&flat, std::iter::empty()), 2.0);
    let want = irradiance(all.boundary(&flat, images(mesh, x).into_iter()), 2.0);
    // Neither value has Lambert's factor of 1/π.
    let error = (got * PI - want).abs() / whole;
    assert!(error < 1e-9, "{what} at {x}: {got}, {error:e}");
    Some((error, want))
}

/// For every mesh and every light, at points from which it is partly or wholly hidden, the light is
/// the light past the images of all triangles by plain `f64`, to 1e-9 of the unshadowed light. The
/// bits are the same on all instruction sets and for all earlier uses of the buffers.
#[test]
fn light_past_thousands_of_triangles() {
    let (mut dense, mut hidden) = (0, 0);
    let mut buffers = Buffers::default();
    for (what, mesh) in &meshes() {
        let before = dense;
        let sets = occluders(mesh);
        for corners in lights() {
            for k in 0..4 {
                let x = DVec3::new(0.21 * f64::from(k) - 0.3, 0.17 * f64::from(k) - 0.25, 0.0);
                let found = error_at((what, mesh, &sets), &corners, x, &mut buffers);
                dense += u32::from(found.is_some());
                hidden += u32::from(found.is_some_and(|(_, want)| want == 0.0));
            }
        }
        assert!(dense > before, "{what} is never dense");
    }
    assert!(dense > 100 && hidden > 10, "{hidden} of {dense}");
}

/// The same holds past random fine meshes: of all sizes, intersecting each other and the planes of
/// the light and the point, some of them twice at the same or almost the same position, among
/// leaves and slats.
#[test]
fn light_past_fine_meshes_at_random() {
    let mut rng = cases::rng(19);
    let mut buffers = Buffers::default();
    let mut seen = 0;
    for case in 0..cases::cases(6) {
        let mut mesh = Mesh::default();
        for _ in 0..1 + rng.below(4) {
            let mut any = |low, high| rng.in_range(low, high);
            let centre = DVec3::new(any(-0.6, 0.6), any(-0.6, 0.6), any(0.1, 2.1));
            let (radius, height) = (10_f64.powf(any(-1.5, -0.2)), any(0.2, 1.8));
            match rng.below(4) {
                0 => mesh.curtain(height, radius, 24),
                _ => mesh.ball(
                    centre,
                    radius,
                    24 + u32::try_from(rng.below(20)).expect("few"),
                ),
            }
            if rng.below(4) == 0 {
                let moved = [0.0, 1e-7, 1e-3][usize::try_from(rng.below(3)).expect("few")];
                let first = u32::try_from(mesh.0.len()).expect("few vertices");
                let copies: Vec<_> = mesh.0.iter().map(|v| [v[0] + moved, v[1], v[2]]).collect();
                let others: Vec<_> = mesh.1.iter().map(|t| t.map(|i| i + first)).collect();
                mesh.0.extend(copies);
                mesh.1.extend(others);
            }
        }
        if rng.below(2) == 0 {
            mesh.leaves(&mut rng, 150, 0.1);
        }
        if rng.below(3) == 0 {
            mesh.blinds(rng.in_range(0.3, 1.7), 20, 0.5);
        }
        let sets = occluders(&mesh);
        for corners in lights() {
            let x = DVec3::new(rng.in_range(-0.4, 0.4), rng.in_range(-0.4, 0.4), 0.0);
            let what = format!("case {case}");
            let found = error_at((&what, &mesh, &sets), &corners, x, &mut buffers);
            seen += u32::from(found.is_some_and(|(_, want)| want > 0.0));
        }
    }
    assert!(seen > 3, "{seen}");
}

/// Combinations on a rough surface past dense shafts of fine meshes have the mean of points, and
/// less than a thousandth of their variance where they use the closed form past silhouettes.
#[test]
fn combinations_past_silhouettes_are_right() {
    let corners = &lights()[0];
    let polygon = ConvexPolygon::new(corners).expect("a light");
    let emission = Emission::one_sided(DVec3::ONE);
    let light = Light::Area(AreaLight { polygon, emission });
    let x = DVec3::new(0.12, 0.09, 0.0);
    let wo = DVec3::new(-0.3, 0.0, 1.0).normalize();
    let point = ShadingPoint::new(x, DVec3::Z, wo, rough(0.15));
    let (_, mesh) = &fine_meshes(&mut cases::rng(16))[0];
    let occluders = Occluders::build(&mesh.0, &mesh.1);
    let mut buffers = Buffers::default();
    let mut estimates = |name: &str, seeds: std::ops::Range<u64>| -> Welford {
        let source = LightSource::new(&light);
        let estimator = name.parse().expect("one");
        let one = |seed| {
            let numbers = RandomNumbers::new(SamplerKind::Sobol, seed, [0, 0], 0);
            let query =
                Query::<_, NoTexture>::new(&occluders, &source, &point, &estimator, numbers, 64);
            estimate(&query, &mut buffers).x
        };
        seeds.map(one).collect()
    };
    let points = estimates("point-ltc+point-bsdf", 10_000..10_512);
    assert!(points.mean() > 0.0);
    let cases = [("exact+point-bsdf", true), ("hybrid+point-bsdf", false)];
    let bound = critical_z(sidak(1e-4, cases.len()));
    for (text, is_closed) in cases {
        let got = estimates(text, 0..512);
        let z = z_score_two(&got, &points);
        assert!(z.abs() < bound, "{text}: {z}");
        assert!(
            !is_closed || got.variance() < 0.001 * points.variance(),
            "{text}"
        );
    }
    assert!(buffers.counts.plan.exact_penumbrae == 512);
}

/// Estimates of light from a point by 512 seeds, with this many samples each.
fn estimates(
    (name, samples): (&str, u32),
    occluders: &Occluders,
    source: &LightSource<'_>,
    point: &ShadingPoint<Bsdf>,
    buffers: &mut Buffers,
) -> Welford {
    let estimator = name.parse().expect("one");
    let one = |seed| {
        let numbers = RandomNumbers::new(SamplerKind::Auto, seed, [0, 0], 0);
        let query =
            Query::<_, NoTexture>::new(occluders, source, point, &estimator, numbers, samples);
        estimate(&query, buffers).x
    };
    (0..512).map(one).collect()
}

/// Past a wall with a hole, `exact` on reflections without a closed form has the mean of points by
/// area. The hole is on the narrow lobe, next to it, or as wide as the light. Samples are drawn on
/// the visible part, so that their variance is a small fraction of the variance of as many points
/// of the whole light. It is smaller still if a few pilot samples show how well LTCs fit.
#[test]
fn differences_are_drawn_on_what_is_visible() {
    let corner = DVec3::new(-1.0, -1.0, 2.0);
    let polygon = ConvexPolygon::parallelogram(corner, DVec3::Y * 2.0, DVec3::X * 2.0);
    let polygon = polygon.expect("a light");
    let emission = Emission::one_sided(DVec3::ONE);
    let light = Light::Area(AreaLight { polygon, emission });
    let source = LightSource::new(&light);
    let mut buffers = Buffers::default();
    let tests = [
        // The variances with 16 and 64 samples, relative to points, are 8e-7, 4e-7; 3e-7, 1e-7;
        // 1e-10.
        (0.05, [0.3, 0.2], 0.02, [1e-5; 2]),
        (0.05, [0.25, 0.2], 0.02, [1e-5; 2]),
        (0.05, [-0.3, 0.1], 0.02, [1e-9; 2]),
        // They are 1e-9, 3e-11, and 8e-10 without pilot samples; 1e-4 and 2e-5 for wide holes.
        (0.3, [0.3, 0.2], 0.02, [1e-8, 2e-10]),
        (0.05, [0.2, 0.1], 0.3, [1e-2; 2]),
        (0.3, [0.0, 0.0], 0.4, [1e-2; 2]),
    ];
    let bound = critical_z(sidak(1e-4, 2 * tests.len()));
    for (alpha, [a, b], size, most) in tests {
        let wall = mesh(&mut |m| {
            let sides = [[-3.0, a - size], [a + size, 3.0]];
            let rest = [[-3.0, b - size], [b + size, 3.0]];
            let mut quad = |[x, u]: [f64; 2], [y, v]: [f64; 2]| {
                let corners = [[x, y], [u, y], [u, v], [x, v]];
                let [c, d, e, f] = corners.map(|[x, y]| DVec3::new(x, y, 1.0));
                m.triangle([c, d, e]);
                m.triangle([c, e, f]);
            };
            for side in sides {
                quad(side, [-3.0, 3.0]);
            }
            for side in rest {
                quad([a - size, a + size], side);
            }
        });
        let occluders = Occluders::build(&wall.0, &wall.1);
        // The mirror image of the viewer is at (0.6, 0.4) on the light.
        let wo = DVec3::new(-0.6, -0.4, 2.0).normalize();
        let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, wo, rough(alpha));
        let mut estimates =
            |name, samples| estimates((name, samples), &occluders, &source, &point, &mut buffers);
        let want = estimates("point-area", 4096);
        // Of 64 samples, some are pilot samples.
        for (samples, most) in [16, 64].into_iter().zip(most) {
            let got = estimates("exact", samples);
            let z = z_score_two(&got, &want);
            assert!(z.abs() < bound, "{alpha}, {a}, {b}, {samples}: {z}");
            let ratio = got.variance() / estimates("point-ltc", samples).variance();
            assert!(ratio < most, "{alpha}, {a}, {b}, {samples}: {ratio:e}");
        }
    }
}
