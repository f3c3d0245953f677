//! The reader of pbrt text: it executes directives one after another, and adds shapes, lights and
//! materials to a scene.
//!
//! Both versions are read by one reader. Where they differ in names (`point`/`point3`,
//! `matte`/`diffuse`, `xwidth`/`xradius`) both names are known, and where they differ in meaning
//! the form of the parameter or the film decides (documented where it matters).

mod cutout;
mod directives;
mod emission;
mod lexer;
mod lights;
mod materials;
mod options;
mod params;
mod shapes;
mod state;
mod textures;
mod transforms;
mod view;

use crate::tessellate::Round;
use lexer::{Lexer, Token, TokenKind};
use linelit_assembly::{
    Assembly, ErrorKind, LoadOptions, Loaded, Result, SceneError, Source, Span, about_its_middle,
    shorten,
};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use linelit_scene::{MeshData, Placement, Texture};
use params::Params;
use state::State;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// The largest number of files that are open at once through `Include`.
const MAX_INCLUDES: usize = 32;

/// The largest number of included files in all. Without this limit, files that each include the
/// next one twice would be read 2ⁿ times at depth n.
const MAX_INCLUDES_IN_ALL: usize = 10_000;

/// Reads pbrt text from memory. Files that it names are looked up in the working directory. `name`
/// is the name of the text in messages.
///
/// # Errors
/// The same as for [`load`].
pub fn from_pbrt_str(text: &str, name: &str, options: &LoadOptions) -> Result<Loaded> {
    load(Source::new(name, text.into()), None, options)
}

/// Reads a scene from the text of a file in memory. Files that it names are looked up in the
/// directory of `path`, or in the working directory if that is `None`.
///
/// # Errors
/// The first error in the file or the files that it names, with its position. With
/// [`LoadOptions::strict`], features that are not supported are errors, too; otherwise they are
/// warnings.
pub fn load(source: Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    about_its_middle(options, |options| scene(&source, path, options))
}

/// Reads a scene with vertices relative to the origin in the options.
fn scene(source: &Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    let mut loader = Loader {
        base: Assembly::new(path, source.bytes().len(), options),
        state: State::default(),
        stack: Vec::new(),
        coordinate_systems: HashMap::new(),
        materials: HashMap::new(),
        textures: HashMap::new(),
        objects: HashMap::new(),
        object: None,
        view: view::View::default(),
        in_world: false,
        includes: path
            .and_then(|p| p.canonicalize().ok())
            .into_iter()
            .collect(),
        includes_in_all: 0,
        shapes: 0,
    };
    loader.read(source)?;
    loader.finish(source)
}

/// A shape between `ObjectBegin` and `ObjectEnd`, which is added with each instance.
#[derive(Debug)]
struct ObjectShape {
    geometry: Geometry,
    /// The placement relative to the object.
    place: Placement,
}

/// The object that is being defined: the shapes since `ObjectBegin`.
#[derive(Debug)]
struct OpenObject {
    name: String,
    shapes: Vec<ObjectShape>,
}

/// An object that `ObjectInstance` can place.
#[derive(Debug)]
struct Object {
    shapes: Rc<[ObjectShape]>,
    /// Whether the object has an instance.
    is_placed: bool,
}

/// The geometry that a shape directive makes.
#[derive(Clone, Debug)]
enum Geometry {
    Mesh(Rc<MeshData>),
    /// A linear light, given by its two ends.
    Line(DVec3, DVec3),
    /// A round shape that emits. Its facets depend on its transform.
    Round(Round),
}

/// A block that has not been closed, such as after `AttributeBegin`.
#[derive(Debug)]
struct Block {
    /// The directive that opened the block.
    opener: &'static str,
    source: Arc<Source>,
    span: Span,
    /// The graphics state before the block.
    saved: State,
}

/// The state of the reader.
struct Loader {
    base: Assembly,
    state: State,
    stack: Vec<Block>,
    coordinate_systems: HashMap<String, DAffine3>,
    materials: HashMap<String, Option<u32>>,
    textures: HashMap<(bool, String), Arc<Texture>>,
    objects: HashMap<String, Object>,
    object: Option<OpenObject>,
    view: view::View,
    in_world: bool,
    /// The canonical paths of the files that are open.
    includes: Vec<PathBuf>,
    includes_in_all: usize,
    /// The number of shapes in the files, including those that are left out.
    shapes: usize,
}

impl Loader {
    /// Executes all directives of a file.
    fn read(&mut self, source: &Arc<Source>) -> Result<()> {
        let mut lexer = Lexer::new(Arc::clone(source));
        while let Some(token) = lexer.next()? {
            if token.kind != TokenKind::Word {
                let text = shorten(&source.text(token.span));
                let message = format!("unexpected `{text}`");
                let at = source.at(token.span);
                return Err(at.error(ErrorKind::Syntax, message, "expected a directive"));
            }
            self.directive(&mut lexer, token)?;
        }
        Ok(())
    }

    /// Finishes the scene after the last directive.
    fn finish(mut self, source: &Source) -> Result<Loaded> {
        if let Some(block) = self.stack.last() {
            let end = block.opener.replace("Begin", "End");
            let message = format!("`{}` is never closed", block.opener);
            let at = block.source.at(block.span);
            let error = at.error(ErrorKind::Nesting, message, "opened here");
            return Err(error.help(format!("add `{end}`")));
        }
        let view = std::mem::take(&mut self.view);
        let (camera, film) = view.finish(&mut self.base.warnings, source)?;
        self.base
            .finish(source.name(), self.shapes > 0, Some(camera), film)
    }

    /// Reads the quoted name after a directive, as in `Shape "sphere"`.
    fn name(&self, lexer: &mut Lexer, directive: Token, what: &str) -> Result<(String, Token)> {
        match lexer.peek()? {
            Some(token) if token.kind == TokenKind::Quoted => {
                lexer.next()?;
                Ok((lexer.unquote(token)?, token))
            }
            _ => {
                let word = lexer.source().text(directive.span);
                let message = format!("`{word}` has no name");
                let label = format!("expected {what} in quotes behind it");
                Err(lexer.error(ErrorKind::Syntax, message, directive.span, label))
            }
        }
    }

    /// Reads a directive's quoted name and its parameters. `what` is the kind of the name, such as
    /// "shape", for messages.
    fn named_params(
        &mut self,
        lexer: &mut Lexer,
        directive: Token,
        what: &str,
    ) -> Result<(String, Params)> {
        let (name, token) = self.name(lexer, directive, "a name")?;
        let owner = match what {
            // The owner of the parameters, without the article.
            "a name" | "a colour space" | "a medium name" => name.clone(),
            _ => format!("{what} `{}`", shorten(&name)),
        };
        let params = Params::parse(lexer, owner, directive.span.to(token.span))?;
        Ok((name, params))
    }

    /// Warns about parameters that the directive did not read.
    fn warn_unused(&mut self, params: &Params) -> Result<()> {
        for (param, near) in params.unused() {
            let message = format!("{} has no parameter `{}`", params.owner, param.name);
            let place = |e: SceneError| e.at(param.at(), "ignored").suggest(near);
            let kind = ErrorKind::UnknownName;
            self.base.warnings.warn(kind, message, place)?;
        }
        Ok(())
    }

    /// Executes `Include "file"`, and `Import "file"`, after which the graphics state is restored.
    fn include(&mut self, lexer: &mut Lexer, directive: Token) -> Result<()> {
        // Check the limits.
        let (name, token) = self.name(lexer, directive, "a file name")?;
        let outer = Arc::clone(lexer.source());
        let at = outer.at(token.span);
        let fail = |kind, message: String, label: &str| Err(at.error(kind, message, label));
        if self.includes.len() > MAX_INCLUDES {
            let message = format!("files are included more than {MAX_INCLUDES} deep");
            return fail(ErrorKind::Limit, message, "one too many");
        }
        self.includes_in_all += 1;
        if self.includes_in_all > MAX_INCLUDES_IN_ALL {
            let message = format!("more than {MAX_INCLUDES_IN_ALL} files are included");
            return fail(ErrorKind::Limit, message, "one too many");
        }
        // Open the file, which must not be open already.
        let file = self.base.open_unpacked(&name, at)?;
        if self.includes.contains(&file.whole) {
            let message = format!("`{name}` includes itself");
            return fail(ErrorKind::Recursion, message, "already open");
        }
        let inner = Source::new(file.path, file.bytes);
        if !directives::begin(&inner) {
            // The message must not quote the file: a scene could name any file of the machine.
            let message = format!("`{name}` does not begin with a directive: it is no pbrt file");
            return fail(ErrorKind::Syntax, message, "named here");
        }
        // Read the file. Settings of an imported file do not hold in the importing file.
        self.includes.push(file.whole);
        let is_import = outer.text(directive.span) == "Import";
        let saved = is_import.then(|| self.state.clone());
        let result = self.read(&inner);
        if let Some(saved) = saved {
            self.state = saved;
        }
        self.includes.pop();
        result.map_err(|e| e.note(format!("included at {}", outer.short(token.span))))
    }
}

/// Returns whether a name is in a list of names separated by blanks.
fn is_one_of(name: &str, list: &str) -> bool {
    list.split(' ').any(|known| known == name)
}
