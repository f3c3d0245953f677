//! The light over the visible region of a round light is integrated here: over the disk that a
//! shading point sees of a sphere or a disk.

use super::boundary::visible_region;
use super::region::{CORNERS, KnownLight, RegionMemory, clip};
use crate::view::{LightView, Shape};
use linelit_bsdf::LtcMixture;
use linelit_geometry::{DVec3, EllipticCone, Frame};
use linelit_lights::{Disk, DiskCone, SphereProjected, around_unit_circle};
use linelit_penumbra::{BoundaryEdge, DiskEdge, PartOnDisk, Penumbra, Point};
use linelit_shading::elliptic_cone::PartOfCone;
use linelit_visibility::{Shaft, ShaftClass};
use std::f64::consts::FRAC_1_PI;

/// Sums over the boundary of disks that are smaller than this times their distance, and of narrower
/// cones, lose more than half of their digits.
const SMALL: f64 = 1e-4;

/// The irradiance of the visible part of a round light of radiance one. If `skip` is set, an empty
/// shaft integrates the whole light. `None` if the boundary cannot be found or is too narrow.
pub(crate) fn irradiance(
    view: &LightView<'_>,
    skip: bool,
    shaft: &mut Shaft<'_>,
    memory: &mut RegionMemory,
) -> Option<f64> {
    let disk = view.disk()?;
    if shaft.class() == ShaftClass::Empty
        && skip
        && let Some(whole) = whole(view, &disk)
    {
        return Some(whole);
    }
    let (penumbra, part) = (&mut memory.penumbra, &mut memory.on_disk);
    let seen = SeenDisk::new(view, &disk, shaft, penumbra, part)?;
    seen.irradiance(|p| p, view.at.normal)
}

/// The irradiance of a whole round light of radiance one: a sphere, which the shading horizon may
/// clip, or a disk above that horizon. `None` if horizons clip more than that.
fn whole(view: &LightView<'_>, disk: &Disk) -> Option<f64> {
    let (x, n) = (view.at.position, view.at.normal);
    let above = |normal: DVec3| {
        let rise = disk.radius * normal.cross(disk.normal).length();
        normal.dot(disk.center - x) >= rise
    };
    if view.at.has_two_horizons() && !above(view.at.geometric_normal) {
        return None;
    }
    match view.shape {
        Shape::Sphere(sphere) => {
            let seen = SphereProjected::new(sphere, x, n);
            Some(seen.map_or(0.0, |s| s.projected_solid_angle()))
        }
        _ if above(n) => Some(n.dot(DiskCone::new(disk, x).vector_irradiance()).max(0.0)),
        _ => None,
    }
}

/// The light ∫ V g dω of the visible part of a round light of radiance one; the LTCs g are stored
/// in the memory. `None` if the boundary cannot be found, and if the disk is too small or seen too
/// flatly.
pub(crate) fn cosines(
    view: &LightView<'_>,
    cosines: &LtcMixture,
    shaft: &mut Shaft<'_>,
    memory: &mut RegionMemory,
) -> Option<KnownLight> {
    memory.cosines.set(cosines);
    let (kept, disk) = (&memory.cosines, view.disk()?);
    let (penumbra, part) = (&mut memory.penumbra, &mut memory.on_disk);
    let seen = SeenDisk::new(view, &disk, shaft, penumbra, part)?;
    let frame = &kept.frame;
    let mut sum = kept.diffuse;
    if sum != DVec3::ZERO {
        sum *= seen.irradiance(|p| p, frame.z)?;
    }
    for (ltc, albedo) in &kept.lobes {
        let image = |p| ltc.to_cosine() * frame.to_local(p);
        sum += *albedo * seen.irradiance(image, DVec3::Z)?;
    }
    let (light, plane) = (sum * FRAC_1_PI, None);
    Some(KnownLight { light, plane })
}

/// The visible part of a disk above the horizons, as a point sees it.
pub(crate) struct SeenDisk<'a> {
    /// The boundary, in units of the radius along the axes.
    pub edges: &'a [DiskEdge],
    /// The centre relative to the shading point.
    pub center: DVec3,
    /// Two orthogonal radii, counter-clockwise about the direction from the shading point.
    pub axes: [DVec3; 2],
}

impl<'a> SeenDisk<'a> {
    /// Finds the visible part. `None` if the shaft has not collected its occluders, or the disk is
    /// too small or seen too flatly.
    fn new(
        view: &LightView<'_>,
        disk: &Disk,
        shaft: &mut Shaft<'_>,
        penumbra: &mut Penumbra,
        part: &'a mut PartOnDisk,
    ) -> Option<Self> {
        let (x, normal, radius) = (view.at.position, disk.normal, disk.radius);
        let center = disk.center - x;
        if !is_wide(radius, center, normal) {
            return None;
        }
        let horizons = (view.at.horizons())
            .map(|n| (n.dot(center) < radius * n.cross(normal).length()).then_some(n));
        Self::within(disk, x, horizons, shaft, penumbra, part)
    }

    /// Finds the visible part of a disk of any size, above those horizons that clip it. `None` if
    /// the shaft has not collected its occluders.
    pub(crate) fn within(
        disk: &Disk,
        x: DVec3,
        horizons: [Option<DVec3>; 2],
        shaft: &mut Shaft<'_>,
        penumbra: &mut Penumbra,
        part: &'a mut PartOnDisk,
    ) -> Option<Self> {
        // Choose two radii as axes, which are counter-clockwise as the point sees them.
        let (center, radius) = (disk.center - x, disk.radius);
        let frame = Frame::from_normal(disk.normal);
        let height = disk.normal.dot(center);
        let axes = [frame.x * radius, frame.y * radius.copysign(height)];
        // Find the boundary: it is empty, the rim, what horizons leave of the disk, or what
        // occluders leave.
        let mut room = [[[0.0; 2]; CORNERS]; 2];
        let mut corners = [[0.0; 2]; CORNERS];
        let edges: &[DiskEdge] = match shaft.class() {
            ShaftClass::Blocked => &[],
            ShaftClass::Empty if horizons == [None; 2] => &[DiskEdge::Rim],
            ShaftClass::Empty => {
                let around = around_unit_circle();
                let polygon = above(&around, [center, axes[0], axes[1]], horizons, &mut room);
                let next = polygon.iter().cycle().skip(1);
                let sides = polygon.iter().zip(next);
                part.of(sides.map(|(&from, &to)| BoundaryEdge { from, to }))
            }
            ShaftClass::Partial => {
                let plane = shaft.light_plane()?;
                let (around, plane) = (plane.corners, plane.axes);
                corners[..around.len()].copy_from_slice(around);
                let polygon = above(&corners[..around.len()], plane, horizons, &mut room);
                let boundary = visible_region(shaft, penumbra, polygon)?;
                let to_disk = ToDisk::new(plane, center, axes);
                part.of(boundary.iter().map(|edge| to_disk.edge(edge)))
            }
        };
        Some(Self {
            edges,
            center,
            axes,
        })
    }

    /// Returns whether sums over the boundary keep at least half of their digits.
    pub(crate) fn is_wide(&self) -> bool {
        let [u, v] = self.axes;
        is_wide(u.length(), self.center, u.cross(v).normalize_or_zero())
    }

    /// Lambert's sum over the boundary after a linear map, for a normal. `None` if the map makes
    /// the disk too narrow.
    pub(crate) fn irradiance(&self, map: impl Fn(DVec3) -> DVec3, n: DVec3) -> Option<f64> {
        let (center, [u, v]) = (map(self.center), self.axes.map(&map));
        let cone = EllipticCone::over(center, u, v)?;
        if !(cone.tan[0] * cone.tan[1] > SMALL * SMALL) {
            return None;
        }
        // A map that mirrors reverses the boundary.
        let mirrors = center.dot(u.cross(v)) < 0.0;
        let at = |[p, q]: &Point| center + u * *p + v * *q;
        let mut sum = PartOfCone::new(&cone, n);
        for edge in self.edges {
            match edge {
                DiskEdge::Rim => sum.add_rim(),
                DiskEdge::Straight(a, b) if mirrors => sum.add_segment(at(b), at(a)),
                DiskEdge::Straight(a, b) => sum.add_segment(at(a), at(b)),
                DiskEdge::Arc(a, b, is_long) if mirrors => sum.add_arc(at(b), at(a), *is_long),
                DiskEdge::Arc(a, b, is_long) => sum.add_arc(at(a), at(b), *is_long),
            }
        }
        Some(sum.irradiance())
    }
}

/// Returns whether a disk is neither too small for sums over its boundary nor seen too flatly.
fn is_wide(radius: f64, center: DVec3, normal: DVec3) -> bool {
    let (distance, height) = (center.length(), normal.dot(center));
    radius > SMALL * distance && height.abs() > SMALL * (distance + radius)
}

/// The part of a polygon in a plane that is above some horizons.
fn above<'a>(
    polygon: &'a [Point],
    plane: [DVec3; 3],
    horizons: [Option<DVec3>; 2],
    room: &'a mut [[Point; CORNERS]; 2],
) -> &'a [Point] {
    let [first, second] = room;
    let mut polygon = polygon;
    for (n, out) in horizons.into_iter().zip([first, second]) {
        if let Some(n) = n {
            let count = clip(polygon, plane, n, out);
            polygon = &out[..count];
        }
    }
    polygon
}

/// The map from a plane's coordinates to the coordinates of a disk in that plane, in units of the
/// radius.
struct ToDisk {
    rows: [[f64; 3]; 2],
    /// Whether one of the two coordinate systems is left-handed relative to the other, so that
    /// boundaries are reversed.
    mirrors: bool,
}

impl ToDisk {
    fn new([origin, p, q]: [DVec3; 3], center: DVec3, axes: [DVec3; 2]) -> Self {
        let rows = axes.map(|axis| {
            let square = axis.length_squared();
            [origin - center, p, q].map(|v| v.dot(axis) / square)
        });
        let [[_, a, b], [_, c, d]] = rows;
        Self {
            rows,
            mirrors: a * d < b * c,
        }
    }

    fn edge(&self, edge: &BoundaryEdge) -> BoundaryEdge {
        let to = |[p, q]: Point| self.rows.map(|[zero, x, y]| zero + x * p + y * q);
        let (from, to) = (to(edge.from), to(edge.to));
        match self.mirrors {
            true => BoundaryEdge { from: to, to: from },
            false => BoundaryEdge { from, to },
        }
    }
}
