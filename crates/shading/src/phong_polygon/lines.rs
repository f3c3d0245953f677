//! A lobe over a polygon by lines across it.

use super::highest;
use crate::exact::dot;
use crate::horizon::crossing;
use crate::phong;
use crate::polygon::{self, clip_with};
use crate::quadrature::{HALF_RULE, MIDDLE};
use linelit_elementary::{atan2, ln, pow, tan};
use linelit_geometry::DVec3;

/// The most corners that are looked at; each of the two horizons may add one.
const MOST: usize = 8;
const CORNERS: usize = MOST + 4;

/// A panel of lines spans at most this many widths of the lobe, 1/√(k + 1), and at most a radian:
/// nothing can hide between the nodes then, and the two rules tell how good they are.
const WIDEST: f64 = 3.0;

/// More panels than this take as long as the robust form.
const MOST_PANELS: f64 = 12.0;

/// Polygons narrower than this for their length, or as small and flat from where they are seen, are
/// not taken: products of plain numbers lose as many digits there, and rounded corners are as far
/// from lying in a plane. Nor are those that see all of the polygon as low over a horizon: ends of
/// lines are rounded.
const FLATTEST: f64 = 1e-5;

/// The integral to `tolerance` times the irradiance; `None` where that cannot be told.
pub(super) fn integral(
    vertices: &[DVec3],
    n: DVec3,
    w: DVec3,
    k: f64,
    tolerance: f64,
) -> Option<f64> {
    if !(3..=MOST).contains(&vertices.len()) {
        return None;
    }
    let across = Across::new(vertices)?;
    let mut clipped = [DVec3::ZERO; CORNERS];
    let count = above(vertices, [n, w], &mut clipped);
    if count < 3 {
        return Some(0.0);
    }
    let clipped = &clipped[..count];
    let peak = peak(clipped, w);
    // The lobe is nowhere above peakᵏ, and the rest is what a diffuse surface gets.
    if k * ln(peak) <= ln(tolerance) {
        return Some(0.0);
    }
    if highest(clipped, n) < FLATTEST || peak < FLATTEST * (0.1 * k).max(1.0) {
        return None;
    }
    let mut bounds = [0.0; CORNERS];
    let bounds = &mut bounds[..count];
    for (to, vertex) in bounds.iter_mut().zip(clipped) {
        *to = across.angle(*vertex);
    }
    bounds.sort_unstable_by(f64::total_cmp);
    // Away from its peak a lobe falls faster, as e to the power of this for each width.
    let steep = (2.0 * k * (1.0 - peak)).sqrt();
    let widest = WIDEST.min((k + 1.0).sqrt()) / ((k + 1.0).sqrt() * (0.5 * steep).max(1.0));
    let (first, last) = (bounds[0], bounds[count - 1]);
    let span = last - first;
    if span > MOST_PANELS * widest || span < FLATTEST || is_grazing(first, last) {
        return None;
    }
    let line = |a, b| phong::ribbon(a, b, n, w, k);
    let (mut sum, mut gap) = (0.0, 0.0);
    for part in bounds.windows(2).filter(|p| p[0] < p[1]) {
        let panels = ((part[1] - part[0]) / widest).ceil();
        let (mut at, step) = (0.0, (part[1] - part[0]) / panels);
        while at < panels {
            let (kronrod, gauss) = across.panel(part[0] + at * step, step, line);
            sum += kronrod;
            gap += (kronrod - gauss).abs();
            at += 1.0;
        }
    }
    // The better rule's error by the two rules' difference, as QUADPACK has it.
    let error = sum * pow(200.0 * gap / sum, 1.5);
    let good = error <= tolerance * sum || error <= tolerance * polygon::irradiance(vertices, n);
    good.then_some(sum)
}

/// Whether lines at much different distances are nearly in one direction: their ends change too
/// much from angle to angle.
fn is_grazing(first: f64, last: f64) -> bool {
    let (a, b) = (first.abs().min(last.abs()), first.abs().max(last.abs()));
    b > 1.4 && (first * last < 0.0 || tan(b) > 4.0 * tan(a))
}

/// The greatest cosine with the axis over a polygon.
fn peak(polygon: &[DVec3], w: DVec3) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let (mut most, mut left, mut right) = (highest(polygon, w), false, false);
    for (a, b) in polygon.iter().zip(next) {
        let outwards = a.cross(*b);
        let side = outwards.dot(w);
        (left, right) = (left || side > 0.0, right || side < 0.0);
        let square = outwards.length_squared();
        if square > 0.0 {
            let foot = w - outwards * (side / square);
            let between = a.cross(foot).dot(outwards) > 0.0 && foot.cross(*b).dot(outwards) > 0.0;
            most = if between {
                most.max(foot.length())
            } else {
                most
            };
        }
    }
    if left && right { most.min(1.0) } else { 1.0 }
}

/// What of a polygon is above two horizons.
fn above(vertices: &[DVec3], horizons: [DVec3; 2], out: &mut [DVec3; CORNERS]) -> usize {
    out[..vertices.len()].copy_from_slice(vertices);
    let mut count = vertices.len();
    for horizon in horizons {
        let source = *out;
        let source = &source[..count];
        let cut = |i: usize, j: usize, ci, cj| crossing(source[i], source[j], horizon, ci, cj);
        if source.iter().any(|p| dot(horizon, *p) <= 0.0) {
            count = clip_with(source, horizon, |i| source[i], cut, out);
        }
    }
    count
}

/// A polygon as lines along its longest side see it.
struct Across<'a> {
    vertices: &'a [DVec3],
    /// Of each vertex, from the line through the first one.
    offsets: [f64; MOST],
    /// Away from that line, in the plane.
    out: DVec3,
    /// Offset of the point of the plane below the shading point.
    foot: f64,
    /// Of the shading point over the polygon's plane.
    height: f64,
}

impl<'a> Across<'a> {
    fn new(vertices: &'a [DVec3]) -> Option<Self> {
        let first = vertices[0];
        let next = vertices.iter().cycle().skip(1);
        let sides = vertices.iter().zip(next).map(|(a, b)| *b - *a);
        let along = sides.fold(DVec3::ZERO, |a, b| {
            if b.length_squared() > a.length_squared() {
                b
            } else {
                a
            }
        });
        let triangles = vertices.windows(2).skip(1);
        let normal: DVec3 = triangles.map(|t| (t[0] - first).cross(t[1] - first)).sum();
        let normal = normal.try_normalize()?;
        let out = normal.cross(along).try_normalize()?;
        let mut offsets = [0.0; MOST];
        for (to, vertex) in offsets.iter_mut().zip(vertices) {
            *to = out.dot(*vertex - first);
        }
        let height = normal.dot(first).abs();
        let wide = offsets.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let narrow = wide < FLATTEST * along.length();
        let flat = wide * height < FLATTEST * first.length_squared();
        (!narrow && !flat).then_some(Self {
            vertices,
            offsets,
            out,
            foot: -out.dot(first),
            height,
        })
    }

    /// Of the plane through the shading point and the line through a point, from upright.
    fn angle(&self, point: DVec3) -> f64 {
        let offset = self.out.dot(point - self.vertices[0]);
        atan2(offset - self.foot, self.height)
    }

    /// h ∫ `line` over the offsets of a panel of angles from `start` on, by both rules.
    fn panel(&self, start: f64, span: f64, line: impl Fn(DVec3, DVec3) -> f64) -> (f64, f64) {
        let half = 0.5 * span;
        let middle = start + half;
        let value = |angle: f64| {
            let tangent = tan(angle);
            let density = self.height * self.height * (1.0 + tangent * tangent);
            let chord = self.chord(self.foot + self.height * tangent);
            chord.map_or(0.0, |[a, b]| density * line(a, b))
        };
        let at_middle = value(middle);
        let (mut kronrod, mut gauss) = (MIDDLE[0] * at_middle, MIDDLE[1] * at_middle);
        for (node, fine, coarse) in HALF_RULE {
            let both = value(middle - half * node) + value(middle + half * node);
            kronrod += fine * both;
            gauss += coarse * both;
        }
        (half * kronrod, half * gauss)
    }

    /// The ends of the line at an offset between those of vertices.
    fn chord(&self, offset: f64) -> Option<[DVec3; 2]> {
        let count = self.vertices.len();
        let mut ends = (0..count).filter_map(|i| {
            let j = if i + 1 == count { 0 } else { i + 1 };
            let (a, b) = (self.offsets[i], self.offsets[j]);
            let part = (offset - a) / (b - a);
            ((a < offset) != (b < offset))
                .then(|| self.vertices[i] + (self.vertices[j] - self.vertices[i]) * part)
        });
        Some([ends.next()?, ends.next()?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What lights in scenes look like is answered here, not by the robust form; what would not be
    /// good enough is not.
    #[test]
    fn lights_of_scenes_are_answered() {
        let light = |size: f64, x: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(a, b)| DVec3::new(x + size * a, size * b, 2.0))
        };
        let ask = |size, x, k| integral(&light(size, x), DVec3::Z, DVec3::Z, k, 1e-9);
        for (size, x) in [(0.1, 0.0), (0.5, 0.3), (1.0, 0.5), (0.5, 2.0)] {
            for k in [0.0, 1.5, 20.0, 100.0] {
                assert!(ask(size, x, k).is_some(), "{size} {x} {k}");
            }
        }
        assert_eq!(
            ask(0.1, 9.0, 1000.0),
            Some(0.0),
            "the lobe points elsewhere"
        );
        assert_eq!(ask(1.0, 0.0, 1e5), None, "too wide for the lobe");
        assert_eq!(ask(1e-7, 0.0, 20.0), None, "a speck");
    }
}
