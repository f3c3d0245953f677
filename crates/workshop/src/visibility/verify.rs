//! Lines of a scene against brute force in `f64`.

use super::Workload;
use linelit_geometry::{DVec3, Margins};
use linelit_scenes::stratified_lines;
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines, brute};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// Lines a point.
const LINES: u32 = 48;

/// How lines compare with brute force.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verified {
    /// Lines compared.
    lines: usize,
    /// Lines of dense shafts among them.
    dense: usize,
    /// The largest difference of a line's visible fraction.
    largest: f64,
    /// Lines that one of the two finds wholly visible or wholly hidden, and the other not.
    misclassified: usize,
}

impl std::fmt::Display for Verified {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} lines ({} of dense shafts) against brute force: largest difference of a visible \
             fraction {:.1e}, {} misclassified",
            self.lines, self.dense, self.largest, self.misclassified
        )
    }
}

/// Compares at least `least` lines from points all over the view, 48 a point.
///
/// Brute force is spared the triangles that a plane through the shading point and a side of the
/// light, or parallel to the light, has wholly on the far side, with room for rounding.
pub(super) fn verify(occluders: &Occluders, work: &Workload<'_>, least: usize) -> Verified {
    let mut found = Verified::default();
    let (mut scratch, mut out) = (Scratch::new(), VisibleLines::new());
    let mut random = Pcg64Mcg::seed_from_u64(17);
    let count = least.div_ceil(LINES as usize).min(work.points.len()).max(1);
    for k in 0..count {
        let Some(&point) = work.points.get(k * work.points.len() / count) else {
            break;
        };
        let lines = stratified_lines(work.light.corners(), LINES, &mut || random.random());
        let query = ShaftQuery::new(point, work.light).excluding(work.exclude.clone());
        let mut shaft = occluders.shaft(query, &mut scratch);
        shaft.visible(&lines, &mut out);
        let dense = shaft.is_dense();
        let near = between(work, point);
        for (i, line) in lines.iter().enumerate() {
            let want = brute::visible(
                work.positions,
                &near,
                point,
                line,
                &(0..0),
                Margins::DEFAULT,
            );
            let want: f64 = want.iter().map(|i| i.hi - i.lo).sum();
            let got = out.fraction(i);
            found.largest = found.largest.max((got - want).abs());
            let alike = (got > 0.0) == (want > 0.0) && (got < 1.0) == (want < 1.0);
            found.misclassified += usize::from(!alike);
        }
        found.lines += lines.len();
        found.dense += if dense { lines.len() } else { 0 };
    }
    found
}

/// The triangles that may be between a point and the light.
fn between(work: &Workload<'_>, point: DVec3) -> Vec<[u32; 3]> {
    let corners = work.light.corners();
    let centre = corners.iter().sum::<DVec3>() / corners.iter().map(|_| 1.0).sum::<f64>() - point;
    let mut planes = Vec::new();
    for i in 0..corners.len() {
        let (a, b) = (corners[i] - point, corners[(i + 1) % corners.len()] - point);
        // A linear light lies in such a plane.
        let n = a.cross(b).normalize_or_zero() * f64::from(u8::from(corners.len() > 2));
        planes.push(n * n.dot(centre).signum());
    }
    let normal = (corners[1] - corners[0]).cross(corners[corners.len() - 1] - corners[0]);
    planes.push(normal.normalize_or_zero() * normal.dot(centre).signum());
    let beside = |t: &[DVec3; 3]| {
        let room = 1e-9 * t.iter().map(|v| v.abs().max_element()).fold(1.0, f64::max);
        let beyond = |n: &DVec3| t.iter().all(|v| n.dot(*v) < -room);
        planes.iter().any(beyond)
    };
    (0_u32..)
        .zip(work.triangles)
        .filter(|(id, corners)| {
            let corner = |c: u32| {
                let v = work.positions[c as usize];
                DVec3::new(v[0].into(), v[1].into(), v[2].into()) - point
            };
            !work.exclude.contains(id) && !beside(&corners.map(corner))
        })
        .map(|(_, corners)| *corners)
        .collect()
}
