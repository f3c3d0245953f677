//! View factors in closed rooms add up to one.
#![allow(clippy::float_cmp, reason = "answers are compared bit by bit")]

use linelit_testkit::rng::SplitMix64;
use linelit_viewfactors::{Facets, Memory, Sides};

type Room = (Vec<[f64; 3]>, Vec<Vec<u32>>);

fn direction(rng: &mut SplitMix64) -> [f64; 3] {
    loop {
        let v = [(); 3].map(|()| rng.in_range(-1.0, 1.0));
        if (0.01..1.0).contains(&v.iter().map(|x| x * x).sum::<f64>()) {
            return v;
        }
    }
}

fn add(room: &mut Room, polygon: &[[f64; 3]]) {
    let first = u32::try_from(room.0.len()).unwrap();
    room.0.extend(polygon);
    let count = u32::try_from(polygon.len()).unwrap();
    room.1.push((first..first + count).collect());
}

/// Adds a box of n × n squares on each side, seen from inside or outside.
fn add_box(room: &mut Room, low: [f64; 3], high: [f64; 3], n: u32, inside: bool) {
    for axis in 0..3 {
        for end in [0, 1] {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for i in 0..n {
                for j in 0..n {
                    let corner = |di: u32, dj: u32| {
                        let mut p = [0.0; 3];
                        p[axis] = if end == 0 { low[axis] } else { high[axis] };
                        let share = |k: u32| f64::from(k) / f64::from(n);
                        p[u] = low[u] + (high[u] - low[u]) * share(i + di);
                        p[v] = low[v] + (high[v] - low[v]) * share(j + dj);
                        p
                    };
                    let mut square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    // Counter-clockwise seen from above the axis.
                    if (end == 1) == inside {
                        square.reverse();
                    }
                    add(room, &square);
                }
            }
        }
    }
}

fn random_room(rng: &mut SplitMix64, fins: u32, boxes: u32, n: u32) -> Room {
    let mut room = (Vec::new(), Vec::new());
    add_box(&mut room, [-1.0, -1.3, -0.7], [1.0, 1.2, 0.9], n, true);
    for _ in 0..boxes {
        let at = [(); 3].map(|()| rng.in_range(-0.6, 0.4));
        let size = [(); 3].map(|()| rng.in_range(0.05, 0.3));
        add_box(&mut room, at, [0, 1, 2].map(|k| at[k] + size[k]), 1, false);
    }
    for _ in 0..fins {
        let at = [(); 3].map(|()| rng.in_range(-0.6, 0.6));
        let fin = [(); 3].map(|()| at.map(|x| x + rng.in_range(-0.3, 0.3)));
        add(&mut room, &fin);
    }
    room
}

/// The largest |Σ − 1| over points in random rooms of some sizes, with fins and boxes through each
/// other.
fn worst_closure(rooms: &[[u32; 3]], points: u32, seed: u64) -> f64 {
    let mut rng = linelit_testkit::cases::rng(seed);
    let mut memory = Memory::default();
    let mut worst = 0.0_f64;
    for &[fins, boxes, n] in rooms {
        let room = random_room(&mut rng, fins, boxes, n);
        let facets = Facets::new(&room.0, &room.1, Sides::Two).unwrap();
        for _ in 0..points {
            let point = [(); 3].map(|()| rng.in_range(-0.65, 0.65));
            let row = facets.from_point(point, direction(&mut rng), &mut memory);
            assert!(row.facets.iter().all(|f| (0.0..=1.0 + 1e-12).contains(f)));
            worst = worst.max(row.sky.abs());
        }
    }
    worst
}

/// Fins, boxes, and squares along each side of some small rooms.
fn small_rooms(count: u32) -> Vec<[u32; 3]> {
    let room = |k| [20 * (k % 3), 3 * (k % 5), 1 + k % 4];
    (0..count).map(room).collect()
}

#[test]
fn rows_of_points_in_closed_rooms_add_up_to_one() {
    // Each of a hundred facets has an error of 1e-12 of its own factor.
    let worst = worst_closure(&small_rooms(16), 100, 31);
    assert!(worst <= 1e-11, "{worst:e}");
}

#[test]
#[ignore = "long: 100,000 points in 64 rooms"]
fn rows_of_points_in_many_rooms_add_up_to_one() {
    let worst = worst_closure(&small_rooms(56), 1_780, 32);
    assert!(worst <= 1e-11, "{worst:e}");
    // Eight rooms of 300 to 5,000 facets have fewer points: their rows take up to .1 s.
    let large = [[50, 20, 5], [100, 50, 8], [200, 10, 10], [0, 100, 15]];
    let larger = [
        [500, 30, 12],
        [20, 200, 18],
        [1_000, 50, 20],
        [200, 100, 27],
    ];
    let worst = worst_closure(&[large, larger].concat(), 40, 33);
    assert!(worst <= 1e-11, "{worst:e}");
}

#[test]
fn true_errors_of_rows_are_below_told_ones() {
    true_errors_of_rows(3, 34);
}

#[test]
#[ignore = "long: twenty rooms"]
fn true_errors_of_rows_of_twenty_rooms_are_below_told_ones() {
    true_errors_of_rows(20, 35);
}

/// Compares the rows of rooms, with fins and boxes through each other, with rows at a hundredth of
/// their tolerance.
fn true_errors_of_rows(rooms: u32, seed: u64) {
    let mut rng = linelit_testkit::cases::rng(seed);
    let [mut pairs, mut wrong] = [0; 2];
    for k in 0..rooms {
        let room = random_room(&mut rng, 2 * (k % 4), k % 3, 1 + k % 3);
        let facets = Facets::new(&room.0, &room.1, Sides::Two).unwrap();
        let tolerance = 1e-2;
        let [coarse, fine] = [tolerance, 1e-2 * tolerance].map(|t| facets.matrix(t));
        for row in 0..facets.len() {
            let factors = |m: &linelit_viewfactors::Matrix| {
                let mut all = vec![[0.0; 2]; facets.len()];
                for place in m.indptr[row]..m.indptr[row + 1] {
                    all[m.indices[place] as usize] = [m.data[place], m.error[place]];
                }
                all
            };
            let (found, truth) = (factors(&coarse), factors(&fine));
            for (a, b) in found.iter().zip(&truth) {
                pairs += u32::from(a[1] > 0.0);
                wrong += u32::from((a[0] - b[0]).abs() > a[1] + b[1]);
            }
            let told: f64 = found.iter().map(|f| f[1]).sum();
            let off: f64 = found
                .iter()
                .zip(&truth)
                .map(|(a, b)| (a[0] - b[0]).abs())
                .sum();
            let room: f64 = truth.iter().map(|f| f[1]).sum();
            assert!(
                told <= tolerance && off <= told + room,
                "{k} {row}: {off} {told}"
            );
            // Both sides of a wall send: half of what it sends leaves the room.
            assert!(coarse.sky[row] >= -told - 1e-12);
        }
    }
    assert!(1_000 * wrong <= pairs, "{wrong} of {pairs}");
}

#[test]
fn what_a_room_lacks_is_sky() {
    let mut room = (Vec::new(), Vec::new());
    add_box(&mut room, [-1.0; 3], [1.0; 3], 1, true);
    let whole = Facets::new(&room.0, &room.1, Sides::One).unwrap();
    let mut memory = Memory::default();
    let row = whole.from_point([0.2, 0.1, 0.3], [0.0, 0.0, 1.0], &mut memory);
    // The last is the ceiling.
    let open = Facets::new(&room.0, &room.1[..5], Sides::One).unwrap();
    let without = open.from_point([0.2, 0.1, 0.3], [0.0, 0.0, 1.0], &mut memory);
    assert!((without.sky - row.facets[5]).abs() < 1e-14 && row.sky.abs() < 1e-14);
    assert_eq!(without.facets, row.facets[..5]);
    // From outside, the inner sides are not seen.
    let outside = whole.from_point([0.0, 0.0, -3.0], [0.0, 0.0, 1.0], &mut memory);
    assert_eq!(outside.sky, 1.0);
    let nowhere = whole.from_point([f64::NAN, 0.0, 0.0], [0.0, 0.0, 1.0], &mut memory);
    assert_eq!(nowhere.sky, 1.0);
}

#[test]
fn a_facet_through_the_plane_of_that_on_which_the_point_lies_takes_one_at_most() {
    let mut room = (Vec::new(), Vec::new());
    let own = [[0.0, 1.0, -2.0], [-2.0, -1.0, 1.0], [0.0, 2.0, 0.0]];
    add(&mut room, &own);
    let other = [[-2.0, 1.0, 2.0], [0.0, 1.0, -2.0], [-2.0, -2.0, 1.0]];
    add(&mut room, &other);
    let facets = Facets::new(&room.0, &room.1, Sides::Two).unwrap();
    let (mut rng, mut memory) = (linelit_testkit::cases::rng(33), Memory::default());
    for _ in 0..1_000 {
        let (u, v) = (rng.in_range(0.0, 0.5), rng.in_range(0.0, 0.5));
        let at = |k: usize| own[0][k] + u * (own[1][k] - own[0][k]) + v * (own[2][k] - own[0][k]);
        let row = facets.from_point([0, 1, 2].map(at), [-7.0, 4.0, -2.0], &mut memory);
        assert!(row.sky >= -1e-12, "{row:?}");
    }
}
