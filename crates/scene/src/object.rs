//! Meshes that stand in a scene many times.

use crate::builder::{AddError, Added, MAX_COORDINATE, MeshData, Placement, SceneBuilder};
use crate::scene::{Mesh, Scene, to_f64};
use linelit_geometry::glam::{DAffine3, DMat3};
use linelit_geometry::{DVec2, DVec3};

/// Meshes with their vertices, in a space of their own.
#[derive(Clone, Debug, Default)]
pub struct Object {
    /// Vertex positions, all finite.
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices, all in range.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, as [`Scene::normals`].
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, as [`Scene::uvs`].
    pub uvs: Vec<[f32; 2]>,
    /// Its meshes, in the order of their triangles, which they cover without gaps.
    pub meshes: Vec<Mesh>,
}

/// An object at a place. It emits nothing: what emits is in the scene itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into the scene's objects.
    pub object: u32,
    /// From the object's space to the world; it can be inverted.
    pub to_world: DAffine3,
}

/// A triangle as a ray meets it: one of the scene's own, or one of an instance's object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index into the scene's instances; `None`: the triangle is the scene's own.
    pub instance: Option<u32>,
    /// The triangle in the list of the scene or of the object.
    pub triangle: u32,
}

impl Instance {
    /// The most by which the longest image of a unit vector may exceed the shortest, in the sense
    /// of the largest sums of rows.
    pub const LARGEST_CONDITION: f64 = 1e7;

    /// Whether a transform can be undone well enough.
    #[must_use]
    pub fn can_stand(to_world: &DAffine3) -> bool {
        let norm = |m: &DMat3| {
            let rows = [0, 1, 2].map(|k| m.row(k).abs().element_sum());
            rows.into_iter().fold(0.0, f64::max)
        };
        let m = to_world.matrix3;
        // Not a number is not less; nor is what overflows or underflows.
        to_world.is_finite()
            && m.determinant().is_normal()
            && norm(&m) * norm(&m.inverse()) < Self::LARGEST_CONDITION
    }
}

impl From<u32> for Place {
    /// A triangle of the scene's own.
    fn from(triangle: u32) -> Self {
        Self {
            instance: None,
            triangle,
        }
    }
}

impl Object {
    /// The index of the mesh that a triangle belongs to. Logarithmic in the number of meshes.
    #[must_use]
    pub fn mesh_of(&self, triangle: u32) -> u32 {
        mesh_of(&self.meshes, triangle)
    }

    /// Bytes that it takes.
    #[must_use]
    pub fn memory(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.meshes[..])
    }

    /// The corners of the smallest box that holds it; `None` without vertices.
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let points = self.positions.iter().map(|p| (to_f64(*p), to_f64(*p)));
        points.reduce(|(lo, hi), (p, _)| (lo.min(p), hi.max(p)))
    }

    /// Gives vertices without normals or coordinates zero ones where others have some.
    pub(crate) fn fill(&mut self) {
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), [0.0; 3]);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), [0.0; 2]);
        }
    }
}

/// The index of the mesh that a triangle belongs to.
pub(crate) fn mesh_of(meshes: &[Mesh], triangle: u32) -> u32 {
    let k = meshes.partition_point(|m| m.triangles.end <= triangle);
    u32::try_from(k).unwrap_or(u32::MAX)
}

/// A triangle in the world.
pub(crate) struct InWorld<'s> {
    pub mesh: &'s Mesh,
    pub points: [DVec3; 3],
    /// Zero of a mesh that has none.
    pub normals: [DVec3; 3],
    pub uvs: [DVec2; 3],
    /// As [`Mesh::flipped`], in the world.
    pub flipped: bool,
    /// How large coordinates are that visibility rounds, in units of the world, beside those of
    /// the points themselves.
    pub reach: f64,
}

impl Scene {
    /// The mesh of a triangle, one of the scene's own or of an object's. Logarithmic in the number
    /// of meshes.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn mesh(&self, place: impl Into<Place>) -> &Mesh {
        let Place { instance, triangle } = place.into();
        match instance {
            None => &self.meshes[self.mesh_of(triangle) as usize],
            Some(instance) => {
                let object = self.object_of(instance);
                &object.meshes[object.mesh_of(triangle) as usize]
            }
        }
    }

    /// The object that stands there as an instance.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn object_of(&self, instance: u32) -> &Object {
        &self.objects[self.instances[instance as usize].object as usize]
    }

    /// Triangles in the world: the scene's own, and those of the objects once for each instance.
    pub fn triangles_in_world(&self) -> usize {
        let of_instance = |i: &Instance| self.objects[i.object as usize].triangles.len();
        self.triangles.len() + self.instances.iter().map(of_instance).sum::<usize>()
    }

    /// The corners of boxes that hold the instances.
    pub(crate) fn instance_corners(&self) -> impl Iterator<Item = DVec3> {
        let boxes: Vec<_> = self.objects.iter().map(Object::bounds).collect();
        let corners = move |i: &Instance| {
            let bounds = boxes.get(i.object as usize).copied().flatten();
            let to_world = i.to_world;
            bounds
                .into_iter()
                .flat_map(move |b| box_corners(b, to_world))
        };
        self.instances.iter().flat_map(corners)
    }

    pub(crate) fn in_world(&self, place: Place) -> InWorld<'_> {
        let mesh = self.mesh(place);
        let Some(instance) = place.instance else {
            let indices = self.triangles[place.triangle as usize];
            return InWorld {
                mesh,
                points: indices.map(|i| to_f64(self.positions[i as usize])),
                normals: corner_normals(&self.normals, mesh, indices),
                uvs: mesh.corner_uvs(&self.uvs, indices),
                flipped: mesh.flipped,
                reach: 0.0,
            };
        };
        let object = self.object_of(instance);
        let to_world = &self.instances[instance as usize].to_world;
        let indices = object.triangles[place.triangle as usize];
        let points = indices.map(|i| to_f64(object.positions[i as usize]));
        let far = points.iter().map(|p| p.abs().max_element());
        let m = to_world.matrix3;
        let longest = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.abs().max_element());
        let turned = normal_matrix(&m);
        let normals = corner_normals(&object.normals, mesh, indices);
        InWorld {
            mesh,
            points: points.map(|p| to_world.transform_point3(p)),
            normals: normals.map(|n| (turned * n).normalize_or_zero()),
            uvs: mesh.corner_uvs(&object.uvs, indices),
            flipped: mesh.flipped != (m.determinant() < 0.0),
            reach: far.fold(0.0, f64::max) * longest.iter().sum::<f64>(),
        }
    }
}

fn corner_normals(normals: &[[f32; 3]], mesh: &Mesh, indices: [u32; 3]) -> [DVec3; 3] {
    if mesh.has_normals {
        indices.map(|i| to_f64(normals[i as usize]))
    } else {
        [DVec3::ZERO; 3]
    }
}

fn box_corners((lo, hi): (DVec3, DVec3), to_world: DAffine3) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |k| {
        let side = |axis: usize| {
            if k >> axis & 1 == 0 {
                lo[axis]
            } else {
                hi[axis]
            }
        };
        to_world.transform_point3(DVec3::new(side(0), side(1), side(2)))
    })
}

/// The inverse transpose up to a positive factor: the cofactor matrix with the sign of the
/// determinant.
pub(crate) fn normal_matrix(m: &DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    cofactors * m.determinant().signum()
}

/// Whether a map flattens space.
pub(crate) fn is_singular(m: &DMat3) -> bool {
    let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    m.determinant().abs() <= 1e-14 * size
}

impl SceneBuilder {
    /// Adds an object to stand in the scene as instances, and gives its index and what was made
    /// of its meshes, as [`SceneBuilder::add_mesh`] makes it. Nothing of it emits: what
    /// [`Placement::emission`] says is left out.
    ///
    /// # Errors
    /// As [`SceneBuilder::add_mesh`].
    pub fn add_object(
        &mut self,
        meshes: &[(&MeshData, Placement)],
    ) -> Result<(u32, Added), AddError> {
        let world = std::mem::take(&mut self.world);
        self.elsewhere += world.triangles.len();
        let mut all = Added::default();
        let mut result = Ok(());
        for (mesh, place) in meshes {
            let place = Placement {
                emission: None,
                ..*place
            };
            match self.add_mesh(mesh, &place) {
                Ok(added) => all.degenerate += added.degenerate,
                Err(error) => {
                    result = Err(error);
                    break;
                }
            }
        }
        let mut object = std::mem::replace(&mut self.world, world);
        self.elsewhere -= self.world.triangles.len();
        result?;
        object.fill();
        self.elsewhere += object.triangles.len();
        self.objects.push(object);
        let index = u32::try_from(self.objects.len() - 1).unwrap_or(u32::MAX);
        Ok((index, all))
    }

    /// Adds an instance of an object.
    ///
    /// # Errors
    /// When the transform flattens space, or stretches it so unevenly that it cannot be undone to
    /// `f64` ([`Instance::LARGEST_CONDITION`]), when a corner of the object's box would be further
    /// than [`MAX_COORDINATE`] from the origin, or when there are too many.
    ///
    /// # Panics
    /// When there is no such object.
    pub fn add_instance(&mut self, object: u32, to_world: DAffine3) -> Result<(), AddError> {
        if !Instance::can_stand(&to_world) {
            return Err(AddError::Singular);
        }
        if self.instances.len() >= self.max_triangles {
            return Err(AddError::TooMany);
        }
        let bounds = self.objects[object as usize].bounds();
        let most = f64::from(MAX_COORDINATE);
        let corners = bounds.into_iter().flat_map(|b| box_corners(b, to_world));
        if corners
            .into_iter()
            .any(|p| !(p.abs().max_element() <= most))
        {
            return Err(AddError::InstanceTooFar);
        }
        self.instances.push(Instance { object, to_world });
        Ok(())
    }

    /// An object that was added.
    ///
    /// # Panics
    /// When there is no such object.
    #[must_use]
    pub fn object(&self, index: u32) -> &Object {
        &self.objects[index as usize]
    }

    /// Takes the object that was added last away, with its instances.
    pub fn remove_last_object(&mut self) {
        if let Some(object) = self.objects.pop() {
            self.elsewhere -= object.triangles.len();
            let left = self.objects.len();
            self.instances.retain(|i| (i.object as usize) < left);
        }
    }
}
