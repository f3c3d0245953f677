//! This module samples directions towards a disk by a linearly transformed cosine (LTC).

use crate::{Disk, Pdf, SolidAngle};
use core::f64::consts::{PI, TAU};
use linelit_elementary::{atan2, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DMat3, DVec3, EllipticCone, Frame};

/// The smallest tangent of a half angle of the cone into which M⁻¹ maps the disk's directions, and
/// the smallest ratio of its two tangents. There is no sampler below it.
const LEAST: f64 = 1e-6;

/// Samples the directions in which a disk is seen, by a linearly transformed cosine (LTC).
///
/// **Formula**: M⁻¹ maps the directions to a cone over an ellipse; a and b are the tangents of its
/// half angles. A further linear map makes the cone circular about z, with the tangent √(ab), and
/// directions in it are drawn by projected solid angle. With ω a direction, N both maps combined
/// and c = N⁻¹ω, the density is
///
/// ```text
/// c.z |det N⁻¹|/(|c|⁴ π sin² θ),    tan² θ = ab
/// ```
///
/// Where the disk covers the whole lobe this is the LTC itself, and where the disk is small it is
/// uniform in the solid angle.
///
/// **Domain**: M maps cosine space, in which z is the axis of the cosine, to the world. Directions
/// that M⁻¹ maps below the horizon are drawn as well. There is no sampler for a disk that is seen
/// from its plane, or for a cone with a tangent below 1e-6, where directions would have too few
/// digits.
///
/// ```
/// use linelit_lights::geometry::{DMat3, DVec3};
/// use linelit_lights::{Disk, TransformedCone};
/// let disk = Disk { center: DVec3::Z, normal: DVec3::Z, radius: 0.5 };
/// // A lobe a fifth as wide as the cosine.
/// let map = DMat3::from_diagonal(DVec3::new(0.2, 0.2, 1.0));
/// let cone = TransformedCone::new(&disk, DVec3::ZERO, map).unwrap();
/// let (direction, pdf) = cone.sample([0.3, 0.7]);
/// assert!((cone.pdf(direction).value() / pdf.value() - 1.0).abs() < 1e-13);
/// assert!((cone.invert(direction)[1] - 0.7).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TransformedCone {
    /// The map N.
    map: DMat3,
    inverse: DMat3,
    /// sin² θ.
    square: f64,
    /// |det N⁻¹|/(π sin² θ).
    scale: f64,
    integral: f64,
}

impl TransformedCone {
    /// Sets the technique up for one light, the shading point `x` and a map from cosine space to
    /// the world; `None` outside the domain.
    #[must_use]
    pub fn new(disk: &Disk, x: DVec3, map: DMat3) -> Option<Self> {
        let to_cosine = map.inverse();
        let determinant = map.determinant().abs();
        let frame = Frame::from_normal(disk.normal);
        // Find the elliptic cone of the image.
        let [u, v] = [frame.x, frame.y].map(|axis| to_cosine * (axis * disk.radius));
        let cone = EllipticCone::over(to_cosine * (disk.center - x), u, v)?;
        let ([a, b], [first, second, axis]) = (cone.tan, cone.axes);
        if !(b > LEAST && b > LEAST * a) {
            return None;
        }
        // Add the map that makes the cone circular; its determinant is one.
        let tan = (a * b).sqrt();
        let [wider, narrower] = [a / tan, b / tan];
        let columns = DMat3::from_cols(first * wider, second * narrower, axis);
        let rows = DMat3::from_cols(first / wider, second / narrower, axis).transpose();
        let square = a * b / (1.0 + a * b);
        // The product `map * columns` has the determinant of `map`, and `square` is sin² of the
        // half angle of the circular cone; the density there is the cosine over π sin².
        let scale = 1.0 / (determinant * PI * square);
        let inverse = rows * to_cosine;
        let usable = scale > 0.0 && scale.is_finite() && inverse.is_finite();
        let sines = (a * b) / ((1.0 + a * a) * (1.0 + b * b)).sqrt();
        usable.then_some(Self {
            map: map * columns,
            inverse,
            square,
            scale,
            integral: fraction(axis.z * sines),
        })
    }

    /// Returns the integral of the LTC over the disk, from 0 to 1, if the cone into which M⁻¹ maps
    /// the disk is completely above the horizon; an approximation where the horizon cuts it.
    #[must_use]
    pub const fn about_integral(&self) -> f64 {
        self.integral
    }

    /// Returns the integral sin² θ of the cosine over a circular cone about z with tan² θ = ab,
    /// where a and b are the tangents of the half angles of the cone into which M⁻¹ maps the disk's
    /// directions. It is close to one where the disk extends into the tails of the lobe.
    #[must_use]
    pub const fn coverage(&self) -> f64 {
        self.square
    }

    /// Returns a unit direction for two random numbers, and its density.
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> (DVec3, Pdf<SolidAngle>) {
        let (s, c) = sin_cos(TAU * u[0]);
        let square = self.square * fraction(u[1]);
        let sine = square.sqrt();
        let z = (1.0 - square).sqrt();
        let to_light = self.map * DVec3::new(sine * c, sine * s, z);
        let length = to_light.length();
        let cube = length * length * length;
        (to_light / length, Pdf::new(self.scale * z * cube))
    }

    /// Returns the density of a unit direction in which the disk is seen.
    #[must_use]
    pub fn pdf(&self, direction: DVec3) -> Pdf<SolidAngle> {
        let c = self.inverse * direction;
        let square = c.length_squared();
        Pdf::new(self.scale * c.z / (square * square))
    }

    /// Returns the random numbers that give a direction in which the disk is seen.
    #[must_use]
    pub fn invert(&self, direction: DVec3) -> [f64; 2] {
        let c = self.inverse * direction;
        let across = c.x * c.x + c.y * c.y;
        let turn = atan2(c.y, c.x) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        [turn, across / (c.length_squared() * self.square)].map(below_one)
    }
}
