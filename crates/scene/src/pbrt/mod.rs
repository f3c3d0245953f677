//! pbrt text, versions 3 and 4.
//!
//! Both versions are read by one reader: where they differ in names (`point`/`point3`,
//! `matte`/`diffuse`, `xwidth`/`xradius`) both are known, and where they differ in meaning the
//! parameter's form decides (documented where it matters).

mod directives;
mod emission;
mod lexer;
mod materials;
mod params;
mod shapes;
mod state;
mod textures;
mod transforms;
mod view;

use crate::error::{ErrorKind, Result, SceneError, Warnings};
use crate::image::ImageData;
use crate::load::{LoadOptions, Loaded};
use crate::mesh::{Builder, EmissionSpec, MeshData};
use crate::source::{Source, Span};
use crate::suggest::nearest;
use crate::texture::Texture;
use lexer::{Lexer, Token, TokenKind, shorten};
use linelit_geometry::DVec3;
use linelit_geometry::glam::DAffine3;
use params::Params;
use state::State;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// Files that may be open at once through `Include`.
const MAX_INCLUDES: usize = 32;

/// Reads a scene from a file in memory; `folder` is where its file names start.
pub(crate) fn load(
    source: Arc<Source>,
    path: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded> {
    let folder = path
        .and_then(Path::parent)
        .unwrap_or(Path::new(""))
        .to_owned();
    let mut loader = Loader {
        folder,
        builder: Builder::new(options.max_triangles),
        warnings: Warnings::new(options.strict),
        state: State::default(),
        stack: Vec::new(),
        coordinate_systems: HashMap::new(),
        materials: HashMap::new(),
        textures: HashMap::new(),
        images: HashMap::new(),
        objects: HashMap::new(),
        object: None,
        view: view::View::default(),
        in_world: false,
        includes: path.map(canonical).into_iter().collect(),
        shapes: 0,
        max_triangles: options.max_triangles,
    };
    loader.read(&source)?;
    loader.finish(&source)
}

/// The file that a path leads to, links followed; the path itself if that fails.
fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// A shape inside `ObjectBegin` … `ObjectEnd`, waiting for its instances.
#[derive(Debug)]
struct ObjectShape {
    geometry: Geometry,
    to_object: DAffine3,
    reverse: bool,
    material: u32,
    emission: Option<EmissionSpec>,
}

/// What a shape directive makes.
#[derive(Clone, Debug)]
enum Geometry {
    Mesh(Rc<MeshData>),
    Line(DVec3, DVec3),
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
    folder: PathBuf,
    builder: Builder,
    warnings: Warnings,
    state: State,
    stack: Vec<Block>,
    coordinate_systems: HashMap<String, DAffine3>,
    materials: HashMap<String, Option<u32>>,
    textures: HashMap<(bool, String), Arc<Texture>>,
    images: HashMap<(PathBuf, bool), Arc<ImageData>>,
    objects: HashMap<String, Rc<Vec<ObjectShape>>>,
    object: Option<(String, Vec<ObjectShape>)>,
    view: view::View,
    in_world: bool,
    includes: Vec<PathBuf>,
    shapes: usize,
    max_triangles: usize,
}

impl Loader {
    /// Carries out all directives of a file.
    fn read(&mut self, source: &Arc<Source>) -> Result<()> {
        let mut lexer = Lexer::new(Arc::clone(source));
        while let Some(token) = lexer.next()? {
            if token.kind != TokenKind::Word {
                let text = shorten(&source.text(token.span));
                return Err(
                    SceneError::new(ErrorKind::Syntax, format!("unexpected `{text}`")).at(
                        source,
                        token.span,
                        "expected a directive",
                    ),
                );
            }
            self.directive(&mut lexer, token)?;
        }
        Ok(())
    }

    /// What stands after the last directive.
    fn finish(mut self, source: &Source) -> Result<Loaded> {
        if let Some(block) = self.stack.last() {
            let end = block.opener.replace("Begin", "End");
            return Err(SceneError::new(
                ErrorKind::Nesting,
                format!("`{}` is never closed", block.opener),
            )
            .at(&block.source, block.span, "opened here")
            .help(format!("add `{end}`")));
        }
        let whole = |e: SceneError| e.in_file(source.name());
        if self.shapes == 0 {
            self.warnings
                .warn(ErrorKind::Suspicious, "the scene has no shapes", whole)?;
        } else if self.builder.light_count() == 0 {
            let message = "the scene has no area or linear lights: its picture is black";
            self.warnings.warn(ErrorKind::Suspicious, message, whole)?;
        }
        let (camera, film) = std::mem::take(&mut self.view).finish(&mut self.warnings, source)?;
        Ok(Loaded {
            scene: self.builder.finish(camera, film),
            warnings: self.warnings.into_list(),
        })
    }

    /// The quoted name behind a directive, as in `Shape "sphere"`.
    fn name(&mut self, lexer: &mut Lexer, directive: Token, what: &str) -> Result<(String, Token)> {
        match lexer.peek()? {
            Some(token) if token.kind == TokenKind::Quoted => {
                lexer.next()?;
                Ok((lexer.unquote(token)?, token))
            }
            _ => {
                let word = lexer.source().text(directive.span);
                let message = format!("`{word}` has no {what} in quotes");
                Err(SceneError::new(ErrorKind::Syntax, message).at(
                    lexer.source(),
                    directive.span,
                    "expected a name in quotes behind it",
                ))
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
        let (name, token) = self.name(lexer, directive, what)?;
        let owner = match what {
            // The owner of the parameters, without the article.
            "a name" | "a colour space" | "a light type" | "a medium name" => name.clone(),
            _ => format!("{what} `{}`", shorten(&name)),
        };
        let params = Params::parse(lexer, owner, directive.span.to(token.span))?;
        Ok((name, params))
    }

    /// Warns about the parameters that nobody asked for.
    fn warn_unused(&mut self, params: &Params) -> Result<()> {
        for (param, near) in params.unused() {
            let message = format!("{} has no parameter `{}`", params.owner, param.name);
            self.warnings.warn(ErrorKind::UnknownName, message, |e| {
                e.at(&param.source, param.span, "ignored").suggest(near)
            })?;
        }
        Ok(())
    }

    /// Warns about something at a directive.
    fn warn_at(
        &mut self,
        params: &Params,
        kind: ErrorKind,
        message: String,
        label: &str,
    ) -> Result<()> {
        self.warnings
            .warn(kind, message, |e| e.at(&params.source, params.span, label))
    }

    /// A file that the scene names, read into memory.
    fn open(&self, name: &str, source: &Source, span: Span) -> Result<(PathBuf, Vec<u8>)> {
        let path = self.folder.join(name);
        match std::fs::read(&path) {
            Ok(bytes) => Ok((path, bytes)),
            Err(error) => Err(SceneError::new(
                ErrorKind::Io,
                format!("cannot read `{name}`: {}", describe(&error)),
            )
            .at(source, span, "named here")),
        }
    }

    fn include(&mut self, lexer: &mut Lexer, directive: Token) -> Result<()> {
        let (name, token) = self.name(lexer, directive, "a file name")?;
        let outer = Arc::clone(lexer.source());
        let path = self.folder.join(&name);
        let fail = |kind, message: String, label: &str| {
            Err(SceneError::new(kind, message).at(&outer, token.span, label))
        };
        if self.includes.contains(&canonical(&path)) {
            return fail(
                ErrorKind::Recursion,
                format!("`{name}` includes itself"),
                "already open",
            );
        }
        if self.includes.len() > MAX_INCLUDES {
            let message = format!("files are included more than {MAX_INCLUDES} deep");
            return fail(ErrorKind::Limit, message, "one too many");
        }
        if name.ends_with(".gz") {
            let message = format!("compressed scene text is not supported: `{name}`");
            return fail(ErrorKind::Unsupported, message, "unpack it first");
        }
        let (path, bytes) = self.open(&name, &outer, token.span)?;
        self.includes.push(canonical(&path));
        let inner = Source::new(path.display().to_string(), bytes);
        let result = self.read(&inner);
        self.includes.pop();
        result.map_err(|e| e.note(format!("included at {}", outer.short(token.span))))
    }
}

/// What an I/O error means, without the system's error number.
pub(crate) fn describe(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        std::io::ErrorKind::IsADirectory => "it is a folder".into(),
        _ => error.to_string(),
    }
}

/// The error for a name that nobody defined.
fn unknown<'a>(
    params: &Params,
    what: &str,
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> SceneError {
    let name = shorten(name);
    params
        .error(
            ErrorKind::UnknownName,
            format!("unknown {what} `{name}`"),
            "",
        )
        .suggest(nearest(&name, known))
}
