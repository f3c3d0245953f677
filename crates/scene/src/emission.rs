//! The emission of shapes: its description in a scene ([`EmissionSpec`]), which is constant or a
//! texture, and the texture of one area light ([`EmissionMap`]).

use crate::footprint::Footprint;
use crate::texture::Texture;
use linelit_geometry::{DVec2, DVec3};
use linelit_lights::Emission;
use std::sync::Arc;

/// The emission of a shape, as a scene describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionSpec {
    /// The radiance in W/(m²·sr); with `power`, only its colour counts.
    pub radiance: DVec3,
    /// Whether both sides emit, instead of the outside alone.
    pub two_sided: bool,
    /// pbrt-v4's `power` Φ, by which the radiance is `radiance` times Φ/(π × area × sides).
    pub power: Option<f64>,
    /// The texture that is a factor over the surface: an index into the builder's list.
    pub map: Option<u32>,
    /// The profile that is a factor by direction: an index into the builder's list.
    pub profile: Option<u32>,
}

impl EmissionSpec {
    /// Creates an emission of constant radiance on the outside.
    #[must_use]
    pub const fn one_sided(radiance: DVec3) -> Self {
        Self {
            radiance,
            two_sided: false,
            power: None,
            map: None,
            profile: None,
        }
    }

    /// Creates an emission of constant radiance on the sides on which this emission has light.
    pub(crate) const fn emission(&self, radiance: DVec3) -> Emission {
        let two_sided = self.two_sided;
        Emission {
            radiance,
            two_sided,
        }
    }

    /// Returns the radiance of a surface of this area (m²), in W/(m²·sr): with a power Φ,
    /// `radiance` times Φ/(π A) for one side that emits, and half of that for two.
    pub(crate) fn radiance_over(&self, area: f64) -> DVec3 {
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        let factor = self
            .power
            .map(|p| p / (std::f64::consts::PI * sides * area));
        factor.map_or(self.radiance, |factor| self.radiance * factor)
    }
}

/// The textured emission of an area light. The [`linelit_lights::Emission`] of the light has the
/// mean radiance over the light.
#[derive(Clone, Debug)]
pub struct EmissionMap {
    /// The radiance where the texture is one, in W/(m²·sr).
    pub radiance: DVec3,
    /// The factor over the surface, as a texture over the coordinates of its triangles
    /// ([`crate::Surface::uv`]).
    pub factor: Arc<Texture>,
    /// The texture coordinates over the plane of the light.
    pub coordinates: PlaneUv,
}

/// Texture coordinates over a plane, as an affine function of the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneUv {
    origin: DVec3,
    at_origin: DVec2,
    /// The gradients of u and v along the plane.
    gradients: [DVec3; 2],
}

impl PlaneUv {
    /// Creates the affine function with these values at the corners of a triangle; a constant if
    /// the triangle has no area.
    #[must_use]
    pub fn new([p, q, r]: [DVec3; 3], uv: [DVec2; 3]) -> Self {
        let (e, f) = (q - p, r - p);
        let normal = e.cross(f);
        let square = normal.length_squared();
        // The dual basis of the edges.
        let (along_e, along_f) = (f.cross(normal) / square, normal.cross(e) / square);
        let (a, b) = (uv[1] - uv[0], uv[2] - uv[0]);
        let gradients = [a.x * along_e + b.x * along_f, a.y * along_e + b.y * along_f];
        Self {
            origin: p,
            at_origin: uv[0],
            gradients: gradients.map(|g| if g.is_finite() { g } else { DVec3::ZERO }),
        }
    }

    /// Returns the same coordinates over the plane after the plane has moved by a vector.
    pub(crate) fn moved(self, by: DVec3) -> Self {
        let origin = self.origin + by;
        Self { origin, ..self }
    }

    /// Returns the texture coordinates of a point of the plane.
    #[must_use]
    pub fn at(&self, point: DVec3) -> DVec2 {
        self.at_origin + self.change(point - self.origin)
    }

    /// Returns the change of the texture coordinates along a vector in the plane.
    pub(crate) fn change(&self, along: DVec3) -> DVec2 {
        DVec2::from(self.gradients.map(|gradient| gradient.dot(along)))
    }

    /// Returns the largest change of a texture coordinate over a distance of one in the plane.
    pub(crate) fn steepness(&self) -> f64 {
        let [u, v] = self.gradients.map(DVec3::length_squared);
        u.max(v).sqrt()
    }
}

impl EmissionMap {
    /// Returns the radiance at texture coordinates, or over a footprint.
    pub fn evaluate(&self, at: impl Into<Footprint>) -> DVec3 {
        (self.radiance * self.factor.evaluate(at)).max(DVec3::ZERO)
    }

    /// Returns the radiance at a point of the light.
    #[must_use]
    pub fn at(&self, point: DVec3) -> DVec3 {
        self.evaluate(self.coordinates.at(point))
    }

    /// Returns the number of texels along a vector in the plane of the light, on the finest image
    /// of the texture; zero without images.
    #[must_use]
    pub fn texels(&self, along: DVec3) -> f64 {
        texels(&self.factor, self.coordinates.change(along))
    }
}

/// Returns the number of texels along a change of coordinates, on the finest image of a texture;
/// zero without images.
fn texels(texture: &Texture, change: DVec2) -> f64 {
    let mut most = 0.0_f64;
    texture.for_each_image(&mut |image| {
        let (width, height) = (image.data.width(), image.data.height());
        let size = DVec2::new(f64::from(width), f64::from(height));
        most = most.max((image.mapping.scale * change * size).length());
    });
    most
}

/// The smallest and the largest number of parts that each edge of a triangle is divided into when
/// the mean of a texture over the triangle is computed.
const PARTS: [f64; 2] = [2.0, 128.0];

/// The number of parts of an edge for each texel along it. A filtered image is smooth only within
/// texels; with eight parts, the mean over some 4 texels has an error of 2e-4 of their contrast
/// (1e-2 with one part).
const PARTS_OF_TEXEL: f64 = 8.0;

/// Returns the mean of a texture over a triangle of texture coordinates: of the values at the
/// centres of n² equal triangles. The number n is eight for each texel along the longest edge, but
/// between 2 and 128, and n² is at most `budget` or 4, whichever is more.
///
/// ```text
///   |\
///   | \          n = 2: the row at the bottom has two upright parts
///   |__\         and, between them, one that is turned by half a turn
///   |\ |\
///   | \| \
///   |__|__\
/// ```
pub(crate) fn mean(texture: &Texture, uv: [DVec2; 3], budget: f64) -> DVec3 {
    if let Some(value) = texture.as_constant() {
        return value;
    }
    // Choose the number of parts along an edge.
    let edge = |k: usize| texels(texture, uv[(k + 1) % 3] - uv[k]);
    let texels = (0..3).map(edge).fold(1.0, f64::max);
    let most = PARTS[1].min(budget.sqrt()).max(PARTS[0]);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between the bounds"
    )]
    let n = (PARTS_OF_TEXEL * texels).ceil().clamp(PARTS[0], most) as u32;
    // Add up the values at the centres of all parts.
    let step = 1.0 / f64::from(n);
    let at = |a: f64, b: f64| {
        let (b1, b2) = (a * step, b * step);
        texture.evaluate(uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2)
    };
    let mut sum = DVec3::ZERO;
    for j in 0..n {
        for i in 0..n - j {
            let (a, b) = (f64::from(i), f64::from(j));
            // Add the upright triangle of this cell, and the turned one if it is inside the whole
            // triangle.
            sum += at(a + 1.0 / 3.0, b + 1.0 / 3.0);
            if i + 1 < n - j {
                sum += at(a + 2.0 / 3.0, b + 2.0 / 3.0);
            }
        }
    }
    sum / (f64::from(n) * f64::from(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImageData, ImageTexture, Wrap};

    #[test]
    fn the_mean_of_a_ramp_is_its_middle() {
        let pixels = (0..=255).map(|i| [i; 3]).collect();
        let data = ImageData::new(256, 1, pixels, false).unwrap();
        let ramp = Texture::Image(Arc::new(ImageTexture {
            wrap: [Wrap::Clamp; 2],
            ..ImageTexture::new(data.into())
        }));
        // Linear inside: (256 u − 1/2)/255, whose mean is that at the centroid, u = 0.4.
        let uv = [
            DVec2::new(0.2, 0.0),
            DVec2::new(0.8, 0.0),
            DVec2::new(0.2, 1.0),
        ];
        let got = mean(&ramp, uv, 1e6).x;
        let want = (256.0 * 0.4 - 0.5) / 255.0;
        // Sums of 2^14 values of about one half.
        assert!((got - want).abs() < 1e-11, "{got} {want}");
    }
}
