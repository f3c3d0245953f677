//! Shapes that a file says once and places many times.

use crate::assembly::Assembly;
use crate::diagnostics::{ErrorKind, Location, Place, Result};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use linelit_scene::{Instance, MAX_COORDINATE, MeshData, Placement};
use std::rc::Rc;

/// Whether what a file places many times is kept once, with a transform for each place, or copied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instancing {
    /// Kept once where that saves at least [`Instancing::SAVED`] triangles, of objects of at least
    /// [`Instancing::FEW`].
    #[default]
    Auto,
    /// Kept once.
    Always,
    /// Copied.
    Never,
}

impl Instancing {
    /// Triangles that instances must save: copies take some 150 MB. What is copied has soft shadows
    /// in closed form: 64 copies of 1,058 triangles are 8 times faster by `hybrid` than instances;
    /// from 1 to 3 million saved triangles on, instances win or tie.
    pub const SAVED: usize = 1 << 20;

    /// Objects of fewer triangles are copied however often they stand in the scene: each instance
    /// costs as much as some of them.
    pub const FEW: usize = 64;
}

/// A shape of an object and its place there.
pub type ObjectShape = (Rc<MeshData>, Placement);

/// An object, for [`Assembly::add_instance`].
#[derive(Clone, Copy, Debug)]
pub struct ObjectId(usize);

/// An object whose instances are still being counted.
#[derive(Debug)]
pub(crate) struct Waiting {
    shapes: Vec<ObjectShape>,
    /// Where it is said.
    at: Place,
    /// The corners of a box that holds it.
    bounds: [DVec3; 2],
    /// Kept in any case.
    once: bool,
    /// No transform is too uneven for that.
    can_stand: bool,
    instances: Vec<DAffine3>,
}

impl Assembly {
    /// Remembers shapes to be placed by [`Assembly::add_instance`]; `None` if they are so few that
    /// they are better placed as copies, one by one, unless the file wants them kept `once`. None
    /// of them may emit.
    pub fn add_object(
        &mut self,
        shapes: Vec<ObjectShape>,
        once: bool,
        at: Location<'_>,
    ) -> Result<Option<ObjectId>> {
        let once = once || self.instancing == Instancing::Always;
        let few = match self.instancing {
            Instancing::Never => return Ok(None),
            Instancing::Always | Instancing::Auto if once => 1,
            Instancing::Always | Instancing::Auto => Instancing::FEW,
        };
        let mut kept = Vec::new();
        for shape in shapes {
            self.warn_about_coordinates(&shape.0, &shape.1, at)?;
            if shape.1.is_singular() {
                let message = "a shape of an object is flattened by its transform";
                self.warn(ErrorKind::BadTransform, message, "left out", at)?;
            } else {
                kept.push(shape);
            }
        }
        let triangles: usize = kept.iter().map(|(mesh, _)| mesh.triangles.len()).sum();
        if triangles < few {
            return Ok(None);
        }
        let points = kept.iter().flat_map(|(mesh, place)| {
            let to_world = place.to_world;
            mesh.positions
                .iter()
                .map(move |p| to_world.transform_point3(*p))
        });
        let all = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = points.fold(all, |(lo, hi), p| (lo.min(p), hi.max(p)));
        self.waiting.push(Waiting {
            shapes: kept,
            at: at.place(),
            bounds: [lo, hi],
            once,
            can_stand: true,
            instances: Vec::new(),
        });
        Ok(Some(ObjectId(self.waiting.len() - 1)))
    }

    /// Places an object; `what` it is, for messages.
    pub fn add_instance(
        &mut self,
        object: ObjectId,
        to_world: DAffine3,
        what: &str,
        at: Location<'_>,
    ) -> Result<()> {
        let place = Placement {
            to_world,
            ..Placement::default()
        };
        if place.is_singular() {
            let message = format!("{what} is flattened by its transform");
            return self.warn(ErrorKind::BadTransform, message, "left out", at);
        }
        let object = &mut self.waiting[object.0];
        let [lo, hi] = object.bounds;
        // No corner of the box is farther out on any axis, before rounding.
        let m = to_world.matrix3;
        let far = lo.abs().max(hi.abs());
        let most = m.x_axis.abs() * far.x + m.y_axis.abs() * far.y + m.z_axis.abs() * far.z;
        let most = most + to_world.translation.abs();
        if !(most.max_element() <= (1.0 - 1e-6) * f64::from(MAX_COORDINATE)) {
            let message = format!("{what} reaches beyond {MAX_COORDINATE:.2e} of the origin");
            return Err(at.error(ErrorKind::OutOfRange, message, "after its transform"));
        }
        if object.instances.len() >= self.max_triangles {
            let message = format!("more than {} instances", self.max_triangles);
            return Err(at.error(ErrorKind::Limit, message, "this one is too many"));
        }
        object.instances.push(to_world);
        object.can_stand &= Instance::can_stand(&to_world);
        Ok(())
    }

    /// Puts the objects into the scene: those worth it as instances, others as copies.
    pub(crate) fn place_objects(&mut self) -> Result<()> {
        for object in std::mem::take(&mut self.waiting) {
            let at = object.at.location();
            let shapes = object.shapes.iter();
            let shapes: Vec<_> = shapes.map(|(mesh, place)| (&**mesh, *place)).collect();
            let count = object.instances.len();
            if object.can_stand && (count > 1 || object.once) {
                let (index, added) = self
                    .builder
                    .add_object(&shapes)
                    .map_err(|error| self.refused(error, "the object", None, at))?;
                let kept = self.builder.object(index).triangles.len();
                let saved = kept * count.saturating_sub(1);
                let pays = kept >= Instancing::FEW && saved >= Instancing::SAVED;
                if kept > 0 && (pays || object.once) {
                    let total = kept + added.degenerate;
                    self.warn_about_degenerate(added.degenerate, total, at)?;
                    for to_world in object.instances {
                        let added = self.builder.add_instance(index, to_world);
                        added.map_err(|error| self.refused(error, "an instance", None, at))?;
                    }
                    continue;
                }
                self.builder.remove_last_object();
            }
            for to_world in &object.instances {
                for (mesh, place) in &shapes {
                    let place = Placement {
                        to_world: *to_world * place.to_world,
                        ..*place
                    };
                    self.add_mesh(mesh, &place, "the object", at)?;
                }
            }
        }
        Ok(())
    }
}
