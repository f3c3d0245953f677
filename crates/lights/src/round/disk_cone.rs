//! This module samples disks by solid angle, through the elliptic cone of directions that meet a
//! disk.

use super::disk::DiskArea;
use crate::{Disk, Pdf, Pieces, PointSample, PointTechnique, SolidAngle, sample_linear};
use core::f64::consts::{FRAC_PI_2, PI};
use linelit_elementary::{atan2, hypot, sin_cos};
use linelit_geometry::finite::{BELOW_ONE, below_one, fraction};
use linelit_geometry::{DVec3, Frame, predicates};

/// The number of pieces of a quarter turn on which the density of the turn is linear.
const PIECES: usize = 8;

/// Samples a disk nearly uniformly in solid angle, with the exact density.
///
/// **Formula**: a disk is seen from x as an elliptic cone about the bisector of the nearest and the
/// farthest point of its rim (Guillén et al. 2017, "Area-preserving parameterizations for spherical
/// ellipses"). With a ≥ b the tangents of its half angles, `A = √(1 + a²)`, `B = √(1 + b²)`, and s
/// the turn for which a point of the rim lies along `(aB cos s, bA sin s)`,
///
/// ```text
/// dΩ = ab/(AB + p(s)) ds,    p(s) = √(B² cos² s + A² sin² s)
/// ```
///
/// The integral of this is elliptic, but the integrand varies by less than a factor of two for any
/// disk. Therefore s is drawn by its linear interpolation between eighths of a quarter turn, and `1
/// − cos θ` uniformly up to the rim. The density that is returned is the interpolated one.
///
/// **Units**: densities in 1/sr. **Domain**: any x outside the disk's plane. The density is zero in
/// the plane, and within its rounding: where the cone is 1e14 times as wide as high, and nearer to
/// the plane than 1e-150 radii. Both sides are sampled. **Accuracy**: the density is within 1 % of
/// 1/Ω. It agrees with the distribution of the samples to a few ε times 1 + R/h, where h is the
/// distance from the plane.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{Disk, DiskCone, PointTechnique};
/// let disk = Disk { center: DVec3::new(0.0, 0.0, 3.0), normal: DVec3::Z, radius: 4.0 };
/// let cone = DiskCone::new(&disk, DVec3::ZERO);
/// // On the axis the cone is circular: Ω = 2π (1 − h/√(h² + R²)).
/// let s = cone.sample([0.3, 0.8]);
/// assert!((1.0 / s.pdf.value() / (2.0 * std::f64::consts::PI * (1.0 - 0.6)) - 1.0).abs() < 1e-14);
/// let u = cone.invert(s.point).unwrap();
/// assert!((u[0] - 0.3).abs() < 1e-14 && (u[1] - 0.8).abs() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DiskCone {
    disk: Disk,
    x: DVec3,
    /// The vector from x to the centre, and its component along the disk's normal.
    to: DVec3,
    along: f64,
    /// The axes of the cone: along a, along b, and its own axis.
    axes: [DVec3; 3],
    /// The tangents of the half angles, and √(1 + tan²).
    tan: [f64; 2],
    sec: [f64; 2],
    /// The values of dΩ/ds at the ends of the pieces of a quarter turn; zero in the disk's plane.
    density: [f64; PIECES + 1],
    pieces: Pieces,
}

/// A cone whose ratio of height to width is below this number counts as the plane itself: heights
/// are differences of coordinates, whose rounding is of this size, and so is the rounding of the
/// directions of samples.
const FLAT: f64 = 32.0 * f64::EPSILON;

/// Returns the sine and the cosine at the end of a piece.
#[allow(clippy::cast_precision_loss, reason = "few pieces")]
fn quarter(k: usize) -> (f64, f64) {
    sin_cos(k as f64 * (FRAC_PI_2 / PIECES as f64))
}

impl DiskCone {
    /// Sets the technique up for one light and shading point.
    #[must_use]
    pub fn new(disk: &Disk, x: DVec3) -> Self {
        let to = disk.center - x;
        let r = disk.radius;
        let along = to.dot(disk.normal);
        let (h, lateral) = (along.abs(), to - disk.normal * along);
        let rho = predicates::length(lateral);
        // Find the nearest and the farthest point of the rim, and the tangent of half the angle
        // between them by the form that does not cancel.
        let (near, far) = (hypot(rho - r, h), hypot(rho + r, h));
        let product = near * far;
        let dot = (rho - r) * (rho + r) + h * h;
        let b = if dot > 0.0 {
            2.0 * r * h / (product + dot)
        } else {
            (product - dot) / (2.0 * r * h)
        };
        let sec_b = (1.0 + b * b).sqrt();
        let a = r * sec_b / product.sqrt();
        let outwards =
            predicates::normalize(lateral).unwrap_or_else(|| Frame::from_normal(disk.normal).x);
        // The axis bisects these two directions, in the plane of symmetry.
        let direction =
            |offset: f64, length: f64| (disk.normal * along + outwards * (rho + offset)) / length;
        let sum = direction(r, far) + direction(-r, near);
        let fallback = disk.normal * along.signum();
        let axis = sum.try_normalize().unwrap_or(fallback);
        let beside = disk.normal.cross(outwards);
        let mut out = Self {
            disk: *disk,
            x,
            to,
            along,
            axes: [beside, axis.cross(beside), axis],
            tan: [a, b],
            sec: [(1.0 + a * a).sqrt(), sec_b],
            density: [0.0; PIECES + 1],
            pieces: Pieces::new(core::iter::empty()),
        };
        // Tabulate the density of the turn.
        if h > 0.0 && r > 0.0 && b > FLAT * a && a.is_finite() && b.is_finite() {
            out.density = core::array::from_fn(|k| out.per_turn(out.rim(quarter(k))));
            let width = 0.5 * FRAC_PI_2 / PIECES as f64;
            let density = out.density;
            out.pieces = Pieces::new((0..PIECES).map(|k| width * (density[k] + density[k + 1])));
        }
        out
    }

    /// Returns `∫ ω dΩ` over the cone, in sr. A surface with the unit normal n receives from the
    /// disk, with radiance one, n times this vector as irradiance, if the whole disk is above its
    /// horizon.
    ///
    /// **Formula**: `π ab/(AB)` along the axis, about which the cone is symmetric in two planes.
    /// The vector is zero where the density of samples is. **Error**: a few ε times 1 + R/h.
    #[must_use]
    pub fn vector_irradiance(&self) -> DVec3 {
        if !self.pieces.is_usable() {
            return DVec3::ZERO;
        }
        let sines = (self.tan[0] / self.sec[0]) * (self.tan[1] / self.sec[1]);
        self.axes[2] * (PI * sines)
    }

    /// Returns p(s).
    fn rim(&self, sin_cos: (f64, f64)) -> f64 {
        hypot(self.sec[1] * sin_cos.1, self.sec[0] * sin_cos.0)
    }

    /// Returns dΩ/ds.
    fn per_turn(&self, p: f64) -> f64 {
        self.tan[0] * self.tan[1] / (self.sec[0] * self.sec[1] + p)
    }

    /// Returns 1 − cos θ at the rim, and the direction of the rim across the axis.
    #[inline(always)]
    fn reach(&self, sin_cos: (f64, f64), p: f64) -> (f64, [f64; 2]) {
        let (s, c) = sin_cos;
        let ([a, b], [sec_a, sec_b]) = (self.tan, self.sec);
        let across = [a * sec_b * c / p, b * sec_a * s / p];
        let tan = hypot(across[0], across[1]);
        let q = sec_a * sec_b / p;
        (tan * tan / (q * (1.0 + q)), across.map(|x| x / tan))
    }

    /// Returns the density of the turn at a position in a piece, over all four quarters.
    fn turn_density(&self, piece: usize, place: f64) -> f64 {
        let [a, b] = [self.density[piece], self.density[piece + 1]];
        (a + (b - a) * place) / (4.0 * self.pieces.total())
    }

    /// Returns the point where a direction meets the disk, moved onto the disk if rounding at
    /// grazing directions has left it outside.
    #[inline(always)]
    fn hit(&self, direction: DVec3) -> DVec3 {
        let n = self.disk.normal;
        let v = direction * (self.along / direction.dot(n)) - self.to;
        // Do it twice: for a distant disk, the rest along n that rounding leaves may be larger than
        // the disk.
        let v = v - n * v.dot(n);
        let v = v - n * v.dot(n);
        let r = predicates::length(v);
        let scale = if r > self.disk.radius {
            self.disk.radius / r
        } else {
            1.0
        };
        self.disk.center + v * scale
    }

    /// Returns the random numbers that give a point, and the density there.
    fn locate(&self, point: DVec3) -> Option<([f64; 2], f64)> {
        DiskArea::new(&self.disk).invert(point)?;
        if !self.pieces.is_usable() {
            return None;
        }
        let v = point - self.x;
        let [x, y, z] = self.axes.map(|axis| v.dot(axis));
        let ([a, b], [sec_a, sec_b]) = (self.tan, self.sec);
        // Find the turn by tan s = (B/A) tan t with (cos t, sin t) along (x/a, y/b).
        let (ps, pc) = (y.abs() * sec_b * a, x.abs() * sec_a * b);
        let turn = if ps > 0.0 || pc > 0.0 {
            atan2(ps, pc)
        } else {
            0.0
        };
        // Find its piece, and the random number for it.
        let scaled = turn * (PIECES as f64 / FRAC_PI_2);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and PIECES"
        )]
        let piece = (scaled as usize).min(PIECES - 1);
        #[allow(clippy::cast_precision_loss, reason = "few pieces")]
        let place = (scaled - piece as f64).clamp(0.0, 1.0);
        let [d0, d1] = [self.density[piece], self.density[piece + 1]];
        let share = place * (2.0 * d0 + (d1 - d0) * place) / (d0 + d1);
        let within = self.pieces.unpick(piece, share);
        let u = match (x >= 0.0, y >= 0.0) {
            (true, true) => within,
            (false, true) => 2.0 - within,
            (false, false) => 2.0 + within,
            (true, false) => 4.0 - within,
        };
        // Compare 1 − cos θ with its value at the rim.
        let sc = sin_cos(turn);
        let p = self.rim(sc);
        let (k, _) = self.reach(sc, p);
        let (across, r) = (x * x + y * y, v.length());
        let m = if z > 0.0 {
            across / (r * (r + z))
        } else {
            1.0 - z / r
        };
        let numbers = [0.25 * u, m / k].map(below_one);
        let density = self.turn_density(piece, place) / self.per_turn(p);
        Some((numbers, density))
    }
}

impl PointTechnique for DiskCone {
    type Measure = SolidAngle;

    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        if !self.pieces.is_usable() {
            return PointSample::none(self.disk.center);
        }
        // The turn is continuous in u₀: every second quarter runs backwards, as the mirror image of
        // a quarter that runs forwards.
        let scaled = 4.0 * u[0];
        let (within, [sx, sy]) = match scaled {
            t if t < 1.0 => (t, [1.0, 1.0]),
            t if t < 2.0 => (2.0 - t, [-1.0, 1.0]),
            t if t < 3.0 => (t - 2.0, [-1.0, -1.0]),
            t => (4.0 - t, [1.0, -1.0]),
        };
        // `pick` treats negative numbers (u₀ outside [0, 1)) and NaN as 0.
        let within = if within > BELOW_ONE {
            BELOW_ONE
        } else {
            within
        };
        let (piece, share) = self.pieces.pick(within);
        let place = sample_linear(share, self.density[piece], self.density[piece + 1]);
        #[allow(clippy::cast_precision_loss, reason = "few pieces")]
        let turn = (piece as f64 + place) * (FRAC_PI_2 / PIECES as f64);
        // Draw 1 − cos θ uniformly up to the rim.
        let (s, c) = sin_cos(turn);
        let p = self.rim((s, c));
        let (k, across) = self.reach((s, c), p);
        let m = fraction(u[1]) * k;
        let sine = (m * (2.0 - m)).sqrt();
        let direction = self.axes[0] * (sine * sx * across[0])
            + self.axes[1] * (sine * sy * across[1])
            + self.axes[2] * (1.0 - m);
        let density = self.turn_density(piece, place) / self.per_turn(p);
        PointSample::at(self.hit(direction), Pdf::new(density))
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        self.locate(point)
            .map_or(Pdf::ZERO, |(_, density)| Pdf::new(density))
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        self.locate(point).map(|(numbers, _)| numbers)
    }
}
