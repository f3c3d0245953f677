//! What `hybrid` is told: by shafts and rays, and by a clock.

use crate::common::{CLUTTER, SQUARE, points, room, settings};
use linelit_integrator::{Renderer, Workspace};
use std::cell::Cell;

/// A clock that is read before and after each of seven measurements of 4 lines, of 16 lines, and of
/// the closed form, which take 1, 2 and `exact` seconds.
fn clock(exact: f64) -> impl FnMut() -> f64 {
    let (reads, now) = (Cell::new(0), Cell::new(0.0));
    move || {
        let read = reads.replace(reads.get() + 1);
        if read % 2 == 1 {
            now.set(now.get() + [1.0, 2.0, exact][read / 14 % 3]);
        }
        now.get()
    }
}

/// Shading points at which two seeds of `hybrid` with so many lines differ.
fn noisy(renderer: &Renderer<'_>, lines: u32) -> usize {
    let mut workspace = Workspace::new();
    let mut differs = |(pixel, point): &([u32; 2], _)| {
        let mut value = |seed| {
            renderer.direct(
                &settings("hybrid", lines, seed),
                point,
                *pixel,
                0,
                &mut workspace,
            )
        };
        value(1) != value(2)
    };
    points(renderer).iter().filter(|p| differs(p)).count()
}

#[test]
fn what_the_clock_says_is_what_hybrid_takes() {
    let scene = room(SQUARE, CLUTTER);
    let mut renderer = Renderer::new(&scene);
    let cost = |renderer: &Renderer<'_>| renderer.plan().lights()[0].occlusion.exact_cost;
    let table = noisy(&renderer, 8);
    assert_eq!(
        cost(&renderer).to_bits(),
        1.0_f64.to_bits(),
        "not measured yet"
    );
    // The closed form in the time of 4 lines less 12 times 1/3: none.
    renderer.calibrate(clock(2.0 / 3.0));
    assert!(
        cost(&renderer) < 1e-12 && noisy(&renderer, 8) == 0,
        "for nothing"
    );
    renderer.calibrate(clock(100.0));
    assert!(
        cost(&renderer) > 10.0 && noisy(&renderer, 8) >= table.max(1),
        "too dear"
    );
}

/// Upright slivers that fill the room between floor and light, so that a shaft keeps very many.
fn grass(blades: usize) -> String {
    let rows = blades.isqrt();
    let share = |i: usize| i as f64 / rows as f64;
    let blade = |i: usize| {
        let (x, y) = (12.4 * share(i % rows) - 6.2, 10.8 * share(i / rows) - 6.0);
        format!("{x} {y} 0.2  {} {y} 0.2  {x} {} 1.8 ", x + 0.01, y + 0.01)
    };
    let indices: String = (0..3 * blades).map(|i| format!("{i} ")).collect();
    let corners: String = (0..blades).map(blade).collect();
    format!(r#"Shape "trianglemesh" "integer indices" [ {indices} ] "point P" [ {corners} ]"#)
}

#[test]
fn a_shaft_for_few_points_is_asked_where_it_is_cheap() {
    let cost = |occluders: &str| {
        let scene = room(SQUARE, occluders);
        let renderer = Renderer::new(&scene);
        let lit = points(&renderer).len();
        let cost = renderer.plan().lights()[0].occlusion.shaft_cost;
        (cost, noisy(&renderer, 1), lit)
    };
    let (open, noisy, _) = cost("");
    assert!(open < 0.9, "{open}");
    assert_eq!(noisy, 0, "empty shafts are answered in closed form");
    let (grown, noisy, lit) = cost(&grass(1600));
    assert!(grown > 1.0, "{grown}");
    assert!(
        noisy * 2 > lit,
        "by rays, but where all are blocked: {noisy} of {lit}"
    );
}

/// Below the number from which lines past clutter are expected to have less noise than rays, there
/// are rays, in the end for the time of lines; from there on there are lines.
#[test]
fn lines_past_clutter_are_drawn_once_they_pay() {
    let scene = room(SQUARE, &grass(160_000));
    let renderer = Renderer::new(&scene);
    let occlusion = renderer.plan().lights()[0].occlusion;
    assert!(occlusion.dense, "{occlusion:?}");
    let enough = occlusion.lines_ahead.expect("much is seen").ceil();
    assert!((6.0..1e4).contains(&enough), "{enough}");
    let sent = |lines: f64| {
        let mut workspace = Workspace::new();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "few"
        )]
        let settings = settings("hybrid", lines as u32, 1);
        for (pixel, point) in &points(&renderer) {
            let _ = renderer.direct(&settings, point, *pixel, 0, &mut workspace);
        }
        let counts = workspace.take_counts().visibility;
        (counts.line_queries, counts.rays)
    };
    let (few, rays_for_few) = sent(4.0);
    let (lines, rays) = sent(enough - 1.0);
    assert_eq!((few, lines), (0, 0));
    assert!(sent(enough).0 > 0);
    // Four lines are 32 rays. Tests of lines take half as long as those of rays; their number is
    // off by √2, to be a power of two, by an eighth, to be whole for a line, and by how near the
    // number of lines is to enough.
    let for_a_point = 32.0 * rays as f64 / rays_for_few as f64;
    let as_long = 0.5 * occlusion.line_cost * (enough - 1.0);
    let ratio = for_a_point / as_long;
    let least = (enough - 1.0) / enough / std::f64::consts::SQRT_2 * 8.0 / 9.0;
    assert!(
        (least..std::f64::consts::SQRT_2).contains(&ratio),
        "{ratio}"
    );
}
