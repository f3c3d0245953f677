//! The scene: triangles in world space, materials, lights, camera and film.

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
    /// The range of its triangles in the scene's list.
    pub triangles: Range<u32>,
    /// Index into the scene's materials.
    pub material: u32,
    /// The outside is opposite to the right-hand normal of the vertex order (pbrt:
    /// `ReverseOrientation` or a transform that mirrors, but not both). Meshes with vertex
    /// normals are oriented by those instead.
    pub flipped: bool,
    /// Whether its vertices have normals.
    pub has_normals: bool,
    /// Whether its vertices have texture coordinates; otherwise the corners of each triangle are at
    /// (0, 0), (1, 0), (1, 1), as in pbrt.
    pub has_uvs: bool,
    /// The mask that cuts its holes, if it has any.
    pub cutout: Option<Cutout>,
    /// Whether it hides no light: views meet it all the same.
    pub casts_no_shadow: bool,
}

/// The holes of a mesh: which of its points are there, as indices into
/// [`SceneDescription::alphas`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cutout {
    /// The mask of the points that the camera sees; all if `None`.
    pub seen: Option<u32>,
    /// The mask of those points that also cast shadows; all of them if `None`.
    pub shadow: Option<u32>,
}

/// A light, and the triangles that look like it.
#[derive(Clone, Debug)]
pub struct SceneLight {
    /// The light as it is sampled; it can be shared with other lists of lights.
    pub light: Arc<Light>,
    /// The triangles of an area light, which rays towards it must not count as occluders; empty
    /// for a linear light.
    pub triangles: Range<u32>,
    /// Emission that varies over an area light; `light` has its mean.
    pub map: Option<EmissionMap>,
    /// The factor of the emission of an area light by direction; its mean, weighted by the cosine,
    /// is one.
    pub profile: Option<Arc<Profile>>,
}

impl SceneLight {
    /// Radiance that an area light shows at texture coordinates or over a footprint, in the unit
    /// direction `outgoing`; zero for other lights.
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

/// A whole emissive sphere, disk or side of a cylinder without a texture, whose facets are among
/// the lights.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundLight {
    /// The light in world space, as it is if it emits outwards; a disk's normal is on the emitting
    /// side.
    pub light: Light,
    /// Whether it emits outwards and no more, as `light` says; disks always do.
    pub outward: bool,
    /// The lights that stand for it.
    pub lights: Range<u32>,
    /// The range of its facets in the scene's list of triangles.
    pub triangles: Range<u32>,
}

/// The objects that a file places by reference, whose meshes are copied to each place: pbrt's
/// objects, and meshes of glTF that stand at several places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placed {
    /// The number of objects that stand somewhere.
    pub objects: usize,
    /// The number of places that they are put at.
    pub instances: usize,
}

/// The description of a scene, as files have it: triangles in world space, materials, lights,
/// camera and film. (`linelit::Scene` answers queries about points.)
///
/// The `f32` vertices *are* the geometry: transforms are applied in `f64` and rounded once,
/// relative to an origin, which is zero but for scenes that are far from the world's. Lights and
/// camera are in world space, and so are the points that [`SceneDescription::corners`] gives.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// Vertex positions relative to [`SceneDescription::origin`], all finite.
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices, all in range; in the order of the files.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, unit length or zero where a mesh has none; as long as `positions`, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates; as long as `positions`, or empty.
    pub uvs: Vec<[f32; 2]>,
    /// Meshes, in the order of their triangles, which they cover without gaps.
    pub meshes: Vec<Mesh>,
    /// The alpha masks that cut holes into meshes.
    pub alphas: Vec<Alpha>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Lights.
    pub lights: Vec<SceneLight>,
    /// Emissive spheres, disks and cylinders, which `lights` has as facets; in their order.
    pub round: Vec<RoundLight>,
    /// Whether one of the lights is a lamp that is not in the scene's file, which has none.
    pub has_lamp: bool,
    /// How many objects the file places by reference, and how often. Their copies are among the
    /// meshes.
    pub placed: Placed,
    /// The camera.
    pub camera: Camera,
    /// Size, crop and filter of the picture.
    pub film: FilmSettings,
    /// The point of the world relative to which vertices are stored.
    pub origin: DVec3,
    /// First and last triangle and index of each area light, in ascending order.
    pub(crate) light_ranges: Vec<(u32, u32, u32)>,
    /// The box around the vertices that triangles use, before rounding, and how far that moved one
    /// of them.
    pub(crate) used: [DVec3; 2],
    pub(crate) displacement: f64,
}

impl SceneDescription {
    /// The three corners of a triangle as they are stored, in world space.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| self.vertex(i))
    }

    /// The position of a vertex in world space, in metres: its stored `f32` coordinates, which are
    /// relative to [`SceneDescription::origin`], plus the origin.
    pub fn vertex(&self, index: u32) -> DVec3 {
        to_f64(self.positions[index as usize]) + self.origin
    }

    /// The origin that [`SceneBuilder::origin`](crate::SceneBuilder::origin) should have had:
    /// [`origin_of_box`] of the vertices that triangles use. `None` if it had.
    pub fn better_origin(&self) -> Option<DVec3> {
        let [low, high] = self.used;
        let origin = origin_of_box(low, high);
        (origin != self.origin).then_some(origin)
    }

    /// What rounding did to the vertices that triangles use.
    pub fn rounding(&self) -> Rounding {
        let every = self.triangles.len().div_ceil(MEASURED).max(1);
        let measured = self.triangles.iter().step_by(every);
        let sides = measured.flat_map(|t| {
            let [a, b, c] = t.map(|i| to_f64(self.positions[i as usize]));
            [a.distance(b), b.distance(c), c.distance(a)]
        });
        Rounding::new(self.displacement, &mut sides.collect::<Vec<_>>())
    }

    /// The index of the mesh that a triangle belongs to. Logarithmic in the number of meshes.
    pub fn mesh_of(&self, triangle: u32) -> u32 {
        let next = self.meshes.partition_point(|m| m.triangles.end <= triangle);
        u32::try_from(next).unwrap_or(u32::MAX)
    }

    /// The material of a triangle. Logarithmic in the number of meshes.
    pub fn material_of(&self, triangle: u32) -> u32 {
        self.meshes[self.mesh_of(triangle) as usize].material
    }

    /// The area light of a triangle, if it emits. Logarithmic in the number of lights.
    pub fn light_of(&self, triangle: u32) -> Option<u32> {
        let k = self.light_ranges.partition_point(|r| r.1 <= triangle);
        let (start, _, light) = *self.light_ranges.get(k)?;
        (start <= triangle).then_some(light)
    }

    /// The round shape that takes the place of a light, by its number, where round shapes are
    /// sampled as they are: the light is one of its facets, and it emits outwards. The whole shape
    /// goes by the number of its first facet. Logarithmic in the number of round shapes.
    #[must_use]
    pub fn whole_of(&self, light: u32) -> Option<&RoundLight> {
        let k = self.round.partition_point(|r| r.lights.end <= light);
        let round = self.round.get(k)?;
        (round.outward && round.lights.contains(&light)).then_some(round)
    }

    /// Reflectance of the diffuse part of a material, with mixtures resolved.
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

    /// Whether a texture is not the same everywhere, so that it matters what a pixel covers.
    pub fn has_textures(&self) -> bool {
        self.materials.iter().any(Material::varies) || self.lights.iter().any(|l| l.map.is_some())
    }

    /// Makes the smaller copies of the images that pixels are looked up in, which the first lookup
    /// would else do.
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

    /// The corners of the smallest box that holds all triangles and linear lights; `None`
    /// if there are none.
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

    /// Tells lights at infinity which ball holds the scene: that about its box; about the world's
    /// origin, of no size, where there is nothing.
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

    /// The lights that views meet where they meet no surface.
    pub fn skies(&self) -> impl Iterator<Item = &Sky> {
        self.lights.iter().filter_map(|light| match &*light.light {
            Light::Sky(sky) => Some(sky),
            _ => None,
        })
    }

    /// Bytes that the geometry takes.
    pub fn memory(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.meshes[..])
            + size_of_val(&self.lights[..])
    }

    /// Bytes that the images of the textures take, each counted once, with the smaller copies that
    /// were made of them.
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

    /// Adds a flat black quad that emits on the side from which its corners run counterclockwise,
    /// with the radiance that a function gives for its area; false if, rounded to `f32`, it is no
    /// convex quadrilateral.
    ///
    /// Other lights keep their numbers and triangles theirs.
    pub fn add_quad_light(
        &mut self,
        name: &str,
        corners: [DVec3; 4],
        radiance: impl FnOnce(f64) -> DVec3,
    ) -> bool {
        let corners = corners.map(|p| to_f32(p - self.origin));
        let Ok(polygon) = ConvexPolygon::new(&corners.map(to_f64)) else {
            return false;
        };
        let polygon = polygon.moved(self.origin);
        let emission = Emission::one_sided(radiance(polygon.area()));
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

    /// Changes the number of pixels; crop becomes the whole picture.
    pub fn set_resolution(&mut self, width: u32, height: u32) {
        self.film.width = width;
        self.film.height = height;
        self.film.crop = [0, width, 0, height];
        self.camera.set_resolution(width, height);
    }
}

/// The most triangles whose edges the median is of.
const MEASURED: usize = 1 << 12;

/// The unit normal on the outside of a triangle.
pub(crate) fn outward(winding: DVec3, vertex_normal: DVec3, flipped: bool) -> DVec3 {
    let inside_out = if vertex_normal == DVec3::ZERO {
        flipped
    } else {
        winding.dot(vertex_normal) < 0.0
    };
    if inside_out { -winding } else { winding }
}

/// Widens a stored vector.
pub(crate) fn to_f64([x, y, z]: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Rounds once; may overflow to infinity.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the renderer's geometry is f32"
)]
pub(crate) fn to_f32(p: DVec3) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}
