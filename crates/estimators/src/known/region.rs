//! Light over the visible region of a polygon: diffuse in closed form, and by transformed cosines.

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

/// Diffuse light of polygons whose sides are longer than the root of this times their distance is
/// Lambert's sum over the boundary; for smaller ones it would lose more than two digits.
const WIDE: f64 = 1e-4;

/// Transformed cosines are summed over the boundary where the square of a side is more than this
/// times that of the distance: the sum is then good to 1e-8.
const SMALL: f64 = 1e-8;

/// Room for the light's corners after a clip, even if rounding has it cross each second side.
pub(super) const CORNERS: usize = ConvexPolygon::CAPACITY / 2 * 3;

/// The memory of visible regions.
#[derive(Debug, Default)]
pub(crate) struct RegionMemory {
    pub penumbra: Penumbra,
    pub(super) on_disk: PartOnDisk,
    /// The transformed cosines that were integrated last.
    pub cosines: KnownLtc,
    /// The light, as sums over the channels, that the cosine itself and each lobe reflect of the
    /// region.
    pub reflected: Vec<f64>,
}

/// The known part of the light that goes to the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnownLight {
    /// The light, for each unit of radiance where it says so.
    pub light: DVec3,
    /// The plane in which the memory has the boundary of the visible region, where it is a polygon
    /// with occluders before it and the rest is to be sampled.
    pub plane: Option<[DVec3; 3]>,
}

/// The light that a reflection makes of a polygon of radiance one past whatever the shaft holds, if
/// not nothing: the irradiance, for its diffuse part, and the light that its lobes reflect.
///
/// Where all of the light is above the horizon it is a sum over the boundary of the visible part
/// ([`Penumbra`]). Otherwise the boundary is joined to a corner of the light, piece by piece;
/// the integrals over the triangles that this makes, with their signs, add up to that over the
/// visible part, since they add up to it as sets.
///
/// There is no error but rounding, 1e-12 of the light unshadowed, and 1e-8 for lobes. `None` where
/// the shaft keeps nothing of the occluders.
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

/// The light that the lobes of a reflection make of light of radiance one, by the integral of each
/// for its axis and exponent.
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

/// The light that a reflection makes of a whole polygon of radiance one.
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
        // Most lights are quadrilaterals, which need no room for more corners to be cleared.
        reflected(&[*a - x, *b - x, *c - x, *d - x])
    } else {
        above(light)
    }
}

/// The light ∫ V g dω of a polygon of radiance one, the light or its part above the horizons, past
/// whatever the shaft holds; keeps g in the memory. `None` if nothing is kept of the occluders.
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
    if shaft.class() == ShaftClass::Empty {
        let above = light.clip(x, view.at.geometric_normal);
        let light = above.map_or(DVec3::ZERO, |above| {
            let mut relative = [DVec3::ZERO; ConvexPolygon::CAPACITY];
            sums.over_convex(above.relative_to(x, &mut relative))
        });
        let plane = None;
        return Some(KnownLight { light, plane });
    }
    let mut corners = [[0.0; 2]; CORNERS];
    let seen = SeenRegion::new(&view.at, shaft, &mut memory.penumbra, &mut corners)?;
    Some(KnownLight {
        light: sums.over(&seen, &mut memory.reflected),
        plane: Some(seen.plane),
    })
}

/// Integrals of transformed cosines.
struct Sums<'a> {
    cosines: &'a KnownLtc,
    /// Whether the light is too small for sums over its edges.
    is_small: bool,
}

impl Sums<'_> {
    /// ∫ g dω over the visible part of a light, with the share of each lobe.
    fn over(&self, seen: &SeenRegion<'_>, reflected: &mut Vec<f64>) -> DVec3 {
        let frame = &self.cosines.frame;
        let whole = seen.irradiance(|p| p, frame.z, SMALL);
        let by_triangles = || seen.triangles(|triangle| self.flat(triangle));
        let flat = whole.map_or_else(by_triangles, |sum| FRAC_1_PI * sum);
        let mut sum = self.cosines.diffuse * flat;
        reflected.clear();
        reflected.push(sum.element_sum());
        // The horizon of a lobe's own cosine need not be the surface's, which cuts it as well.
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

    /// ∫ g dω over a convex polygon relative to the shading point.
    fn over_convex(&self, vertices: &[DVec3]) -> DVec3 {
        let flat = self.cosines.diffuse * self.flat(vertices);
        let lobes = self.cosines.lobes.iter();
        lobes.fold(flat, |sum, (ltc, albedo)| {
            sum + *albedo * self.lobe(ltc, vertices)
        })
    }

    /// The integral of the cosine itself.
    fn flat(&self, vertices: &[DVec3]) -> f64 {
        let n = self.cosines.frame.z;
        FRAC_1_PI
            * match self.is_small {
                true => polygon::irradiance(vertices, n),
                false => polygon::irradiance_by_edges(vertices, n),
            }
    }

    /// The integral of a lobe.
    fn lobe(&self, ltc: &Ltc, vertices: &[DVec3]) -> f64 {
        match self.is_small {
            true => ltc.polygon(&self.cosines.frame, vertices),
            false => ltc.polygon_by_edges(&self.cosines.frame, vertices),
        }
    }
}

/// The visible part of a polygon, by its boundary.
pub(crate) struct SeenRegion<'a> {
    /// The light's corners above the surface, in its plane.
    light: &'a [Point],
    pieces: &'a [BoundaryEdge],
    /// The origin of the plane's coordinates, and their axes.
    plane: [DVec3; 3],
}

impl<'a> SeenRegion<'a> {
    /// The part of a polygon within a boundary, both in a plane's coordinates.
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

    /// `None` if the shaft keeps nothing of what is in between.
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

    /// A point of the light relative to the shading point.
    fn in_space(&self, p: Point) -> DVec3 {
        let [origin, along_p, along_q] = self.plane;
        origin + along_p * p[0] + along_q * p[1]
    }

    /// Whether all of the light is above the horizon of a normal.
    fn is_above(&self, n: DVec3) -> bool {
        self.light.iter().all(|&p| n.dot(self.in_space(p)) > 0.0)
    }

    /// Lambert's sum over the boundary, mapped by a linear map, with a normal; `None` where the
    /// mapped light is cut by the horizon, or the square of a side is less than `least` times that
    /// of the distance: rounding is ε over it.
    fn irradiance(&self, map: impl Fn(DVec3) -> DVec3, n: DVec3, least: f64) -> Option<f64> {
        let plane = self.plane.map(&map);
        let at = |p: Point| plane[0] + plane[1] * p[0] + plane[2] * p[1];
        (self.is_wide(least) && self.light.iter().all(|&p| n.dot(at(p)) > 0.0)).then(|| {
            let edges = self.pieces.iter().map(|edge| [edge.from, edge.to]);
            polygon::boundary_irradiance(edges, &plane, n)
        })
    }

    /// The integral of a Phong lobe about the axis `w` with the exponent `k`, times the cosine to
    /// the normal `n`, over what is visible of the light. It is a sum over the boundary where all
    /// of the light is above the horizon and so large that the sum keeps eight digits; else a sum
    /// over triangles, which keeps more and takes longer.
    fn lobe(&self, n: DVec3, w: DVec3, k: f64) -> f64 {
        let edges = self.pieces.iter().map(|edge| [edge.from, edge.to]);
        let whole = (self.is_wide(WIDE) && self.is_above(n))
            .then(|| phong_polygon::boundary_irradiance(edges, &self.plane, n, w, k));
        whole.flatten().unwrap_or_else(|| {
            let sum = self.triangles(|triangle| phong_polygon::irradiance(triangle, n, w, k));
            sum.max(0.0)
        })
    }

    /// Whether the square of the light's sides is more than `least` times that of its distance.
    fn is_wide(&self, least: f64) -> bool {
        let [origin, along_p, along_q] = self.plane;
        let side = along_p.length_squared().min(along_q.length_squared());
        side > least * origin.length_squared()
    }

    /// The sum of an integral over triangles relative to the shading point, which with their signs
    /// make up what is visible.
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

/// The light's corners in its plane; with an interpolated normal, of the part above the surface's
/// own horizon (the closed forms clip to the normal's).
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
