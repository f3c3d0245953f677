//! What a clock tells `hybrid`.

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

/// Shading points at which two seeds of `hybrid` with 8 lines differ.
fn noisy(renderer: &Renderer<'_>) -> usize {
    let mut workspace = Workspace::new();
    let mut differs = |(pixel, point): &([u32; 2], _)| {
        let mut value = |seed| {
            renderer.direct(
                &settings("hybrid", 8, seed),
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
    let table = noisy(&renderer);
    assert_eq!(
        cost(&renderer).to_bits(),
        1.0_f64.to_bits(),
        "not measured yet"
    );
    // The closed form in the time of 4 lines less 12 times 1/3: none.
    renderer.calibrate(clock(2.0 / 3.0));
    assert!(
        cost(&renderer) < 1e-12 && noisy(&renderer) == 0,
        "for nothing"
    );
    renderer.calibrate(clock(100.0));
    assert!(
        cost(&renderer) > 10.0 && noisy(&renderer) >= table.max(1),
        "too dear"
    );
}
