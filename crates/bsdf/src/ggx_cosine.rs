//! Microfacet reflection as a linearly transformed cosine, by a fitted table.

use crate::ggx_table::{SIZE, TABLE};
use crate::microfacet::TrowbridgeReitz;
use crate::{Fresnel, TransformedCosine};
use linelit_geometry::finite::fraction;
use linelit_geometry::{DMat3, DVec3};

impl TrowbridgeReitz {
    /// D G F/(4 cos_o) for ω_o in the local frame, as a linearly transformed cosine.
    ///
    /// The map is that of the shape without F. The albedo is that shape's times F at the cosine
    /// c̄ = 1 − ⟨(1 − ω_i·h)⁵⟩^⅕, the mean being over the shape: exact for Schlick's F.
    ///
    /// Unlike widths along x and y are those of their geometric mean α, stretched in the cosine's
    /// space by αx/α and αy/α: exact as α → 0.
    #[must_use]
    pub fn transformed_cosine(&self, wo: DVec3, fresnel: &Fresnel) -> TransformedCosine {
        let [a, b] = self.alpha();
        let alpha = (a * b).sqrt();
        let [whole, rise, m00, m20, m11, m02] = lookup(alpha.sqrt(), wo.z);
        let shape = DMat3::from_cols(
            DVec3::new(m00, 0.0, m20),
            DVec3::new(0.0, m11, 0.0),
            DVec3::new(m02, 0.0, 1.0),
        );
        // From the frame whose x axis lies towards the viewer.
        let across = DVec3::new(wo.x, wo.y, 0.0).try_normalize();
        let x = across.unwrap_or(DVec3::X);
        let turn = DMat3::from_cols(x, DVec3::new(-x.y, x.x, 0.0), DVec3::Z);
        let stretch = DMat3::from_diagonal(DVec3::new(a / alpha, b / alpha, 1.0));
        let effective = 1.0 - (rise / whole).powf(0.2);
        TransformedCosine {
            map: turn * shape * (turn.transpose() * stretch * turn),
            albedo: fresnel.at(effective) * whole,
        }
    }
}

/// The smallest roughness of the table; smaller ones are treated like it.
pub(crate) const MIN_ROUGHNESS: f64 = 0.1;

/// The albedo, its part weighted by (1 − ω_i·h)⁵, and four entries of the map, interpolated.
fn lookup(roughness: f64, cosine: f64) -> [f64; 6] {
    let cells = f64::from(u16::try_from(SIZE - 1).unwrap_or(1));
    let place = |x: f64| {
        let x = fraction(x) * cells;
        let cell = x.floor().min(cells - 1.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to SIZE − 2"
        )]
        let index = cell as usize;
        (index, x - cell)
    };
    let (i, s) = place((roughness - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS));
    let (j, t) = place((1.0 - fraction(cosine)).sqrt());
    let at = |i: usize, j: usize, k: usize| f64::from(TABLE[i * SIZE + j][k]);
    std::array::from_fn(|k| {
        (at(i, j, k) * (1.0 - t) + at(i, j + 1, k) * t) * (1.0 - s)
            + (at(i + 1, j, k) * (1.0 - t) + at(i + 1, j + 1, k) * t) * s
    })
}
