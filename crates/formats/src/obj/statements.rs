//! The statements of an OBJ file: they are checked, and rewritten to a text that the crate tobj
//! reads as intended.
//!
//! tobj has limits. Its errors have no position; it accepts indices of vertices that come later,
//! stops at indices of normals that do not exist, confuses meshes of which only some faces have
//! normals, panics where an index overflows in a product, and reads `l a b c` as a triangle.
//! Therefore each statement is checked here with its position, while tobj reads through the
//! interface of `BufRead`. tobj gets vertices with finite numbers, faces with valid indices, and
//! groups with names of their own, whose faces all have the same attributes.

use super::lines::{self, Line, Lines};
use super::mtl::{self, Entry};
use linelit_assembly::{Assembly, ErrorKind, Result, SceneError, Source, Span, nearest, shorten};
use linelit_geometry::DVec3;
use std::collections::{HashMap, HashSet};
use std::io::{self, BufRead, Read, Write as _};

/// The statements that do not affect pictures of triangles, and are ignored.
const SILENT: [&str; 8] = ["o", "g", "s", "bevel", "c_interp", "d_interp", "lod", "mg"];

/// The statements that are not supported, such as those for curves and surfaces.
const UNSUPPORTED: &str = "p vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con \
                           call csh shadow_obj trace_obj ctech stech";

/// The statements that are read, for suggestions.
const KNOWN: [&str; 7] = ["v", "vt", "vn", "f", "l", "usemtl", "mtllib"];

/// The names of the kinds of indices, in the order in which corners have them, for messages.
const WHAT: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The position, texture coordinate and normal of a corner, as indices from zero.
type Corner = [Option<u32>; 3];

/// Consecutive faces with the same material and the same attributes (normals, texture coordinates),
/// or a line element. The name of a group for tobj is the index of the group.
#[derive(Clone)]
pub(super) struct Group {
    /// The material with its emission.
    pub(super) material: Entry,
    pub(super) is_line: bool,
    /// For each of the three kinds of indices (position, texture coordinate, normal), whether the
    /// corners of the group have it.
    has: [bool; 3],
    /// The position of the group's first statement.
    pub(super) first: Span,
}

/// The statements of a file, from which tobj reads the rewritten text.
pub(super) struct Statements<'a> {
    pub(super) base: Assembly,
    pub(super) groups: Vec<Group>,
    /// The number of faces and line elements, including those that are left out.
    pub(super) shapes: usize,
    source: &'a Source,
    lines: Lines<'a>,
    /// The numbers of positions, texture coordinates and normals so far.
    counts: [usize; 3],
    materials: HashMap<String, Entry>,
    /// The names of the material libraries that were read.
    libraries: HashSet<String>,
    /// The current material.
    material: Entry,
    /// Whether the next face may belong to the last group.
    is_open: bool,
    /// The position of the last statement that was read.
    last: Span,
    /// The error in the last statement, if it has one. Such an error ends the text.
    refused: Option<SceneError>,
    /// The rewritten text of the last statement.
    text: Vec<u8>,
    /// The number of bytes of `text` that tobj has read.
    at: usize,
    /// Whether all statements have been read, or one was refused.
    ended: bool,
}

impl BufRead for Statements<'_> {
    /// Rewrites statements until there is text to read.
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.at == self.text.len() && !self.ended {
            self.text.clear();
            self.at = 0;
            match self.lines.next() {
                Some(line) => {
                    if let Err(error) = self.statement(&line) {
                        self.refused = Some(error);
                        self.text.clear();
                        self.ended = true;
                    }
                    self.last = line.span;
                }
                None => self.ended = true,
            }
        }
        Ok(&self.text[self.at..])
    }

    fn consume(&mut self, count: usize) {
        self.at += count;
    }
}

impl Read for Statements<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl<'a> Statements<'a> {
    /// Creates the statements of a file, whose materials are added to `base`.
    pub(super) fn new(source: &'a Source, base: Assembly) -> Self {
        Self {
            base,
            groups: Vec::new(),
            shapes: 0,
            source,
            lines: Lines::new(source),
            counts: [0; 3],
            materials: HashMap::new(),
            libraries: HashSet::new(),
            material: Entry::default(),
            is_open: false,
            last: Span::default(),
            refused: None,
            text: Vec::new(),
            at: 0,
            ended: false,
        }
    }

    /// Reads all material libraries beforehand, as some files name them after the first use of a
    /// material.
    pub(super) fn read_libraries(&mut self) -> Result<()> {
        let source = self.source;
        for line in Lines::that_begin_with(source, b"mtllib") {
            self.statement(&line)?;
        }
        Ok(())
    }

    /// Returns the result of tobj, or the error of the statement that was refused. An error of tobj
    /// gets the position of the last statement.
    pub(super) fn check<T>(&mut self, read: std::result::Result<T, tobj::LoadError>) -> Result<T> {
        if let Some(refused) = self.refused.take() {
            return Err(refused);
        }
        read.map_err(|error| {
            let at = self.source.at(self.last);
            at.error(ErrorKind::Syntax, error.to_string(), "in this statement")
        })
    }

    /// Checks a statement, and appends its rewritten form to the text.
    fn statement(&mut self, line: &Line) -> Result<()> {
        let source = self.source;
        let Some((&keyword, rest)) = line.words.split_first() else {
            return Ok(());
        };
        match &source.bytes()[keyword.start..keyword.end] {
            // Read vertices with their attributes.
            b"v" => {
                // A fourth number is a weight; six or more are position and colour.
                if rest.len() >= 6 {
                    let message = "vertex colours are not supported";
                    let at = source.at(keyword);
                    self.base.unsupported(message, "left out", at)?;
                }
                let position = lines::numbers::<3>(source, keyword, rest)?;
                self.vertex(0, "v", &position);
            }
            b"vn" => {
                let normal = self.finite(rest, lines::numbers::<3>(source, keyword, rest))?;
                self.vertex(2, "vn", &normal);
            }
            b"vt" => {
                // The second coordinate may be left out.
                let two = lines::numbers::<2>(source, keyword, rest);
                let one = || lines::numbers::<1>(source, keyword, rest).map(|[u]| [u, 0.0]);
                let uv = self.finite(rest, if rest.len() < 2 { one() } else { two })?;
                self.vertex(1, "vt", &uv);
            }
            // Read faces, lines and materials.
            b"f" | b"fo" => self.face(line.span, rest)?,
            b"l" => self.polyline(keyword, rest)?,
            b"usemtl" => self.use_material(line.rest(source))?,
            b"mtllib" => self.name_libraries(line)?,
            _ => self.other(keyword)?,
        }
        Ok(())
    }

    /// Writes a position, a texture coordinate or a normal.
    fn vertex(&mut self, kind: usize, keyword: &str, numbers: &[f64]) {
        self.counts[kind] += 1;
        self.text.extend(keyword.as_bytes());
        for number in numbers {
            self.put(format_args!(" {number:e}"));
        }
        self.text.push(b'\n');
    }

    /// Appends to the text.
    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        self.text
            .write_fmt(text)
            .expect("writing to memory does not fail");
    }

    /// Returns the numbers of a normal or a texture coordinate. Where the file has NaN or infinity
    /// instead of a number, they are zeros, with a warning.
    fn finite<const N: usize>(
        &mut self,
        words: &[Span],
        numbers: Result<[f64; N]>,
    ) -> Result<[f64; N]> {
        // C libraries print NaN and infinity as `nan`, `-nan(ind)`, `1.#QNAN` or `inf`.
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

    /// Ignores a statement, or warns that it is not supported or unknown.
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

    /// Returns an index in the text of the file as an index from zero. `kind` is 0 for a position,
    /// 1 for a texture coordinate and 2 for a normal.
    fn resolve(&self, span: Span, text: &[u8], kind: usize) -> Result<u32> {
        resolve(self.source, span, text, (kind, self.counts[kind]))
    }

    /// Reads a corner of a face, such as `1/2/3` or `1//3`.
    fn corner(&mut self, span: Span) -> Result<Corner> {
        let text = &self.source.bytes()[span.start..span.end];
        let mut parts = text.split(|b| *b == b'/');
        let position = self.resolve(span, parts.next().unwrap_or(&[]), 0)?;
        let uv = self.optional(span, parts.next(), 1)?;
        let normal = self.optional(span, parts.next(), 2)?;
        Ok([Some(position), uv, normal])
    }

    /// Reads an index that may be missing. An index out of range is a warning, and the face is read
    /// without this attribute, as other readers do.
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

    /// Reads a face, and begins a new group if its attributes differ from the last one's.
    fn face(&mut self, line: Span, rest: &[Span]) -> Result<()> {
        // Read the corners.
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
        // Find the attributes that all corners have; all faces of a group have the same.
        let has = [0, 1, 2].map(|k| corners.iter().all(|c| c[k].is_some()));
        if !self.is_open || self.groups.last().is_none_or(|g| g.has != has) {
            self.begin(false, has, line);
        }
        // Write the face with these attributes.
        self.text.push(b'f');
        for corner in corners {
            let shown = [0, 1, 2].map(|k| match corner[k] {
                Some(index) if has[k] => (u64::from(index) + 1).to_string(),
                _ => String::new(),
            });
            self.put(format_args!(" {}", shown.join("/")));
        }
        self.text.push(b'\n');
        Ok(())
    }

    /// Begins a group of faces or of a line element; `has` says which kinds of indices its corners
    /// have.
    fn begin(&mut self, is_line: bool, has: [bool; 3], first: Span) {
        self.put(format_args!("g {}\n", self.groups.len()));
        self.is_open = !is_line;
        self.groups.push(Group {
            material: self.material,
            is_line,
            has,
            first,
        });
    }

    /// Reads a line element, which becomes linear lights if the material emits.
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
        self.begin(true, [true, false, false], keyword);
        for pair in ends.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|index| u64::from(index) + 1);
            self.put(format_args!("l {a} {b}\n"));
        }
        Ok(())
    }

    /// Executes `usemtl name`.
    fn use_material(&mut self, (name, span): (String, Span)) -> Result<()> {
        let source = self.source;
        self.is_open = false;
        let found = self.materials.get(&name).copied();
        self.material = found.unwrap_or_default();
        if found.is_none() {
            let shown = shorten(&name);
            let message = format!("unknown material `{shown}`");
            let names = self.materials.keys().map(String::as_str);
            // Search for a suggestion only with the first warning about a name, as it takes time.
            let place = |e: SceneError| {
                let error = e.at(source.at(span), "replaced by grey, 0.5");
                error.suggest(nearest(&name, names))
            };
            let warnings = &mut self.base.warnings;
            warnings.warn(ErrorKind::UnknownName, message, place)?;
        }
        Ok(())
    }

    /// Executes `mtllib a.mtl b.mtl`, which names two libraries, or one whose name contains a
    /// blank.
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

    /// Reads a material library, once for each name.
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
                    // The message must not quote the file: a scene could name any file of the
                    // machine.
                    let message = format!("`{name}` is no material library");
                    let label = "does not begin with a statement of the format";
                    return Err(at.error(ErrorKind::Syntax, message, label));
                }
                let materials = mtl::read(&mut self.base, &library)
                    .map_err(|e| e.note(format!("read for {}", source.short(place))))?;
                self.materials.extend(materials);
                Ok(())
            }
            // Only warn about missing libraries, which are common.
            Err(error) if error.kind() == ErrorKind::Io => {
                let label = "its materials become grey, 0.5";
                self.base.warn(ErrorKind::Io, error.message(), label, at)
            }
            Err(error) => Err(error),
        }
    }
}

/// Converts an index in the file (from one, or negative from the end) to an index from zero. `kind`
/// is its kind and `count` the number of entries of this kind so far.
fn resolve(source: &Source, span: Span, text: &[u8], (kind, count): (usize, usize)) -> Result<u32> {
    // Read an integer.
    let what = WHAT[kind];
    let shown = shorten(&String::from_utf8_lossy(text));
    let index = std::str::from_utf8(text)
        .ok()
        .and_then(|t| t.parse::<i64>().ok());
    let Some(index) = index else {
        let message = format!("`{shown}` is no index of a {what}");
        return Err(source.error(ErrorKind::Syntax, message, span, "expected an integer"));
    };
    // Count it from zero, and refuse one that is out of range so far.
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

/// The polygons of a file, not triangulated.
#[derive(Debug, Default)]
pub struct Polygons {
    /// The positions of the vertices.
    pub positions: Vec<DVec3>,
    /// For each polygon, the indices of its vertices.
    pub polygons: Vec<Vec<u32>>,
    /// The line of each polygon in the file, counted from one.
    pub lines: Vec<usize>,
}

/// Reads the positions of the vertices and the corners of the faces, and ignores everything else.
pub(super) fn polygons(source: &Source) -> Result<Polygons> {
    let mut found = Polygons::default();
    let (mut number, mut counted) = (1, 0);
    for line in Lines::new(source) {
        let Some((&keyword, rest)) = line.words.split_first() else {
            continue;
        };
        match &source.bytes()[keyword.start..keyword.end] {
            b"v" => {
                // Add a vertex.
                let position = lines::numbers::<3>(source, keyword, rest)?;
                found.positions.push(DVec3::from_array(position));
            }
            b"f" | b"fo" => {
                // Take the positions of the corners alone.
                let count = found.positions.len();
                let corner = |span: &Span| {
                    let mut parts = source.bytes()[span.start..span.end].split(|b| *b == b'/');
                    resolve(source, *span, parts.next().unwrap_or(&[]), (0, count))
                };
                let corners = rest.iter().map(corner);
                found.polygons.push(corners.collect::<Result<_>>()?);
                // Count the lines since the last face.
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
