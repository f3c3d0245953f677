//! The execution of directives: a table of all of them, and the directives for blocks, objects and
//! the world. Other files of this folder have the rest.

use super::lexer::{Lexer, Token, TokenKind};
use super::params::Params;
use super::state::Target;
use super::{Block, Loader, Object, OpenObject, is_one_of};
use linelit_assembly::{ErrorKind, Result, SceneError, Source, Span, nearest, shorten};
use linelit_geometry::glam::DAffine3;
use linelit_scene::Placement;
use std::rc::Rc;
use std::sync::Arc;

/// All directives of both versions, for suggestions.
const DIRECTIVES: &str = "\
    Accelerator ActiveTransform AreaLightSource Attribute AttributeBegin \
    AttributeEnd Camera ColorSpace ConcatTransform CoordSysTransform \
    CoordinateSystem Film Identity Import Include Integrator LightSource LookAt \
    MakeNamedMaterial MakeNamedMedium Material MediumInterface NamedMaterial \
    ObjectBegin ObjectEnd ObjectInstance Option PixelFilter ReverseOrientation \
    Rotate Sampler Scale Shape SurfaceIntegrator Texture Transform \
    TransformBegin TransformEnd TransformTimes Translate WorldBegin WorldEnd";

/// The targets for which `Attribute` sets default parameters; `None` for media, which are not
/// supported.
const TARGETS: &[(&str, Option<Target>)] = &[
    ("shape", Some(Target::Shape)),
    ("light", Some(Target::Light)),
    ("material", Some(Target::Material)),
    ("texture", Some(Target::Texture)),
    ("medium", None),
];

/// The warning about media.
const NO_MEDIA: &str = "participating media are not supported";
/// The warning about motion.
const NO_MOTION: &str = "motion is not supported: transforms are those of the start";

/// The largest number of blocks that are open at once.
const MAX_BLOCKS: usize = 10_000;

/// Returns whether a file is empty or its first word is a directive.
pub(super) fn begin(source: &Arc<Source>) -> bool {
    let mut lexer = Lexer::new(Arc::clone(source));
    match lexer.next() {
        Ok(None) => true,
        Ok(Some(token)) => is_one_of(&source.text(token.span), DIRECTIVES),
        Err(_) => false,
    }
}

impl Loader {
    /// Executes one directive.
    pub(super) fn directive(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Directives that are not in this table have no effect, or are unknown.
        match lexer.word(token) {
            b"Identity" | b"Translate" | b"Scale" | b"Rotate" | b"LookAt" | b"Transform"
            | b"ConcatTransform" | b"CoordinateSystem" | b"CoordSysTransform" => {
                self.transform_directive(lexer, token)
            }
            b"AttributeBegin" => self.open_block(lexer, token, "AttributeBegin"),
            b"TransformBegin" => self.open_block(lexer, token, "TransformBegin"),
            b"AttributeEnd" => self.close_block(lexer, token, "AttributeBegin").map(drop),
            b"TransformEnd" => self.close_block(lexer, token, "TransformBegin").map(drop),
            b"ObjectBegin" => self.object_begin(lexer, token),
            b"ObjectEnd" => self.object_end(lexer, token),
            b"ObjectInstance" => self.object_instance(lexer, token),
            b"ReverseOrientation" => {
                self.state.reverse = !self.state.reverse;
                Ok(())
            }
            b"Attribute" => self.attribute(lexer, token),
            b"WorldBegin" => self.world_begin(lexer, token),
            b"WorldEnd" => self.world_end(lexer, token),
            b"Shape" => self.shape(lexer, token),
            b"AreaLightSource" => self.area_light(lexer, token),
            b"LightSource" => self.light_source(lexer, token),
            b"Material" => self.material(lexer, token),
            b"MakeNamedMaterial" => self.make_named_material(lexer, token),
            b"NamedMaterial" => self.named_material(lexer, token),
            b"Texture" => self.texture(lexer, token),
            b"Include" | b"Import" => self.include(lexer, token),
            b"Camera" => self.camera(lexer, token),
            b"Film" => self.film(lexer, token),
            b"PixelFilter" => self.pixel_filter(lexer, token),
            _ => self.other_directive(lexer, token),
        }
    }

    /// Executes a directive that does not change pictures of linelit or is not supported, or
    /// refuses an unknown one.
    fn other_directive(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let word = lexer.source().text(token.span);
        match word.as_str() {
            "Integrator" | "SurfaceIntegrator" | "Sampler" | "Accelerator" => {
                self.rendering_option(lexer, token)
            }
            "Option" => self.option(lexer, token),
            // Read all colours as sRGB.
            "ColorSpace" => {
                let (name, params) = self.named_params(lexer, token, "a colour space")?;
                if name == "srgb" {
                    return Ok(());
                }
                let message = format!("colour space `{}` is not supported", shorten(&name));
                self.base
                    .unsupported(message, "read as `srgb`", params.at())
            }
            // Leave out media.
            "MakeNamedMedium" => {
                let (_, params) = self.named_params(lexer, token, "a medium name")?;
                self.base.unsupported(NO_MEDIA, "left out", params.at())
            }
            "MediumInterface" => {
                self.name(lexer, token, "a medium name")?;
                if lexer.peek()?.is_some_and(|t| t.kind == TokenKind::Quoted) {
                    self.name(lexer, token, "a medium name")?;
                }
                self.unsupported(lexer, token, NO_MEDIA, "left out")
            }
            // Ignore motion.
            "ActiveTransform" => self.active_transform(lexer, token),
            "TransformTimes" => {
                self.next_number(lexer, token)?;
                self.next_number(lexer, token)?;
                self.unsupported(lexer, token, NO_MOTION, "ignored")
            }
            _ => {
                let is_number = word.starts_with(|c: char| c.is_ascii_digit() || c == '-');
                let what = if is_number {
                    "unexpected number"
                } else {
                    "unknown directive"
                };
                let message = format!("{what} `{}`", shorten(&word));
                let kind = ErrorKind::UnknownName;
                let error = lexer.error(kind, message, token.span, "expected a directive");
                Err(error.suggest(nearest(&word, DIRECTIVES.split(' '))))
            }
        }
    }

    /// Executes `ActiveTransform StartTime`, `EndTime` or `All`: transforms for the end are
    /// ignored.
    fn active_transform(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let which = lexer.next()?.map(|t| lexer.source().text(t.span));
        self.state.end_time_only = match which.as_deref() {
            Some("EndTime") => true,
            Some("StartTime" | "All") => false,
            _ => {
                let message = "`ActiveTransform` without a time";
                let label = "expected `StartTime`, `EndTime` or `All` behind it";
                return Err(lexer.error(ErrorKind::Syntax, message, token.span, label));
            }
        };
        self.unsupported(lexer, token, NO_MOTION, "ignored")
    }

    /// Warns that a directive is not supported.
    fn unsupported(
        &mut self,
        lexer: &Lexer,
        token: Token,
        message: &str,
        label: &str,
    ) -> Result<()> {
        let at = lexer.source().at(token.span);
        self.base.unsupported(message, label, at)
    }

    /// Opens a block: saves the graphics state. `opener` is the directive that opened it.
    fn open_block(&mut self, lexer: &Lexer, token: Token, opener: &'static str) -> Result<()> {
        if self.stack.len() >= MAX_BLOCKS {
            let message = format!("blocks are nested more than {MAX_BLOCKS} deep");
            return Err(lexer.error(ErrorKind::Limit, message, token.span, ""));
        }
        self.stack.push(Block {
            opener,
            source: Arc::clone(lexer.source()),
            span: token.span,
            saved: self.state.clone(),
        });
        Ok(())
    }

    /// Closes the innermost block, which must have been opened by the directive `opener`, and
    /// restores the graphics state; for `TransformBegin`, only the transform.
    fn close_block(&mut self, lexer: &Lexer, token: Token, opener: &'static str) -> Result<()> {
        let word = lexer.source().text(token.span);
        let Some(block) = self.stack.pop_if(|b| b.opener == opener) else {
            let message = format!("`{word}` without `{opener}`");
            let error = misplaced(lexer, token.span, message, "nothing to close");
            return Err(match self.stack.last() {
                Some(b) => {
                    let (opener, place) = (b.opener, b.source.short(b.span));
                    error.note(format!("the innermost open block is `{opener}` at {place}"))
                }
                None => error,
            });
        };
        if opener == "TransformBegin" {
            self.state.ctm = block.saved.ctm;
        } else {
            self.state = block.saved;
        }
        Ok(())
    }

    /// Executes `ObjectBegin "name"`.
    fn object_begin(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, name_token) = self.name(lexer, token, "a name")?;
        self.needs_world(lexer, token)?;
        let span = token.span.to(name_token.span);
        let params = Params::parse(lexer, format!("object `{}`", shorten(&name)), span)?;
        self.warn_unused(&params)?;
        if self.object.is_some() {
            let message = "`ObjectBegin` inside `ObjectBegin`";
            return Err(misplaced(lexer, token.span, message, "objects do not nest"));
        }
        self.open_block(lexer, token, "ObjectBegin")?;
        self.object = Some(OpenObject {
            name,
            shapes: Vec::new(),
        });
        Ok(())
    }

    /// Executes `ObjectEnd`.
    fn object_end(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        self.close_block(lexer, token, "ObjectBegin")?;
        let Some(object) = self.object.take() else {
            return Ok(());
        };
        let whole = Object {
            shapes: object.shapes.into(),
            is_placed: false,
        };
        self.objects.insert(object.name, whole);
        Ok(())
    }

    /// Executes `ObjectInstance "name"`.
    fn object_instance(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        // Find the object.
        let (name, name_token) = self.name(lexer, token, "an object's name")?;
        let span = token.span.to(name_token.span);
        if self.object.is_some() {
            let message = "`ObjectInstance` inside `ObjectBegin`";
            return Err(misplaced(lexer, span, message, "instances do not nest"));
        }
        let Some(object) = self.objects.get_mut(&name) else {
            let names = self.objects.keys().map(String::as_str);
            let message = format!("unknown object `{}`", shorten(&name));
            let error = lexer.error(ErrorKind::UnknownName, message, span, "");
            return Err(error.suggest(nearest(&name, names)));
        };
        // Count the instance, and warn if it emits, which instances in pbrt do not.
        let placed = &mut self.base.builder.placed;
        placed.objects += usize::from(!object.is_placed);
        placed.instances += 1;
        object.is_placed = true;
        let shapes = Rc::clone(&object.shapes);
        let params = Params::parse(lexer, format!("object `{}`", shorten(&name)), span)?;
        if shapes.iter().any(|s| s.place.emission.is_some()) {
            let message = format!("object `{}` emits light", shorten(&name));
            let label = "its instances do so here, but not in pbrt";
            self.base.suspicious(message, label, params.at())?;
        }
        // Add a copy of each shape under the current transform.
        for shape in &*shapes {
            let to_world = self.state.ctm * shape.place.to_world;
            let place = Placement {
                to_world,
                ..shape.place
            };
            self.add_shape(&params, &shape.geometry, &place)?;
        }
        Ok(())
    }

    /// Executes `Attribute "target" …`, which sets default parameters.
    fn attribute(&mut self, lexer: &mut Lexer, token: Token) -> Result<()> {
        let (name, params) = self.named_params(lexer, token, "an attribute target")?;
        let Some(target) = params.pick("attribute target", &name, TARGETS)? else {
            return Ok(());
        };
        let (source, span) = (Arc::clone(&params.source), params.span);
        if self.state.add_defaults(target, params.list) {
            return Ok(());
        }
        let message = "too many defaults by `Attribute`";
        Err(source.error(ErrorKind::Limit, message, span, "these are too many"))
    }

    /// Executes `WorldBegin`.
    fn world_begin(&mut self, lexer: &Lexer, token: Token) -> Result<()> {
        if self.in_world {
            let label = "the world has begun already";
            return Err(misplaced(lexer, token.span, "a second `WorldBegin`", label));
        }
        self.in_world = true;
        self.state.ctm = DAffine3::IDENTITY;
        self.coordinate_systems
            .insert("world".into(), DAffine3::IDENTITY);
        Ok(())
    }

    /// Executes `WorldEnd`.
    fn world_end(&mut self, lexer: &Lexer, token: Token) -> Result<()> {
        if !self.in_world {
            let message = "`WorldEnd` without `WorldBegin`";
            return Err(misplaced(lexer, token.span, message, "nothing to close"));
        }
        if let Some(block) = self.stack.last() {
            let (opener, place) = (block.opener, block.source.short(block.span));
            let message = "`WorldEnd` inside a block";
            let error = misplaced(lexer, token.span, message, "a block is still open");
            return Err(error.note(format!("`{opener}` at {place} is still open")));
        }
        Ok(())
    }

    /// Refuses a directive that has to be after `WorldBegin`, such as for shapes and lights.
    pub(super) fn needs_world(&self, lexer: &Lexer, token: Token) -> Result<()> {
        if self.in_world {
            return Ok(());
        }
        let word = lexer.source().text(token.span);
        let message = format!("`{word}` before `WorldBegin`");
        let error = misplaced(lexer, token.span, message, "belongs to the world");
        Err(error.help("add `WorldBegin` before the first shape, light or object"))
    }
}

/// Returns the error for a directive at a position where it is not allowed.
fn misplaced(lexer: &Lexer, span: Span, message: impl Into<String>, label: &str) -> SceneError {
    lexer.error(ErrorKind::Nesting, message, span, label)
}
