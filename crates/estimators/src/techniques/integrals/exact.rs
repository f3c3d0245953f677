//! `exact`: light in closed form past occluders, soft shadows without noise.

use super::{Between, Instead, Integral};
use crate::light::even_emission;
use crate::strategy::{Strategy, through_shaft};
use crate::text::{Options, OwnOptions, Result};
use crate::{Buffers, EmissionTexture, Lines, Query, ShadingPoint};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::AreaLight;
use linelit_penumbra::{BoundaryEdge, Penumbra, Point};
use linelit_shading::polygon;
use linelit_visibility::{Images, Shaft};
use std::iter;

/// Lights whose sides are longer than the root of this times their distance take Lambert's sum over
/// the boundary; for smaller ones it would lose more than two digits.
const WIDE: f64 = 1e-4;

/// A ray tells what is visible of a place at least so far from all edges: in units of how far
/// triangles reach, some forty roundings of coordinates; and in units of the light, as many as they
/// seem of what is a thousandth of the way from the shading point.
const CLOSE: f64 = 1e-14;
const LEAST_ASIDE: f64 = 1e-11;

/// Room for the light's corners after a clip, even if rounding has it cross each second side.
pub(crate) const CORNERS: usize = ConvexPolygon::CAPACITY / 2 * 3;

/// How exact [`Integration::Exact`](crate::Integration::Exact) is, and where it gives up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactOptions {
    /// The accuracy asked for, relative to the light unshadowed: 1e-3 to 1e-10. All closed forms
    /// are more accurate, so that nothing depends on it.
    pub tolerance: f64,
    /// Past more triangles in between than this, and wherever there are too many to count, lines
    /// take over; nowhere if it is [`ExactOptions::NO_LIMIT`].
    pub limit: u32,
}

impl ExactOptions {
    /// The closed form past any number of triangles.
    pub const NO_LIMIT: u32 = u32::MAX;

    /// Whether the closed form is taken past what a shaft holds.
    fn is_for(self, shaft: &Shaft<'_>) -> bool {
        let within = !shaft.is_dense() && shaft.candidates() <= self.limit as usize;
        within || self.limit == Self::NO_LIMIT
    }
}

impl Default for ExactOptions {
    /// Accurate to 1e-6, past any number of triangles.
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            limit: Self::NO_LIMIT,
        }
    }
}

impl Integral for ExactOptions {
    const NAME: &'static str = "exact";

    /// The closed form past occluders, unless more than a limit of triangles are in between; past
    /// those, lines.
    fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        lines: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3 {
        through_shaft(query, area, lines, buffers, |shaft| {
            if self.is_for(shaft) {
                (Strategy::Exact, 1)
            } else {
                (Strategy::Lines, 1)
            }
        })
    }

    fn instead(self, between: &Between<'_, '_>) -> Instead {
        if between.has_cosines && self.is_for(between.shaft) {
            Instead::Differences(1)
        } else {
            Instead::Line
        }
    }
}

impl OwnOptions for ExactOptions {
    fn read(mut self, options: &mut Options<'_>) -> Result<Self> {
        let accuracy = |text: &str| text.parse().ok().filter(|t| (1e-10..=1e-3).contains(t));
        options.read("tolerance", "1e-10 to 1e-3", accuracy, &mut self.tolerance)?;
        let number = |text: &str| text.parse().ok();
        options.read("limit", "a number of triangles", number, &mut self.limit)?;
        Ok(self)
    }

    fn write(self, out: &mut Vec<String>) {
        let default = Self::default();
        if self.tolerance.to_bits() != default.tolerance.to_bits() {
            out.push(format!("tolerance={:e}", self.tolerance));
        }
        if self.limit != default.limit {
            out.push(format!("limit={}", self.limit));
        }
    }
}

/// The light over what a shading point sees of an area light past triangles.
///
/// For a diffuse surface that has the light above its horizon, Lambert's sum over the boundary of
/// the visible part ([`Penumbra`]). Otherwise the boundary is joined to a corner of the light,
/// piece by piece; the irradiances of the triangles that this makes, with their signs, add up to
/// that of the visible part, since they add up to it as sets.
///
/// There is no error but rounding, 1e-12 of the light unshadowed. `None` where the shaft keeps
/// nothing of what is in between.
pub(crate) fn visible_light<R>(
    area: &AreaLight,
    point: &ShadingPoint<R>,
    reflection: &ClosedForm<'_>,
    shaft: &mut Shaft<'_>,
    penumbra: &mut Penumbra,
) -> Option<DVec3> {
    let (emitted, _) = even_emission(area, point.position);
    let mut corners = [[0.0; 2]; CORNERS];
    let seen = Seen::new(point, shaft, penumbra, &mut corners)?;
    if emitted == DVec3::ZERO || seen.pieces.is_empty() {
        return Some(DVec3::ZERO);
    }
    let n = point.normal;
    let flat = seen.irradiance(|p| p, n, WIDE).unwrap_or_else(|| {
        let sum = seen.triangles(|triangle| polygon::irradiance(triangle, n));
        sum.max(0.0)
    });
    Some(emitted * reflection.diffuse.value() * flat)
}

/// What a shading point sees of an area light, by its boundary.
pub(crate) struct Seen<'a> {
    /// The light's corners above the surface, in its plane.
    light: &'a [Point],
    pieces: &'a [BoundaryEdge],
    /// Where the plane's coordinates are zero, and their axes.
    plane: [DVec3; 3],
}

impl<'a> Seen<'a> {
    /// `None` if the shaft keeps nothing of what is in between.
    pub(crate) fn new<R>(
        point: &ShadingPoint<R>,
        shaft: &mut Shaft<'_>,
        penumbra: &'a mut Penumbra,
        corners: &'a mut [Point; CORNERS],
    ) -> Option<Self> {
        let (light, plane, pieces) = boundary(shaft, penumbra, |images| {
            above_surface(point, images, corners)
        })?;
        Some(Self {
            light,
            pieces,
            plane,
        })
    }

    /// Where the coordinates of the boundary are zero, relative to the shading point, and their
    /// axes.
    pub(crate) const fn plane(&self) -> [DVec3; 3] {
        self.plane
    }

    /// A point of the light relative to the shading point.
    fn in_space(&self, p: Point) -> DVec3 {
        let [origin, along_p, along_q] = self.plane;
        origin + along_p * p[0] + along_q * p[1]
    }

    /// Whether all of the light is above the horizon of a normal.
    pub(crate) fn is_above(&self, n: DVec3) -> bool {
        self.light.iter().all(|&p| n.dot(self.in_space(p)) > 0.0)
    }

    /// Lambert's sum over the boundary, mapped by a linear map, with a normal; `None` where the
    /// mapped light is cut by the horizon, or the square of a side is less than `least` times that
    /// of the distance: rounding is ε over it.
    pub(crate) fn irradiance(
        &self,
        map: impl Fn(DVec3) -> DVec3,
        n: DVec3,
        least: f64,
    ) -> Option<f64> {
        let [origin, along_p, along_q] = self.plane;
        let plane = self.plane.map(&map);
        let at = |p: Point| plane[0] + plane[1] * p[0] + plane[2] * p[1];
        let side = along_p.length_squared().min(along_q.length_squared());
        let fits = side > least * origin.length_squared();
        (fits && self.light.iter().all(|&p| n.dot(at(p)) > 0.0)).then(|| {
            let edges = self.pieces.iter().map(|edge| [edge.from, edge.to]);
            polygon::boundary_irradiance(edges, &plane, n)
        })
    }

    /// The sum of an integral over triangles relative to the shading point, which with their signs
    /// make up what is visible.
    pub(crate) fn triangles(&self, mut integral: impl FnMut(&[DVec3; 3]) -> f64) -> f64 {
        let apex = self.light[0];
        let top = self.in_space(apex);
        let mut sum = 0.0;
        for piece in self.pieces {
            let u = [piece.from[0] - apex[0], piece.from[1] - apex[1]];
            let v = [piece.to[0] - apex[0], piece.to[1] - apex[1]];
            let turn = u[0] * v[1] - u[1] * v[0];
            if turn != 0.0 {
                let triangle = [top, self.in_space(piece.from), self.in_space(piece.to)];
                sum += integral(&triangle) * turn.signum();
            }
        }
        sum
    }
}

/// A polygon in the light's plane, that plane, and the boundary of what is visible of the polygon;
/// `None` if the shaft keeps nothing of what is in between.
pub(crate) fn boundary<'a, 'b>(
    shaft: &mut Shaft<'_>,
    penumbra: &'a mut Penumbra,
    polygon: impl FnOnce(&Images<'_>) -> &'b [Point],
) -> Option<(&'b [Point], [DVec3; 3], &'a [BoundaryEdge])> {
    let mut by_silhouettes = true;
    let images = match shaft.loose_front() {
        Some(images) => images,
        None => {
            by_silhouettes = false;
            shaft.front()?
        }
    };
    let (polygon, plane) = (polygon(&images), images.axes());
    penumbra.begin(polygon);
    penumbra.add(images.triangles());
    if !by_silhouettes {
        past_triangles(shaft, penumbra);
    } else if !past_surfaces(shaft, penumbra, plane) {
        penumbra.begin(polygon);
        penumbra.add(shaft.front()?.triangles());
        past_triangles(shaft, penumbra);
    }
    Some((polygon, plane, penumbra.latest()))
}

/// Finds the boundary past triangles, and those that turn out to be behind it.
fn past_triangles(shaft: &mut Shaft<'_>, penumbra: &mut Penumbra) {
    penumbra.boundary_past(iter::empty());
    let ends = |edge: &BoundaryEdge| [edge.from, edge.to];
    while let Some(images) = shaft.behind(penumbra.latest().iter().map(ends)) {
        penumbra.boundary_past(images.triangles());
    }
}

/// Finds the boundary past loose triangles and, by their silhouettes, fine meshes; false if there
/// are none, or they are so close to each other that they do not tell.
fn past_surfaces(
    shaft: &mut Shaft<'_>,
    penumbra: &mut Penumbra,
    [origin, along_p, along_q]: [DVec3; 3],
) -> bool {
    loop {
        let Some((images, silhouettes)) = shaft.silhouettes() else {
            return false;
        };
        penumbra.add(images.triangles());
        penumbra.set_silhouettes(silhouettes.iter().map(|s| (s.from, s.to, s.layers)));
        match shaft.behind(penumbra.outline()) {
            Some(images) => penumbra.add(images.triangles()),
            None => break,
        }
    }
    let side = along_p
        .length_squared()
        .min(along_q.length_squared())
        .sqrt();
    let least = (CLOSE * shaft.reach() / side).max(LEAST_ASIDE);
    let is_visible = |[p, q]: Point| shaft.place_visible(origin + along_p * p + along_q * q);
    penumbra.settle(least, is_visible).is_some()
}

/// The light's corners in its plane; with an interpolated normal, of the part above the surface's
/// own horizon (the closed forms clip to the normal's).
fn above_surface<'a, R>(
    point: &ShadingPoint<R>,
    images: &Images<'_>,
    out: &'a mut [Point; CORNERS],
) -> &'a [Point] {
    let light = images.light();
    if point.normal == point.geometric_normal {
        out[..light.len()].copy_from_slice(light);
        return &out[..light.len()];
    }
    let count = clip(light, images.axes(), point.geometric_normal, out);
    &out[..count]
}

/// The corners of what of a polygon in a plane, given by its origin and axes relative to the
/// shading point, is above the horizon of a normal.
pub(crate) fn clip(
    polygon: &[Point],
    [origin, along_p, along_q]: [DVec3; 3],
    n: DVec3,
    out: &mut [Point; CORNERS],
) -> usize {
    let slopes = [n.dot(origin), n.dot(along_p), n.dot(along_q)];
    let height = |p: Point| slopes[0] + slopes[1] * p[0] + slopes[2] * p[1];
    let mut count = 0;
    for (i, &b) in polygon.iter().enumerate() {
        let a = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if (ha >= 0.0) != (hb >= 0.0) {
            let t = ha / (ha - hb);
            out[count] = [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
            count += 1;
        }
        if hb >= 0.0 {
            out[count] = b;
            count += 1;
        }
    }
    count
}
