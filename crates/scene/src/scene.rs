//! [`SceneDescription`]: a scene as triangles in world space with materials, lights, a camera and a
//! film, and the queries of it that a renderer needs.

use crate::alpha::Alpha;
use crate::camera::Camera;
use crate::emission::EmissionMap;
use crate::film::FilmSettings;
use crate::footprint::Footprint;
use crate::image::ImageData;
use crate::material::{Material, MaterialKind};
use crate::texture::ImageTexture;
use linelit_geometry::{ConvexPolygon, DVec3, Rounding, origin_of_box};
use linelit_lights::{AreaLight, Emission, Light, Profile, Sky, Sphere};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Triangles that share a material and vertex attributes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mesh {
    /// The range of the mesh's triangles in the scene's list.
    pub triangles: Range<u32>,
    /// The index of the mesh's material in the scene's list.
    pub material: u32,
    /// Whether the outside is opposite to the right-hand normal of the vertex order (pbrt:
    /// `ReverseOrientation` or a transform that mirrors, but not both). The outside of a mesh with
    /// vertex normals is where they point instead.
    pub flipped: bool,
    /// Whether the vertices of the mesh have normals.
    pub has_normals: bool,
    /// Whether the vertices of the mesh have texture coordinates; otherwise the corners of each
    /// triangle have the coordinates (0, 0), (1, 0), (1, 1), as in pbrt.
    pub has_uvs: bool,
    /// The masks that cut holes into the mesh, if there are any.
    pub cutout: Option<Cutout>,
    /// Whether the mesh casts no shadow; cameras see it nevertheless.
    pub casts_no_shadow: bool,
}

/// The masks that cut holes into a mesh, as indices into [`SceneDescription::alphas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cutout {
    /// The mask of the points that the camera sees; `None` means all points.
    pub seen: Option<u32>,
    /// The mask of the points that cast shadows, among the points that the camera sees; `None`
    /// means that all of these points do.
    pub shadow: Option<u32>,
}

/// A light, and the triangles that are its surface in the scene's list.
#[derive(Clone, Debug)]
pub struct SceneLight {
    /// The light as it is sampled; it can be shared with other lists of lights.
    pub light: Arc<Light>,
    /// The triangles of an area light, which rays towards it must not count as occluders; empty
    /// for other lights.
    pub triangles: Range<u32>,
    /// The texture of an area light whose emission varies over it; `light` then has the mean.
    pub map: Option<EmissionMap>,
    /// The profile of an area light, a factor by which its emission depends on the direction. The
    /// mean of the factor, weighted by the cosine, is one.
    pub profile: Option<Arc<Profile>>,
}

impl SceneLight {
    /// Returns the radiance that a camera sees of an area light at texture coordinates or over a
    /// footprint, in the unit direction `outgoing` from the light; zero for other lights.
    pub fn shown(&self, at: impl Into<Footprint>, outgoing: DVec3) -> DVec3 {
        let Light::Area(area) = &*self.light else {
            return DVec3::ZERO;
        };
        let normal = area.polygon.normal();
        let side = normal.dot(outgoing);
        let mean = area.emission.towards(side);
        if mean == DVec3::ZERO {
            return mean;
        }
        let radiance = self.map.as_ref().map_or(mean, |map| map.evaluate(at));
        let factor = |profile: &Arc<Profile>| profile.on_surface(normal * side.signum(), outgoing);
        radiance * self.profile.as_ref().map_or(DVec3::ONE, factor)
    }
}

/// An emissive sphere, disk or curved side of a cylinder as a whole, without a texture. The scene
/// also has its facets, as triangles and as polygonal lights; a renderer samples one or the other.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundLight {
    /// The round light in world space, which emits outwards; a disk's normal is on the emitting
    /// side.
    pub light: Light,
    /// Whether the shape emits outwards alone, so that `light` can replace the facets; always true
    /// for disks.
    pub outward: bool,
    /// The range of the shape's facets in the scene's list of lights.
    pub lights: Range<u32>,
    /// The range of the shape's facets in the scene's list of triangles.
    pub triangles: Range<u32>,
}

/// The numbers of objects that a file places by reference and of their instances, each of which
/// has become a copy: pbrt's objects, and glTF's meshes that several nodes refer to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placed {
    /// The number of objects with an instance.
    pub objects: usize,
    /// The number of instances of all objects together.
    pub instances: usize,
}

/// The description of a scene from a file: triangles in world space, materials, lights, camera and
/// film. (`linelit::Scene` is another type: it answers queries about points.)
///
/// The `f32` vertices *are* the geometry: transforms are applied in `f64`, and the results are
/// rounded once, relative to an origin, which is zero unless the scene is far from the world's
/// origin. Lights and camera are in world space, and so are the points that
/// [`SceneDescription::corners`] returns.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// Vertex positions relative to [`SceneDescription::origin`], all finite.
    pub positions: Vec<[f32; 3]>,
    /// The vertex indices of each triangle, all in range, in the order of the files.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, of unit length, or zero for meshes without normals; as many as `positions`,
    /// or empty if no mesh has normals.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; as many as `positions`, or empty if no mesh has any.
    pub uvs: Vec<[f32; 2]>,
    /// Meshes, in the order of their triangles, which they cover without gaps.
    pub meshes: Vec<Mesh>,
    /// The alpha masks that cut holes into meshes.
    pub alphas: Vec<Alpha>,
    /// The materials; the first is a grey matte.
    pub materials: Vec<Material>,
    /// The lights.
    pub lights: Vec<SceneLight>,
    /// Emissive spheres, disks and cylinders as wholes, in the order of their facets in `lights`.
    pub round: Vec<RoundLight>,
    /// Whether a lamp was added to the lights because the scene's file has no light.
    pub has_lamp: bool,
    /// The numbers of objects that the file places by reference, and of their instances. The copies
    /// are among the meshes.
    pub placed: Placed,
    /// The camera.
    pub camera: Camera,
    /// Size, crop and filter of the picture.
    pub film: FilmSettings,
    /// The point of the world relative to which vertices are stored.
    pub origin: DVec3,
    /// The first triangle, the end of the range and the index of each area light, in ascending
    /// order.
    pub(crate) light_ranges: Vec<(u32, u32, u32)>,
    /// The lower and the upper corner of the box around the vertices that triangles use, before
    /// rounding.
    pub(crate) used: [DVec3; 2],
    /// The largest distance by which rounding moved one of the vertices that triangles use.
    pub(crate) displacement: f64,
}

impl SceneDescription {
    /// Returns the three corners of a triangle in world space, as they are after rounding.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| self.vertex(i))
    }

    /// Returns the position of a vertex in world space, in metres: its stored `f32` coordinates,
    /// which are relative to [`SceneDescription::origin`], plus the origin.
    pub fn vertex(&self, index: u32) -> DVec3 {
        to_f64(self.positions[index as usize]) + self.origin
    }

    /// Returns the best origin for this scene, the [`origin_of_box`] of the vertices that triangles
    /// use, if [`SceneBuilder::origin`](crate::SceneBuilder::origin) was another: a reader then
    /// builds the scene again with this origin. `None` if the scene was built with the best origin.
    pub fn better_origin(&self) -> Option<DVec3> {
        let [low, high] = self.used;
        let origin = origin_of_box(low, high);
        (origin != self.origin).then_some(origin)
    }

    /// Returns the distance by which rounding moved vertices, compared with the median of the edges
    /// (of at most 4096 triangles).
    pub fn rounding(&self) -> Rounding {
        let every = self.triangles.len().div_ceil(MEASURED).max(1);
        let measured = self.triangles.iter().step_by(every);
        let sides = measured.flat_map(|t| {
            let [a, b, c] = t.map(|i| to_f64(self.positions[i as usize]));
            [a.distance(b), b.distance(c), c.distance(a)]
        });
        Rounding::new(self.displacement, &mut sides.collect::<Vec<_>>())
    }

    /// Returns the index of the mesh that a triangle belongs to. The time is logarithmic in the
    /// number of meshes.
    pub fn mesh_of(&self, triangle: u32) -> u32 {
        let next = self.meshes.partition_point(|m| m.triangles.end <= triangle);
        u32::try_from(next).unwrap_or(u32::MAX)
    }

    /// Returns the index of the material of a triangle. The time is logarithmic in the number of
    /// meshes.
    pub fn material_of(&self, triangle: u32) -> u32 {
        self.meshes[self.mesh_of(triangle) as usize].material
    }

    /// Returns the index of the area light that a triangle belongs to, if it emits. The time is
    /// logarithmic in the number of lights.
    pub fn light_of(&self, triangle: u32) -> Option<u32> {
        let k = self.light_ranges.partition_point(|r| r.1 <= triangle);
        let (start, _, light) = *self.light_ranges.get(k)?;
        (start <= triangle).then_some(light)
    }

    /// Returns the round shape that the light with this index is a facet of, if the shape can be
    /// sampled as a whole because it emits outwards. The whole shape is referred to by the index of
    /// its first facet. The time is logarithmic in the number of round shapes.
    #[must_use]
    pub fn whole_of(&self, light: u32) -> Option<&RoundLight> {
        let k = self.round.partition_point(|r| r.lights.end <= light);
        let round = self.round.get(k)?;
        (round.outward && round.lights.contains(&light)).then_some(round)
    }

    /// Returns the reflectance of the diffuse part of a material, a linear RGB colour in [0, 1].
    /// For a mixture it is the mixture of the reflectances of its two materials.
    pub fn diffuse_reflectance(&self, material: u32, at: impl Into<Footprint>) -> DVec3 {
        let at = at.into();
        let material = &self.materials[material as usize];
        match &material.kind {
            // The parts of a mixture have smaller indices, so this ends.
            MaterialKind::Mix {
                materials: [a, b],
                amount,
            } => {
                let t = amount.evaluate(at).clamp(DVec3::ZERO, DVec3::ONE);
                self.diffuse_reflectance(*a, at) * (DVec3::ONE - t)
                    + self.diffuse_reflectance(*b, at) * t
            }
            _ => material.diffuse_reflectance(at),
        }
    }

    /// Returns whether any texture of a material or a light varies over a surface, so that lookups
    /// need the footprint of a pixel.
    pub fn has_textures(&self) -> bool {
        self.materials.iter().any(Material::varies) || self.lights.iter().any(|l| l.map.is_some())
    }

    /// Builds the mipmaps of all images of materials and lights, which the first lookups would
    /// otherwise do.
    pub fn prepare_textures(&self) {
        let mut make = |image: &ImageTexture| {
            image.data.mipmap(image.wrap);
        };
        for material in &self.materials {
            material.for_each_image(&mut make);
        }
        for map in self.lights.iter().filter_map(|light| light.map.as_ref()) {
            map.factor.for_each_image(&mut make);
        }
    }

    /// Returns the lower and the upper corner of the bounding box of all triangles and linear
    /// lights; `None` if there are none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut points = self.triangles.iter().flatten().map(|i| self.vertex(*i));
        let lines = self.lights.iter().filter_map(|l| match &*l.light {
            Light::Linear(line) => Some([line.segment.p0, line.segment.p1]),
            _ => None,
        });
        let mut others = lines.flatten();
        let first = points.next().or_else(|| others.next())?;
        let all = points.chain(others);
        Some(all.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
    }

    /// Sets the ball that holds the scene in all lights at infinity: the ball around its bounding
    /// box, or a ball of radius zero at the world's origin if the scene is empty.
    pub(crate) fn tell_lights_of_size(&mut self) {
        let (lo, hi) = self.bounds().unwrap_or_default();
        let ball = Sphere {
            center: 0.5 * (lo + hi),
            radius: 0.5 * lo.distance(hi),
        };
        for light in &mut self.lights {
            if matches!(*light.light, Light::Distant(_) | Light::Sky(_)) {
                Arc::make_mut(&mut light.light).set_scene(ball);
            }
        }
    }

    /// Returns the skies among the lights, which camera rays meet where they meet no surface.
    pub fn skies(&self) -> impl Iterator<Item = &Sky> {
        self.lights.iter().filter_map(|light| match &*light.light {
            Light::Sky(sky) => Some(sky),
            _ => None,
        })
    }

    /// Returns the size of the geometry in bytes.
    pub fn memory(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.meshes[..])
            + size_of_val(&self.lights[..])
    }

    /// Returns the size of all images of textures in bytes, with the mipmaps that have been built;
    /// each image counts once.
    pub fn texture_memory(&self) -> usize {
        let mut images: HashMap<*const ImageData, usize> = HashMap::new();
        let mut count = |image: &ImageTexture| {
            let bytes = image.data.memory() + image.data.pyramid_memory();
            images.insert(Arc::as_ptr(&image.data), bytes);
        };
        for material in &self.materials {
            material.for_each_image(&mut count);
        }
        for alpha in &self.alphas {
            alpha.texture.for_each_image(&mut count);
        }
        let skies = self.skies().map(Sky::memory);
        images.values().sum::<usize>() + skies.sum::<usize>()
    }

    /// Adds a flat black quadrilateral that emits on the side from which its corners run
    /// counter-clockwise. `radiance` is called with the area of the quadrilateral and returns the
    /// radiance. The result is false, and the scene unchanged, if the corners, rounded to `f32`, do
    /// not form a convex quadrilateral.
    ///
    /// The indices of other lights and of other triangles do not change.
    pub fn add_quad_light(
        &mut self,
        name: &str,
        corners: [DVec3; 4],
        radiance: impl FnOnce(f64) -> DVec3,
    ) -> bool {
        // Make the polygon from the corners as they are stored, so that the light lies exactly in
        // its triangles.
        let corners = corners.map(|p| to_f32(p - self.origin));
        let Ok(polygon) = ConvexPolygon::new(&corners.map(to_f64)) else {
            return false;
        };
        let polygon = polygon.moved(self.origin);
        let emission = Emission::one_sided(radiance(polygon.area()));
        // Add a mesh of two triangles with a black material.
        let index = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (base, first) = (index(self.positions.len()), index(self.triangles.len()));
        self.positions.extend(corners);
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), [0.0; 3]);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), [0.0; 2]);
        }
        self.triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|k| base + k)));
        self.meshes.push(Mesh {
            triangles: first..first + 2,
            material: index(self.materials.len()),
            flipped: false,
            has_normals: false,
            has_uvs: false,
            cutout: None,
            casts_no_shadow: false,
        });
        self.materials.push(Material::matte(name, DVec3::ZERO));
        // Add the light.
        self.light_ranges
            .push((first, first + 2, index(self.lights.len())));
        self.lights.push(SceneLight {
            light: Arc::new(Light::Area(AreaLight { polygon, emission })),
            triangles: first..first + 2,
            map: None,
            profile: None,
        });
        true
    }

    /// Changes the number of pixels across and down; the crop becomes the whole picture.
    pub fn set_resolution(&mut self, width: u32, height: u32) {
        self.film.width = width;
        self.film.height = height;
        self.film.crop = [0, width, 0, height];
        self.camera.set_resolution(width, height);
    }
}

/// The largest number of triangles whose edges are used for the median in
/// [`SceneDescription::rounding`].
const MEASURED: usize = 1 << 12;

/// Returns the unit normal on the outside of a triangle: `winding`, the right-hand normal of the
/// vertex order, or its opposite. The outside is where the vertex normal points; for a vertex
/// normal of zero it is opposite to `winding` if the mesh is flipped.
pub(crate) fn outward(winding: DVec3, vertex_normal: DVec3, flipped: bool) -> DVec3 {
    let inside_out = if vertex_normal == DVec3::ZERO {
        flipped
    } else {
        winding.dot(vertex_normal) < 0.0
    };
    if inside_out { -winding } else { winding }
}

/// Returns a stored vector in double precision.
pub(crate) fn to_f64([x, y, z]: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Returns a vector rounded to single precision, which may overflow to infinity.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the renderer's geometry is f32"
)]
pub(crate) fn to_f32(p: DVec3) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}
