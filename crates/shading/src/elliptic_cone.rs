//! This module integrates over a part of an ellipse, as a diffuse surface receives it: as a sum
//! over a boundary of straight pieces and arcs. Visible regions of disks and spheres are such
//! parts.

use crate::polygon;
use linelit_elementary::{acos, atan, atan2, atanh, hypot, sin_cos};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{DVec3, EllipticCone};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// If the turns (angles about the cone's axis, in radians) of an arc's ends differ by less than
/// this, or by a whole turn up to this, their values do not decide between an empty arc and the
/// whole rim; `is_long` does. It is larger than rounding errors and smaller than any arc that
/// matters.
const CLOSE: f64 = 1e-6;

/// Computes `∫ max(0, n·ω) dω` over a part of an elliptic cone, as a sum over the part's boundary.
///
/// The boundary runs counter-clockwise about the cone's axis. It consists of straight pieces
/// ([`Self::add_segment`]) and arcs of the rim ([`Self::add_arc`]), which together are closed
/// curves, with holes clockwise. Where pieces join, their ends must be equal bit for bit, since for
/// each of them it is decided on its own which side of the horizon it is on.
///
/// **Formula**: half the sum of Lambert's `n·∫ w × dw/|w|²` over the boundary of the part above the
/// horizon. A straight piece contributes [`polygon::edge`]. For an arc, let w =
/// (a cos s, b sin s, 1) in the cone's axes, with a and b the tangents of the half angles, A² = 1 +
/// a², B² = 1 + b² and k² = a² − b². It contributes
///
/// ```text
/// ∫ (−b cos s, −a sin s, ab)/(A² cos² s + B² sin² s) ds
///   = (−b artanh(k sin s/A)/(Ak), a arctan(k cos s/B)/(Bk), ab arg(A cos s, B sin s)/(AB))
/// ```
///
/// Along the horizon the contribution is the angle from where the boundary goes below it to where
/// it comes back.
///
/// **Error**: absolute, 16 ε of the rim's angle, and 4 ε a/b for each point where pieces join or
/// meet the horizon. For a part that fills a small angle s, this is ε/s² of the part.
/// **Source**: Lambert 1760 for the sum; the arcs are elementary integrals.
///
/// ```
/// use linelit_shading::geometry::{DVec3, EllipticCone};
/// use linelit_shading::elliptic_cone::PartOfCone;
/// use std::f64::consts::PI;
/// // A disk overhead, of which the half with x > 0 is hidden.
/// let cone = EllipticCone::over(DVec3::Z * 2.0, DVec3::X, DVec3::Y).unwrap();
/// let mut part = PartOfCone::new(&cone, DVec3::Z);
/// let (back, front) = (DVec3::new(0.0, -1.0, 2.0), DVec3::new(0.0, 1.0, 2.0));
/// part.add_segment(back, front);
/// part.add_arc(front, back, false);
/// assert!((part.irradiance() - 0.5 * PI / 5.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PartOfCone<'a> {
    cone: &'a EllipticCone,
    n: DVec3,
    /// √(1 + tan²) for each half angle.
    sec: [f64; 2],
    /// The components of n along the axes.
    local: [f64; 3],
    above: Above,
    sum: f64,
    /// The first point where the boundary meets the horizon.
    first: Option<DVec3>,
}

/// The part of the rim above the horizon.
#[derive(Clone, Copy, Debug)]
enum Above {
    None,
    /// The turn of the highest point, and half the angle of the part.
    Part(f64, f64),
    All,
}

impl<'a> PartOfCone<'a> {
    /// Starts the sum for a unit normal of the surface, without any piece.
    #[must_use]
    pub fn new(cone: &'a EllipticCone, n: DVec3) -> Self {
        let [a, b] = cone.tan;
        let local = cone.axes.map(|axis| axis.dot(n));
        let rise = [local[0] * a, local[1] * b];
        let most = hypot(rise[0], rise[1]);
        let above = if local[2] >= most {
            Above::All
        } else if local[2] <= -most {
            Above::None
        } else {
            Above::Part(atan2(rise[1], rise[0]), acos(-local[2] / most))
        };
        Self {
            cone,
            n,
            sec: [(1.0 + a * a).sqrt(), (1.0 + b * b).sqrt()],
            local,
            above,
            sum: 0.0,
            first: None,
        }
    }

    /// Adds a straight piece of the boundary. It lies in the ellipse's plane, or in any other plane
    /// in which the part appears.
    pub fn add_segment(&mut self, from: DVec3, to: DVec3) {
        let [from_above, to_above] = [from, to].map(|p| self.is_up(p));
        let (mut a, mut b) = (from, to);
        match (from_above, to_above) {
            (false, false) => return,
            (true, true) => {}
            (true, false) => {
                b = self.crossing(from, to);
                self.meet_horizon(b, -1.0);
            }
            (false, true) => {
                a = self.crossing(from, to);
                self.meet_horizon(a, 1.0);
            }
        }
        self.sum += polygon::edge(a, b, self.n);
    }

    /// Adds an arc of the rim, counter-clockwise about the axis. `is_long` says whether it is more
    /// than about half of the rim; it matters only if the ends almost coincide.
    pub fn add_arc(&mut self, from: DVec3, to: DVec3, is_long: bool) {
        // A rim that is completely above the horizon, or below, needs no clipping.
        let (middle, half) = match self.above {
            Above::All => {
                self.sum += self.arc(self.turn(from), self.turn(to), is_long);
                return;
            }
            Above::None => return,
            Above::Part(middle, half) => (middle, half),
        };
        let (start, end) = (middle - half, middle + half);
        // Place both ends on the rim, measured from `start`, on the side of the horizon that each
        // is on.
        let place = |p: DVec3| {
            let on = {
                let (s, c) = self.turn(p);
                (atan2(s, c) - start).rem_euclid(TAU)
            };
            match (self.is_up(p), on <= 2.0 * half) {
                (true, true) | (false, false) => on,
                (true, false) if on > half + PI => 0.0,
                (true, false) | (false, true) if on > half => 2.0 * half,
                (true, false) => 2.0 * half,
                (false, true) => TAU,
            }
        };
        let [from_up, to_up] = [from, to].map(|p| self.is_up(p));
        let (t0, t1) = (place(from), place(to));
        let wraps = if (t1 - t0).abs() < CLOSE {
            is_long
        } else {
            t1 < t0
        };
        // Add the parts of the arc that are above the horizon.
        let [rise, set] = [start, end].map(sin_cos);
        match (from_up, to_up, wraps) {
            (true, true, false) => {
                self.sum += self.arc(self.turn(from), self.turn(to), t1 - t0 > 1.0);
            }
            (false, false, false) => {}
            (false, false, true) => self.add_whole(rise, set, half),
            (true, true, true) | (true, false, _) | (false, true, _) => {
                if from_up {
                    self.sum += self.arc(self.turn(from), set, 2.0 * half - t0 > 1.0);
                    self.meet_horizon(self.at(set), -1.0);
                }
                if to_up {
                    self.sum += self.arc(rise, self.turn(to), t1 > 1.0);
                    self.meet_horizon(self.at(rise), 1.0);
                }
            }
        }
    }

    /// Adds the whole rim.
    pub fn add_rim(&mut self) {
        match self.above {
            Above::None => {}
            Above::All => {
                let ([a, b], [sec_a, sec_b]) = (self.cone.tan, self.sec);
                self.sum += TAU * (a / sec_a) * (b / sec_b) * self.local[2];
            }
            Above::Part(middle, half) => {
                let [rise, set] = [middle - half, middle + half].map(sin_cos);
                self.add_whole(rise, set, half);
            }
        }
    }

    /// Returns the irradiance for each unit of radiance.
    #[must_use]
    pub fn irradiance(&self) -> f64 {
        nonnegative(0.5 * self.sum).min(PI * self.n.length())
    }

    /// Whether a point is above the horizon.
    fn is_up(&self, p: DVec3) -> bool {
        self.n.dot(p) > 0.0
    }

    /// Returns the point between a and b on the horizon.
    fn crossing(&self, a: DVec3, b: DVec3) -> DVec3 {
        let (ha, hb) = (self.n.dot(a), self.n.dot(b));
        a + (b - a) * (ha / (ha - hb))
    }

    /// Adds the part of the rim that is above the horizon.
    fn add_whole(&mut self, rise: (f64, f64), set: (f64, f64), half: f64) {
        self.sum += self.arc(rise, set, half > FRAC_PI_2);
        self.meet_horizon(self.at(rise), 1.0);
        self.meet_horizon(self.at(set), -1.0);
    }

    /// Adds the contribution of a point `p` at which the boundary comes above the horizon (sign 1)
    /// or goes below it (sign −1). The horizon leads from each point of the second kind to one of
    /// the first kind, so that a signed sum of angles from one fixed point is the sum over the
    /// pieces of the horizon.
    fn meet_horizon(&mut self, p: DVec3, sign: f64) {
        let first = *self.first.get_or_insert(p);
        let angle = atan2(self.n.dot(first.cross(p)), first.dot(p));
        self.sum += sign * angle;
    }

    /// Returns the sine and the cosine of the turn of a point of the rim.
    fn turn(&self, p: DVec3) -> (f64, f64) {
        let ([x, y, _], [a, b]) = (self.cone.axes, self.cone.tan);
        let (c, s) = (p.dot(x) * b, p.dot(y) * a);
        let length = hypot(c, s);
        if length > 0.0 {
            (s / length, c / length)
        } else {
            (0.0, 1.0)
        }
    }

    /// Returns the point of the rim at a turn.
    fn at(&self, sin_cos: (f64, f64)) -> DVec3 {
        let (s, c) = sin_cos;
        let ([x, y, z], [a, b]) = (self.cone.axes, self.cone.tan);
        x * (a * c) + y * (b * s) + z
    }

    /// Returns n·∫ w × dw/|w|² from one turn to another.
    fn arc(&self, from: (f64, f64), to: (f64, f64), is_long: bool) -> f64 {
        let ([a, b], [sec_a, sec_b], [nx, ny, nz]) = (self.cone.tan, self.sec, self.local);
        let k = ((a - b) * (a + b)).sqrt();
        let (ka, kb) = (k / sec_a, k / sec_b);
        // Form artanh(k s/A)/(Ak) and arctan(k c/B)/(Bk), by their series where k is almost zero.
        let along = |s: f64| match ka > 1e-8 {
            true => atanh(ka * s) / (sec_a * k),
            false => s / (sec_a * sec_a),
        };
        let across = |c: f64| match kb > 1e-8 {
            true => atan(kb * c) / (sec_b * k),
            false => c / (sec_b * sec_b),
        };
        // Measure the turn from end to end.
        let ((s0, c0), (s1, c1)) = (from, to);
        let ([x0, y0], [x1, y1]) = ([sec_a * c0, sec_b * s0], [sec_a * c1, sec_b * s1]);
        let mut turned = atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1);
        if turned < -CLOSE || (turned < CLOSE && is_long) {
            turned += TAU;
        }
        let around = (a / sec_a) * (b / sec_b) * turned;
        nz * around - nx * b * (along(s1) - along(s0)) + ny * a * (across(c1) - across(c0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;

    fn ellipse([c, u, v]: [DVec3; 3], turn: f64) -> DVec3 {
        let (s, t) = turn.sin_cos();
        c + u * t + v * s
    }

    /// Arcs without length, and all but without a gap, whichever side of each other rounding has
    /// put their ends.
    #[test]
    fn arcs_whose_ends_meet_are_nothing_or_all() {
        let shape = [DVec3::Z, DVec3::X, DVec3::Y * 0.5];
        let cone = EllipticCone::over(shape[0], shape[1], shape[2]).expect("a cone");
        for n in [DVec3::Z, DVec3::X, DVec3::new(0.8, 0.0, -0.6)] {
            let mut whole = PartOfCone::new(&cone, n);
            whole.add_rim();
            for k in 0..40 {
                let turn = f64::from(k) * 0.17;
                for off in [-1e-15, 0.0, 1e-15] {
                    let ends = [turn, turn + off].map(|turn| ellipse(shape, turn));
                    for (is_long, want) in [(false, 0.0), (true, whole.irradiance())] {
                        let mut part = PartOfCone::new(&cone, n);
                        part.add_arc(ends[0], ends[1], is_long);
                        let got = part.irradiance();
                        assert_close!(got, want, 1e-13, "rounding");
                    }
                }
            }
        }
    }
}
