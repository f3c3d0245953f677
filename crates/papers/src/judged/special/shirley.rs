//! Shirley & Wang 1991.

use super::Out;
use crate::judged::bench::Bench;
use crate::measured::Measured;
use crate::shirley_advice;
use anyhow::Result;
use linelit_geometry::DVec3;

/// The variance of points by the proxy triangle at unit distance over that of points uniform on the
/// area, from above and at a grazing angle.
pub(super) fn grazing(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let batches = bench.pick(2, 16, 64);
    for (name, degrees) in [("overhead", 60.0), ("grazing", 5.0)] {
        let gain = shirley_advice::grazing(degrees, batches, bench.context.seed)?.gain;
        let ratio = Measured::exact(1.0).over(gain);
        out.insert(format!("proxy over area, {name}"), ratio);
    }
    Ok(())
}

/// How much of a sphere a point does not see, near and far.
pub(super) fn unseen(_: &Bench<'_>, out: &mut Out) -> Result<()> {
    for (name, distance) in [("near", 1.2), ("far", 10.0)] {
        let share = Measured::exact(unseen_from(distance));
        out.insert(format!("far side, {name}"), share);
    }
    Ok(())
}

/// The share of points uniform on a sphere of radius one that face away from a point at this
/// distance from its centre: counted on a spiral of 100,000, of which none is counted twice.
fn unseen_from(distance: f64) -> f64 {
    const COUNT: u32 = 100_000;
    let viewer = DVec3::Z * distance;
    let faces_away = |k: u32| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(COUNT);
        let turn = f64::from(k) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let r = (1.0 - z * z).sqrt();
        let p = DVec3::new(r * turn.cos(), r * turn.sin(), z);
        (viewer - p).dot(p) <= 0.0
    };
    f64::from((0..COUNT).map(|k| u32::from(faces_away(k))).sum::<u32>()) / f64::from(COUNT)
}
