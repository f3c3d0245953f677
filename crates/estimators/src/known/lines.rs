//! The light along lines is integrated here in closed form (Billen & Dutré 2016, section 5.3).

use crate::WorkCounters;
use crate::draw::lines::{Draw, Draws};
use crate::point::Receiver;
use crate::view::LightView;
use crate::visible::Visible;
use linelit_bsdf::{ClosedForm, ClosedLobe};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{LineSample, Width};
use linelit_shading::{batch, horizon, phong, ribbon, spherical_gaussian};
use linelit_visibility::VisibleLines;

/// The memory of lines, their visible parts and their integrals, which is reused.
#[derive(Debug, Default)]
pub(crate) struct LineMemory {
    pub draws: Draws,
    pub pieces: Pieces,
    pub visible: VisibleLines,
}

impl LineMemory {
    /// Queries the visible parts of the lines that were drawn, and counts them.
    pub(crate) fn ask(&mut self, visible: &mut Visible<'_>, counts: &mut WorkCounters) {
        let lines = &self.draws.segments;
        visible.lines(lines, &mut self.visible);
        counts.count_lines(&self.visible, lines.len());
    }
}

/// The sum over the drawn lines of their integrals in closed form. `height` is the factor for a
/// line that has a plane of its own, and `visible` returns the visible parts of a line.
pub(crate) fn gather<'v>(
    view: &LightView<'_>,
    form: &ClosedForm<'_>,
    height: impl Fn(&LineSample) -> f64,
    draws: &Draws,
    pieces: &mut Pieces,
    visible: impl Fn(usize) -> &'v [Interval],
) -> DVec3 {
    pieces.clear();
    for (i, Draw { line, share, .. }) in draws.samples.iter().enumerate() {
        let weight = height(line) * (share / line.pdf.value());
        let first = pieces.pieces.len();
        pieces.add(&view.at, &line.segment, visible(i), weight);
        if draws.width == Width::Growing {
            pieces.taper(first, &view.at, &line.segment);
        }
    }
    let (emitted, height) = view.emitted();
    pieces.light(emitted, height, &view.at, form)
}

/// Visible pieces of lines on a light, relative to the shading point, which are integrated
/// together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    pieces: Vec<Segment>,
    /// The factors of the pieces' integrals.
    weights: Vec<f64>,
    /// The widths at both ends of each piece; empty if all pieces have the width one.
    widths: Vec<[f64; 2]>,
    values: Vec<f64>,
}

impl Pieces {
    /// Removes all pieces.
    pub(crate) fn clear(&mut self) {
        self.pieces.clear();
        self.weights.clear();
        self.widths.clear();
    }

    /// Adds the visible parts of a line, with a factor for their integrals.
    pub(crate) fn add(&mut self, at: &Receiver, line: &Segment, parts: &[Interval], weight: f64) {
        for part in parts {
            if let Some(piece) = above_surface(at, line, *part) {
                self.pieces.push(piece);
                self.weights.push(weight);
            }
        }
    }

    /// Adds widths for the pieces of a line, which are those from index `first` on. The widths grow
    /// from zero at the line's first end to one at its other end. Either all pieces have such
    /// widths, or none.
    fn taper(&mut self, first: usize, at: &Receiver, line: &Segment) {
        let (begin, length) = (line.p0 - at.position, line.length());
        let widths = |piece: &Segment| [piece.p0, piece.p1].map(|p| p.distance(begin) / length);
        self.widths.extend(self.pieces[first..].iter().map(widths));
    }

    /// The sum of weight × ∫ L f_r cos θ cos θ'/r² along the pieces, given the radiance of a flat
    /// light and the height of the shading point above its plane.
    pub(crate) fn light(
        &mut self,
        emitted: DVec3,
        height: f64,
        at: &Receiver,
        reflection: &ClosedForm<'_>,
    ) -> DVec3 {
        if emitted == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let n = at.normal;
        // Integrate the diffuse part.
        self.values.resize(self.pieces.len(), 0.0);
        if self.widths.is_empty() {
            batch::ribbons(&self.pieces, n, &mut self.values);
        }
        for (i, widths) in self.widths.iter().enumerate() {
            self.values[i] = ribbon::tapered(self.pieces[i].p0, self.pieces[i].p1, n, *widths);
        }
        let weighted = self.values.iter().zip(&self.weights).map(|(v, w)| v * w);
        let mut reflected = reflection.diffuse.value() * weighted.sum::<f64>();
        // Integrate the lobes.
        for lobe in reflection.lobes(at.outgoing, n) {
            let mut sum = 0.0;
            for (i, (piece, weight)) in self.pieces.iter().zip(&self.weights).enumerate() {
                sum += weight * lobe_along(&lobe, piece, self.widths.get(i).copied(), n);
            }
            reflected += lobe.scale() * sum;
        }
        emitted * reflected * height.abs()
    }
}

/// The integral of a lobe along a strip of width one, or of a width that changes linearly.
fn lobe_along(lobe: &ClosedLobe, piece: &Segment, widths: Option<[f64; 2]>, n: DVec3) -> f64 {
    let Segment { p0, p1 } = *piece;
    match (*lobe, widths) {
        (ClosedLobe::Power { axis, exponent, .. }, None) => {
            phong::ribbon(p0, p1, n, axis, exponent)
        }
        (ClosedLobe::Power { axis, exponent, .. }, Some(widths)) => {
            phong::tapered(p0, p1, n, axis, exponent, widths)
        }
        (
            ClosedLobe::Gaussian {
                axis, sharpness, ..
            },
            widths,
        ) => {
            let widths = widths.unwrap_or([1.0; 2]);
            spherical_gaussian::tapered(p0, p1, n, axis, sharpness, widths)
        }
    }
}

/// A visible part, relative to the shading point. With an interpolated normal it is clipped to the
/// geometric horizon; the closed forms themselves clip to the horizon of the shading normal.
pub(crate) fn above_surface(at: &Receiver, line: &Segment, part: Interval) -> Option<Segment> {
    let piece = line.piece(part.lo, part.hi).relative_to(at.position);
    if !at.has_two_horizons() {
        return Some(piece);
    }
    horizon::clip_segment(piece.p0, piece.p1, at.geometric_normal)
        .map(|clipped| Segment::new(clipped.p0, clipped.p1))
}
