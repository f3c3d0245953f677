//! This module holds the special case in which the shading point is near the light's plane: lines,
//! pieces and offsets are measured from the end that is nearer to the shading point's foot, because
//! this end is known more precisely.

use super::{AngularLines, Marginal};
use crate::line::piece::{Line, Piece};
use linelit_geometry::finite::fraction;
use linelit_geometry::{CloseLines, ConvexPolygon, DVec3};

impl AngularLines {
    /// Sets up [`AngularLines::by_projected_solid_angle`] if the plane is nearer than
    /// [`super::NEAR`].
    #[cold]
    #[inline(never)]
    pub(super) fn next_to_the_plane(
        polygon: &ConvexPolygon,
        angle_rad: f64,
        x: DVec3,
        normal: DVec3,
    ) -> Self {
        match CloseLines::new(polygon, angle_rad, x, normal) {
            Some(close) => {
                let (foot, height, normal) = (close.foot, close.height, Some(normal));
                let marginal = Marginal::Projected;
                Self::with_foot(close.lines, x, foot, height, normal, marginal, true)
            }
            None => Self::nothing(polygon, angle_rad, x),
        }
    }

    /// Returns the whole line at an offset; `None` outside the light.
    #[cold]
    #[inline(never)]
    pub(super) fn close_line_at(&self, offset: f64) -> Option<Line> {
        let (a, b) = self.lines.range();
        if !(a < b && (a..=b).contains(&offset)) {
            return None;
        }
        let k = self.piece_at(offset);
        let piece = self.piece::<true>(k);
        Some(piece.at(self.fraction(k, &piece, offset)))
    }

    /// Returns the fraction of a piece's width, from its first line, at which an offset lies.
    fn fraction(&self, k: usize, piece: &Piece<true>, offset: f64) -> f64 {
        let knots = self.lines.knots();
        let steps = if piece.is_reversed() {
            knots[k + 1] - offset
        } else {
            offset - knots[k]
        };
        fraction(steps / piece.width.abs())
    }

    /// Returns the offset in a piece of the measure `whole` below which the fraction `place` of it
    /// lies.
    #[cold]
    #[inline(never)]
    pub(super) fn close_offset(&self, k: usize, place: f64, whole: f64) -> f64 {
        let (piece, knots) = (self.piece::<true>(k), self.lines.knots());
        let (from, share) = if piece.is_reversed() {
            (knots[k + 1], 1.0 - place)
        } else {
            (knots[k], place)
        };
        let s = fraction(self.find(&piece, share * whole, whole));
        (from + piece.width * s).max(knots[k]).min(knots[k + 1])
    }

    /// Inverts [`AngularLines::close_offset`].
    #[cold]
    #[inline(never)]
    pub(super) fn close_place(&self, k: usize, offset: f64, whole: f64) -> f64 {
        let piece = self.piece::<true>(k);
        let part = piece.part(self.fraction(k, &piece, offset), self.z);
        let share = fraction(self.measure(&part) / whole);
        if piece.is_reversed() {
            1.0 - share
        } else {
            share
        }
    }
}
