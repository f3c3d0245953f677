//! What transformed cosines take of the visible pieces of lines, and points on these.

use super::Fit;
use crate::ShadingPoint;
use linelit_bsdf::Reflection;
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::linear::ProjectedLine;
use linelit_shading::{batch, horizon};
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

/// Points of a line: a line before many triangles takes as long as some ten of them.
const POINTS: u32 = 4;

/// The share of points uniform in length: bounds weights where g is less than what it stands for,
/// or nothing.
const UNIFORM: f64 = 0.1;

/// Visible pieces of lines on a light, with ∫ g cos'/r² along each.
#[derive(Clone, Debug, Default)]
pub(crate) struct CosinePieces {
    /// Relative to the shading point, above the surface.
    pieces: Vec<Segment>,
    /// Which of them are whose line's.
    lines: Vec<Range<usize>>,
    /// For the cosine itself and each lobe, one after the other: the pieces in its space, and what
    /// it takes of them.
    images: Vec<Segment>,
    values: Vec<f64>,
    /// The distance of the shading point from the light's plane.
    height: f64,
}

impl CosinePieces {
    /// No lines.
    pub(super) fn clear(&mut self) {
        self.pieces.clear();
        self.lines.clear();
    }

    /// Adds a line by what is visible of it, above both horizons.
    pub(super) fn add<R>(&mut self, point: &ShadingPoint<R>, line: &Segment, parts: &[Interval]) {
        let first = self.pieces.len();
        let above = |piece: Segment, n: DVec3| {
            let clipped = horizon::clip_segment(piece.p0, piece.p1, n)?;
            Some(Segment::new(clipped.p0, clipped.p1))
        };
        self.pieces.extend(parts.iter().filter_map(|part| {
            let piece = line.piece(part.lo, part.hi).relative_to(point.position);
            above(above(piece, point.normal)?, point.geometric_normal)
        }));
        self.lines.push(first..self.pieces.len());
    }

    /// Integrates along all pieces.
    ///
    /// With q = M⁻¹p, a lobe's ∫ g cos'/r² dt is albedo/π |det M⁻¹| height ∫ q.z/|q|⁴ dt: the
    /// ribbon integral along the image, but for its stretch.
    pub(super) fn integrate(&mut self, fit: &Fit, height: f64) {
        self.height = height.abs();
        self.images.clear();
        self.values.clear();
        for map in fit.maps() {
            let image = |s: &Segment| Segment::new(map * s.p0, map * s.p1);
            self.images.extend(self.pieces.iter().map(image));
        }
        self.values.resize(self.images.len(), 0.0);
        batch::ribbons(&self.images, DVec3::Z, &mut self.values);
        let mut images = self.images.iter().zip(&mut self.values);
        for map in fit.maps() {
            let scale = map.determinant().abs() * self.height * FRAC_1_PI;
            for (piece, (image, value)) in self.pieces.iter().zip(&mut images) {
                let stretch = image.length() / piece.length();
                *value = if stretch > 0.0 {
                    *value * scale / stretch
                } else {
                    0.0
                };
            }
        }
    }

    /// ∫ f cos cos'/r² along line `i`: the integral of g, and the mean over points of what f cos
    /// exceeds it by, drawn by g along the visible pieces; `v` is the random number of all.
    ///
    /// Where g is but f's size, it is the mean of f/g times the integral: no noise from what is
    /// hidden of g alone.
    pub(super) fn line<R: Reflection>(
        &self,
        i: usize,
        fit: &Fit,
        point: &ShadingPoint<R>,
        v: f64,
    ) -> DVec3 {
        let albedos = fit.albedos().enumerate();
        let taken = |(k, albedo): (usize, DVec3)| albedo * self.taken(k, i).iter().sum::<f64>();
        let sum: DVec3 = albedos.map(taken).sum();
        let (whole, length) = (sum.element_sum(), self.length(i));
        if !(length > 0.0) {
            return DVec3::ZERO;
        }
        let uniform = if whole > 0.0 { UNIFORM } else { 1.0 };
        let mut rest = DVec3::ZERO;
        for k in 0..POINTS {
            let u = (f64::from(k) + v) / f64::from(POINTS);
            let at = if u < uniform {
                self.by_length(i, u / uniform * length)
            } else {
                self.by_cosines(i, fit, (u - uniform) / (1.0 - uniform) * whole)
            };
            let Some(at) = at else {
                continue;
            };
            let r = at.length();
            let (w, per_length) = (at / r, self.height / (r * r * r));
            let cosine = point.cosine(w);
            let g = fit.at(w, cosine);
            let by_cosines = if whole > 0.0 {
                g.element_sum() / whole
            } else {
                0.0
            };
            let density = (1.0 - uniform) * by_cosines * per_length + uniform / length;
            let f = point.bsdf.eval(w, point.outgoing, point.normal) * cosine;
            rest += (f - g) * (per_length / density);
        }
        sum + rest / f64::from(POINTS)
    }

    /// What lobe `k` takes of the pieces of line `i`, for each unit of its albedo.
    fn taken(&self, k: usize, i: usize) -> &[f64] {
        let (first, range) = (k * self.pieces.len(), &self.lines[i]);
        &self.values[first + range.start..first + range.end]
    }

    /// The length of line `i`'s pieces.
    fn length(&self, i: usize) -> f64 {
        let pieces = &self.pieces[self.lines[i].clone()];
        pieces.iter().map(Segment::length).sum()
    }

    /// The point of line `i` before which g's integral is `below`, lobe by lobe and piece by piece.
    fn by_cosines(&self, i: usize, fit: &Fit, below: f64) -> Option<DVec3> {
        let masses = fit.albedos().enumerate().flat_map(|(k, albedo)| {
            let (albedo, pieces) = (albedo.element_sum(), self.lines[i].clone());
            let masses = self.taken(k, i).iter().map(move |value| value * albedo);
            masses.zip(pieces.map(move |j| (k, j)))
        });
        let (place, (k, j)) = pick(masses, below)?;
        let image = &self.images[k * self.pieces.len() + j];
        let [p0, p1] = [image.p0, image.p1].map(|p| p.to_array());
        let line = ProjectedLine::new(p0, p1, DVec3::Z.to_array())?;
        let on_image = line.sample(below_one(place)).lambda;
        Some(self.pieces[j].at(line.view().whole_fraction(on_image)))
    }

    /// The point of line `i` with the length `below` of its pieces before it.
    fn by_length(&self, i: usize, below: f64) -> Option<DVec3> {
        let pieces = &self.pieces[self.lines[i].clone()];
        let (place, piece) = pick(pieces.iter().map(|p| (p.length(), p)), below)?;
        Some(piece.at(fraction(place)))
    }
}

/// What of several masses the sum `below` ends in, and at which fraction of it.
fn pick<T>(masses: impl Iterator<Item = (f64, T)>, mut below: f64) -> Option<(f64, T)> {
    let mut last = None;
    for (mass, what) in masses.filter(|(mass, _)| *mass > 0.0) {
        last = Some((below / mass, what));
        if below < mass {
            break;
        }
        below -= mass;
    }
    last
}
