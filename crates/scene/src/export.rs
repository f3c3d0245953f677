//! Writing pbrt-v4 text, so that other renderers can check ours.

use crate::camera::Projection;
use crate::film::FilterKind;
use crate::material::{Material, MaterialKind, NormalMap, Remap, Roughness};
use crate::scene::{EmissiveSphere, Mesh, Scene};
use crate::texture::{ImageTexture, Texture, Wrap};
use linelit_geometry::DVec3;
use linelit_lights::{Emission, Light, LinearLight};
use std::fmt::{self, Write as _};
use std::io;

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

impl Scene {
    /// Writes the scene as pbrt text that pbrt-v4 reads.
    ///
    /// Geometry is written exactly (the shortest decimal form of each `f32`), in its order;
    /// cameras, films, materials, textures and area lights as far as pbrt-v4 has them. With
    /// [`ExportOptions::extensions`] reading it back gives the same scene, so that pictures are
    /// the same bit for bit. Without, what pbrt-v4 does not have is the nearest thing, with a
    /// comment: `phong`, `substrate` and `plastic` as `coateddiffuse`.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write_pbrt(
        &self,
        out: &mut impl io::Write,
        options: &ExportOptions<'_>,
    ) -> io::Result<()> {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = self.header(&mut text);
        out.write_all(text.as_bytes())?;
        let mut writer = Writer {
            scene: self,
            options,
            text: String::new(),
            textures: 0,
        };
        for (k, material) in self.materials.iter().enumerate() {
            let _ = writer.material(k, material);
            writer.flush(out)?;
        }
        // Linear lights stand between the meshes where they stood: the order of the lights names
        // their random numbers.
        let mut lines = self.lights.iter().filter_map(|l| match l.light {
            Light::Linear(line) => Some((l.triangles.start, line)),
            _ => None,
        });
        let mut next = lines.next();
        for mesh in &self.meshes {
            while let Some((_, line)) = next.filter(|(at, _)| *at <= mesh.triangles.start) {
                let _ = writer.line(&line);
                next = lines.next();
            }
            let _ = writer.mesh(mesh);
            writer.flush(out)?;
        }
        while let Some((_, line)) = next {
            let _ = writer.line(&line);
            next = lines.next();
        }
        writer.flush(out)
    }

    fn header(&self, text: &mut String) -> fmt::Result {
        let camera = &self.camera;
        let m = camera.world_to_camera;
        let columns = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
        writeln!(text, "# written by linelit; pbrt-v4")?;
        write!(text, "Transform [")?;
        for column in columns {
            write!(text, " {} 0", Triple(column))?;
        }
        writeln!(text, " {} 1 ]", Triple(m.translation))?;
        match camera.projection {
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
        let film = &self.film;
        let [x0, x1, y0, y1] = film.crop;
        writeln!(text)?;
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
        )?;
        writeln!(
            text,
            "Sampler \"stratified\"\nIntegrator \"path\" \"integer maxdepth\" [ 1 ]\nWorldBegin"
        )
    }
}

/// Three numbers.
struct Triple(DVec3);

impl fmt::Display for Triple {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.0.x, self.0.y, self.0.z)
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
}

impl Writer<'_> {
    fn flush(&mut self, out: &mut impl io::Write) -> io::Result<()> {
        out.write_all(self.text.as_bytes())?;
        self.text.clear();
        Ok(())
    }

    /// Writes the textures that a parameter needs and gives the parameter.
    fn parameter(
        &mut self,
        name: &str,
        texture: &Texture,
        is_number: bool,
    ) -> Result<String, fmt::Error> {
        if let Texture::Constant(value) = texture {
            return Ok(if is_number {
                format!(" \"float {name}\" [ {} ]", value.x)
            } else {
                format!(" \"rgb {name}\" [ {} ]", Triple(*value))
            });
        }
        let ty = if is_number { "float" } else { "spectrum" };
        let body = match texture {
            Texture::Constant(_) => String::new(),
            Texture::Image(image) => {
                let [wrap, v_wrap] = image.wrap.map(|wrap| match wrap {
                    Wrap::Repeat => "repeat",
                    // The nearest that pbrt has.
                    Wrap::Mirror if !self.options.extensions => "repeat",
                    Wrap::Mirror => "mirror",
                    Wrap::Black => "black",
                    Wrap::Clamp => "clamp",
                });
                let mut own = String::new();
                if self.options.extensions && image.mapping.rotation != 0.0 {
                    own = format!(" \"float uvrotation\" [ {} ]", image.mapping.rotation);
                }
                if self.options.extensions && wrap != v_wrap {
                    own += &format!(" \"string vwrap\" \"{v_wrap}\"");
                }
                let (s, o) = (image.mapping.scale, image.mapping.offset);
                let encoding = if image.data.is_srgb() {
                    "sRGB"
                } else {
                    "linear"
                };
                format!(
                    "\"imagemap\" \"string filename\" {} \"string wrap\" \"{wrap}\" \"string encoding\" \"{encoding}\" \
                     \"float scale\" [ {} ] \"bool invert\" {} \"float uscale\" [ {} ] \"float vscale\" [ {} ] \
                     \"float udelta\" [ {} ] \"float vdelta\" [ {} ]{own}",
                    Quoted(&(self.options.image_name)(image)),
                    image.scale,
                    image.invert,
                    s.x,
                    s.y,
                    o.x,
                    o.y
                )
            }
            Texture::Product(a, b) => {
                let a = self.parameter("tex", a, is_number)?;
                // pbrt-v4 scales by a number only; a colour is for readers like ours.
                match b.as_constant() {
                    Some(v) if v.x.to_bits() == v.y.to_bits() && v.x.to_bits() == v.z.to_bits() => {
                        format!("\"scale\"{a} \"float scale\" [ {} ]", v.x)
                    }
                    _ => {
                        let b = self.parameter("scale", b, is_number)?;
                        format!("\"scale\"{a}{b}")
                    }
                }
            }
            Texture::Mix { a, b, amount } => {
                let a = self.parameter("tex1", a, is_number)?;
                let b = self.parameter("tex2", b, is_number)?;
                let amount = self.parameter("amount", amount, true)?;
                format!("\"mix\"{a}{b}{amount}")
            }
            Texture::Checkerboard { mapping, even, odd } => {
                let even = self.parameter("tex1", even, is_number)?;
                let odd = self.parameter("tex2", odd, is_number)?;
                let (s, o) = (mapping.scale, mapping.offset);
                format!(
                    "\"checkerboard\"{even}{odd} \"float uscale\" [ {} ] \"float vscale\" [ {} ] \
                     \"float udelta\" [ {} ] \"float vdelta\" [ {} ]",
                    s.x, s.y, o.x, o.y
                )
            }
        };
        self.textures += 1;
        let label = format!("t{}", self.textures);
        writeln!(self.text, "Texture \"{label}\" \"{ty}\" {body}")?;
        Ok(format!(" \"texture {name}\" \"{label}\""))
    }

    /// Roughness for a material that remaps it by `reader`: as it is, if it is remapped so, else
    /// as α. Textures that pbrt-v4 remaps in another way than the file did stay as they are.
    fn roughness(&mut self, roughness: &Roughness, reader: Remap) -> Result<String, fmt::Error> {
        let as_is = roughness.remap == reader;
        let mut out = String::new();
        for (name, texture) in [("uroughness", &roughness.u), ("vroughness", &roughness.v)] {
            let texture = match texture.as_constant() {
                // Zero is smooth, whatever the remapping.
                Some(value) if !as_is && value.x > 0.0 => {
                    Texture::number(roughness.remap.alpha(value.x))
                }
                _ => texture.clone(),
            };
            out += &self.parameter(name, &texture, true)?;
        }
        let textured = roughness.u.as_constant().is_none() || roughness.v.as_constant().is_none();
        let remap = as_is || textured && roughness.remap != Remap::None;
        Ok(out + &format!(" \"bool remaproughness\" {remap}"))
    }

    fn material(&mut self, index: usize, material: &Material) -> fmt::Result {
        let mut comment = "";
        let body = if self.options.extensions
            && let Some(body) = self.own_material(&material.kind)?
        {
            body
        } else {
            self.plain_material(&material.kind, &mut comment)?
        };
        let relief = self.relief(material)?;
        let name: String = material.name.chars().filter(|c| !c.is_control()).collect();
        write!(
            self.text,
            "MakeNamedMaterial \"m{index}\" \"string type\" {body}{relief} # {name}"
        )?;
        if comment.is_empty() {
            writeln!(self.text)
        } else {
            writeln!(self.text, ": {comment}")
        }
    }

    /// A material under pbrt-v3's or our own name, if pbrt-v4 does not have it.
    fn own_material(&mut self, kind: &MaterialKind) -> Result<Option<String>, fmt::Error> {
        let parameters = |writer: &mut Self, list: &[(&str, &Texture, bool)]| {
            list.iter().try_fold(String::new(), |text, (n, t, number)| {
                Ok(text + &writer.parameter(n, t, *number)?)
            })
        };
        Ok(Some(match kind {
            MaterialKind::Matte { kd, sigma } => {
                let list = [("Kd", kd, false), ("sigma", sigma, true)];
                format!("\"matte\"{}", parameters(self, &list)?)
            }
            MaterialKind::Plastic { kd, ks, roughness } => {
                let list = [("Kd", kd, false), ("Ks", ks, false)];
                let list = parameters(self, &list)?;
                format!("\"plastic\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Substrate { kd, ks, roughness } => {
                let list = [("Kd", kd, false), ("Ks", ks, false)];
                let list = parameters(self, &list)?;
                format!(
                    "\"substrate\"{list}{}",
                    self.roughness(roughness, Remap::V3)?
                )
            }
            MaterialKind::Uber {
                kd,
                ks,
                kr,
                kt,
                roughness,
                eta,
                opacity,
            } => {
                let list = [
                    ("Kd", kd, false),
                    ("Ks", ks, false),
                    ("Kr", kr, false),
                    ("Kt", kt, false),
                    ("eta", eta, true),
                    ("opacity", opacity, false),
                ];
                let list = parameters(self, &list)?;
                format!("\"uber\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Conductor { eta, k, roughness } if roughness.remap == Remap::V3 => {
                let list = parameters(self, &[("eta", eta, false), ("k", k, false)])?;
                format!("\"metal\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Mirror { kr } => {
                format!("\"mirror\"{}", parameters(self, &[("Kr", kr, false)])?)
            }
            MaterialKind::Dielectric {
                kr,
                kt,
                eta,
                roughness,
                thin: false,
            } if roughness.remap != Remap::V4 => {
                let list = [("Kr", kr, false), ("Kt", kt, false), ("eta", eta, true)];
                let list = parameters(self, &list)?;
                format!("\"glass\"{list}{}", self.roughness(roughness, Remap::V3)?)
            }
            MaterialKind::Phong { kd, ks, exponent } => {
                let list = [
                    ("Kd", kd, false),
                    ("Ks", ks, false),
                    ("exponent", exponent, true),
                ];
                format!("\"phong\"{}", parameters(self, &list)?)
            }
            _ => return Ok(None),
        }))
    }

    /// A material as pbrt-v4 has it, or the nearest thing and a remark.
    fn plain_material(
        &mut self,
        kind: &MaterialKind,
        comment: &mut &'static str,
    ) -> Result<String, fmt::Error> {
        Ok(match kind {
            MaterialKind::Matte { kd, .. } => {
                format!("\"diffuse\"{}", self.parameter("reflectance", kd, false)?)
            }
            MaterialKind::Plastic { kd, roughness, .. }
            | MaterialKind::Substrate { kd, roughness, .. }
            | MaterialKind::Uber { kd, roughness, .. } => {
                *comment = "the nearest that pbrt-v4 has";
                let kd = self.parameter("reflectance", kd, false)?;
                format!(
                    "\"coateddiffuse\"{kd}{}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::CoatedDiffuse {
                reflectance,
                roughness,
                eta,
                thickness,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                let eta = self.parameter("eta", eta, true)?;
                let roughness = self.roughness(roughness, Remap::V4)?;
                format!("\"coateddiffuse\"{r}{roughness}{eta} \"float thickness\" [ {thickness} ]")
            }
            MaterialKind::Phong { kd, .. } => {
                *comment = "the diffuse part of `phong`";
                format!("\"diffuse\"{}", self.parameter("reflectance", kd, false)?)
            }
            MaterialKind::Conductor { eta, k, roughness } => {
                let eta = self.parameter("eta", eta, false)?;
                let k = self.parameter("k", k, false)?;
                format!(
                    "\"conductor\"{eta}{k}{}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::ColoredConductor {
                reflectance,
                roughness,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                format!("\"conductor\"{r}{}", self.roughness(roughness, Remap::V4)?)
            }
            MaterialKind::Mirror { kr } => {
                format!(
                    "\"conductor\"{} \"float roughness\" [ 0 ]",
                    self.parameter("reflectance", kr, false)?
                )
            }
            MaterialKind::Dielectric {
                eta, thin: true, ..
            } => {
                format!("\"thindielectric\"{}", self.parameter("eta", eta, true)?)
            }
            MaterialKind::Dielectric {
                eta,
                roughness,
                thin: false,
                ..
            } => {
                let eta = self.parameter("eta", eta, true)?;
                format!(
                    "\"dielectric\"{eta}{}",
                    self.roughness(roughness, Remap::V4)?
                )
            }
            MaterialKind::DiffuseTransmission {
                reflectance,
                transmittance,
            } => {
                let r = self.parameter("reflectance", reflectance, false)?;
                let t = self.parameter("transmittance", transmittance, false)?;
                format!("\"diffusetransmission\"{r}{t}")
            }
            MaterialKind::Mix {
                materials: [a, b],
                amount,
            } => {
                // pbrt-v4 mixes by a number, pbrt-v3 by a colour.
                let amount = self.parameter("amount", amount, !self.options.extensions)?;
                format!("\"mix\" \"string materials\" [ \"m{a}\" \"m{b}\" ]{amount}")
            }
        })
    }

    /// Bump or normal map; pbrt's normal maps have no factor, ours is then lost.
    fn relief(&mut self, material: &Material) -> Result<String, fmt::Error> {
        if let Some(height) = &material.bump {
            return self.parameter("displacement", height, true);
        }
        Ok(match &material.normal_map {
            Some(NormalMap {
                texture: Texture::Image(image),
                ..
            }) => {
                let name = (self.options.image_name)(image);
                format!(" \"string normalmap\" {}", Quoted(&name))
            }
            _ => String::new(),
        })
    }

    /// A linear light.
    fn line(&mut self, line: &LinearLight) -> fmt::Result {
        let prefix = if self.options.extensions { "" } else { "# " };
        writeln!(
            self.text,
            "{prefix}AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ {} ] Shape \"line\" \
             \"point3 p0\" [ {} ] \"point3 p1\" [ {} ] AttributeEnd",
            Triple(line.radiance_radius),
            Triple(line.segment.p0),
            Triple(line.segment.p1)
        )
    }

    /// A mesh, each of its lights a shape of its own.
    fn mesh(&mut self, mesh: &Mesh) -> fmt::Result {
        let mut spheres = self.scene.spheres.iter();
        if let Some(sphere) = spheres.find(|s| s.triangles == mesh.triangles) {
            return self.sphere(mesh, sphere);
        }
        writeln!(
            self.text,
            "AttributeBegin\nNamedMaterial \"m{}\"",
            mesh.material
        )?;
        // Vertex normals say where the outside is, if there are any.
        if mesh.flipped && !mesh.has_normals {
            writeln!(self.text, "ReverseOrientation")?;
        }
        let mut start = mesh.triangles.start;
        while start < mesh.triangles.end {
            let light = self.scene.light_of(start);
            let end = (start + 1..mesh.triangles.end)
                .find(|t| self.scene.light_of(*t) != light)
                .unwrap_or(mesh.triangles.end);
            if let Some(light) = light {
                let emission = self.emission(light);
                writeln!(
                    self.text,
                    "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {} ] \"bool twosided\" {}",
                    Triple(emission.radiance),
                    emission.two_sided
                )?;
            }
            self.triangles(mesh, start, end)?;
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
            "AttributeBegin\nNamedMaterial \"m{}\"\nAreaLightSource \"diffuse\" \"rgb L\" [ {} ] \"bool twosided\" {}",
            mesh.material,
            Triple(sphere.emission.radiance),
            sphere.emission.two_sided
        )?;
        if self.options.extensions {
            let sign = if sphere.inward { -1.0 } else { 1.0 };
            self.shape(mesh, mesh.triangles.start, mesh.triangles.end)?;
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

    fn emission(&self, light: u32) -> Emission {
        match &self.scene.lights[light as usize].light {
            Light::Area(area) => area.emission,
            _ => Emission::one_sided(DVec3::ZERO),
        }
    }

    fn triangles(&mut self, mesh: &Mesh, start: u32, end: u32) -> fmt::Result {
        self.shape(mesh, start, end)?;
        writeln!(self.text)
    }

    /// A shape of some triangles, without the end of its line.
    fn shape(&mut self, mesh: &Mesh, start: u32, end: u32) -> fmt::Result {
        let scene = self.scene;
        let mut numbers: std::collections::HashMap<u32, usize> = std::collections::HashMap::new();
        let mut vertices = Vec::new();
        write!(self.text, "Shape \"trianglemesh\" \"integer indices\" [")?;
        for t in start..end {
            for i in scene.triangles[t as usize] {
                let number = *numbers.entry(i).or_insert_with(|| {
                    vertices.push(i as usize);
                    vertices.len() - 1
                });
                write!(self.text, " {number}")?;
            }
        }
        write!(self.text, " ] \"point3 P\" [")?;
        for i in &vertices {
            let [x, y, z] = scene.positions[*i];
            write!(self.text, " {x} {y} {z}")?;
        }
        if mesh.has_normals {
            write!(self.text, " ] \"normal N\" [")?;
            for i in &vertices {
                let [x, y, z] = scene.normals[*i];
                write!(self.text, " {x} {y} {z}")?;
            }
        }
        if mesh.has_uvs {
            write!(self.text, " ] \"point2 uv\" [")?;
            for i in &vertices {
                let [u, v] = scene.uvs[*i];
                write!(self.text, " {u} {v}")?;
            }
        }
        write!(self.text, " ]")
    }
}
