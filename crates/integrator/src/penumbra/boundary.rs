//! The boundary of what is visible.

use super::clip::{Edge, Passing, Span};
use super::orient::{Point, orient};

/// A piece of the boundary of the visible part of a light: what is visible lies on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub from: Point,
    pub to: Point,
}

/// A triangle's image, counter-clockwise, and its bounds.
#[derive(Clone, Copy, Debug)]
struct Image {
    corners: [Point; 3],
    low: Point,
    high: Point,
}

/// What bounds are widened by, in units of the light.
const ROOM: f64 = 1e-9;

/// Finds boundaries; keeps its buffers.
#[derive(Debug, Default)]
pub(crate) struct Penumbra {
    light: Vec<Point>,
    images: Vec<Image>,
    hidden: Vec<Span>,
    pieces: Vec<Piece>,
}

impl Penumbra {
    /// The boundary of a convex light, either way round, minus triangles, either way round.
    ///
    /// Pieces come in no particular order; together they are closed curves around the visible
    /// part, but for ends that are rounded.
    pub(crate) fn boundary(
        &mut self,
        light: &[Point],
        triangles: impl Iterator<Item = [Point; 3]>,
    ) -> &[Piece] {
        self.pieces.clear();
        self.set_light(light);
        if self.light.len() < 3 {
            return &self.pieces;
        }
        let (low, high) = bounds(&self.light);
        self.images.clear();
        let near = triangles
            .filter_map(Image::new)
            .filter(|image| image.meets(low, high));
        self.images.extend(near);
        for i in 0..self.images.len() {
            let [a, b, c] = self.images[i].corners;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                self.image_edge(i, Edge { from, to }, low, high);
            }
        }
        for i in 0..self.light.len() {
            // Backwards: the light on the right.
            let from = self.light[(i + 1) % self.light.len()];
            let to = self.light[i];
            let edge = Edge { from, to };
            self.edge(usize::MAX, edge, edge.whole());
        }
        &self.pieces
    }

    fn set_light(&mut self, light: &[Point]) {
        self.light.clear();
        self.light.extend_from_slice(light);
        let area: f64 = (1..light.len().max(1) - 1)
            .map(|i| orient(light[0], light[i], light[i + 1]))
            .sum();
        if area < 0.0 {
            self.light.reverse();
        }
    }

    /// An edge of image `own`, as far as it is on the light.
    fn image_edge(&mut self, own: usize, edge: Edge, low: Point, high: Point) {
        let apart = |k: usize| {
            edge.from[k].max(edge.to[k]) < low[k] || edge.from[k].min(edge.to[k]) > high[k]
        };
        if apart(0) || apart(1) {
            return;
        }
        // What lies along an edge of the light is left to the light.
        if let Passing::Through(Some(span), false) = edge.pass(&self.light) {
            self.edge(own, edge, span);
        }
    }

    /// Adds the visible pieces of a part of an edge.
    fn edge(&mut self, own: usize, edge: Edge, part: Span) {
        // With room for the rounding of the two points: an edge of the light's size, far corners
        // within the guard, 1e-12.
        let (low, high) = bounds(&[part.lo.point, part.hi.point]);
        let (low, high) = (low.map(|x| x - ROOM), high.map(|x| x + ROOM));
        self.hidden.clear();
        for (i, image) in self.images.iter().enumerate() {
            if i == own || !image.meets(low, high) {
                continue;
            }
            let span = match edge.pass(&image.corners) {
                Passing::Through(span, _) => span,
                Passing::Along(a, b) if i < own && own != usize::MAX => edge.between(a, b),
                Passing::Along(..) | Passing::Beside => None,
            };
            if let Some(span) = span {
                if span.lo.at <= part.lo.at && span.hi.at >= part.hi.at {
                    return;
                }
                self.hidden.push(span);
            }
        }
        self.hidden
            .sort_unstable_by(|a, b| a.lo.at.total_cmp(&b.lo.at));
        let mut reached = part.lo;
        for span in &self.hidden {
            if span.lo.at >= part.hi.at {
                break;
            }
            if span.lo.at > reached.at {
                // Reversed: what is visible is right of the edge.
                self.pieces.push(Piece {
                    from: span.lo.point,
                    to: reached.point,
                });
            }
            if span.hi.at > reached.at {
                reached = span.hi;
            }
        }
        if part.hi.at > reached.at {
            self.pieces.push(Piece {
                from: part.hi.point,
                to: reached.point,
            });
        }
    }
}

impl Image {
    /// `None` if it has no area: then it hides nothing.
    fn new([a, b, c]: [Point; 3]) -> Option<Self> {
        let turn = orient(a, b, c);
        let corners = if turn > 0.0 { [a, b, c] } else { [a, c, b] };
        let (low, high) = bounds(&corners);
        (turn != 0.0).then_some(Self { corners, low, high })
    }

    fn meets(&self, low: Point, high: Point) -> bool {
        self.low[0] <= high[0]
            && low[0] <= self.high[0]
            && self.low[1] <= high[1]
            && low[1] <= self.high[1]
    }
}

fn bounds(points: &[Point]) -> (Point, Point) {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in points {
        for k in 0..2 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    (low, high)
}
