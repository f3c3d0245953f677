//! Wavefront OBJ with its material library.
//!
//! Faces (polygons are cut into triangles), line elements, groups by material. `Ke` makes the
//! faces of a material an area light (radiance in linear RGB, emitted on the outside), and its
//! line elements linear lights (`Ke` is then radiance × radius). The outside is where the vertex
//! normals point, or without them where the corners turn counter-clockwise. The world is
//! right-handed with y up; a camera that frames everything is added, since OBJ has none.

mod lines;
mod mtl;

use crate::assembly::Assembly;
use crate::diagnostics::{ErrorKind, Result, SceneError, Source, Span, nearest};
use crate::load::{LoadOptions, Loaded};
use crate::polygon::triangulate;
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use linelit_scene::{EmissionSpec, FilmSettings, MeshData, Placement};
use lines::{Line, Lines};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

/// Statements of the format that mean nothing to a renderer of triangles.
const SILENT: &[&str] = &["o", "g", "s", "bevel", "c_interp", "d_interp", "lod", "mg"];

/// Statements that describe things we do not draw.
const UNSUPPORTED: &[&str] = &[
    "p",
    "vp",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "call",
    "csh",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

const KNOWN: &[&str] = &["v", "vt", "vn", "f", "l", "usemtl", "mtllib"];

/// Reads a scene from a file in memory.
pub(crate) fn load(
    source: Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    let source = match utf16(source.bytes()) {
        Some(text) => Source::new(source.name().clone(), text.into_bytes()),
        None => source,
    };
    let mut reader = Reader {
        base: Assembly::new(path, source.bytes().len(), options),
        source: Arc::clone(&source),
        positions: Vec::new(),
        normals: Vec::new(),
        uvs: Vec::new(),
        materials: HashMap::new(),
        current: Group::default(),
        material: (0, None),
        shapes: 0,
        libraries: HashSet::new(),
    };
    reader.read()?;
    let shapes = reader.shapes > 0;
    reader
        .base
        .finish(source.name(), shapes, None, FilmSettings::default())
}

/// The text of a file that begins with a UTF-16 byte order mark.
fn utf16(bytes: &[u8]) -> Option<String> {
    let (big, rest) = match bytes {
        [0xfe, 0xff, rest @ ..] => (true, rest),
        [0xff, 0xfe, rest @ ..] => (false, rest),
        _ => return None,
    };
    let units = rest.as_chunks::<2>().0.iter().map(|unit| {
        if big {
            u16::from_be_bytes(*unit)
        } else {
            u16::from_le_bytes(*unit)
        }
    });
    let chars = char::decode_utf16(units);
    Some(
        chars
            .map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect(),
    )
}

/// Position, texture coordinate and normal of a corner, as indices from zero.
type Corner = (u32, Option<u32>, Option<u32>);

/// Faces with one material, being collected.
#[derive(Debug, Default)]
struct Group {
    mesh: MeshData,
    corners: HashMap<Corner, u32>,
    has_normals: bool,
    has_uvs: bool,
    first: Span,
}

struct Reader {
    base: Assembly,
    source: Arc<Source>,
    positions: Vec<DVec3>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Index and emission by name.
    materials: HashMap<String, (u32, Option<EmissionSpec>)>,
    current: Group,
    material: (u32, Option<EmissionSpec>),
    shapes: usize,
    libraries: HashSet<String>,
}

impl Reader {
    fn read(&mut self) -> Result<()> {
        let source = Arc::clone(&self.source);
        // Some files name their library behind the first use of its materials.
        for line in Lines::that_begin_with(&source, b"mtllib") {
            self.statement(&source, &line)?;
        }
        for line in Lines::new(&source) {
            self.statement(&source, &line)?;
        }
        self.end_group()
    }

    fn statement(&mut self, source: &Source, line: &Line) -> Result<()> {
        let Some((&keyword, rest)) = line.words.split_first() else {
            return Ok(());
        };
        match &source.bytes()[keyword.start..keyword.end] {
            b"v" => {
                let p = lines::numbers::<3>(source, keyword, rest)?;
                self.positions.push(DVec3::from_array(p));
                // A fourth number is a weight; six or more are position and colour.
                if rest.len() >= 6 {
                    let at = |e: SceneError, label: &str| e.at(source, keyword, label);
                    let message = "vertex colours are not supported";
                    self.base
                        .warn(ErrorKind::Unsupported, message, "left out", &at)?;
                }
            }
            b"vn" => {
                let n = self.finite(source, rest, lines::numbers::<3>(source, keyword, rest))?;
                self.normals.push(DVec3::from_array(n).as_vec3().to_array());
            }
            b"vt" => {
                // The second coordinate may be left out.
                let two = lines::numbers::<2>(source, keyword, rest);
                let one = || lines::numbers::<1>(source, keyword, rest).map(|[u]| [u, 0.0]);
                let uv = if rest.len() < 2 { one() } else { two };
                let [u, v] = self.finite(source, rest, uv)?;
                self.uvs
                    .push(DVec3::new(u, v, 0.0).as_vec3().truncate().to_array());
            }
            b"f" | b"fo" => self.face(source, line.span, rest)?,
            b"l" => self.polyline(source, keyword, rest)?,
            b"usemtl" => self.use_material(source, keyword, line.rest(source))?,
            b"mtllib" => self.libraries(source, keyword, line)?,
            _ => self.other(source, keyword)?,
        }
        Ok(())
    }

    /// The numbers of a normal or a texture coordinate: zeros after a warning where the file has
    /// what its writer could not compute.
    fn finite<const N: usize>(
        &mut self,
        source: &Source,
        words: &[Span],
        numbers: Result<[f64; N]>,
    ) -> Result<[f64; N]> {
        // What C libraries print for NaN and infinity: `nan`, `-nan(ind)`, `1.#QNAN`, `inf`.
        let is_odd = |span: &Span| {
            let word = source.text(*span).to_ascii_lowercase();
            ["nan", "#ind", "inf"].iter().any(|odd| word.contains(odd))
        };
        match (numbers, words.iter().find(|w| is_odd(w))) {
            (Err(_), Some(odd)) => {
                let at = |e: SceneError, label: &str| e.at(source, *odd, label);
                let message = "normals or texture coordinates that are not finite";
                self.base
                    .warn(ErrorKind::OutOfRange, message, "replaced by zeros", &at)?;
                Ok([0.0; N])
            }
            (numbers, _) => numbers,
        }
    }

    fn other(&mut self, source: &Source, keyword: Span) -> Result<()> {
        let word = source.text(keyword);
        if SILENT.contains(&word.as_str()) {
            return Ok(());
        }
        let at = |e: SceneError, label: &str| e.at(source, keyword, label);
        if UNSUPPORTED.contains(&word.as_str()) {
            let message = format!("OBJ statement `{word}` is not supported");
            return self
                .base
                .warn(ErrorKind::Unsupported, message, "left out", &at);
        }
        let word: String = word.chars().take(40).collect();
        let near = nearest(&word, KNOWN.iter().chain(SILENT).copied());
        let message = format!("unknown OBJ statement `{word}`");
        let suggest = |e: SceneError, label: &str| at(e, label).suggest(near);
        self.base
            .warn(ErrorKind::UnknownName, message, "left out", &suggest)
    }

    /// An index of the file (from one, or negative from the end) as an index from zero.
    fn resolve(source: &Source, span: Span, text: &[u8], count: usize, what: &str) -> Result<u32> {
        let shown = String::from_utf8_lossy(text)
            .chars()
            .take(40)
            .collect::<String>();
        let index = std::str::from_utf8(text)
            .ok()
            .and_then(|t| t.parse::<i64>().ok());
        let Some(index) = index else {
            let message = format!("`{shown}` is no index of a {what}");
            return Err(SceneError::new(ErrorKind::Syntax, message).at(
                source,
                span,
                "expected an integer",
            ));
        };
        let count_i = i64::try_from(count).unwrap_or(i64::MAX);
        let zero_based = if index < 0 {
            count_i + index
        } else {
            index - 1
        };
        let fits = (0..count_i).contains(&zero_based);
        u32::try_from(zero_based)
            .ok()
            .filter(|_| fits)
            .ok_or_else(|| {
                let message = format!("{what} {index} does not exist");
                let label = match count {
                    0 => format!("there is no {what} so far"),
                    _ => format!("there are {count} so far, counted from 1"),
                };
                SceneError::new(ErrorKind::BadMesh, message).at(source, span, label)
            })
    }

    fn corner(&mut self, source: &Source, span: Span) -> Result<Corner> {
        let text = &source.bytes()[span.start..span.end];
        let mut parts = text.split(|b| *b == b'/');
        let first = parts.next().unwrap_or(&[]);
        let position = Self::resolve(source, span, first, self.positions.len(), "vertex")?;
        let (uv, normal) = (parts.next(), parts.next());
        let uv = self.optional(source, span, uv, self.uvs.len(), "texture coordinate")?;
        let normal = self.optional(source, span, normal, self.normals.len(), "normal")?;
        Ok((position, uv, normal))
    }

    /// An index that may be left out; a warning where there is no such thing, as other readers
    /// draw such faces without.
    fn optional(
        &mut self,
        source: &Source,
        span: Span,
        text: Option<&[u8]>,
        count: usize,
        what: &str,
    ) -> Result<Option<u32>> {
        let Some(text) = text.filter(|t| !t.is_empty()) else {
            return Ok(None);
        };
        match Self::resolve(source, span, text, count, what) {
            Ok(index) => Ok(Some(index)),
            Err(error) if error.kind() == ErrorKind::BadMesh => {
                let message = format!("faces with a {what} that does not exist");
                let at = |e: SceneError, _: &str| e.at(source, span, error.message());
                self.base
                    .warn(ErrorKind::BadMesh, message, "drawn without", &at)?;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn face(&mut self, source: &Source, line: Span, rest: &[Span]) -> Result<()> {
        self.shapes += 1;
        if rest.len() < 3 {
            let at = |e: SceneError, label: &str| e.at(source, line, label);
            let message = "a face with fewer than three corners";
            return self.base.warn(ErrorKind::BadMesh, message, "left out", &at);
        }
        let corners = rest
            .iter()
            .map(|s| self.corner(source, *s))
            .collect::<Result<Vec<_>>>()?;
        // Normals and texture coordinates are for all corners of a mesh or for none.
        let has_normals = corners.iter().all(|c| c.2.is_some());
        let has_uvs = corners.iter().all(|c| c.1.is_some());
        let group = &self.current;
        if group.mesh.triangles.is_empty()
            || (group.has_normals, group.has_uvs) != (has_normals, has_uvs)
        {
            self.end_group()?;
            self.current.has_normals = has_normals;
            self.current.has_uvs = has_uvs;
            self.current.first = line;
        }
        let group = &mut self.current;
        let indices: Vec<u32> = corners
            .iter()
            .map(|&(p, uv, n)| {
                let key = (p, uv.filter(|_| has_uvs), n.filter(|_| has_normals));
                *group.corners.entry(key).or_insert_with(|| {
                    group.mesh.positions.push(self.positions[p as usize]);
                    group
                        .mesh
                        .normals
                        .extend(key.2.map(|n| self.normals[n as usize]));
                    group.mesh.uvs.extend(key.1.map(|uv| self.uvs[uv as usize]));
                    u32::try_from(group.mesh.positions.len() - 1).unwrap_or(u32::MAX)
                })
            })
            .collect();
        triangulate(&group.mesh.positions, &indices, &mut group.mesh.triangles);
        Ok(())
    }

    /// A line element: linear lights if the material emits.
    fn polyline(&mut self, source: &Source, keyword: Span, rest: &[Span]) -> Result<()> {
        self.shapes += 1;
        let corners = rest
            .iter()
            .map(|s| self.corner(source, *s))
            .collect::<Result<Vec<_>>>()?;
        let at = |e: SceneError, label: &str| e.at(source, keyword, label);
        let Some(spec) = self.material.1 else {
            let message = "line elements without an emissive material are nothing";
            return self
                .base
                .warn(ErrorKind::Suspicious, message, "left out", &at);
        };
        for pair in corners.windows(2) {
            let ends = [pair[0], pair[1]].map(|c| self.positions[c.0 as usize]);
            self.base.place_line(ends, &spec, &at)?;
        }
        Ok(())
    }

    fn use_material(
        &mut self,
        source: &Source,
        keyword: Span,
        (name, span): (String, Span),
    ) -> Result<()> {
        self.end_group()?;
        let found = self.materials.get(&name).copied();
        self.material = found.unwrap_or((0, None));
        if found.is_none() {
            let shown: String = name.chars().take(40).collect();
            let message = format!("unknown material `{shown}`");
            let place = if span.start == span.end {
                keyword
            } else {
                span
            };
            let materials = &self.materials;
            // Called for the first warning of a name only: suggestions take time.
            let at = |e: SceneError, label: &str| {
                let near = nearest(&name, materials.keys().map(String::as_str));
                e.at(source, place, label).suggest(near)
            };
            self.base.warn(
                ErrorKind::UnknownName,
                message,
                "replaced by grey, 0.5",
                &at,
            )?;
        }
        Ok(())
    }

    /// `mtllib a.mtl b.mtl` names two libraries, or one whose name holds a blank.
    fn libraries(&mut self, source: &Source, keyword: Span, line: &Line) -> Result<()> {
        let (whole, span) = line.rest(source);
        if line.words.len() > 2 && !self.base.has_file(&whole) {
            for word in &line.words[1..] {
                self.library(source, *word, &source.text(*word))?;
            }
            return Ok(());
        }
        let place = if span.start == span.end {
            keyword
        } else {
            span
        };
        self.library(source, place, &whole)
    }

    fn library(&mut self, source: &Source, place: Span, name: &str) -> Result<()> {
        let at = |e: SceneError, label: &str| e.at(source, place, label);
        if !self.libraries.insert(name.to_owned()) {
            return Ok(());
        }
        match self.base.open(name, &at) {
            Ok(file) => {
                let library = Source::new(file.path, file.bytes);
                if !mtl::begins(&library) {
                    // What other files hold is nobody's business.
                    let message = format!("`{name}` is no material library");
                    let error = SceneError::new(ErrorKind::Syntax, message);
                    return Err(at(error, "does not begin with a statement of the format"));
                }
                let materials = mtl::read(&mut self.base, &library)
                    .map_err(|e| e.note(format!("read for {}", source.short(place))))?;
                self.materials.extend(materials);
                Ok(())
            }
            // A missing library is common; the shapes are still worth seeing.
            Err(error) if error.kind() == ErrorKind::Io => {
                let message = error.message().to_owned();
                self.base.warn(
                    ErrorKind::Io,
                    message,
                    "its materials become grey, 0.5",
                    &at,
                )
            }
            Err(error) => Err(error),
        }
    }

    /// Puts the collected faces into the scene.
    fn end_group(&mut self) -> Result<()> {
        let group = std::mem::take(&mut self.current);
        if group.mesh.triangles.is_empty() {
            return Ok(());
        }
        let source = Arc::clone(&self.source);
        let at = |e: SceneError, label: &str| e.at(&source, group.first, label);
        let place = Placement {
            to_world: DAffine3::IDENTITY,
            reverse: false,
            material: self.material.0,
            emission: self.material.1,
        };
        self.base
            .place(&group.mesh, &place, "the mesh from here", &at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf16_text_is_converted() {
        assert_eq!(utf16(b"\xfe\xff\0v\0 \0\xe4").as_deref(), Some("v \u{e4}"));
        assert_eq!(utf16(b"\xff\xfev\0").as_deref(), Some("v"));
        assert_eq!(utf16(b"v 1 2 3"), None);
    }
}
