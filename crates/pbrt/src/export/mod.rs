//! Writing pbrt-v4 text, so that other renderers can check ours.

mod materials;

pub use materials::nearest_in_pbrt_v4;

use linelit_geometry::glam::DAffine3;
use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Cylinder, Disk, Emission, Light, LinearLight};
use linelit_scene::{
    EmissionMap, EmissiveCylinder, EmissiveDisk, EmissiveSphere, FilmSettings, FilterKind,
    ImageTexture, Instance, Mesh, Object, Projection, Scene, Texture, UvMapping, Wrap,
};
use std::fmt::{self, Write as _};
use std::io;
use std::ops::Range;

/// What to write.
pub struct ExportOptions<'a> {
    /// Also what linelit alone reads: linear lights as `Shape "line"`, materials under their own
    /// names. Without it, linear lights are comments, and materials that pbrt-v4 does not have are
    /// the nearest that it has.
    pub extensions: bool,
    /// The file name to write for an image; its own by default.
    pub image_name: &'a dyn Fn(&ImageTexture) -> String,
}

impl fmt::Debug for ExportOptions<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("ExportOptions");
        out.field("extensions", &self.extensions)
            .finish_non_exhaustive()
    }
}

impl Default for ExportOptions<'_> {
    /// What pbrt-v4 reads, with the file names that the scene has.
    fn default() -> Self {
        Self {
            extensions: false,
            image_name: &|image| image.filename.clone(),
        }
    }
}

impl ExportOptions<'_> {
    /// The image over a light, if it can be written: pbrt's lies over the whole range of
    /// coordinates and has one factor for all colours, or with extensions one for each.
    fn image_of<'m>(&self, map: &'m EmissionMap) -> Option<&'m ImageTexture> {
        let Texture::Image(image) = &*map.factor else {
            return None;
        };
        let as_it_is = image.mapping == UvMapping::IDENTITY
            && image.wrap == [Wrap::Clamp; 2]
            && !image.invert
            && (image.data.is_srgb() || image.data.is_linear());
        let grey = map.radiance == DVec3::splat(map.radiance.x);
        (as_it_is && (grey || self.extensions)).then_some(image)
    }

    /// Whether an emission that varies over a light is written; if not, its mean is.
    #[must_use]
    pub fn writes(&self, map: &EmissionMap) -> bool {
        self.image_of(map).is_some()
    }
}

/// Writes the scene as pbrt text that pbrt-v4 reads.
///
/// Geometry is written exactly (the shortest decimal form of each `f32`), in its order;
/// cameras, films, materials, textures and area lights as far as pbrt-v4 has them. With
/// [`ExportOptions::extensions`] reading it back gives the same scene, so that pictures are
/// the same bit for bit; but of emission that is no image as pbrt has it
/// ([`ExportOptions::writes`]) only the mean is written. Without, what pbrt-v4 does not have is the
/// nearest thing, with a comment: of `phong` the diffuse part, for `substrate`, `plastic`, `uber`
/// and `frostbite` a `coateddiffuse`.
///
/// # Errors
/// When writing fails.
pub fn write_pbrt(
    scene: &Scene,
    out: &mut impl io::Write,
    options: &ExportOptions<'_>,
) -> io::Result<()> {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = header(scene, &mut text);
    out.write_all(text.as_bytes())?;
    let mut writer = Writer {
        scene,
        options,
        text: String::new(),
        textures: 0,
        alphas: Vec::new(),
    };
    for (k, material) in scene.materials.iter().enumerate() {
        let _ = writer.material(k, material);
        writer.flush(out)?;
    }
    let _ = writer.alphas();
    // Linear lights stand between the meshes where they stood: the order of the lights names
    // their random numbers.
    let mut lines = scene.lights.iter().filter_map(|l| match *l.light {
        Light::Linear(line) => Some((l.triangles.start, (line, l.set))),
        _ => None,
    });
    let mut next = lines.next();
    for mesh in &scene.meshes {
        while let Some((_, line)) = next.filter(|(at, _)| *at <= mesh.triangles.start) {
            let _ = writer.line(line);
            next = lines.next();
        }
        let _ = writer.mesh(mesh);
        writer.flush(out)?;
    }
    while let Some((_, line)) = next {
        let _ = writer.line(line);
        next = lines.next();
    }
    for (k, object) in scene.objects.iter().enumerate() {
        let _ = writer.object(k, object);
        writer.flush(out)?;
    }
    for instance in &scene.instances {
        let _ = writer.instance(instance);
        writer.flush(out)?;
    }
    writer.flush(out)
}

fn header(scene: &Scene, text: &mut String) -> fmt::Result {
    let camera = &scene.camera;
    writeln!(text, "# written by linelit; pbrt-v4")?;
    writeln!(text, "Transform {}", Matrix(&camera.world_to_camera))?;
    match camera.projection() {
        Projection::Perspective { fov_degrees } => {
            write!(
                text,
                "Camera \"perspective\" \"float fov\" [ {fov_degrees} ]"
            )?;
        }
        Projection::Orthographic => write!(text, "Camera \"orthographic\"")?,
        Projection::Spherical { z_up: true } => {
            write!(
                text,
                "Camera \"spherical\" \"string mapping\" \"equirectangular\""
            )?;
        }
        Projection::Spherical { z_up: false } => write!(text, "Camera \"environment\"")?,
    }
    if let Some([x0, x1, y0, y1]) = camera.screen_window {
        write!(text, " \"float screenwindow\" [ {x0} {x1} {y0} {y1} ]")?;
    }
    if let Some(aspect) = camera.frame_aspect_ratio {
        write!(text, " \"float frameaspectratio\" [ {aspect} ]")?;
    }
    // The film's scale, of ISO 100.
    let scale = scene.film.scale;
    if scale.to_bits() != 1.0_f64.to_bits() {
        write!(text, " \"float shutterclose\" [ {scale} ]")?;
    }
    writeln!(text)?;
    film(&scene.film, text)?;
    writeln!(
        text,
        "Sampler \"stratified\"\nIntegrator \"path\" \"integer maxdepth\" [ 1 ]\nWorldBegin"
    )
}

fn film(film: &FilmSettings, text: &mut String) -> fmt::Result {
    let [x0, x1, y0, y1] = film.crop;
    write!(
        text,
        "Film \"rgb\" \"integer xresolution\" [ {} ] \"integer yresolution\" [ {} ]",
        film.width, film.height
    )?;
    if film.crop != [0, film.width, 0, film.height] {
        write!(text, " \"integer pixelbounds\" [ {x0} {x1} {y0} {y1} ]")?;
    }
    if let Some(name) = &film.filename {
        write!(text, " \"string filename\" {}", Quoted(name))?;
    }
    let kind = match film.filter.kind {
        FilterKind::Box => "box",
        FilterKind::Triangle => "triangle",
        FilterKind::Gaussian => "gaussian",
        FilterKind::Mitchell => "mitchell",
        FilterKind::Sinc => "sinc",
    };
    let [rx, ry] = film.filter.radius;
    writeln!(text)?;
    writeln!(
        text,
        "PixelFilter \"{kind}\" \"float xradius\" [ {rx} ] \"float yradius\" [ {ry} ]"
    )
}

/// Three numbers.
struct Triple(DVec3);

impl fmt::Display for Triple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.0.x, self.0.y, self.0.z)
    }
}

/// An affine map, column by column.
struct Matrix<'a>(&'a DAffine3);

impl fmt::Display for Matrix<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = self.0.matrix3;
        f.write_char('[')?;
        for column in [m.x_axis, m.y_axis, m.z_axis] {
            write!(f, " {} 0", Triple(column))?;
        }
        write!(f, " {} 1 ]", Triple(self.0.translation))
    }
}

/// A string in quotes.
struct Quoted<'a>(&'a str);

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_char('"')?;
        for c in self.0.chars() {
            match c {
                '"' | '\\' => write!(f, "\\{c}")?,
                '\n' => f.write_str("\\n")?,
                '\r' => f.write_str("\\r")?,
                _ => f.write_char(c)?,
            }
        }
        f.write_char('"')
    }
}

struct Writer<'a> {
    scene: &'a Scene,
    options: &'a ExportOptions<'a>,
    text: String,
    /// Textures written so far; their number is their name.
    textures: usize,
    /// The parameter `alpha` of what meshes have holes by.
    alphas: Vec<String>,
}

/// Triangles with their vertices: the scene's own, or an object's.
#[derive(Clone, Copy)]
struct Geometry<'a> {
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    normals: &'a [[f32; 3]],
    uvs: &'a [[f32; 2]],
}

impl<'a> Writer<'a> {
    /// The scene's own triangles.
    const fn own(&self) -> Geometry<'a> {
        let scene = self.scene;
        Geometry {
            positions: scene.positions.as_slice(),
            triangles: scene.triangles.as_slice(),
            normals: scene.normals.as_slice(),
            uvs: scene.uvs.as_slice(),
        }
    }

    fn flush(&mut self, out: &mut impl io::Write) -> io::Result<()> {
        out.write_all(self.text.as_bytes())?;
        self.text.clear();
        Ok(())
    }

    /// A linear light.
    fn line(&mut self, (line, set): (LinearLight, u32)) -> fmt::Result {
        let prefix = if self.options.extensions { "" } else { "# " };
        let set = self.set(set);
        writeln!(
            self.text,
            "{prefix}AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ {} ]{set} Shape \"line\" \
             \"point3 p0\" [ {} ] \"point3 p1\" [ {} ] AttributeEnd",
            Triple(line.radiance_radius),
            Triple(line.segment.p0),
            Triple(line.segment.p1)
        )
    }

    /// The start of a mesh.
    fn begin(&mut self, mesh: &Mesh) -> fmt::Result {
        let material = mesh.material;
        writeln!(self.text, "AttributeBegin\nNamedMaterial \"m{material}\"")?;
        // Vertex normals say where the outside is, if there are any.
        if mesh.flipped && !mesh.has_normals {
            writeln!(self.text, "ReverseOrientation")?;
        }
        Ok(())
    }

    /// A mesh, each of its lights a shape of its own.
    fn mesh(&mut self, mesh: &Mesh) -> fmt::Result {
        let mut spheres = self.scene.spheres.iter();
        if let Some(sphere) = spheres.find(|s| s.triangles == mesh.triangles) {
            return self.sphere(mesh, sphere);
        }
        let mut disks = self.scene.disks.iter();
        if let Some(disk) = disks.find(|d| d.triangles == mesh.triangles) {
            return self.disk(mesh, disk);
        }
        let mut cylinders = self.scene.cylinders.iter();
        if let Some(cylinder) = cylinders.find(|c| c.triangles == mesh.triangles) {
            return self.cylinder(mesh, cylinder);
        }
        self.begin(mesh)?;
        let mut start = mesh.triangles.start;
        while start < mesh.triangles.end {
            let light = self.scene.light_of(start);
            let end = (start + 1..mesh.triangles.end)
                .find(|t| self.scene.light_of(*t) != light)
                .unwrap_or(mesh.triangles.end);
            if let Some(light) = light {
                let emission = self.emission(light)?;
                writeln!(
                    self.text,
                    "AttributeBegin\nAreaLightSource \"diffuse\"{emission}"
                )?;
            }
            self.shape(self.own(), mesh, start..end)?;
            writeln!(self.text)?;
            if light.is_some() {
                writeln!(self.text, "AttributeEnd")?;
            }
            start = end;
        }
        writeln!(self.text, "AttributeEnd")
    }

    /// An emissive sphere: itself, or with extensions its facets and what they stand for.
    fn sphere(&mut self, mesh: &Mesh, sphere: &EmissiveSphere) -> fmt::Result {
        writeln!(
            self.text,
            "AttributeBegin\nNamedMaterial \"m{}\"\nAreaLightSource \"diffuse\" \"rgb L\" [ {} ] \"bool twosided\" {}{}",
            mesh.material,
            Triple(sphere.emission.radiance),
            sphere.emission.two_sided,
            self.set(self.scene.lights[sphere.lights.start as usize].set)
        )?;
        if self.options.extensions {
            let sign = if sphere.inward { -1.0 } else { 1.0 };
            self.shape(self.own(), mesh, mesh.triangles.clone())?;
            let (centre, radius) = (Triple(sphere.center), sign * sphere.radius);
            writeln!(self.text, " \"float sphere\" [ {centre} {radius} ]")?;
        } else {
            if sphere.inward {
                writeln!(self.text, "ReverseOrientation")?;
            }
            let (centre, radius) = (Triple(sphere.center), sphere.radius);
            writeln!(
                self.text,
                "Translate {centre} Shape \"sphere\" \"float radius\" [ {radius} ]"
            )?;
        }
        writeln!(self.text, "AttributeEnd")
    }

    /// An emissive disk, as [`Self::sphere`].
    fn disk(&mut self, mesh: &Mesh, light: &EmissiveDisk) -> fmt::Result {
        let Disk {
            center,
            normal,
            radius,
        } = light.disk;
        writeln!(
            self.text,
            "AttributeBegin\nNamedMaterial \"m{}\"\nAreaLightSource \"diffuse\" \"rgb L\" [ {} ] \"bool twosided\" {}{}",
            mesh.material,
            Triple(light.emission.radiance),
            light.emission.two_sided,
            self.set(self.scene.lights[light.lights.start as usize].set)
        )?;
        if self.options.extensions {
            if mesh.flipped && !mesh.has_normals {
                writeln!(self.text, "ReverseOrientation")?;
            }
            self.shape(self.own(), mesh, mesh.triangles.clone())?;
            let (centre, normal) = (Triple(center), Triple(normal));
            writeln!(self.text, " \"float disk\" [ {centre} {normal} {radius} ]")?;
        } else {
            let Frame { x, y, z } = Frame::from_normal(normal);
            let [x, y, z, centre] = [x, y, z, center].map(Triple);
            writeln!(
                self.text,
                "ConcatTransform [ {x} 0 {y} 0 {z} 0 {centre} 1 ] Shape \"disk\" \"float radius\" [ {radius} ]"
            )?;
        }
        writeln!(self.text, "AttributeEnd")
    }

    /// An emissive cylinder, as [`Self::sphere`].
    fn cylinder(&mut self, mesh: &Mesh, light: &EmissiveCylinder) -> fmt::Result {
        let Cylinder { axis, radius } = light.cylinder;
        writeln!(
            self.text,
            "AttributeBegin\nNamedMaterial \"m{}\"\nAreaLightSource \"diffuse\" \"rgb L\" [ {} ] \"bool twosided\" {}{}",
            mesh.material,
            Triple(light.emission.radiance),
            light.emission.two_sided,
            self.set(self.scene.lights[light.lights.start as usize].set)
        )?;
        if self.options.extensions {
            let sign = if light.inward { -1.0 } else { 1.0 };
            self.shape(self.own(), mesh, mesh.triangles.clone())?;
            let ([p0, p1], radius) = ([axis.p0, axis.p1].map(Triple), sign * radius);
            writeln!(self.text, " \"float cylinder\" [ {p0} {p1} {radius} ]")?;
        } else {
            if light.inward {
                writeln!(self.text, "ReverseOrientation")?;
            }
            let Frame { x, y, z } = Frame::from_normal(axis.direction());
            let [x, y, z, origin] = [x, y, z, axis.p0].map(Triple);
            writeln!(
                self.text,
                "ConcatTransform [ {x} 0 {y} 0 {z} 0 {origin} 1 ] Shape \"cylinder\" \"float radius\" [ {radius} ] \"float zmin\" [ 0 ] \"float zmax\" [ {} ]",
                axis.length()
            )?;
        }
        writeln!(self.text, "AttributeEnd")
    }

    /// The parameters of an area light.
    fn emission(&self, light: u32) -> Result<String, fmt::Error> {
        let light = &self.scene.lights[light as usize];
        let emission = match &*light.light {
            Light::Area(area) => area.emission,
            _ => Emission::one_sided(DVec3::ZERO),
        };
        let image = light.map.as_ref();
        let image = image.and_then(|map| Some((map, self.options.image_of(map)?)));
        let mut out = String::new();
        match image {
            None => write!(out, " \"rgb L\" [ {} ]", Triple(emission.radiance))?,
            Some((map, image)) => {
                let name = (self.options.image_name)(image);
                let radiance = map.radiance * image.scale;
                write!(out, " \"string filename\" {}", Quoted(&name))?;
                // pbrt-v4 takes either an image or a radiance.
                if self.options.extensions {
                    let filter = materials::filter(image.filter);
                    write!(out, " \"rgb L\" [ {} ]{filter}", Triple(radiance))?;
                } else {
                    write!(out, " \"float scale\" [ {} ]", radiance.x)?;
                }
            }
        }
        let set = self.set(light.set);
        write!(out, " \"bool twosided\" {}{set}", emission.two_sided)?;
        Ok(out)
    }

    /// An extension: the set of a light, if it is in one.
    fn set(&self, set: u32) -> String {
        match self.scene.light_sets.get(set as usize) {
            Some(name) if set > 0 && self.options.extensions => {
                format!(" \"string set\" {}", Quoted(name))
            }
            _ => String::new(),
        }
    }

    /// The textures of what meshes have holes by.
    fn alphas(&mut self) -> fmt::Result {
        for alpha in &self.scene.alphas {
            let parameter = self.parameter("alpha", &alpha.texture, true)?;
            self.alphas.push(parameter);
        }
        Ok(())
    }

    /// The holes of a mesh, and with extensions their cutoffs and what lights have to do with it.
    fn extent(&mut self, mesh: &Mesh) -> fmt::Result {
        let extensions = self.options.extensions;
        let cutout = mesh.cutout;
        let seen = cutout.and_then(|holes| Some(("alpha", holes.seen?)));
        let shadow = cutout.and_then(|holes| Some(("shadowalpha", holes.shadow?)));
        // pbrt-v4 has no holes for lights alone.
        for (name, alpha) in seen.into_iter().chain(shadow.filter(|_| extensions)) {
            let parameter = &self.alphas[alpha as usize];
            let parameter = parameter.replacen(" alpha\"", &format!(" {name}\""), 1);
            write!(self.text, "{parameter}")?;
            if extensions {
                let cutoff = self.scene.alphas[alpha as usize].cutoff;
                write!(self.text, " \"float {name}cutoff\" [ {cutoff} ]")?;
            }
        }
        for (name, sets) in [
            ("litby", mesh.links.lit_by),
            ("shadows", mesh.links.shadows),
        ] {
            let known = self.scene.light_sets.iter().enumerate();
            let chosen = known.filter(|(k, _)| sets >> k & 1 != 0);
            let chosen: Vec<_> = chosen.map(|(_, set)| Quoted(set).to_string()).collect();
            if !extensions || chosen.len() == self.scene.light_sets.len() {
                continue;
            }
            let none = "\"none\"".to_owned();
            let chosen = if chosen.is_empty() {
                none
            } else {
                chosen.join(" ")
            };
            write!(self.text, " \"string {name}\" [ {chosen} ]")?;
        }
        Ok(())
    }

    /// An object, with extensions kept once in any case.
    fn object(&mut self, number: usize, object: &Object) -> fmt::Result {
        let once = if self.options.extensions {
            " \"bool once\" true"
        } else {
            ""
        };
        writeln!(self.text, "ObjectBegin \"o{number}\"{once}")?;
        let geometry = Geometry {
            positions: &object.positions,
            triangles: &object.triangles,
            normals: &object.normals,
            uvs: &object.uvs,
        };
        for mesh in &object.meshes {
            self.begin(mesh)?;
            self.shape(geometry, mesh, mesh.triangles.clone())?;
            writeln!(self.text, "\nAttributeEnd")?;
        }
        writeln!(self.text, "ObjectEnd")
    }

    fn instance(&mut self, instance: &Instance) -> fmt::Result {
        writeln!(
            self.text,
            "AttributeBegin ConcatTransform {} ObjectInstance \"o{}\" AttributeEnd",
            Matrix(&instance.to_world),
            instance.object
        )
    }

    /// A shape of some triangles, without the end of its line.
    fn shape(&mut self, of: Geometry<'_>, mesh: &Mesh, triangles: Range<u32>) -> fmt::Result {
        let mut numbers: std::collections::HashMap<u32, usize> = std::collections::HashMap::new();
        let mut vertices = Vec::new();
        write!(self.text, "Shape \"trianglemesh\" \"integer indices\" [")?;
        for t in triangles {
            for i in of.triangles[t as usize] {
                let number = *numbers.entry(i).or_insert_with(|| {
                    vertices.push(i as usize);
                    vertices.len() - 1
                });
                write!(self.text, " {number}")?;
            }
        }
        write!(self.text, " ]")?;
        self.list("point3 P", of.positions, &vertices)?;
        if mesh.has_normals {
            self.list("normal N", of.normals, &vertices)?;
        }
        if mesh.has_uvs {
            self.list("point2 uv", of.uvs, &vertices)?;
        }
        self.extent(mesh)
    }

    /// A parameter of the numbers that some vertices have.
    fn list<const N: usize>(
        &mut self,
        parameter: &str,
        of_vertices: &[[f32; N]],
        vertices: &[usize],
    ) -> fmt::Result {
        write!(self.text, " \"{parameter}\" [")?;
        for number in vertices.iter().flat_map(|i| of_vertices[*i]) {
            write!(self.text, " {number}")?;
        }
        write!(self.text, " ]")
    }
}
