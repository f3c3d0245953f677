//! The statements of an OBJ file, one after the other, each refused with its place.
//!
//! Positions, texture coordinates and normals have numbers of their own, and a corner of a face
//! names one of each. A mesh has vertices instead: each combination that the faces of a group name
//! becomes one, in the order in which they name it.

use super::lines::{self, Line, Lines};
use super::mtl::{self, Entry};
use linelit_assembly::triangulate;
use linelit_assembly::{Assembly, ErrorKind, Result, SceneError, Source, Span, nearest, shorten};
use linelit_geometry::DVec3;
use linelit_scene::MeshData;
use std::collections::{HashMap, HashSet};

/// Statements of the format that mean nothing to a renderer of triangles.
const SILENT: [&str; 8] = ["o", "g", "s", "bevel", "c_interp", "d_interp", "lod", "mg"];

/// Statements that describe things we do not draw.
const UNSUPPORTED: &str = "p vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con \
                           call csh shadow_obj trace_obj ctech stech";

const KNOWN: [&str; 7] = ["v", "vt", "vn", "f", "l", "usemtl", "mtllib"];

/// The kinds of indices, in the order in which corners have them.
const WHAT: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Position, texture coordinate and normal of a corner, as indices from zero.
type Corner = [Option<u32>; 3];

/// Faces in a row with one material, which all have normals or none, and coordinates or none; or
/// a line element.
pub(super) struct Group {
    /// Index and emission.
    pub(super) material: Entry,
    /// The place of its first statement.
    pub(super) first: Span,
    /// The segments of a line element.
    pub(super) segments: Vec<[DVec3; 2]>,
    pub(super) mesh: MeshData,
    /// The kinds of indices that its corners have.
    has: [bool; 3],
    /// The vertex of each corner.
    vertices: HashMap<Corner, u32>,
}

/// What the statements of a file so far make.
pub(super) struct Statements<'a> {
    pub(super) base: Assembly,
    pub(super) groups: Vec<Group>,
    /// Faces and line elements, drawn or not.
    pub(super) shapes: usize,
    source: &'a Source,
    positions: Vec<DVec3>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    materials: HashMap<String, Entry>,
    libraries: HashSet<String>,
    material: Entry,
    /// Whether the last group goes on.
    is_open: bool,
}

impl<'a> Statements<'a> {
    pub(super) fn new(source: &'a Source, base: Assembly) -> Self {
        Self {
            base,
            groups: Vec::new(),
            shapes: 0,
            source,
            positions: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            materials: HashMap::new(),
            libraries: HashSet::new(),
            material: Entry::default(),
            is_open: false,
        }
    }

    /// Reads all statements; first the material libraries, which some files name behind the first
    /// use of a material.
    pub(super) fn read(&mut self) -> Result<()> {
        let source = self.source;
        for line in Lines::that_begin_with(source, b"mtllib") {
            self.statement(&line)?;
        }
        Lines::new(source).try_for_each(|line| self.statement(&line))
    }

    fn statement(&mut self, line: &Line) -> Result<()> {
        let source = self.source;
        let Some((&keyword, rest)) = line.words.split_first() else {
            return Ok(());
        };
        match &source.bytes()[keyword.start..keyword.end] {
            b"v" => {
                // A fourth number is a weight; six or more are position and colour.
                if rest.len() >= 6 {
                    let message = "vertex colours are not supported";
                    let at = source.at(keyword);
                    self.base.unsupported(message, "left out", at)?;
                }
                let position = lines::numbers::<3>(source, keyword, rest)?;
                self.positions.push(DVec3::from_array(position));
            }
            b"vn" => {
                let normal = self.finite(rest, lines::numbers::<3>(source, keyword, rest))?;
                self.normals.push(single(normal));
            }
            b"vt" => {
                // The second coordinate may be left out.
                let two = lines::numbers::<2>(source, keyword, rest);
                let one = || lines::numbers::<1>(source, keyword, rest).map(|[u]| [u, 0.0]);
                let uv = self.finite(rest, if rest.len() < 2 { one() } else { two })?;
                self.uvs.push(single(uv));
            }
            b"f" | b"fo" => self.face(line.span, rest)?,
            b"l" => self.polyline(keyword, rest)?,
            b"usemtl" => self.use_material(line.rest(source))?,
            b"mtllib" => self.name_libraries(line)?,
            _ => self.other(keyword)?,
        }
        Ok(())
    }

    /// The numbers of a normal or a texture coordinate: zeros after a warning where the file has
    /// what its writer could not compute.
    fn finite<const N: usize>(
        &mut self,
        words: &[Span],
        numbers: Result<[f64; N]>,
    ) -> Result<[f64; N]> {
        // What C libraries print for NaN and infinity: `nan`, `-nan(ind)`, `1.#QNAN`, `inf`.
        let source = self.source;
        let is_odd = |span: &Span| {
            let word = source.text(*span).to_ascii_lowercase();
            ["nan", "#ind", "inf"].iter().any(|odd| word.contains(odd))
        };
        match (numbers, words.iter().find(|w| is_odd(w))) {
            (Err(_), Some(odd)) => {
                let message = "normals or texture coordinates that are not finite";
                let (kind, at) = (ErrorKind::OutOfRange, source.at(*odd));
                self.base.warn(kind, message, "replaced by zeros", at)?;
                Ok([0.0; N])
            }
            (numbers, _) => numbers,
        }
    }

    fn other(&mut self, keyword: Span) -> Result<()> {
        let source = self.source;
        let word = source.text(keyword);
        if SILENT.contains(&word.as_str()) {
            return Ok(());
        }
        let at = source.at(keyword);
        if UNSUPPORTED.split(' ').any(|known| known == word) {
            let message = format!("OBJ statement `{word}` is not supported");
            return self.base.unsupported(message, "left out", at);
        }
        let word = shorten(&word);
        let near = nearest(&word, KNOWN.into_iter().chain(SILENT));
        let message = format!("unknown OBJ statement `{word}`");
        let place = |e: SceneError| e.at(at, "left out").suggest(near);
        self.base
            .warnings
            .warn(ErrorKind::UnknownName, message, place)
    }

    fn resolve(&self, span: Span, text: &[u8], kind: usize) -> Result<u32> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        resolve(self.source, span, text, (kind, counts[kind]))
    }

    fn corner(&mut self, span: Span) -> Result<Corner> {
        let text = &self.source.bytes()[span.start..span.end];
        let mut parts = text.split(|b| *b == b'/');
        let position = self.resolve(span, parts.next().unwrap_or(&[]), 0)?;
        let uv = self.optional(span, parts.next(), 1)?;
        let normal = self.optional(span, parts.next(), 2)?;
        Ok([Some(position), uv, normal])
    }

    /// An index that may be left out; a warning where there is no such thing, as other readers
    /// draw such faces without.
    fn optional(&mut self, span: Span, text: Option<&[u8]>, kind: usize) -> Result<Option<u32>> {
        let Some(text) = text.filter(|t| !t.is_empty()) else {
            return Ok(None);
        };
        match self.resolve(span, text, kind) {
            Ok(index) => Ok(Some(index)),
            Err(error) if error.kind() == ErrorKind::BadMesh => {
                let message = format!("faces with a {} that does not exist", WHAT[kind]);
                let (kind, at) = (ErrorKind::BadMesh, self.source.at(span));
                self.base.warn(kind, message, error.message(), at)?;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn face(&mut self, line: Span, rest: &[Span]) -> Result<()> {
        self.shapes += 1;
        if rest.len() < 3 {
            let message = "a face with fewer than three corners";
            let (kind, at) = (ErrorKind::BadMesh, self.source.at(line));
            return self.base.warn(kind, message, "left out", at);
        }
        let corners = rest
            .iter()
            .map(|s| self.corner(*s))
            .collect::<Result<Vec<_>>>()?;
        // Normals and texture coordinates are for all corners of a mesh or for none.
        let has = [0, 1, 2].map(|k| corners.iter().all(|c| c[k].is_some()));
        if !self.is_open || self.groups.last().is_none_or(|g| g.has != has) {
            self.begin(has, line);
        }
        let Some(group) = self.groups.last_mut() else {
            return Ok(());
        };
        // Make each corner that is new to the group a vertex of its mesh.
        let mesh = &mut group.mesh;
        let vertex = |corner: &Corner| {
            let corner = [0, 1, 2].map(|k| corner[k].filter(|_| has[k]));
            let next = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
            *group.vertices.entry(corner).or_insert_with(|| {
                let [position, uv, normal] = corner.map(|index| index.map(|k| k as usize));
                mesh.positions.extend(position.map(|k| self.positions[k]));
                mesh.uvs.extend(uv.map(|k| self.uvs[k]));
                mesh.normals.extend(normal.map(|k| self.normals[k]));
                next
            })
        };
        let polygon: Vec<u32> = corners.iter().map(vertex).collect();
        match triangulate(&mesh.positions, &polygon, &mut mesh.triangles) {
            Ok(()) => Ok(()),
            Err(it) => {
                let (kind, at) = (ErrorKind::BadMesh, self.source.at(line));
                self.base.warn(kind, format!("a face {it}"), "left out", at)
            }
        }
    }

    /// Begins a group.
    fn begin(&mut self, has: [bool; 3], first: Span) {
        if let Some(last) = self.groups.last_mut() {
            last.vertices = HashMap::new();
        }
        self.groups.push(Group {
            material: self.material,
            first,
            segments: Vec::new(),
            mesh: MeshData::default(),
            has,
            vertices: HashMap::new(),
        });
        self.is_open = true;
    }

    /// A line element: linear lights if the material emits.
    fn polyline(&mut self, keyword: Span, rest: &[Span]) -> Result<()> {
        self.shapes += 1;
        let ends = rest.iter().map(|s| self.corner(*s).map(|c| c[0]));
        let ends = ends
            .collect::<Result<Option<Vec<_>>>>()?
            .unwrap_or_default();
        if self.material.emission.is_none() {
            let message = "line elements without an emissive material are nothing";
            let at = self.source.at(keyword);
            return self.base.suspicious(message, "left out", at);
        }
        self.begin([true, false, false], keyword);
        self.is_open = false;
        let position = |index: u32| self.positions[index as usize];
        let segments = ends.windows(2).map(|pair| [pair[0], pair[1]].map(position));
        if let Some(group) = self.groups.last_mut() {
            group.segments = segments.collect();
        }
        Ok(())
    }

    fn use_material(&mut self, (name, span): (String, Span)) -> Result<()> {
        let source = self.source;
        self.is_open = false;
        let found = self.materials.get(&name).copied();
        self.material = found.unwrap_or_default();
        if found.is_none() {
            let shown = shorten(&name);
            let message = format!("unknown material `{shown}`");
            let names = self.materials.keys().map(String::as_str);
            // Called for the first warning of a name only: suggestions take time.
            let place = |e: SceneError| {
                let error = e.at(source.at(span), "replaced by grey, 0.5");
                error.suggest(nearest(&name, names))
            };
            let warnings = &mut self.base.warnings;
            warnings.warn(ErrorKind::UnknownName, message, place)?;
        }
        Ok(())
    }

    /// `mtllib a.mtl b.mtl` names two libraries, or one whose name holds a blank.
    fn name_libraries(&mut self, line: &Line) -> Result<()> {
        let source = self.source;
        let (whole, span) = line.rest(source);
        if line.words.len() > 2 && !self.base.has_file(&whole) {
            for word in &line.words[1..] {
                self.library(*word, &source.text(*word))?;
            }
            return Ok(());
        }
        self.library(span, &whole)
    }

    fn library(&mut self, place: Span, name: &str) -> Result<()> {
        let source = self.source;
        let at = source.at(place);
        if !self.libraries.insert(name.to_owned()) {
            return Ok(());
        }
        match self.base.open(name, at) {
            Ok(file) => {
                let library = Source::new(file.path, file.bytes);
                if !mtl::begins(&library) {
                    // What other files hold is nobody's business.
                    let message = format!("`{name}` is no material library");
                    let label = "does not begin with a statement of the format";
                    return Err(at.error(ErrorKind::Syntax, message, label));
                }
                let materials = mtl::read(&mut self.base, &library)
                    .map_err(|e| e.note(format!("read for {}", source.short(place))))?;
                self.materials.extend(materials);
                Ok(())
            }
            // A missing library is common; the shapes are still worth seeing.
            Err(error) if error.kind() == ErrorKind::Io => {
                let label = "its materials become grey, 0.5";
                self.base.warn(ErrorKind::Io, error.message(), label, at)
            }
            Err(error) => Err(error),
        }
    }
}

/// A normal or texture coordinates.
#[allow(clippy::cast_possible_truncation, reason = "they are f32 in a scene")]
fn single<const N: usize>(values: [f64; N]) -> [f32; N] {
    values.map(|x| x as f32)
}

/// An index of the file (from one, or negative from the end) as an index from zero.
fn resolve(source: &Source, span: Span, text: &[u8], (kind, count): (usize, usize)) -> Result<u32> {
    let what = WHAT[kind];
    let shown = shorten(&String::from_utf8_lossy(text));
    let index = std::str::from_utf8(text)
        .ok()
        .and_then(|t| t.parse::<i64>().ok());
    let Some(index) = index else {
        let message = format!("`{shown}` is no index of a {what}");
        return Err(source.error(ErrorKind::Syntax, message, span, "expected an integer"));
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
            source.error(ErrorKind::BadMesh, message, span, label)
        })
}

/// Polygons with all their corners.
#[derive(Debug, Default)]
pub struct Polygons {
    /// The positions of the vertices.
    pub positions: Vec<DVec3>,
    /// The vertices of each polygon.
    pub polygons: Vec<Vec<u32>>,
    /// The line of each polygon in the file, counted from one.
    pub lines: Vec<usize>,
}

/// Reads the positions of the vertices and the corners of the faces, and nothing else.
pub(super) fn polygons(source: &Source) -> Result<Polygons> {
    let mut found = Polygons::default();
    let (mut number, mut counted) = (1, 0);
    for line in Lines::new(source) {
        let Some((&keyword, rest)) = line.words.split_first() else {
            continue;
        };
        match &source.bytes()[keyword.start..keyword.end] {
            b"v" => {
                let position = lines::numbers::<3>(source, keyword, rest)?;
                found.positions.push(DVec3::from_array(position));
            }
            b"f" | b"fo" => {
                let count = found.positions.len();
                let corner = |span: &Span| {
                    let mut parts = source.bytes()[span.start..span.end].split(|b| *b == b'/');
                    resolve(source, *span, parts.next().unwrap_or(&[]), (0, count))
                };
                let corners = rest.iter().map(corner);
                found.polygons.push(corners.collect::<Result<_>>()?);
                let between = &source.bytes()[counted..keyword.start];
                number += between.iter().filter(|b| **b == b'\n').count();
                counted = keyword.start;
                found.lines.push(number);
            }
            _ => {}
        }
    }
    Ok(found)
}
