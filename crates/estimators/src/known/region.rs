//! The light over the visible region of a polygon is integrated here: of the reflection itself, if
//! it is diffuse or has Phong lobes, or of LTCs.
//!
//! The penumbra finds the boundary of the visible region. If all of the light is above the horizon
//! and not too small, the integral is a sum over the edges of the boundary. Otherwise each edge is
//! joined to a corner of the light, and the integrals over these triangles are added up. A triangle
//! counts as positive if its edge runs counter-clockwise as seen from that corner, and as negative
//! otherwise. Then each visible point is covered once, if signs are added up, and each hidden point
//! not at all.

use super::boundary::visible_region;
use crate::integrand::KnownLtc;
use crate::point::Receiver;
use crate::view::LightView;
use linelit_bsdf::{ClosedForm, ClosedLobe, LtcMixture};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_penumbra::{BoundaryEdge, PartOnDisk, Penumbra, Point};
use linelit_shading::ltc::Ltc;
use linelit_shading::{phong_polygon, polygon};
use linelit_visibility::{LightPlane, Shaft, ShaftClass};
use std::f64::consts::FRAC_1_PI;

/// If the square of a polygon's sides is more than this times the square of its distance, its
/// diffuse light is Lambert's sum over the boundary. For smaller polygons the sum would lose more
/// than two digits.
const WIDE: f64 = 1e-4;

/// LTCs are summed over the boundary if the square of a side is more than this times the square of
/// the distance. The sum is then good to 1e-8.
const SMALL: f64 = 1e-8;

/// The number of corners that the light may have after a clip, even if rounding makes the horizon
/// cross every second side.
pub(super) const CORNERS: usize = ConvexPolygon::CAPACITY / 2 * 3;

/// The memory of visible regions, which is reused.
#[derive(Debug, Default)]
pub(crate) struct RegionMemory {
    pub penumbra: Penumbra,
    pub(super) on_disk: PartOnDisk,
    /// The LTCs that were integrated last.
    pub cosines: KnownLtc,
    /// The light of the region that the cosine itself and each lobe reflect, summed over the
    /// channels.
    pub reflected: Vec<f64>,
}

/// The integral of the known part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownLight {
    /// The light; where a function says so, for a radiance of one.
    pub light: DVec3,
    /// The plane in which the memory has the boundary of the visible region. This is `None` unless
    /// the light is a polygon that the shaft did not find wholly visible.
    pub plane: Option<[DVec3; 3]>,
}

/// Integrates the reflection over the visible part of a polygon of radiance one that is partly
/// hidden. Returns the irradiance, for the diffuse part, and the light that the lobes reflect.
///
/// If all of the light is above the horizon, each is a sum over the boundary of the visible part
/// ([`Penumbra`]). Otherwise each is a sum over triangles, as described at the head of this module.
///
/// The only error is rounding: 1e-12 of the unshadowed light, and 1e-8 for lobes. `None` if the
/// shaft has not collected its occluders.
pub(crate) fn reflected(
    view: &LightView<'_>,
    form: &ClosedForm<'_>,
    shaft: &mut Shaft<'_>,
    memory: &mut RegionMemory,
) -> Option<(f64, DVec3)> {
    let n = view.at.normal;
    let mut corners = [[0.0; 2]; CORNERS];
    let seen = SeenRegion::new(&view.at, shaft, &mut memory.penumbra, &mut corners)?;
    if seen.pieces.is_empty() {
        return Some((0.0, DVec3::ZERO));
    }
    let flat = seen.irradiance(|p| p, n, WIDE).unwrap_or_else(|| {
        let sum = seen.triangles(|triangle| polygon::irradiance(triangle, n));
        sum.max(0.0)
    });
    Some((flat, lobes(view, form, |w, k| seen.lobe(n, w, k))))
}

/// The light that the lobes of a reflection make of light of radiance one, given the integral of a
/// lobe for its axis and exponent.
fn lobes(
    view: &LightView<'_>,
    form: &ClosedForm<'_>,
    integral: impl Fn(DVec3, f64) -> f64,
) -> DVec3 {
    let light = |lobe| match lobe {
        ClosedLobe::Power {
            scale,
            axis,
            exponent,
        } => scale * integral(axis, exponent),
        ClosedLobe::Gaussian { .. } => {
            debug_assert!(false, "no method takes Gaussians over regions");
            DVec3::ZERO
        }
    };
    form.lobes(view.at.outgoing, view.at.normal)
        .map(light)
        .sum()
}

/// Integrates the reflection over a whole polygon of radiance one.
pub(crate) fn whole(view: &LightView<'_>, form: &ClosedForm<'_>) -> DVec3 {
    let Some(light) = view.polygon() else {
        return DVec3::ZERO;
    };
    let (x, n) = (view.at.position, view.at.normal);
    let reflected = |vertices: &[DVec3]| {
        let flat = form.diffuse.value() * polygon::irradiance(vertices, n);
        flat + lobes(view, form, |w, k| {
            phong_polygon::irradiance(vertices, n, w, k)
        })
    };
    let above = |above: &ConvexPolygon| {
        let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
        reflected(above.relative_to(x, &mut relative))
    };
    if view.at.has_two_horizons() {
        let part = light.clip(x, view.at.geometric_normal);
        part.as_ref().map_or(DVec3::ZERO, above)
    } else if let [a, b, c, d] = light.vertices() {
        // Most lights are quadrilaterals, for which no array for more corners has to be cleared.
        reflected(&[*a - x, *b - x, *c - x, *d - x])
    } else {
        above(light)
    }
}

/// The light ∫ V g dω of a polygon of radiance one, which is the light or its part above the
/// horizons, past all occluders in the shaft; the LTCs g are stored in the memory. `None` if the
/// shaft has not collected its occluders.
pub(crate) fn cosines(
    view: &LightView<'_>,
    light: &ConvexPolygon,
    cosines: &LtcMixture,
    shaft: &mut Shaft<'_>,
    memory: &mut RegionMemory,
) -> Option<KnownLight> {
    let x = view.at.position;
    let is_small = light.area() < SMALL * light.vertices()[0].distance_squared(x);
    memory.cosines.set(cosines);
    let sums = Sums {
        cosines: &memory.cosines,
        is_small,
    };
    // Integrate over the whole polygon if nothing hides it.
    if shaft.class() == ShaftClass::Empty {
        let above = light.clip(x, view.at.geometric_normal);
        let light = above.map_or(DVec3::ZERO, |above| {
            let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
            sums.over_convex(above.relative_to(x, &mut relative))
        });
        let plane = None;
        return Some(KnownLight { light, plane });
    }
    // Otherwise integrate over the visible region.
    let mut corners = [[0.0; 2]; CORNERS];
    let seen = SeenRegion::new(&view.at, shaft, &mut memory.penumbra, &mut corners)?;
    Some(KnownLight {
        light: sums.over(&seen, &mut memory.reflected),
        plane: Some(seen.plane),
    })
}

/// Integrals of LTCs over parts of a light.
struct Sums<'a> {
    cosines: &'a KnownLtc,
    /// Whether the light is too small for sums over its edges.
    is_small: bool,
}

impl Sums<'_> {
    /// The integral ∫ g dω over the visible part of a light. `reflected` gets the light of each
    /// lobe.
    fn over(&self, seen: &SeenRegion<'_>, reflected: &mut Vec<f64>) -> DVec3 {
        // Integrate the untransformed cosine.
        let frame = &self.cosines.frame;
        let whole = seen.irradiance(|p| p, frame.z, SMALL);
        let by_triangles = || seen.triangles(|triangle| self.flat(triangle));
        let flat = whole.map_or_else(by_triangles, |sum| FRAC_1_PI * sum);
        let mut sum = self.cosines.diffuse * flat;
        reflected.clear();
        reflected.push(sum.element_sum());
        // Integrate each lobe. Its own horizon need not be the surface's horizon, which clips it as
        // well.
        let is_above = seen.is_above(frame.z);
        for (ltc, albedo) in &self.cosines.lobes {
            let image = |p| ltc.to_cosine() * frame.to_local(p);
            let whole = seen.irradiance(image, DVec3::Z, SMALL).filter(|_| is_above);
            let by_triangles = || seen.triangles(|triangle| self.lobe(ltc, triangle));
            let part = whole.map_or_else(by_triangles, |sum| FRAC_1_PI * sum);
            let part = *albedo * part;
            reflected.push(part.element_sum());
            sum += part;
        }
        sum
    }

    /// The integral ∫ g dω over a convex polygon relative to the shading point.
    fn over_convex(&self, vertices: &[DVec3]) -> DVec3 {
        let flat = self.cosines.diffuse * self.flat(vertices);
        let lobes = self.cosines.lobes.iter();
        lobes.fold(flat, |sum, (ltc, albedo)| {
            sum + *albedo * self.lobe(ltc, vertices)
        })
    }

    /// The integral of the untransformed cosine over a convex polygon.
    fn flat(&self, vertices: &[DVec3]) -> f64 {
        let n = self.cosines.frame.z;
        FRAC_1_PI
            * match self.is_small {
                true => polygon::irradiance(vertices, n),
                false => polygon::irradiance_by_edges(vertices, n),
            }
    }

    /// The integral of a lobe over a convex polygon.
    fn lobe(&self, ltc: &Ltc, vertices: &[DVec3]) -> f64 {
        match self.is_small {
            true => ltc.polygon(&self.cosines.frame, vertices),
            false => ltc.polygon_by_edges(&self.cosines.frame, vertices),
        }
    }
}

/// The visible part of a polygon, given by its boundary.
pub(crate) struct SeenRegion<'a> {
    /// The light's corners above the geometric horizon, in its plane.
    light: &'a [Point],
    pieces: &'a [BoundaryEdge],
    /// The origin of the plane's coordinates relative to the shading point, and their axes.
    plane: [DVec3; 3],
}

impl<'a> SeenRegion<'a> {
    /// The part of a polygon within a boundary, both in the coordinates of a plane.
    pub(crate) const fn within(
        light: &'a [Point],
        pieces: &'a [BoundaryEdge],
        plane: [DVec3; 3],
    ) -> Self {
        Self {
            light,
            pieces,
            plane,
        }
    }

    /// Finds the visible part of a shaft's light. `None` if the shaft has not collected its
    /// occluders.
    fn new(
        at: &Receiver,
        shaft: &mut Shaft<'_>,
        penumbra: &'a mut Penumbra,
        corners: &'a mut [Point; CORNERS],
    ) -> Option<Self> {
        let plane = shaft.light_plane()?;
        let (light, axes) = (above_surface(at, &plane, corners), plane.axes);
        let pieces = visible_region(shaft, penumbra, light)?;
        Some(Self::within(light, pieces, axes))
    }

    /// The vector from the shading point to a point of the light.
    fn in_space(&self, p: Point) -> DVec3 {
        let [origin, along_p, along_q] = self.plane;
        origin + along_p * p[0] + along_q * p[1]
    }

    /// Returns whether all of the light is above the horizon of a normal.
    fn is_above(&self, n: DVec3) -> bool {
        self.light.iter().all(|&p| n.dot(self.in_space(p)) > 0.0)
    }

    /// Lambert's sum over the boundary after a linear map, for a normal. `None` if the horizon
    /// clips the mapped light, or the square of a side is less than `least` times the square of the
    /// distance: the relative rounding error is ε over that ratio.
    fn irradiance(&self, map: impl Fn(DVec3) -> DVec3, n: DVec3, least: f64) -> Option<f64> {
        let plane = self.plane.map(&map);
        let at = |p: Point| plane[0] + plane[1] * p[0] + plane[2] * p[1];
        (self.is_wide(least) && self.light.iter().all(|&p| n.dot(at(p)) > 0.0)).then(|| {
            let edges = self.pieces.iter().map(|edge| [edge.from, edge.to]);
            polygon::boundary_irradiance(edges, &plane, n)
        })
    }

    /// The integral of a Phong lobe about the axis `w` with the exponent `k`, times the cosine to
    /// the normal `n`, over the visible part of the light. It is a sum over the boundary if all of
    /// the light is above the horizon and so large that the sum has eight correct digits. Otherwise
    /// it is a sum over triangles, which is more accurate and takes longer.
    fn lobe(&self, n: DVec3, w: DVec3, k: f64) -> f64 {
        let edges = self.pieces.iter().map(|edge| [edge.from, edge.to]);
        let whole = (self.is_wide(WIDE) && self.is_above(n))
            .then(|| phong_polygon::boundary_irradiance(edges, &self.plane, n, w, k));
        whole.flatten().unwrap_or_else(|| {
            let sum = self.triangles(|triangle| phong_polygon::irradiance(triangle, n, w, k));
            sum.max(0.0)
        })
    }

    /// Returns whether the square of the light's sides is more than `least` times the square of its
    /// distance.
    fn is_wide(&self, least: f64) -> bool {
        let [origin, along_p, along_q] = self.plane;
        let side = along_p.length_squared().min(along_q.length_squared());
        side > least * origin.length_squared()
    }

    /// The sum of an integral over triangles relative to the shading point, with the signs by which
    /// they add up to the visible part.
    pub(crate) fn triangles(&self, mut integral: impl FnMut(&[DVec3; 3]) -> f64) -> f64 {
        let Some(&apex) = self.light.first() else {
            return 0.0;
        };
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

/// The light's corners in its plane. With an interpolated normal they are clipped to the geometric
/// horizon; the closed forms themselves clip to the horizon of the shading normal.
fn above_surface<'a>(
    at: &Receiver,
    plane: &LightPlane<'_>,
    out: &'a mut [Point; CORNERS],
) -> &'a [Point] {
    let light = plane.corners;
    if !at.has_two_horizons() {
        out[..light.len()].copy_from_slice(light);
        return &out[..light.len()];
    }
    let count = clip(light, plane.axes, at.geometric_normal, out);
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
