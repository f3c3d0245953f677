//! What is timed.

use linelit_geometry::{DVec3, Segment};
use linelit_testkit::rng::SplitMix64;

/// Segments at once.
pub(crate) const COUNT: usize = 512;

/// Ordinary segments above the origin.
pub(crate) fn segments() -> Vec<Segment> {
    let mut rng = SplitMix64::new(11);
    let mut v = |a: f64, b: f64| rng.in_range(a, b);
    (0..COUNT)
        .map(|_| {
            let p = DVec3::new(v(-2.0, 2.0), v(-2.0, 2.0), v(1.0, 3.0));
            Segment::new(p, p + DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), 0.0))
        })
        .collect()
}
