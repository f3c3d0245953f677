//! This module finds the visible part of a light from a point, as a fraction or as polygons.

use crate::{Luminaire, Workspace};
use linelit_estimators::{Measure, is_clear};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{DeltaSample, Disk, DistantLight, Light, PointLight};
use linelit_shading::cylinder;
use linelit_visibility::{LightCorners, Occluders, ShaftQuery};
use std::fmt;

/// The reason why the visible part of a light cannot be given exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// It cannot be found for lights of this shape, or not by this measure.
    Shape,
    /// A triangle reaches into a sphere on the side that the point sees, so that the visible part
    /// is not a part of the disk of its outline.
    Pierced,
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Shape => "visible parts have no exact answer for lights of this shape",
            Self::Pierced => "a triangle reaches into the sphere",
        })
    }
}

impl std::error::Error for Unknown {}

impl Luminaire {
    /// The fraction of the light that a point sees past the occluders, between 0 and 1. If the
    /// measure has a normal, it must be a unit vector. NaN if the measure of the whole light is
    /// zero. A sphere counts as the disk of its outline.
    ///
    /// # Errors
    /// Returns [`Unknown`] for cylinders, for skies, for the solid angle of a line, and for spheres
    /// that a triangle reaches into.
    pub fn visible_fraction(
        &self,
        occluders: &Occluders,
        point: DVec3,
        measure: Measure,
        workspace: &mut Workspace,
    ) -> Result<f64, Unknown> {
        match (&*self.light, measure) {
            // Find the visible region of lights with a surface.
            (Light::Area(area), _) => {
                let query = self.shaft(point, &area.polygon);
                let scratch = &mut workspace.buffers.scratch;
                workspace.region.find(occluders, query, scratch);
                Ok(workspace.region.fraction(measure))
            }
            (Light::Disk(_) | Light::Sphere(_), _) => {
                self.find_disk(occluders, point, workspace)?;
                Ok(workspace.disk.fraction(measure))
            }
            (Light::Linear(line), Measure::Area | Measure::Cosine(_)) => {
                Ok(self.fraction_of_line(occluders, point, &line.segment, measure, workspace))
            }
            // Send one shadow ray to a delta light, as if it emitted equally in all directions.
            (Light::Point(light), _) => {
                let even = PointLight {
                    intensity: DVec3::ONE,
                    profile: None,
                    ..*light
                };
                Ok(self.fraction_of_beam(occluders, point, even.beam(point), measure, workspace))
            }
            (Light::Distant(light), _) => {
                let even = DistantLight {
                    irradiance: DVec3::ONE,
                    ..light.clone()
                };
                Ok(self.fraction_of_beam(occluders, point, even.beam(point), measure, workspace))
            }
            _ => Err(Unknown::Shape),
        }
    }

    /// The visible part of a polygon, a disk or a sphere, as rings of corners. As the point sees
    /// them, rings around the visible part run counter-clockwise and rings around holes clockwise.
    ///
    /// # Errors
    /// Returns [`Unknown`] for lights of other shapes, and for spheres that a triangle reaches
    /// into.
    pub fn visible_rings(
        &self,
        occluders: &Occluders,
        point: DVec3,
        workspace: &mut Workspace,
    ) -> Result<Vec<Vec<DVec3>>, Unknown> {
        match &*self.light {
            Light::Area(area) => {
                let query = self.shaft(point, &area.polygon);
                let scratch = &mut workspace.buffers.scratch;
                workspace.region.find(occluders, query, scratch);
                Ok(workspace.region.rings())
            }
            Light::Disk(_) | Light::Sphere(_) => {
                self.find_disk(occluders, point, workspace)?;
                Ok(workspace.disk.rings())
            }
            _ => Err(Unknown::Shape),
        }
    }

    /// Finds the visible part of a disk, or of a sphere as the disk of its outline.
    fn find_disk(
        &self,
        occluders: &Occluders,
        point: DVec3,
        workspace: &mut Workspace,
    ) -> Result<(), Unknown> {
        // Replace a sphere by the disk of its outline, which does not exist from inside.
        let disk: Option<Disk> = match &*self.light {
            Light::Disk(light) => Some(light.disk),
            Light::Sphere(light) => light.sphere.outline(point),
            _ => None,
        };
        let Some(disk) = disk else {
            workspace.disk.hide(point);
            return Ok(());
        };
        // Find the visible part of the disk, unless an occluder reaches into the sphere.
        let (around, scratch) = (disk.around(), &mut workspace.buffers.scratch);
        let query = || self.shaft(point, &around);
        if let Light::Sphere(light) = &*self.light
            && !is_clear(occluders, &light.sphere, query(), scratch)
        {
            return Err(Unknown::Pierced);
        }
        workspace.disk.find(occluders, &disk, query(), scratch);
        Ok(())
    }

    /// The visible fraction of a line.
    fn fraction_of_line(
        &self,
        occluders: &Occluders,
        point: DVec3,
        line: &Segment,
        measure: Measure,
        workspace: &mut Workspace,
    ) -> f64 {
        // Find the visible pieces of the line.
        let ends = [line.p0, line.p1];
        let query = self.shaft(point, &ends);
        let mut shaft = occluders.shaft(query, &mut workspace.buffers.scratch);
        shaft.visible(&[*line], &mut workspace.lines);
        let Measure::Cosine(n) = measure else {
            // Adding zero turns the minus zero of an empty sum into zero.
            return workspace.lines.fraction(0) + 0.0;
        };
        // Add up their irradiance, relative to the irradiance of the whole line.
        let along = |lo: f64, hi: f64| {
            let piece = line.piece(lo, hi).relative_to(point);
            cylinder::irradiance(piece.p0, piece.p1, n)
        };
        let visible = workspace.lines.line(0).iter();
        let visible: f64 = visible.map(|part| along(part.lo, part.hi)).sum();
        let whole = along(0.0, 1.0);
        match whole > 0.0 {
            true => (visible / whole).min(1.0) + 0.0,
            false => f64::NAN,
        }
    }

    /// The visible fraction of a delta light, which is 0 or 1; NaN for a point at its position.
    fn fraction_of_beam(
        &self,
        occluders: &Occluders,
        point: DVec3,
        beam: Option<DeltaSample>,
        measure: Measure,
        workspace: &mut Workspace,
    ) -> f64 {
        let Some(beam) = beam else {
            return f64::NAN;
        };
        if let Measure::Cosine(n) = measure
            && n.dot(beam.direction) <= 0.0
        {
            return f64::NAN;
        }
        let rays = [beam.to_light];
        let fan = occluders.shadow_rays(point, &rays, self.margins);
        let hidden = occluders.any_hits(&fan, &self.triangles, &mut workspace.buffers.scratch);
        if hidden == 0 { 1.0 } else { 0.0 }
    }

    /// The query for the visible part of a light with these corners.
    fn shaft<'a>(&self, point: DVec3, corners: impl Into<LightCorners<'a>>) -> ShaftQuery<'a> {
        ShaftQuery {
            margins: self.margins,
            ..ShaftQuery::new(point, corners).excluding(self.triangles.clone())
        }
    }
}
