//! Closure: the facets around a point together send all light that the point can receive.

use linelit_bsdf::{Bsdf, Lambert};
use linelit_estimators::{
    Buffers, Estimator, LightSource, Query, RandomNumbers, ShadingPoint, estimate,
};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Margins};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_samplers::SamplerKind;
use linelit_testkit::{cases::cases, cases::rng, rng::SplitMix64};
use linelit_visibility::Occluders;

/// Triangles, and boxes in whose inside no point may be.
#[derive(Default)]
struct Room {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    solids: Vec<[[f32; 3]; 8]>,
}

impl Room {
    /// Twelve triangles of a box whose corners are numbered by bits.
    fn add_box(&mut self, corner: impl Fn([f64; 3]) -> DVec3) {
        let corners: [[f32; 3]; 8] = std::array::from_fn(|i| {
            let bits = [0, 1, 2].map(|k| f64::from(u8::from(i >> k & 1 != 0)));
            corner(bits).as_vec3().to_array()
        });
        let first = u32::try_from(self.positions.len()).unwrap();
        self.positions.extend(corners);
        let quads = [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ];
        for quad in quads {
            let [a, b, c, d] = quad.map(|i| first + i);
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
        self.solids.push(corners);
    }

    fn add_triangle(&mut self, corners: [DVec3; 3]) {
        let first = u32::try_from(self.positions.len()).unwrap();
        self.positions
            .extend(corners.map(|v| v.as_vec3().to_array()));
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize].map(f64::from).into())
    }

    /// Returns whether a point is inside one of the boxes, with a margin, apart from the first box,
    /// which is the room.
    fn is_free(&self, at: DVec3) -> bool {
        self.solids[1..].iter().all(|corners| {
            let corner = |i: usize| DVec3::from(corners[i].map(f64::from));
            let from = at - corner(0);
            let beyond = |i: usize| {
                let edge = corner(i) - corner(0);
                let share = from.dot(edge) / edge.length_squared();
                !(-1e-3..=1.0 + 1e-3).contains(&share)
            };
            beyond(1) || beyond(2) || beyond(4)
        })
    }
}

/// The sum of the light that a point receives from all facets, with the default margins and without
/// margins.
fn sums_of_view_factors(room: &Room, occluders: &Occluders, at: DVec3, normal: DVec3) -> [f64; 2] {
    let estimator: Estimator = "exact".parse().unwrap();
    let point = ShadingPoint::new(
        at,
        normal,
        normal,
        Bsdf::Lambert(Lambert { albedo: DVec3::ONE }),
    );
    let mut buffers = Buffers::default();
    let mut sums = [0.0; 2];
    for (k, id) in (0..room.triangles.len()).zip(0_u32..) {
        let Ok(polygon) = ConvexPolygon::new(&room.corners(k)) else {
            continue;
        };
        let light = Light::Area(AreaLight {
            polygon,
            emission: Emission {
                radiance: DVec3::ONE,
                two_sided: true,
            },
        });
        let mut source = LightSource::new(&light);
        source.triangles = id..id + 1;
        let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], 0);
        let mut query = Query::new(occluders, &source, &point, &estimator, numbers, 1);
        sums[0] += estimate(&query, &mut buffers).x;
        query.margins = Margins::NONE;
        sums[1] += estimate(&query, &mut buffers).x;
    }
    sums
}

/// A box around boxes. Some of them are on its floor, some have faces in the planes of its walls,
/// and some are tilted.
fn room_of_boxes(rng: &mut SplitMix64, count: usize) -> Room {
    let mut room = Room::default();
    let size = DVec3::new(4.0, 3.0, 2.5);
    room.add_box(|bits| DVec3::from(bits) * size);
    for k in 0..count {
        let edges = DVec3::from([(); 3].map(|()| rng.in_range(0.1, 1.2))) / (count as f64).cbrt();
        let mut low = DVec3::from([(); 3].map(|()| rng.next_f64())) * (size - edges);
        let turn = match k % 3 {
            0 => {
                DMat3::from_rotation_x(rng.in_range(0.0, 0.5))
                    * DMat3::from_rotation_z(rng.in_range(0.0, 0.5))
            }
            1 => DMat3::from_rotation_z(rng.in_range(0.0, 0.5)),
            _ => DMat3::IDENTITY,
        };
        if k % 3 != 0 {
            low.z = 0.0;
        }
        room.add_box(|bits| low + turn * (DVec3::from(bits) * edges));
    }
    room
}

/// A box around separate triangles, which intersect each other and the box's walls.
fn loose_triangles(rng: &mut SplitMix64, count: usize) -> Room {
    let mut room = Room::default();
    room.add_box(DVec3::from);
    for _ in 0..count {
        let at = DVec3::from([(); 3].map(|()| rng.next_f64()));
        let corners = [(); 3].map(|()| at + DVec3::from([(); 3].map(|()| rng.in_range(-0.2, 0.2))));
        room.add_triangle(corners);
    }
    room
}

/// A point in the room, often so near to a facet that the facet fills half of its view.
fn place(rng: &mut SplitMix64, room: &Room) -> DVec3 {
    let [lo, hi] = [0, 7].map(|i| DVec3::from(room.solids[0][i].map(f64::from)));
    loop {
        let mut at = lo + DVec3::from([(); 3].map(|()| rng.next_f64())) * (hi - lo);
        if rng.below(2) == 0 {
            let count = room.triangles.len() as u64;
            let [a, b, c] = room.corners(usize::try_from(rng.below(count)).unwrap());
            let (u, v) = (rng.next_f64(), rng.next_f64());
            let height = 0.1_f64.powf(rng.in_range(1.0, 6.0)) * rng.in_range(-1.0, 1.0);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            at = a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v);
            at += normal * (height * (b - a).length());
        }
        if at.cmpgt(lo).all() && at.cmplt(hi).all() && room.is_free(at) {
            return at;
        }
    }
}

/// The view factors from a point to all facets around it add up to one. Each facet is a light whose
/// own triangle is excluded.
///
/// Without margins, the sums for 3,000 points were within 3e-12; half of these points were at a
/// tenth to a millionth of a facet's size above it. The error is rounding of a few 1e-15 for each
/// side of each visible part. With the default margins, light gets past objects that touch a facet,
/// in the last 1e-10 of the way. With margins of 1e-6, the sums were off by 3e-7 to 3e-6 for up to
/// 3,000 facets. This error is proportional to the margin, so that it is 3e-10 at most.
#[test]
fn view_factors_to_all_facets_of_a_room_add_up_to_one() {
    let mut rng = rng(40);
    for (boxes, points) in [(0, 24), (4, 24), (40, 4), (249, 1)] {
        for room in [
            room_of_boxes(&mut rng, boxes),
            loose_triangles(&mut rng, 12 * boxes),
        ] {
            let occluders = Occluders::build(&room.positions, &room.triangles);
            for _ in 0..cases(points) {
                let (at, normal) = (place(&mut rng, &room), DVec3::from(rng.unit_vector()));
                let sums = sums_of_view_factors(&room, &occluders, at, normal);
                let facets = room.triangles.len();
                for (sum, bound) in sums.into_iter().zip([1e-9, 1e-11]) {
                    let error = sum - 1.0;
                    assert!(
                        error.abs() < bound,
                        "{facets} facets, {at}, {normal}: {error:e}"
                    );
                }
            }
        }
    }
}
