//! pbrt text, versions 3 and 4.
//!
//! Both versions are read by one reader: where they differ in names (`point`/`point3`,
//! `matte`/`diffuse`, `xwidth`/`xradius`) both are known, and where they differ in meaning the
//! parameter's form decides (documented where it matters).

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

/// Files that may be open at once through `Include`.
const MAX_INCLUDES: usize = 32;

/// Files that may be included in all: files that include each other twice double with each level.
const MAX_INCLUDES_IN_ALL: usize = 10_000;

/// Reads pbrt text from memory. Files that it names are looked up in the working folder; `name` is
/// what messages call the text.
///
/// # Errors
/// As [`load`].
pub fn from_pbrt_str(text: &str, name: &str, options: &LoadOptions) -> Result<Loaded> {
    load(Source::new(name, text.into()), None, options)
}

/// Reads a scene from a file in memory; the files that it names are looked up beside `path`.
///
/// # Errors
/// Whatever is wrong with the file or the files that it names, with its place; when
/// [`LoadOptions::strict`] also what is merely not supported.
pub fn load(source: Arc<Source>, path: Option<&Path>, options: &LoadOptions) -> Result<Loaded> {
    about_its_middle(options, |options| scene(&source, path, options))
}

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

/// A shape inside `ObjectBegin` … `ObjectEnd`, waiting for its instances.
#[derive(Debug)]
struct ObjectShape {
    geometry: Geometry,
    /// The placement in the object.
    place: Placement,
}

/// The shapes between `ObjectBegin` and `ObjectEnd`.
#[derive(Debug)]
struct OpenObject {
    name: String,
    shapes: Vec<ObjectShape>,
}

/// An object that `ObjectInstance` can place.
#[derive(Debug)]
struct Object {
    shapes: Rc<[ObjectShape]>,
    is_placed: bool,
}

/// The geometry that a shape directive makes.
#[derive(Clone, Debug)]
enum Geometry {
    Mesh(Rc<MeshData>),
    Line(DVec3, DVec3),
    /// A round shape that emits.
    Round(Round),
}

/// An open block.
#[derive(Debug)]
struct Block {
    /// The directive that opened it.
    opener: &'static str,
    source: Arc<Source>,
    span: Span,
    saved: State,
}

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
    /// The files that are open, links followed.
    includes: Vec<PathBuf>,
    includes_in_all: usize,
    shapes: usize,
}

impl Loader {
    /// Carries out all directives of a file.
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

    /// The quoted name behind a directive, as in `Shape "sphere"`.
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

    /// A directive's quoted name and its parameters.
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

    /// Warns about the parameters that nobody asked for.
    fn warn_unused(&mut self, params: &Params) -> Result<()> {
        for (param, near) in params.unused() {
            let message = format!("{} has no parameter `{}`", params.owner, param.name);
            let place = |e: SceneError| e.at(param.at(), "ignored").suggest(near);
            let kind = ErrorKind::UnknownName;
            self.base.warnings.warn(kind, message, place)?;
        }
        Ok(())
    }

    fn include(&mut self, lexer: &mut Lexer, directive: Token) -> Result<()> {
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
        let file = self.base.open_unpacked(&name, at)?;
        if self.includes.contains(&file.whole) {
            let message = format!("`{name}` includes itself");
            return fail(ErrorKind::Recursion, message, "already open");
        }
        let inner = Source::new(file.path, file.bytes);
        if !directives::begin(&inner) {
            // What other files hold is nobody's business.
            let message = format!("`{name}` does not begin with a directive: it is no pbrt file");
            return fail(ErrorKind::Syntax, message, "named here");
        }
        self.includes.push(file.whole);
        // What an imported file sets does not reach the file that imports it.
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

/// Whether a name is one of those in a list with blanks between.
fn is_one_of(name: &str, list: &str) -> bool {
    list.split(' ').any(|known| known == name)
}
