//! This module approximates microfacet reflection by a linearly transformed cosine (LTC), from
//! tables of fits.
//!
//! Let α be the roughness, and c and s the cosine and sine of ω_o. A cell (p, q, r) of the 64 × 64
//! table over √α and c (1 + α)/(c + α) is the map
//!
//! ```text
//! M = | α p/(c + α)²    0    −r s/(c + α) |
//!     |      0         α q        0       |
//!     |      0          0         1       |
//! ```
//!
//! in the frame whose x axis points towards the viewer. For a narrow lobe, which is exactly an LTC,
//! p and q are 2 and r is 1. Since p and q are positive, every map between cells is invertible. The
//! third row makes the horizon of the lobe the horizon of the surface, so that the density is
//! positive above it and integrates to one there. Heitz et al. leave that entry free: their lobes
//! fit a little better, but are zero on a part of the hemisphere.
//!
//! **Fit**: `cargo xtask fit-ltc` minimises the divergence ∫ g ln(g/p) dω of Kullback and Leibler
//! from the reflection g = f cos/albedo. A sample of p has the weight g/p, so that directions in
//! which p is too small cost most. The squared difference would allow p to be almost zero in the
//! tails, and the variance of g/p would sacrifice the peak at grazing angles to the tails. The
//! error of the fits is in `docs/accuracy-ltc.md`.
//!
//! **Source**: Heitz, Dupuy, Hill & Neubelt 2016.
#![allow(
    clippy::disallowed_types,
    reason = "the tables are kept in single precision"
)]

use crate::lobe::by_cosine;
use crate::microfacet::TrowbridgeReitz;
use crate::{Fresnel, LtcLobe};
use linelit_elementary::hypot;
use linelit_geometry::finite::fraction;
use linelit_geometry::{DMat3, DVec3};

/// The number of cells along each axis.
const SIZE: usize = 64;

/// The range of α in the tables; α outside is clamped. pbrt-v3's roughness of one is 1.62.
const ALPHAS: [f64; 2] = [TrowbridgeReitz::MIN_ALPHA, 1.69];

/// The fits to one model: cells by α and then cosine, as single-precision numbers, little-endian.
pub(crate) struct Fits {
    /// For each cell, the three numbers p, q and r from which the LTC's map is made.
    maps: &'static [u8; SIZE * SIZE * 12],
    /// The albedo, and the excess of 1 − ⟨(1 − ω_i·h)⁵⟩^⅕ over c, where the mean is over the lobe.
    albedos: &'static [u8; SIZE * SIZE * 8],
}

/// The fits to D G/(4 cos_o), the reflection of a rough mirror.
pub(crate) static MASKED: Fits = Fits {
    maps: include_bytes!("fits/masked.maps"),
    albedos: include_bytes!("fits/masked.albedos"),
};

/// The fits to D cos_i/(4 ω_i·h max(cos_i, cos_o)), the reflection of the coat of a substrate.
pub(crate) static UNMASKED: Fits = Fits {
    maps: include_bytes!("fits/unmasked.maps"),
    albedos: include_bytes!("fits/unmasked.albedos"),
};

impl Fits {
    /// Returns the LTC of microfacets for ω_o in the local frame.
    ///
    /// The map belongs to the shape of the lobe without Fresnel's factor F. The albedo is the
    /// albedo of this shape times F at the cosine 1 − ⟨(1 − ω_i·h)⁵⟩^⅕, where the mean is over the
    /// shape; this is exact for Schlick's F. For total reflection there is no such cosine, and F is
    /// its mean over twelve directions of the lobe.
    ///
    /// Anisotropic microfacets have a covariance of slopes Σ in the frame whose x axis points
    /// towards the viewer. In the plane of incidence, where masking depends on the view, the map
    /// has the width √Σ₁₁. Across it, it has the width √(det Σ/Σ₁₁), and is sheared so that slopes
    /// have the covariance Σ. The albedo is the geometric mean of the albedos for both widths. The
    /// map is exact as α → 0.
    pub(crate) fn lobe(&self, facets: &TrowbridgeReitz, fresnel: &Fresnel, wo: DVec3) -> LtcLobe {
        // Find the two widths and the shear in the frame of the viewer.
        let x = DVec3::new(wo.x, wo.y, 0.0).try_normalize();
        let x = x.unwrap_or(DVec3::X);
        let turn = DMat3::from_cols(x, DVec3::new(-x.y, x.x, 0.0), DVec3::Z);
        let [a, b] = facets.alpha();
        let within = hypot(a * x.x, b * x.y);
        let shear = (b + a) * (b - a) * x.x * x.y / within;
        // Look both widths up in the tables.
        let (cosine, sine) = (fraction(wo.z), hypot(wo.x, wo.y));
        let [flat, side] = [within, a * (b / within)].map(|width| {
            let alpha = width.clamp(ALPHAS[0], ALPHAS[1]);
            let place = TablePosition::new(alpha, cosine);
            TableEntry {
                alpha,
                map: place.read(self.maps),
                view: place.read(self.albedos),
            }
        });
        // Combine the two maps, and rotate the result to the local frame.
        let ([p, _, r], [_, q, _]) = (flat.map, side.map);
        let near = cosine + flat.alpha;
        let map = DMat3::from_cols(
            DVec3::new(flat.alpha * p / (near * near), q * shear, 0.0),
            DVec3::Y * (q * side.alpha),
            DVec3::new(-r * sine / near, 0.0, 1.0),
        );
        let map = turn * map;
        // Multiply by Fresnel's factor at the mean cosine.
        let share = match fresnel {
            Fresnel::Dielectric { eta } if *eta < 1.0 => mean(fresnel, map, wo),
            _ => fresnel.at(cosine + 0.5 * (flat.view[1] + side.view[1])),
        };
        LtcLobe {
            map,
            albedo: share * (flat.view[0] * side.view[0]).sqrt(),
        }
    }
}

/// Returns the mean of F at the midpoints of three by four equal parts of a lobe.
fn mean(fresnel: &Fresnel, map: DMat3, wo: DVec3) -> DVec3 {
    let share = |[v, turn]: [f64; 2]| {
        let w = (map * by_cosine([v, turn])).normalize_or(DVec3::Z);
        // The argument is the cosine of the half angle.
        fresnel.at((0.5 + 0.5 * w.dot(wo)).max(0.0).sqrt())
    };
    let parts = [1.0, 3.0, 5.0].map(|v| [1.0, 3.0, 5.0, 7.0].map(|t| share([v / 6.0, t / 8.0])));
    parts.iter().flatten().sum::<DVec3>() / 12.0
}

/// The interpolated numbers of the tables for one width.
struct TableEntry {
    alpha: f64,
    map: [f64; 3],
    view: [f64; 2],
}

/// A position in the tables: a cell, and the fraction of the way to the next one along both axes.
struct TablePosition {
    cell: [usize; 2],
    rest: [f64; 2],
}

impl TablePosition {
    /// Finds the position of a width and of the cosine of the view.
    fn new(alpha: f64, cosine: f64) -> Self {
        let [least, most] = ALPHAS.map(f64::sqrt);
        let axes = [
            (alpha.sqrt() - least) / (most - least),
            cosine * (1.0 + alpha) / (cosine + alpha),
        ];
        let cells = f64::from(u16::try_from(SIZE - 1).unwrap_or(1));
        let at = axes.map(|x| fraction(x) * cells);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to SIZE − 2"
        )]
        let cell = at.map(|x| x.min(cells - 1.0) as usize);
        Self {
            cell,
            rest: [0, 1].map(|k| at[k] - f64::from(u16::try_from(cell[k]).unwrap_or(0))),
        }
    }

    /// Returns N numbers, interpolated between four cells.
    fn read<const N: usize>(&self, table: &[u8]) -> [f64; N] {
        let (numbers, _) = table.as_chunks::<4>();
        let ([i, j], [s, t]) = (self.cell, self.rest);
        std::array::from_fn(|k| {
            let at = |i: usize, j: usize| {
                let number = numbers.get((i * SIZE + j) * N + k);
                number.map_or(0.0, |bytes| f64::from(f32::from_le_bytes(*bytes)))
            };
            (at(i, j) * (1.0 - t) + at(i, j + 1) * t) * (1.0 - s)
                + (at(i + 1, j) * (1.0 - t) + at(i + 1, j + 1) * t) * s
        })
    }
}
