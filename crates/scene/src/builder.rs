//! [`SceneBuilder`], which puts a [`SceneDescription`] together mesh by mesh. Readers of scene
//! files call it for everything that they find.
//!
//! A mesh is transformed to the world and rounded to `f32` once. If it emits, its triangles become
//! lights: coplanar neighbours that emit the same are merged into convex polygons, which takes the
//! means of textures over triangles and the sums of areas for `power`.

use crate::emission::{self, EmissionMap, EmissionSpec, PlaneUv};
use crate::merge::{self, Facet};
use crate::round::RoundShape;
use crate::scene::{
    Mesh, Placed, RoundLight, SceneDescription, SceneLight, outward, to_f32, to_f64,
};
use crate::{Alpha, Camera, Cutout, FilmSettings, Material, Texture};
use linelit_geometry::glam::{DAffine3, DMat3};
use linelit_geometry::{ConvexPolygon, DVec2, DVec3, PolygonError, Segment};
use linelit_lights::{AreaLight, Emission, Light, LightSpace, LinearLight, Profile};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A triangle mesh in its own space, from which [`SceneBuilder::add_mesh`] makes a part of a scene.
#[derive(Clone, Debug, Default)]
pub struct MeshData {
    /// Vertices, all finite.
    pub positions: Vec<DVec3>,
    /// Indices of vertices, all in range.
    pub triangles: Vec<[u32; 3]>,
    /// Normals of the vertices, of any length; as many as `positions`, or none.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates of the vertices; as many as `positions`, or none.
    pub uvs: Vec<[f32; 2]>,
    /// Whether the triangles are one shape to pbrt, so that `power` is the power of all of them
    /// together and not of each.
    pub one_shape: bool,
    /// The round shape that the triangles approximate, if any.
    pub round: Option<RoundShape>,
}

/// The placement of a mesh in the world, its material, emission and holes. The default is the
/// identity transform and a grey matte without emission.
#[derive(Clone, Copy, Debug, Default)]
pub struct Placement {
    /// The transform from the space of the mesh to the world.
    pub to_world: DAffine3,
    /// Whether outside and inside are swapped compared with the vertex order or the vertex normals,
    /// as by pbrt's `ReverseOrientation`.
    pub reverse: bool,
    /// The index that [`SceneBuilder::add_material`] returned; 0 is a grey matte.
    pub material: u32,
    /// The emission of the outside, if any.
    pub emission: Option<EmissionSpec>,
    /// The holes of the mesh; they are ignored if it emits.
    pub cutout: Option<Cutout>,
    /// Whether the mesh casts no shadow; cameras see it nevertheless.
    pub casts_no_shadow: bool,
}

impl Placement {
    /// Returns whether the transform is singular: it maps space to a plane, a line or a point.
    #[must_use]
    pub fn is_singular(&self) -> bool {
        let m = &self.to_world.matrix3;
        let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        m.determinant().abs() <= 1e-14 * size
    }
}

/// The result of [`SceneBuilder::add_mesh`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Added {
    /// The number of triangles without area, which were left out.
    pub degenerate: usize,
    /// The number of lights that were made; coplanar neighbours that form a convex polygon are one
    /// light.
    pub lights: usize,
    /// The number of triangles that should emit but could not be made a light.
    pub unlit: usize,
    /// The reason why the first of the `unlit` triangles could not be made a light.
    pub why_unlit: Option<PolygonError>,
}

/// The reason why [`SceneBuilder`] refused a mesh or a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddError {
    /// The vertex with this index in the mesh is beyond [`MAX_COORDINATE`] in world space.
    Vertex(usize),
    /// The transform is singular.
    Singular,
    /// The scene would have more triangles or vertices than allowed.
    TooMany,
    /// The scene would have more lights than allowed.
    TooManyLights,
}

impl fmt::Display for AddError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(k) => write!(f, "vertex {k} is beyond {MAX_COORDINATE:.2e} of the origin"),
            Self::Singular => f.write_str("the transform flattens space"),
            Self::TooMany => f.write_str("too many triangles"),
            Self::TooManyLights => f.write_str("too many lights"),
        }
    }
}

impl std::error::Error for AddError {}

/// The largest coordinate that a vertex may have in world space, 2⁶⁰. Products of two differences
/// of such coordinates are finite in `f32`, in which visibility makes its first, cheap tests.
pub const MAX_COORDINATE: f32 = 1_152_921_504_606_846_976.0;

/// The largest number of lights of a scene: each takes half a kilobyte.
const MAX_LIGHTS: usize = 1 << 20;

/// The largest number of texture lookups for the means over all triangles of a textured emitter
/// together; the more triangles it has, the coarser is the mean over each.
const MEAN_BUDGET: f64 = 4e6;

/// Puts a [`SceneDescription`] together from meshes, materials and lights. It transforms vertices
/// to the world and rounds them once, drops triangles without area, and makes lights of meshes that
/// emit. The crate's first page has an example.
///
/// Meshes, lights and the camera are given in world space. Vertices are rounded relative to
/// [`SceneBuilder::origin`], so that precision does not depend on how far away they are. The origin
/// is zero unless it is set before anything is added; [`SceneDescription::better_origin`] of the
/// finished scene returns the origin that would have been best.
#[derive(Debug)]
pub struct SceneBuilder {
    /// The point of the world relative to which vertices are stored.
    pub origin: DVec3,
    /// The lower and the upper corner of the box around the vertices that triangles use, in world
    /// space.
    used: [DVec3; 2],
    /// The largest distance by which rounding moved one of the vertices that triangles use.
    displacement: f64,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    pub(crate) meshes: Vec<Mesh>,
    /// The materials so far; the first is a grey matte.
    pub materials: Vec<Material>,
    /// The numbers of objects that the file has placed by reference so far, and of their instances;
    /// they become [`SceneDescription::placed`].
    pub placed: Placed,
    alphas: Vec<Alpha>,
    pub(crate) lights: Vec<SceneLight>,
    light_ranges: Vec<(u32, u32, u32)>,
    pub(crate) round: Vec<RoundLight>,
    emission_maps: Vec<Arc<Texture>>,
    profiles: Vec<Arc<Profile>>,
    pub(crate) max_triangles: usize,
    /// The largest number of lights; by default a quarter of the triangles allowed, and at most
    /// 2²⁰.
    pub max_lights: usize,
    /// The number of vertices and triangles that were read so far, whether or not they are in the
    /// scene: a bound of the time that a malicious file can take.
    work: usize,
}

impl SceneBuilder {
    /// Creates a builder with an empty scene, to which at most `max_triangles` triangles can be
    /// added.
    #[must_use]
    pub fn new(max_triangles: usize) -> Self {
        Self {
            origin: DVec3::ZERO,
            used: [DVec3::INFINITY, DVec3::NEG_INFINITY],
            displacement: 0.0,
            positions: Vec::new(),
            triangles: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            meshes: Vec::new(),
            alphas: Vec::new(),
            materials: vec![Material::default_matte()],
            placed: Placed::default(),
            lights: Vec::new(),
            light_ranges: Vec::new(),
            round: Vec::new(),
            emission_maps: Vec::new(),
            profiles: Vec::new(),
            max_lights: MAX_LIGHTS.min(max_triangles / 4),
            max_triangles: max_triangles.min(u32::MAX as usize / 4),
            work: 0,
        }
    }

    /// Returns the number of triangles so far.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Returns the number of lights so far.
    #[must_use]
    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Adds a material and returns its index.
    pub fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        index(self.materials.len() - 1)
    }

    /// Adds an alpha mask and returns its index. If the same mask was added before, it returns the
    /// index of that.
    pub fn add_alpha(&mut self, alpha: Alpha) -> u32 {
        let known = self.alphas.iter().position(|a| a.is_same(&alpha));
        let at = known.unwrap_or_else(|| {
            self.alphas.push(alpha);
            self.alphas.len() - 1
        });
        index(at)
    }

    /// Returns the alpha mask with this index.
    ///
    /// # Panics
    /// If there is no alpha mask with this index.
    #[must_use]
    pub fn alpha(&self, index: u32) -> &Alpha {
        &self.alphas[index as usize]
    }

    /// Adds a texture of emission and returns its index, for [`EmissionSpec::map`].
    pub fn add_emission_map(&mut self, texture: Arc<Texture>) -> u32 {
        self.emission_maps.push(texture);
        index(self.emission_maps.len() - 1)
    }

    /// Adds a profile of emission and returns its index, for [`EmissionSpec::profile`]. The profile
    /// is scaled so that it does not change the power of shapes; `None` if it emits no light above
    /// the surface.
    pub fn add_profile(&mut self, profile: Profile) -> Option<u32> {
        let mean = profile.lambertian_mean();
        if !(mean > 0.0 && mean.is_finite()) {
            return None;
        }
        self.profiles.push(Arc::new(profile.scaled(1.0 / mean)));
        Some(index(self.profiles.len() - 1))
    }

    /// Returns whether an emission has a profile that depends on the angle around its axis while
    /// the transform of the shape stretches or shears. The profile is then only rotated and does
    /// not follow the shape, about which readers warn.
    #[must_use]
    pub fn bends_profile(&self, spec: &EmissionSpec, to_world: &DMat3) -> bool {
        let profile = spec.profile.map(|k| &self.profiles[k as usize]);
        profile.is_some_and(|profile| profile.has_angles())
            && LightSpace::new(*to_world).is_some_and(|space| !space.is_rigid())
    }

    /// Returns the number of emissive spheres, disks and cylinders so far
    /// ([`SceneDescription::round`]).
    #[must_use]
    pub fn round_light_count(&self) -> usize {
        self.round.len()
    }

    /// Adds a mesh: transforms its vertices and rounds them, drops triangles without area, and
    /// makes lights of the others if the mesh emits.
    ///
    /// # Errors
    /// The transform is singular, a vertex is too far from the origin, or there are too many
    /// triangles or lights. A part of the mesh may then be in the scene, so discard the builder.
    ///
    /// # Panics
    /// When an index of the mesh is out of range.
    pub fn add_mesh(&mut self, mesh: &MeshData, place: &Placement) -> Result<Added, AddError> {
        // Check the transform and the limits on memory and time.
        let matrix = place.to_world.matrix3;
        if place.is_singular() {
            return Err(AddError::Singular);
        }
        let vertices = self.positions.len() + mesh.positions.len();
        self.work += mesh.positions.len() + mesh.triangles.len();
        if self.triangle_count() + mesh.triangles.len() > self.max_triangles
            || vertices > 4 * self.max_triangles
            || self.work > 4 * self.max_triangles
        {
            return Err(AddError::TooMany);
        }
        // Add the vertices, and the triangles that have an area after rounding.
        let (base, first) = (self.positions.len(), self.triangles.len());
        self.add_vertices(mesh, place)?;
        self.measure(mesh, place, base);
        let mut added = Added::default();
        for t in &mesh.triangles {
            let t = t.map(|i| i + index(base));
            if self.has_area(t) {
                self.triangles.push(t);
            } else {
                added.degenerate += 1;
            }
        }
        // Drop the vertices of a mesh without triangles.
        if self.triangles.len() == first {
            self.positions.truncate(base);
            self.normals.truncate(base);
            self.uvs.truncate(base);
            return Ok(added);
        }
        // Add the mesh, and its lights if it emits.
        self.meshes.push(Mesh {
            triangles: index(first)..index(self.triangles.len()),
            material: place.material,
            flipped: place.reverse != (matrix.determinant() < 0.0),
            has_normals: !mesh.normals.is_empty(),
            has_uvs: !mesh.uvs.is_empty(),
            // Emitters have no holes.
            cutout: place.cutout.filter(|_| place.emission.is_none()),
            casts_no_shadow: place.casts_no_shadow,
        });
        if let Some(emission) = &place.emission {
            self.add_lights(first, emission, (mesh.one_shape, place), &mut added)?;
            // Round shapes as wholes cannot have a texture.
            if let Some(shape) = mesh.round.as_ref().filter(|_| emission.map.is_none()) {
                self.note_round(first, added.lights, shape, place, emission);
            }
        }
        Ok(added)
    }

    /// Adds the round shape that the triangles from `first` on and the last `lights` lights are the
    /// facets of, unless its transform makes another shape of it.
    fn note_round(
        &mut self,
        first: usize,
        lights: usize,
        shape: &RoundShape,
        place: &Placement,
        spec: &EmissionSpec,
    ) {
        // Take the emitting side of a disk from its first facet.
        let start = self.lights.len() - lights;
        let facing = self.lights.get(start).and_then(|l| match &*l.light {
            Light::Area(facet) => Some(facet.polygon.normal()),
            _ => None,
        });
        let emission = |area| spec.emission(spec.radiance_over(area));
        let Some((light, turned)) = shape.light(&place.to_world, facing, emission) else {
            return;
        };
        self.round.push(RoundLight {
            light,
            outward: turned.is_none_or(|turned| place.reverse == turned && !spec.two_sided),
            lights: index(start)..index(self.lights.len()),
            triangles: index(first)..index(self.triangles.len()),
        });
    }

    /// Adds the vertices of a mesh with their attributes, transformed to the world and rounded.
    fn add_vertices(&mut self, mesh: &MeshData, place: &Placement) -> Result<(), AddError> {
        // Round the positions relative to the origin.
        let base = self.positions.len();
        self.positions.reserve(mesh.positions.len());
        for (k, p) in mesh.positions.iter().enumerate() {
            let rounded = to_f32(place.to_world.transform_point3(*p) - self.origin);
            if !rounded.iter().all(|c| c.abs() <= MAX_COORDINATE) {
                self.positions.truncate(base);
                return Err(AddError::Vertex(k));
            }
            self.positions.push(rounded);
        }
        // Transform the normals. Earlier meshes without attributes get zeros, so that the lists
        // stay as long as the positions.
        if !mesh.normals.is_empty() {
            self.normals.resize(base, [0.0; 3]);
            let sign = if place.reverse { -1.0 } else { 1.0 };
            let to_world = sign * normal_matrix(&place.to_world.matrix3);
            let normals = mesh.normals.iter();
            self.normals
                .extend(normals.map(|n| to_f32(unit(to_world * to_f64(*n)))));
        }
        if !mesh.uvs.is_empty() {
            self.uvs.resize(base, [0.0; 2]);
            self.uvs.extend_from_slice(&mesh.uvs);
        }
        Ok(())
    }

    /// Extends the box around all used vertices, and the largest distance by which rounding moved
    /// one, by the mesh whose first vertex has the index `base`. A vertex counts as used if one of
    /// its triangles has an area before rounding.
    fn measure(&mut self, mesh: &MeshData, place: &Placement, base: usize) {
        let mut is_used = vec![false; mesh.positions.len()];
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            if (b - a).cross(c - a) != DVec3::ZERO {
                t.iter().for_each(|i| is_used[*i as usize] = true);
            }
        }
        let rounded = &self.positions[base..];
        let vertices = mesh.positions.iter().zip(rounded).zip(is_used);
        for ((p, rounded), _) in vertices.filter(|(_, is_used)| *is_used) {
            let p = place.to_world.transform_point3(*p);
            let moved = (p - self.origin).distance(to_f64(*rounded));
            self.displacement = self.displacement.max(moved);
            let [low, high] = self.used;
            self.used = [low.min(p), high.max(p)];
        }
    }

    /// Returns whether a triangle has an area after rounding.
    fn has_area(&self, t: [u32; 3]) -> bool {
        let [a, b, c] = t.map(|i| to_f64(self.positions[i as usize]));
        // Differences and products of f32 are exact or nearly so in f64; squares do not underflow.
        (b - a).cross(c - a) != DVec3::ZERO
    }

    /// Makes lights of the triangles from `first` on, reorders them so that the triangles of each
    /// light are consecutive, and counts lights and refused triangles in `added`.
    fn add_lights(
        &mut self,
        first: usize,
        spec: &EmissionSpec,
        (one_shape, place): (bool, &Placement),
        added: &mut Added,
    ) -> Result<(), AddError> {
        let Some(mesh) = self.meshes.last() else {
            return Ok(());
        };
        // Compute the radiance of each triangle: `full` where the texture is one, `radiance` with
        // the mean of the texture. The power of a shape is spread over its whole area.
        let facets = self.facets(first, mesh);
        let total: f64 = facets.iter().map(Facet::area).sum();
        let factors = self.emission_factors(first, mesh, spec);
        let full = |k: usize| spec.radiance_over(if one_shape { total } else { facets[k].area() });
        let radiance = |k: usize| full(k) * factors.get(k).copied().unwrap_or(DVec3::ONE);
        // Two triangles emit the same if their radiance is equal to 1e-5 and, with a texture, the
        // coordinates continue from one to the other.
        let texture = Coordinates::new(self, first, mesh, spec);
        let is_textured = texture.is_some();
        let plain = |k| if is_textured { full(k) } else { radiance(k) };
        let same = |a: usize, b: usize| {
            let (x, y) = (plain(a), plain(b));
            (x - y).abs().max_element() <= 1e-5 * x.max_element()
                && texture.as_ref().is_none_or(|t| t.continues(a, b))
        };
        // Merge triangles into convex polygons.
        let profile = self.placed_profile(spec, place);
        let old: Vec<[u32; 3]> = self.triangles[first..].to_vec();
        let mut next = first;
        let lights_before = self.lights.len();
        merge::merge(&facets, same, |group| {
            // Put the triangles of this light next to each other.
            let start = next;
            for &k in &group.facets {
                self.triangles[next] = old[k];
                next += 1;
            }
            let k = group.facets[0];
            let polygon = match group.polygon {
                Ok(polygon) => polygon,
                Err(why) => {
                    added.unlit += group.facets.len();
                    added.why_unlit.get_or_insert(why);
                    return Ok(());
                }
            };
            // Add a light with the mean radiance and, if there is one, the texture.
            let radiance = if is_textured {
                mean(&group.facets, |k| (radiance(k), facets[k].area()))
            } else {
                radiance(k)
            };
            let emission = spec.emission(radiance);
            let map = spec.map.zip(texture.as_ref());
            let map = map.map(|(map, texture)| EmissionMap {
                radiance: full(k),
                factor: Arc::clone(&self.emission_maps[map as usize]),
                coordinates: texture.plane(k).moved(self.origin),
            });
            self.push_area_light(polygon, emission, map, profile.clone(), start..next)
        })?;
        added.lights = self.lights.len() - lights_before;
        Ok(())
    }

    /// Returns the profile of an emission, if it has one, rotated by the transform of its mesh.
    fn placed_profile(&self, spec: &EmissionSpec, place: &Placement) -> Option<Arc<Profile>> {
        let profile = Profile::clone(&self.profiles[spec.profile? as usize]);
        let space = LightSpace::new(place.to_world.matrix3).unwrap_or(LightSpace::WORLD);
        Some(Arc::new(profile.placed(&space)))
    }

    /// Returns the triangles from `first` on as facets, wound so that their normals are on the side
    /// that emits.
    fn facets(&self, first: usize, mesh: &Mesh) -> Vec<Facet> {
        let facet = |t: &[u32; 3]| {
            let corners = t.map(|i| to_f64(self.positions[i as usize]));
            let normal = if mesh.has_normals {
                t.iter().map(|i| to_f64(self.normals[*i as usize])).sum()
            } else {
                DVec3::ZERO
            };
            Facet::new(corners, |winding| {
                outward(winding, normal, mesh.flipped) == winding
            })
        };
        self.triangles[first..].iter().map(facet).collect()
    }

    /// Returns the mean of the emission's texture over each triangle from `first` on; empty without
    /// a texture.
    fn emission_factors(&self, first: usize, mesh: &Mesh, spec: &EmissionSpec) -> Vec<DVec3> {
        let Some(map) = spec.map.map(|map| &self.emission_maps[map as usize]) else {
            return Vec::new();
        };
        let triangles = &self.triangles[first..];
        let budget = MEAN_BUDGET / triangles.len() as f64;
        let factor = |t: &[u32; 3]| {
            let uv = mesh.corner_uvs(&self.uvs, *t);
            emission::mean(map, uv, budget).max(DVec3::ZERO)
        };
        triangles.iter().map(factor).collect()
    }

    /// Adds a polygonal light and its range of triangles, unless its texture is black all over it.
    fn push_area_light(
        &mut self,
        polygon: ConvexPolygon,
        emission: Emission,
        map: Option<EmissionMap>,
        profile: Option<Arc<Profile>>,
        triangles: Range<usize>,
    ) -> Result<(), AddError> {
        // Leave out dark parts of a texture, and refuse too many lights.
        if map.is_some() && emission.radiance == DVec3::ZERO {
            return Ok(());
        }
        if self.lights.len() >= self.max_lights {
            return Err(AddError::TooManyLights);
        }
        // Add the light in world space; its polygon is relative to the origin until here.
        let triangles = index(triangles.start)..index(triangles.end);
        let range = (triangles.start, triangles.end, index(self.lights.len()));
        self.light_ranges.push(range);
        let polygon = polygon.moved(self.origin);
        self.lights.push(SceneLight {
            light: Arc::new(Light::Area(AreaLight { polygon, emission })),
            triangles,
            map,
            profile,
        });
        Ok(())
    }

    /// Adds a linear light between two points of the world. The `radiance` of `spec` is radiance
    /// times radius, in W/(sr·m), or, if `spec` has a `power`, its colour.
    ///
    /// # Errors
    /// There are too many lights.
    pub fn add_line(&mut self, p0: DVec3, p1: DVec3, spec: &EmissionSpec) -> Result<(), AddError> {
        let length = (p1 - p0).length();
        let factor = spec
            .power
            .map_or(1.0, |p| p / (2.0 * std::f64::consts::PI.powi(2) * length));
        self.add_light(Light::Linear(LinearLight {
            segment: Segment { p0, p1 },
            radiance_radius: spec.radiance * factor,
        }))
    }

    /// Adds a light without triangles: a point, a line, parallel light or a sky. The ball around
    /// the scene, which lights at infinity need, is set by [`SceneBuilder::finish`].
    ///
    /// # Errors
    /// There are too many lights.
    pub fn add_light(&mut self, light: Light) -> Result<(), AddError> {
        if self.lights.len() >= self.max_lights {
            return Err(AddError::TooManyLights);
        }
        let at = index(self.triangles.len());
        self.lights.push(SceneLight {
            light: Arc::new(light),
            triangles: at..at,
            map: None,
            profile: None,
        });
        Ok(())
    }

    /// Returns the finished scene with this camera and film.
    pub fn finish(mut self, camera: Camera, film: FilmSettings) -> SceneDescription {
        // Make the attributes as long as the positions, where the last meshes have none.
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), [0.0; 3]);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), [0.0; 2]);
        }
        let mut scene = SceneDescription {
            positions: self.positions,
            triangles: self.triangles,
            normals: self.normals,
            uvs: self.uvs,
            meshes: self.meshes,
            alphas: self.alphas,
            materials: self.materials,
            lights: self.lights,
            round: self.round,
            has_lamp: false,
            placed: self.placed,
            camera,
            film,
            light_ranges: self.light_ranges,
            origin: self.origin,
            used: self.used,
            displacement: self.displacement,
        };
        // Set the ball around the scene in lights at infinity.
        scene.tell_lights_of_size();
        scene
    }
}

/// Returns the unit vector of a direction, or zero. A vector that already has unit length to `f32`
/// rounding (half an ulp in each of three components) is not changed, so that a scene that was
/// written to a file is the same bit for bit when it is read again.
fn unit(n: DVec3) -> DVec3 {
    let rounding = 2.0 * f64::from(f32::EPSILON);
    if (n.length_squared() - 1.0).abs() <= rounding {
        n
    } else {
        n.normalize_or_zero()
    }
}

/// Returns a number as an index. Numbers are below `u32::MAX`, as [`SceneBuilder::add_mesh`]
/// refuses more.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// The texture coordinates of the triangles of a textured emitter.
struct Coordinates {
    corners: Vec<[DVec3; 3]>,
    uvs: Vec<[DVec2; 3]>,
}

impl Coordinates {
    /// Collects the coordinates of the triangles from `first` on; `None` without a texture.
    fn new(builder: &SceneBuilder, first: usize, mesh: &Mesh, spec: &EmissionSpec) -> Option<Self> {
        spec.map?;
        let triangles = &builder.triangles[first..];
        let at = |i: &u32| to_f64(builder.positions[*i as usize]);
        let uv = |t: &[u32; 3]| mesh.corner_uvs(&builder.uvs, *t);
        Some(Self {
            corners: triangles
                .iter()
                .map(|t| [at(&t[0]), at(&t[1]), at(&t[2])])
                .collect(),
            uvs: triangles.iter().map(uv).collect(),
        })
    }

    /// Returns the texture coordinates of triangle `k`, as an affine function over its plane.
    fn plane(&self, k: usize) -> PlaneUv {
        PlaneUv::new(self.corners[k], self.uvs[k])
    }

    /// Returns whether the texture coordinates of two triangles are one affine function, so that
    /// one map can serve both.
    fn continues(&self, a: usize, b: usize) -> bool {
        let over = |a: usize, b: usize| {
            let plane = self.plane(a);
            let corners = self.corners[b].iter().zip(self.uvs[b]);
            corners.into_iter().all(|(p, uv)| {
                // Positions and coordinates are rounded to f32; fewer than 8 roundings add up.
                let scale = plane.steepness() * p.length() + uv.length();
                (plane.at(*p) - uv).length() <= 8.0 * f64::from(f32::EPSILON) * scale
            })
        };
        over(a, b) && over(b, a)
    }
}

/// Returns the weighted mean over some facets, given by their indices: `value` returns the value
/// and the weight of a facet.
fn mean(of: &[usize], value: impl Fn(usize) -> (DVec3, f64)) -> DVec3 {
    let (sum, weight) = of.iter().fold((DVec3::ZERO, 0.0), |(sum, weight), &k| {
        let (v, w) = value(k);
        (sum + v * w, weight + w)
    });
    sum / weight
}

/// Returns the matrix that transforms normals: the inverse transpose up to a positive factor,
/// computed as the cofactor matrix times the sign of the determinant.
fn normal_matrix(m: &DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    cofactors * m.determinant().signum()
}
