//! What differs next to the light's plane: lines, pieces and offsets are taken from the end that is
//! nearer to the shading point's foot.

use super::{AngularLines, Marginal};
use crate::line::piece::{Line, Piece};
use linelit_geometry::finite::fraction;
use linelit_geometry::{CloseLines, ConvexPolygon, DVec3};

impl AngularLines {
    /// [`AngularLines::by_projected_solid_angle`] nearer than [`super::NEAR`].
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

    /// The whole line at an offset; `None` outside the light.
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

    /// The fraction of a piece's width, from its first line, of an offset.
    fn fraction(&self, k: usize, piece: &Piece<true>, offset: f64) -> f64 {
        let knots = self.lines.knots();
        let steps = if piece.is_reversed() {
            knots[k + 1] - offset
        } else {
            offset - knots[k]
        };
        fraction(steps / piece.width.abs())
    }

    /// The offset in a piece of the measure `whole` that has the share `place` of it below.
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

    /// The inverse of [`AngularLines::close_offset`].
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
