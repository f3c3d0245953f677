//! `Shape`: triangle meshes, PLY files, bilinear patches, quads, round shapes and lines.

use super::lexer::{Lexer, Token};
use super::params::{Param, Params, Type};
use super::state::Target;
use super::{Geometry, Loader, ObjectShape, is_one_of};
use crate::tessellate::{self, Kind, Round};
use linelit_assembly::{ErrorKind, Result, Source, ply};
use linelit_geometry::{ConvexPolygon, DVec3, PolygonError};
use linelit_scene::{EmissionSpec, MeshData, Placement, RoundShape};
use std::rc::Rc;

/// The shapes that pbrt has and linelit does not.
const UNSUPPORTED: &str = "cone curve heightfield hyperboloid loopsubdiv nurbs paraboloid";

/// The shapes that linelit has, for suggestions.
const SHAPES: &str = "bilinearmesh cylinder disk line plymesh quad sphere trianglemesh";

/// The type of parameters that are points.
const POINT: &[Type] = &[Type::Point3];
/// The type of parameters that are vectors.
const VECTOR: &[Type] = &[Type::Vector3];

/// The number of cells along each side of a bilinear patch that is not flat. A flat patch becomes
/// two triangles.
const PATCH_CELLS: usize = 8;

impl Loader {
    /// Executes `Shape "…" …`.
    pub(super) fn shape(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Read the geometry and the holes.
        self.needs_world(lexer, token)?;
        let (name, mut params) = self.named_params(lexer, token, "shape")?;
        params.add_defaults(&self.state.defaults(Target::Shape));
        self.shapes += 1;
        if is_one_of(&name, UNSUPPORTED) {
            let message = format!("shape `{name}` is not supported");
            return self.base.unsupported(message, "left out", params.at());
        }
        let Some(geometry) = self.geometry(&name, &params)? else {
            return Ok(());
        };
        let extent = self.extent(&params)?;
        self.warn_unused(&params)?;
        let Some(extent) = extent else {
            return Ok(());
        };
        // Take transform, material and emission from the graphics state. A shape that emits has a
        // surface in any case.
        let Some(material) = self.state.material.or(self.state.emission.map(|_| 0)) else {
            let message = "a shape with the material `interface` is left out";
            return self
                .base
                .unsupported(message, "has no surface", params.at());
        };
        let place = Placement {
            to_world: self.state.ctm,
            reverse: self.state.reverse,
            material,
            emission: self.state.emission,
            cutout: extent.cutout,
            casts_no_shadow: extent.casts_no_shadow,
        };
        // Add the shape to the object that is being defined, or else to the scene.
        match &mut self.object {
            Some(object) => {
                object.shapes.push(ObjectShape { geometry, place });
                Ok(())
            }
            None => self.add_shape(&params, &geometry, &place),
        }
    }

    /// Reads a shape in its own space; `None`, with a warning, if it is empty.
    fn geometry(&mut self, name: &str, params: &Params) -> Result<Option<Geometry>> {
        let mesh = match name {
            "trianglemesh" => self.triangle_mesh(params)?,
            "plymesh" => self.ply_mesh(params)?,
            "bilinearmesh" => self.bilinear_mesh(params)?,
            "quad" => quad(params)?,
            "sphere" | "disk" | "cylinder" => {
                // Tessellate emissive shapes later, as their facets depend on the transform.
                let round = round(name, params)?;
                if self.state.emission.is_some() {
                    return Ok(Some(Geometry::Round(round)));
                }
                round.facets()
            }
            "line" => return line(params).map(Some),
            _ => {
                let known = SHAPES.split(' ').chain(UNSUPPORTED.split(' '));
                return Err(params.unknown("shape", name, known));
            }
        };
        if mesh.triangles.is_empty() {
            let message = format!("{} has no triangles", params.owner);
            self.base.suspicious(message, "empty mesh", params.at())?;
            return Ok(None);
        }
        Ok(Some(Geometry::Mesh(Rc::new(mesh))))
    }

    /// Adds a shape to the scene.
    pub(super) fn add_shape(
        &mut self,
        params: &Params,
        geometry: &Geometry,
        place: &Placement,
    ) -> Result<()> {
        // Warn about a profile under a transform that stretches.
        let emission = place.emission.as_ref();
        let to_world = &place.to_world.matrix3;
        if emission.is_some_and(|spec| self.base.builder.bends_profile(spec, to_world)) {
            let message = "an IES file is not stretched with its shape";
            let label = "its angles are those of the world, under any scale";
            self.base.suspicious(message, label, params.at())?;
        }
        // Add the geometry.
        let mesh = match geometry {
            Geometry::Mesh(mesh) => mesh,
            Geometry::Line(p0, p1) => return self.add_line(params, [*p0, *p1], place),
            Geometry::Round(round) => return self.add_round(params, round, place),
        };
        self.base
            .add_mesh(mesh, place, &params.owner, params.at())?;
        // Warn if each triangle has the power, not the mesh.
        let split = place.emission.is_some_and(|e| e.power.is_some())
            && !mesh.one_shape
            && mesh.triangles.len() > 1;
        if split {
            let message = "the `power` of an area light goes to each triangle of its mesh";
            let label = format!("{} triangles, as in pbrt-v4", mesh.triangles.len());
            self.base.suspicious(message, &label, params.at())?;
        }
        Ok(())
    }

    /// Adds a round shape that emits, and warns if it becomes facets that emit instead of a round
    /// light.
    fn add_round(&mut self, params: &Params, round: &Round, place: &Placement) -> Result<()> {
        let mesh = round.emissive_facets(&place.to_world.matrix3);
        let before = self.base.builder.round_light_count();
        self.base
            .add_mesh(&mesh, place, &params.owner, params.at())?;
        let is_round = self.base.builder.round_light_count() > before;
        let why = why_facets(&mesh, place, is_round);
        if why.is_empty() {
            return Ok(());
        }
        let name = round.name();
        let message = format!("an emissive {name} is lit and drawn as flat facets");
        let label = format!("{} triangles of its area; {why}", mesh.triangles.len());
        self.base.suspicious(message, &label, params.at())
    }

    /// Adds a linear light, and warns about emission that a line cannot have.
    fn add_line(&mut self, params: &Params, ends: [DVec3; 2], place: &Placement) -> Result<()> {
        let [p0, p1] = ends.map(|p| place.to_world.transform_point3(p));
        let Some(emission) = place.emission else {
            let message =
                "a line without `AreaLightSource` is ignored: it neither emits nor hides anything";
            return self.base.suspicious(message, "left out", params.at());
        };
        if emission.profile.is_some() {
            let message = "a line has no normal that its light could turn with";
            self.base
                .unsupported(message, "emits alike in all directions", params.at())?;
        }
        if emission.map.is_some() {
            let message = "a line has no place for an image";
            if emission.power.is_some() {
                let label = "left out, as its `power` is the image's";
                return self.base.suspicious(message, label, params.at());
            }
            let label = "emits as a white one";
            self.base.suspicious(message, label, params.at())?;
        }
        self.base.add_line([p0, p1], &emission, params.at())
    }

    /// Reads a `trianglemesh`.
    fn triangle_mesh(&mut self, params: &Params) -> Result<MeshData> {
        let points = params.require("P", params.array("P", POINT, 3)?)?;
        let indices = params.array("indices", &[Type::Integer], 3)?;
        let mut mesh = MeshData {
            positions: to_points(points.numbers()),
            ..MeshData::default()
        };
        let count = mesh.positions.len();
        let corners = match indices {
            Some(param) => checked_indices(params, param, count)?,
            None if count == 3 => vec![0, 1, 2],
            None => params.require("indices", None)?,
        };
        mesh.triangles = corners.as_chunks::<3>().0.to_vec();
        self.attributes(params, &mut mesh)?;
        Ok(mesh)
    }

    /// Reads the normals and texture coordinates of a mesh. Lists of a wrong length are ignored,
    /// with a warning.
    fn attributes(&mut self, params: &Params, mesh: &mut MeshData) -> Result<()> {
        // Ignore tangents and the numbers of faces.
        params.ignore(&["faceIndices"]);
        if params.find("S", VECTOR)?.is_some() {
            let message = "the tangents of a mesh are not supported";
            let label = "`S` is ignored: they are along its texture coordinates";
            self.base.unsupported(message, label, params.at())?;
        }
        // Read the normals.
        let count = mesh.positions.len();
        if let Some(param) = params.array("N", &[Type::Normal, Type::Vector3], 3)? {
            let normals = to_points(param.numbers());
            let normals: Vec<_> = normals.iter().map(|n| n.as_vec3().to_array()).collect();
            if normals.len() == count {
                mesh.normals = normals;
            } else {
                self.wrong_count(params, param, normals.len(), count)?;
            }
        }
        // Read the texture coordinates under both of their names.
        for name in ["uv", "st"] {
            let types = [Type::Point2, Type::Float, Type::Vector2];
            let Some(param) = params.array(name, &types, 2)? else {
                continue;
            };
            #[allow(
                clippy::cast_possible_truncation,
                reason = "texture coordinates are f32"
            )]
            let narrow = |uv: &[f64; 2]| uv.map(|v| v as f32);
            let uvs: Vec<_> = param
                .numbers()
                .as_chunks::<2>()
                .0
                .iter()
                .map(narrow)
                .collect();
            if uvs.len() == count {
                mesh.uvs = uvs;
            } else {
                self.wrong_count(params, param, uvs.len(), count)?;
            }
        }
        Ok(())
    }

    /// Warns about a list that has not one entry for each vertex.
    fn wrong_count(
        &mut self,
        params: &Params,
        param: &Param,
        got: usize,
        want: usize,
    ) -> Result<()> {
        let message = format!(
            "`{}` of {} has {got} entries for {want} vertices",
            param.name, params.owner
        );
        let kind = ErrorKind::BadMesh;
        self.base.warn(kind, message, "ignored", param.at())
    }

    /// Reads a `plymesh`.
    fn ply_mesh(&mut self, params: &Params) -> Result<MeshData> {
        let param = params.require("filename", params.text("filename")?)?;
        let file = self
            .base
            .open_unpacked(&param.strings()[0], param.at_value(0))?;
        let source = Source::new(file.path, file.bytes);
        if params.find("displacement", &[Type::Texture])?.is_some() {
            let message = "displacement is not supported";
            self.base.unsupported(message, "ignored", params.at())?;
        }
        params.ignore(&["edgelength"]);
        // Read the file without its warnings, which are about features that pbrt ignores, too.
        ply::read(&source).map(|read| read.mesh).map_err(|e| {
            e.note(format!(
                "read for {}",
                param.source.short(param.value_span(0))
            ))
        })
    }

    /// Reads a `bilinearmesh`, and tessellates its patches.
    fn bilinear_mesh(&mut self, params: &Params) -> Result<MeshData> {
        // Read the vertices and the corners of the patches.
        let points = params.require("P", params.array("P", POINT, 3)?)?;
        let mut corners = MeshData {
            positions: to_points(points.numbers()),
            ..MeshData::default()
        };
        let count = corners.positions.len();
        let indices = match params.array("indices", &[Type::Integer], 4)? {
            Some(param) => checked_indices(params, param, count)?,
            None if count == 4 => vec![0, 1, 2, 3],
            None => params.require("indices", None)?,
        };
        self.attributes(params, &mut corners)?;
        // Tessellate each patch: into two triangles if it is flat.
        let mut mesh = MeshData {
            one_shape: indices.len() == 4,
            ..MeshData::default()
        };
        for patch in indices.as_chunks::<4>().0 {
            let at = patch.map(|i| i as usize);
            let p = at.map(|i| corners.positions[i]);
            let uvs = if corners.uvs.is_empty() {
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
            } else {
                at.map(|i| corners.uvs[i])
            };
            let normals = (!corners.normals.is_empty()).then(|| at.map(|i| corners.normals[i]));
            let cells = if is_flat(p) { 1 } else { PATCH_CELLS };
            tessellate::bilinear(&mut mesh, p, uvs, normals, cells);
            if mesh.triangles.len() > self.base.max_triangles {
                let message = format!("more than {} triangles", self.base.max_triangles);
                return Err(params.error(ErrorKind::Limit, message, "too many patches"));
            }
        }
        Ok(mesh)
    }
}

/// Reads a sphere, a disk or a cylinder.
fn round(name: &str, params: &Params) -> Result<Round> {
    // Read the parameters of all three.
    let radius = params.positive_or("radius", 1.0)?;
    let phi_max = params.positive_or("phimax", 360.0)?.min(360.0).to_radians();
    let heights = |low: f64, high: f64| -> Result<[f64; 2]> {
        let (a, b) = (
            params.float_or("zmin", low)?,
            params.float_or("zmax", high)?,
        );
        Ok([a.min(b), a.max(b)])
    };
    // Read the radii and heights.
    let kind = match name {
        "disk" => {
            let inner = params.float_or("innerradius", 0.0)?.clamp(0.0, radius);
            let height = params.float_or("height", 0.0)?;
            let radii = [inner, radius];
            Kind::Disk { height, radii }
        }
        "cylinder" => {
            let heights = heights(-1.0, 1.0)?;
            Kind::Cylinder { radius, heights }
        }
        _ => {
            let heights = heights(-radius, radius)?.map(|z| z.clamp(-radius, radius));
            Kind::Sphere { radius, heights }
        }
    };
    Ok(Round { kind, phi_max })
}

/// Returns the reason why an emissive round shape is lit by its facets instead of the round light,
/// for a warning; empty if it is a round light.
fn why_facets(mesh: &MeshData, place: &Placement, is_round: bool) -> &'static str {
    let emits = |what: fn(&EmissionSpec) -> bool| place.emission.as_ref().is_some_and(what);
    let inwards = place.reverse || emits(|emission| emission.two_sided);
    match mesh.round {
        None => "exact are whole spheres, disks and cylinders only",
        Some(_) if emits(|emission| emission.map.is_some()) => {
            "exact are those without an image only"
        }
        Some(_) if !is_round => "exact are those that its transform leaves round only",
        Some(RoundShape::Sphere(_) | RoundShape::Cylinder(_)) if inwards => {
            "exact are those that emit outwards only"
        }
        Some(_) => "",
    }
}

/// Converts the indices of a mesh, and refuses those that are not below the number of vertices.
fn checked_indices(params: &Params, param: &Param, count: usize) -> Result<Vec<u32>> {
    let indices = param.numbers().iter().enumerate().map(|(k, &i)| {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "an i32 held in f64, checked not to be negative"
        )]
        let index = i as u32;
        if i >= 0.0 && (index as usize) < count {
            return Ok(index);
        }
        let message = format!("index {i} of {} is out of range", params.owner);
        let label = format!("there are {count} vertices");
        Err(param.at_value(k).error(ErrorKind::BadMesh, message, &label))
    });
    indices.collect()
}

/// Reads a `quad`, a shape of the authors of the papers on points and lines: the parallelogram with
/// the corner `o` and the edges `u` and `v`.
///
/// Its outside (the side that emits) is the side of `u × v`, taken in the shape's own space and
/// transformed as a normal: in world space it is reversed by `ReverseOrientation` or by a
/// mirroring transform, but not by both, as for pbrt's triangles. By this rule the lights of all
/// three published scenes face the way they do in the published pictures: in the Cornell box
/// `u × v` = x × z points down; in the kitchen x × y points into the room; in the Veach scene the
/// transform mirrors, and the light points down to the plates.
fn quad(params: &Params) -> Result<MeshData> {
    let vector = |name: &'static str, types: &[Type]| -> Result<DVec3> {
        let value = params.fixed::<3>(name, types)?;
        params.require(name, value).map(DVec3::from_array)
    };
    let o = vector("o", POINT)?;
    let (u, v) = (vector("u", VECTOR)?, vector("v", VECTOR)?);
    Ok(MeshData {
        positions: vec![o, o + u, o + u + v, o + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        one_shape: true,
        ..MeshData::default()
    })
}

/// Reads a `line`, an extension of linelit: a linear light between two points.
fn line(params: &Params) -> Result<Geometry> {
    let end = |name: &'static str| -> Result<DVec3> {
        let value = params.fixed::<3>(name, POINT)?;
        params.require(name, value).map(DVec3::from_array)
    };
    Ok(Geometry::Line(end("p0")?, end("p1")?))
}

/// Returns whether the corners p00, p10, p01, p11 form a flat convex quadrilateral, for which two
/// triangles are exact. It is also true for patches without area, too small for `f32` or too far
/// away, about which there are warnings when the mesh is added.
fn is_flat([p00, p10, p01, p11]: [DVec3; 4]) -> bool {
    use PolygonError::{Count, NotConvex, NotPlanar};
    let polygon = ConvexPolygon::new(&[p00, p10, p11, p01]);
    !matches!(polygon, Err(Count(_) | NotPlanar(_) | NotConvex(_)))
}

/// Groups numbers into points, three each.
fn to_points(numbers: &[f64]) -> Vec<DVec3> {
    let triples = numbers.as_chunks::<3>().0.iter();
    triples.map(|c| DVec3::from_array(*c)).collect()
}
