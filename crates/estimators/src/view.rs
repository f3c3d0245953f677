//! A view is a light as one shading point sees it: its shape, its emission, and the part of it
//! above the horizons.

use crate::light::LightSource;
use crate::point::{Receiver, ShadingPoint};
use linelit_geometry::{ConvexPolygon, DVec3, Margins, Segment};
use linelit_lights::{
    CylinderView, DeltaSample, Disk, Emission, Light, SeenSurface, SkyView, Sphere, Surface,
};
use std::ops::Range;

/// A light as one shading point sees it: its shape, its emission and the part above the horizons.
#[derive(Debug)]
pub(crate) struct LightView<'a> {
    /// The shading point.
    pub at: Receiver,
    /// The light's own triangles, which never block it.
    pub own: &'a Range<u32>,
    /// The distances from the point and from the light within which occluders hide nothing.
    pub margins: Margins,
    pub shape: Shape<'a>,
    emission: Emission,
    /// The part of a polygon above the horizons, if techniques are weighted, which draw on that
    /// part.
    pub above: Option<&'a Above>,
}

/// The shape of a light, as a shading point sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape<'a> {
    Polygon(&'a ConvexPolygon),
    Segment(&'a Segment),
    Sphere(&'a Sphere),
    Disk(&'a Disk),
    Cylinder(&'a CylinderView),
    Sky(SkyView<'a>),
    DeltaSample(DeltaSample),
}

/// The part of a polygon above both horizons.
#[derive(Debug)]
pub(crate) struct Above {
    pub polygon: ConvexPolygon,
    /// The angle from the first edge of this part to the first edge of the whole light, in radians,
    /// counter-clockwise about the normal. The angle of a direction from the whole light's first
    /// edge plus this is its angle from the part's first edge.
    pub turn: f64,
}

impl Above {
    /// Clips a polygon to both horizons. `None` if no part of it is above them.
    pub(crate) fn new(polygon: &ConvexPolygon, at: &Receiver) -> Option<Self> {
        let mut above = polygon.clip(at.position, at.normal)?;
        if at.has_two_horizons() {
            above = above.clip(at.position, at.geometric_normal)?;
        }
        let turn = polygon.plane_frame().turn_from(&above.plane_frame());
        Some(Self {
            polygon: above,
            turn,
        })
    }
}

impl<'a> LightView<'a> {
    /// Sees a light from a shading point. `None` if the point is behind a light that emits on one
    /// side or in its plane, if it does not see a cylinder, or if a delta light does not shine on
    /// it.
    pub(crate) fn new<R, T>(
        source: &'a LightSource<'a, T>,
        point: &ShadingPoint<R>,
        margins: Margins,
        seen: Option<&'a SeenSurface<'a>>,
    ) -> Option<Self> {
        let (x, margin) = (point.position, margins.light);
        let shape = match source.light {
            Light::Area(light) if !light.faces(x, margin) => return None,
            Light::Disk(light) if !light.faces(x, margin) => return None,
            Light::Area(light) => Shape::Polygon(&light.polygon),
            Light::Disk(light) => Shape::Disk(&light.disk),
            Light::Linear(light) => Shape::Segment(&light.segment),
            Light::Sphere(light) => Shape::Sphere(&light.sphere),
            Light::Cylinder(_) => match seen? {
                SeenSurface::Cylinder(view) => Shape::Cylinder(view),
                SeenSurface::Fixed(_) | SeenSurface::Sky(_) => return None,
            },
            Light::Sky(sky) => Shape::Sky(SkyView::new(sky, x)),
            Light::Point(_) | Light::Distant(_) => Shape::DeltaSample(source.light.beam(x)?),
        };
        Some(Self {
            at: point.receiver(),
            own: &source.triangles,
            margins,
            shape,
            emission: source.light.emission(),
            above: None,
        })
    }

    /// The surface of the light; `None` for a linear light and a delta light.
    pub(crate) fn surface(&self) -> Option<Surface<'_>> {
        Some(match &self.shape {
            Shape::Polygon(polygon) => Surface::Polygon(polygon),
            Shape::Segment(_) | Shape::DeltaSample(_) => return None,
            Shape::Sphere(sphere) => Surface::Sphere(sphere),
            Shape::Disk(disk) => Surface::Disk(disk),
            Shape::Cylinder(view) => Surface::Cylinder(view),
            Shape::Sky(view) => Surface::Sky(view),
        })
    }

    /// Returns whether no horizon of the shading point clips the cylinder.
    pub(crate) fn is_above(&self, cylinder: &CylinderView) -> bool {
        let above = |n: &DVec3| cylinder.heights(*n)[0] >= 0.0;
        self.at.horizons().iter().all(above)
    }

    /// The polygon of a polygonal light; `None` for other lights.
    pub(crate) const fn polygon(&self) -> Option<&'a ConvexPolygon> {
        match self.shape {
            Shape::Polygon(polygon) => Some(polygon),
            _ => None,
        }
    }

    /// The disk that a shading point sees of a round light. From outside, a sphere of one radiance
    /// looks like the flat disk of its outline. `None` inside a sphere, and for other lights.
    pub(crate) fn disk(&self) -> Option<Disk> {
        match self.shape {
            Shape::Sphere(sphere) => sphere.outline(self.at.position),
            Shape::Disk(disk) => Some(*disk),
            Shape::Polygon(_) | Shape::Segment(_) | Shape::Cylinder(_) => None,
            Shape::Sky(_) | Shape::DeltaSample(_) => None,
        }
    }

    /// The radiance that a light of one radiance sends to the shading point, and the height of the
    /// point above the light's plane, which is positive on the side of the normal. For a linear
    /// light the radiance is multiplied by the radius. For a light that is not flat the height is
    /// 1.
    pub(crate) fn emitted(&self) -> (DVec3, f64) {
        let x = self.at.position;
        let height = match self.shape {
            Shape::Polygon(polygon) => polygon.normal().dot(x - polygon.vertices()[0]),
            Shape::Disk(disk) => disk.normal.dot(x - disk.center),
            Shape::Segment(_) | Shape::Sphere(_) | Shape::Cylinder(_) => 1.0,
            Shape::Sky(_) | Shape::DeltaSample(_) => 1.0,
        };
        (self.emission.towards(height), height)
    }
}
