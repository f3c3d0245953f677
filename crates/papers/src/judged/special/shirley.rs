//! Variances of Shirley & Wang 1991: points by a proxy triangle, and points on the far side of a
//! sphere.

use super::Out;
use crate::judged::bench::Bench;
use crate::measured::Measured;
use anyhow::Result;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaSampler, PointTechnique as _, ProxySampler};
use linelit_samplers::{Sampler, SamplerKind};
use std::f64::consts::{PI, TAU};

/// Measures the variance of points by the proxy triangle at unit distance, relative to the variance
/// of points uniform on the area, from above and at a grazing angle. The light is a triangle of
/// side √3 around the origin; the receiver is at distance one and faces the triangle's centroid.
pub(super) fn grazing(bench: &Bench<'_>, out: &mut Out) -> Result<()> {
    let batches = bench.pick(2, 16, 64);
    let seed = bench.context.seed;
    let corner = |turn: f64| {
        let (sin, cos) = (TAU * turn).sin_cos();
        DVec3::new(cos, sin, 0.0)
    };
    // The shading point is over the middle of a side, so that it leaves the triangle's prism as it
    // sinks.
    let light = ConvexPolygon::triangle(corner(0.0), corner(1.0 / 3.0), corner(2.0 / 3.0))?;
    for (name, degrees) in [("overhead", 60.0_f64), ("grazing", 5.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let x = DVec3::new(-cos, 0.0, sin);
        let (area, proxy) = (AreaSampler::new(&light), ProxySampler::new(&light, x));
        // The cosine at the receiver, and the cosine at the light over the squared distance.
        let cosines = |y: DVec3| {
            let (to, distance) = (y - x, (y - x).length());
            (to.dot(-x).max(0.0) / distance, x.z / distance.powi(3))
        };
        // Estimate the light by both techniques, and compare their variances.
        let by_area = |u| {
            let s = area.sample(u);
            let (receiver, emitter) = cosines(s.point);
            receiver * emitter / s.pdf.value()
        };
        let by_proxy = |u| {
            let s = proxy.sample(u);
            cosines(s.point).0 / s.pdf.value()
        };
        let by_area = relative_variances(by_area, batches, seed);
        let by_proxy = relative_variances(by_proxy, batches, seed.wrapping_add(1));
        let ratio = Measured::ratio(&by_proxy, &by_area);
        out.insert(format!("proxy over area, {name}"), ratio);
    }
    Ok(())
}

/// Returns the relative variance of the estimates of each batch.
fn relative_variances(estimate: impl Fn([f64; 2]) -> f64, batches: u32, seed: u64) -> Vec<f64> {
    const BATCH: u32 = 4096;
    let numbers = Sampler::new(SamplerKind::Independent, seed);
    let batch = |k| {
        let set = numbers.points([k, 0], 0, BATCH);
        let values: Vec<f64> = (0..BATCH).map(|i| estimate(set.get_2d(i))).collect();
        let n = f64::from(BATCH);
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v / mean - 1.0).powi(2)).sum();
        squares / (n - 1.0)
    };
    (0..batches).map(batch).collect()
}

/// Computes the fraction of a sphere that a point does not see, from near and from far.
pub(super) fn unseen(_: &Bench<'_>, out: &mut Out) -> Result<()> {
    for (name, distance) in [("near", 1.2), ("far", 10.0)] {
        let share = Measured::exact(unseen_from(distance));
        out.insert(format!("far side, {name}"), share);
    }
    Ok(())
}

/// Returns the fraction of points uniform on a unit sphere that face away from a point at this
/// distance from its centre, counted over a spiral of 100,000 points.
fn unseen_from(distance: f64) -> f64 {
    const COUNT: u32 = 100_000;
    let viewer = DVec3::Z * distance;
    let faces_away = |k: u32| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(COUNT);
        let turn = f64::from(k) * PI * (3.0 - 5.0_f64.sqrt());
        let r = (1.0 - z * z).sqrt();
        let p = DVec3::new(r * turn.cos(), r * turn.sin(), z);
        (viewer - p).dot(p) <= 0.0
    };
    f64::from((0..COUNT).map(|k| u32::from(faces_away(k))).sum::<u32>()) / f64::from(COUNT)
}
