//! What shapes emit: the same everywhere, or a texture over them.

use crate::texture::Texture;
use linelit_geometry::{DVec2, DVec3};
use std::sync::Arc;

/// What a light-emitting shape emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EmissionSpec {
    /// Radiance, or with `power` its colour.
    pub(crate) radiance: DVec3,
    pub(crate) two_sided: bool,
    /// pbrt-v4's `power`: π × area × sides × (radiance of a unit `L`).
    pub(crate) power: Option<f64>,
    /// A factor over the surface: an index into the builder's list.
    pub(crate) map: Option<u32>,
}

impl EmissionSpec {
    /// The same radiance everywhere, on the outside.
    pub(crate) const fn one_sided(radiance: DVec3) -> Self {
        Self {
            radiance,
            two_sided: false,
            power: None,
            map: None,
        }
    }
}

/// Textured emission of an area light, whose [`linelit_lights::Emission`] is the mean over it.
#[derive(Clone, Debug)]
pub struct EmissionMap {
    /// Radiance where the texture is one, W/(m²·sr).
    pub radiance: DVec3,
    /// The factor over the surface, by the texture coordinates of its triangles
    /// ([`crate::Surface::uv`]).
    pub factor: Arc<Texture>,
}

impl EmissionMap {
    /// The radiance at texture coordinates.
    pub fn evaluate(&self, uv: DVec2) -> DVec3 {
        (self.radiance * self.factor.evaluate(uv)).max(DVec3::ZERO)
    }
}

/// Fewest and most parts that the edges of a triangle are cut into to take a mean.
const PARTS: [f64; 2] = [2.0, 128.0];

/// The mean of a texture over a triangle of texture coordinates: at the centres of n² equal parts,
/// n the number of texels along its longest edge, within bounds that keep `budget` parts a
/// triangle.
pub(crate) fn mean(texture: &Texture, uv: [DVec2; 3], budget: f64) -> DVec3 {
    if let Some(value) = texture.as_constant() {
        return value;
    }
    let mut texels = 1.0_f64;
    texture.for_each_image(&mut |image| {
        let size = DVec2::new(
            f64::from(image.data.width()),
            f64::from(image.data.height()),
        );
        for k in 0..3 {
            let edge = image.mapping.scale * (uv[(k + 1) % 3] - uv[k]);
            texels = texels.max((edge * size).length());
        }
    });
    let most = PARTS[1].min(budget.sqrt()).max(PARTS[0]);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between the bounds"
    )]
    let n = texels.ceil().clamp(PARTS[0], most) as u32;
    let step = 1.0 / f64::from(n);
    let at = |a: f64, b: f64| {
        let (b1, b2) = (a * step, b * step);
        texture.evaluate(uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2)
    };
    let mut sum = DVec3::ZERO;
    for j in 0..n {
        for i in 0..n - j {
            let (a, b) = (f64::from(i), f64::from(j));
            // A part that stands, and the one beside it that hangs.
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
    use crate::{ImageData, ImageTexture, UvMapping, Wrap};

    #[test]
    fn the_mean_of_a_ramp_is_its_middle() {
        let pixels = (0..=255).map(|i| [i; 3]).collect();
        let ramp = Texture::Image(Arc::new(ImageTexture {
            data: ImageData::new(256, 1, pixels, false).unwrap().into(),
            mapping: UvMapping::IDENTITY,
            wrap: [Wrap::Clamp; 2],
            scale: 1.0,
            invert: false,
            filename: String::new(),
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
