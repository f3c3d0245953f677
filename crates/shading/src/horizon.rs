//! Clipping a segment to a half-space through the shading point.

use linelit_geometry::{DVec3, predicates::cross};

/// A segment relative to the shading point, clipped to `k·p ≥ 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippedSegment {
    /// Its ends.
    pub p0: DVec3,
    /// Its ends.
    pub p1: DVec3,
    /// `k·p0` and `k·p1`: not negative, and exactly zero at an end that was cut.
    pub cosines: [f64; 2],
    /// What is left of the segment, as a fraction of its length: from one product, without a
    /// difference.
    pub fraction: f64,
}

/// Clips the segment to the half-space `k·p ≥ 0`; `None` where nothing of it has `k·p > 0`.
///
/// **Formula**: the crossing is `Q = (k × (p0 × p1))/(k·(p1 − p0))`, which keeps its accuracy
/// relative to itself also where it is very near the shading point; interpolating between the
/// ends has the absolute error ε|p0| there.
///
/// **Error**: a few ε of each component of Q, given exact cosines.
#[must_use]
pub fn clip_segment(p0: DVec3, p1: DVec3, k: DVec3) -> Option<ClippedSegment> {
    let (c0, c1) = (k.dot(p0), k.dot(p1));
    if c0 <= 0.0 && c1 <= 0.0 {
        return None;
    }
    if c0 >= 0.0 && c1 >= 0.0 {
        return Some(ClippedSegment { p0, p1, cosines: [c0, c1], fraction: 1.0 });
    }
    // The signs differ, so this difference adds magnitudes.
    let span = c1 - c0;
    let crossing = cross(k, cross(p0, p1)) / span;
    Some(if c0 < 0.0 {
        ClippedSegment { p0: crossing, p1, cosines: [0.0, c1], fraction: c1 / span }
    } else {
        ClippedSegment { p0, p1: crossing, cosines: [c0, 0.0], fraction: -c0 / span }
    })
}
