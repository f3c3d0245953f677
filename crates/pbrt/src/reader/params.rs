//! Typed parameter lists: `"float radius" [ 2 ] "rgb L" [ 1 1 1 ]`.

use super::lexer::{Lexer, Token, TokenKind};
use linelit_assembly::{ErrorKind, Result, SceneError, Source, Span, nearest, shorten};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::Arc;

/// The declared type of a parameter; v3 and v4 names of one thing are one type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Bool,
    Integer,
    Float,
    Point2,
    Vector2,
    Point3,
    Vector3,
    Normal,
    Rgb,
    Xyz,
    Blackbody,
    Spectrum,
    String,
    Texture,
}

const TYPES: &[(&str, Type)] = &[
    ("bool", Type::Bool),
    ("integer", Type::Integer),
    ("float", Type::Float),
    ("point2", Type::Point2),
    ("vector2", Type::Vector2),
    ("point3", Type::Point3),
    ("point", Type::Point3),
    ("vector3", Type::Vector3),
    ("vector", Type::Vector3),
    ("normal3", Type::Normal),
    ("normal", Type::Normal),
    ("rgb", Type::Rgb),
    ("color", Type::Rgb),
    ("xyz", Type::Xyz),
    ("blackbody", Type::Blackbody),
    ("spectrum", Type::Spectrum),
    ("string", Type::String),
    ("texture", Type::Texture),
];

/// Parameters that one directive may have; pbrt's longest have about twenty.
const MAX_PARAMETERS: usize = 500;

impl Type {
    const fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Integer => "integer",
            Self::Float => "float",
            Self::Point2 => "point2",
            Self::Vector2 => "vector2",
            Self::Point3 => "point",
            Self::Vector3 => "vector",
            Self::Normal => "normal",
            Self::Rgb => "rgb",
            Self::Xyz => "xyz",
            Self::Blackbody => "blackbody",
            Self::Spectrum => "spectrum",
            Self::String => "string",
            Self::Texture => "texture",
        }
    }

    /// Numbers per element.
    const fn arity(self) -> usize {
        match self {
            Self::Point2 | Self::Vector2 => 2,
            Self::Point3 | Self::Vector3 | Self::Normal | Self::Rgb | Self::Xyz => 3,
            _ => 1,
        }
    }
}

/// The values of a parameter.
#[derive(Clone, Debug)]
pub(crate) enum Values {
    Numbers(Vec<f64>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

/// One parameter with its places.
#[derive(Clone, Debug)]
pub(crate) struct Param {
    pub(crate) ty: Type,
    pub(crate) name: String,
    pub(crate) values: Values,
    pub(crate) source: Arc<Source>,
    /// The quoted declaration.
    pub(crate) span: Span,
    /// The values with their brackets.
    value_span: Span,
    used: Cell<bool>,
}

impl Param {
    /// An error that points at the declaration.
    pub(crate) fn error(&self, kind: ErrorKind, message: String, label: &str) -> SceneError {
        self.source.error(kind, message, self.span, label)
    }

    /// Points at the declaration.
    pub(crate) fn at(&self) -> impl Fn(SceneError, &str) -> SceneError {
        |e: SceneError, label: &str| e.at(&self.source, self.span, label)
    }

    /// Points at the first value.
    pub(crate) fn at_value(&self) -> impl Fn(SceneError, &str) -> SceneError {
        let span = self.value_span(0);
        move |e: SceneError, label: &str| e.at(&self.source, span, label)
    }

    /// The place of the `k`-th value, found by reading the values again.
    pub(crate) fn value_span(&self, k: usize) -> Span {
        let mut lexer = Lexer::from_offset(Arc::clone(&self.source), self.value_span.start);
        let mut seen = 0;
        while let Ok(Some(token)) = lexer.next() {
            if token.span.start >= self.value_span.end {
                break;
            }
            if matches!(token.kind, TokenKind::Open | TokenKind::Close) {
                continue;
            }
            if seen == k {
                return token.span;
            }
            seen += 1;
        }
        self.span
    }

    /// An error that points at the `k`-th value.
    pub(crate) fn value_error(
        &self,
        k: usize,
        kind: ErrorKind,
        message: String,
        label: &str,
    ) -> SceneError {
        self.source.error(kind, message, self.value_span(k), label)
    }

    pub(crate) fn numbers(&self) -> &[f64] {
        match &self.values {
            Values::Numbers(n) => n,
            _ => &[],
        }
    }

    pub(crate) fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(s) => s,
            _ => &[],
        }
    }
}

/// The parameters of one directive. Whoever reads one marks it as used, so that the rest can be
/// named in a warning.
#[derive(Clone, Debug)]
pub(crate) struct Params {
    /// What they belong to, for messages: "shape `sphere`".
    pub(crate) owner: String,
    pub(crate) source: Arc<Source>,
    /// The directive and its name.
    pub(crate) span: Span,
    pub(crate) list: Vec<Rc<Param>>,
    asked: RefCell<Vec<&'static str>>,
}

impl Params {
    /// Reads parameters until something comes that is no string.
    pub(crate) fn parse(lexer: &mut Lexer, owner: String, span: Span) -> Result<Self> {
        let mut list: Vec<Rc<Param>> = Vec::new();
        while let Some(token) = lexer.peek()? {
            if token.kind != TokenKind::Quoted {
                break;
            }
            lexer.next()?;
            let param = parse_param(lexer, token)?;
            if list
                .iter()
                .any(|p| p.name == param.name && p.ty == param.ty)
            {
                return Err(param.error(
                    ErrorKind::BadParameter,
                    format!("parameter `{}` is given twice", param.name),
                    "second time",
                ));
            }
            if list.len() >= MAX_PARAMETERS {
                let message = format!("more than {MAX_PARAMETERS} parameters");
                return Err(param.error(ErrorKind::Limit, message, "one too many"));
            }
            list.push(Rc::new(param));
        }
        Ok(Self {
            owner,
            source: Arc::clone(lexer.source()),
            span,
            list,
            asked: RefCell::default(),
        })
    }

    /// Points at the directive.
    pub(crate) fn at(&self) -> impl Fn(SceneError, &str) -> SceneError {
        |e: SceneError, label: &str| e.at(&self.source, self.span, label)
    }

    /// An error that points at the directive.
    pub(crate) fn error(&self, kind: ErrorKind, message: String, label: &str) -> SceneError {
        self.source.error(kind, message, self.span, label)
    }

    /// Adds those of `defaults` that are not given.
    pub(crate) fn add_defaults(&mut self, defaults: &[Rc<Param>]) {
        for param in defaults {
            if !self.list.iter().any(|p| p.name == param.name) {
                param.used.set(true);
                self.list.push(Rc::clone(param));
            }
        }
    }

    /// The parameter of that name, which must have one of the types.
    pub(crate) fn find(&self, name: &'static str, types: &[Type]) -> Result<Option<&Param>> {
        self.asked.borrow_mut().push(name);
        let Some(param) = self.list.iter().map(|p| &**p).find(|p| p.name == name) else {
            return Ok(None);
        };
        param.used.set(true);
        if types.contains(&param.ty) {
            return Ok(Some(param));
        }
        let expected: Vec<String> = types.iter().map(|t| format!("`{}`", t.name())).collect();
        let message = format!(
            "parameter `{name}` of {} has type `{}`, expected {}",
            self.owner,
            param.ty.name(),
            expected.join(" or ")
        );
        Err(param.error(ErrorKind::BadParameter, message, "wrong type"))
    }

    fn single<'a>(&'a self, name: &'static str, types: &[Type]) -> Result<Option<&'a Param>> {
        let Some(param) = self.find(name, types)? else {
            return Ok(None);
        };
        let count = match &param.values {
            Values::Numbers(n) => n.len(),
            Values::Strings(s) => s.len(),
            Values::Bools(b) => b.len(),
        };
        let arity = param.ty.arity();
        if count == arity {
            return Ok(Some(param));
        }
        let message = format!(
            "parameter `{name}` of {} takes {arity} value{}, got {count}",
            self.owner,
            if arity == 1 { "" } else { "s" }
        );
        Err(param.error(ErrorKind::BadParameter, message, "wrong number of values"))
    }

    pub(crate) fn float(&self, name: &'static str) -> Result<Option<f64>> {
        let param = self.single(name, &[Type::Float, Type::Integer])?;
        Ok(param.map(|p| p.numbers()[0]))
    }

    pub(crate) fn float_or(&self, name: &'static str, default: f64) -> Result<f64> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    /// A float that must be greater than zero.
    pub(crate) fn positive_or(&self, name: &'static str, default: f64) -> Result<f64> {
        let value = self.float_or(name, default)?;
        if value > 0.0 {
            return Ok(value);
        }
        let param = self.list.iter().find(|p| p.name == name);
        let message = format!(
            "parameter `{name}` of {} must be positive, not {value}",
            self.owner
        );
        Err(match param {
            Some(p) => p.value_error(0, ErrorKind::OutOfRange, message, "must be greater than 0"),
            None => self.error(ErrorKind::OutOfRange, message, ""),
        })
    }

    pub(crate) fn integer(&self, name: &'static str) -> Result<Option<i32>> {
        let param = self.single(name, &[Type::Integer])?;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "checked to be an i32 when parsed"
        )]
        Ok(param.map(|p| p.numbers()[0] as i32))
    }

    pub(crate) fn bool_or(&self, name: &'static str, default: bool) -> Result<bool> {
        let param = self.single(name, &[Type::Bool])?;
        Ok(match param.map(|p| &p.values) {
            Some(Values::Bools(b)) => b[0],
            _ => default,
        })
    }

    pub(crate) fn string(&self, name: &'static str) -> Result<Option<&str>> {
        let param = self.text(name)?;
        Ok(param.map(|p| p.strings()[0].as_str()))
    }

    /// A parameter that holds one string.
    pub(crate) fn text(&self, name: &'static str) -> Result<Option<&Param>> {
        self.single(name, &[Type::String])
    }

    /// A list of numbers whose length is a multiple of the type's arity (or of `multiple`, for
    /// plain floats).
    pub(crate) fn array(
        &self,
        name: &'static str,
        types: &[Type],
        multiple: usize,
    ) -> Result<Option<&Param>> {
        let Some(param) = self.find(name, types)? else {
            return Ok(None);
        };
        let (count, arity) = (param.numbers().len(), param.ty.arity().max(multiple));
        if count % arity == 0 {
            return Ok(Some(param));
        }
        let message = format!(
            "parameter `{name}` of {} has {count} numbers, which is not a multiple of {arity}",
            self.owner
        );
        Err(param.error(ErrorKind::BadParameter, message, "wrong number of values"))
    }

    /// As many numbers as asked for, or none.
    pub(crate) fn fixed<const N: usize>(
        &self,
        name: &'static str,
        types: &[Type],
    ) -> Result<Option<[f64; N]>> {
        let Some(param) = self.find(name, types)? else {
            return Ok(None);
        };
        match <[f64; N]>::try_from(param.numbers()) {
            Ok(values) => Ok(Some(values)),
            Err(_) => {
                let count = param.numbers().len();
                let message = format!(
                    "parameter `{name}` of {} takes {N} values, got {count}",
                    self.owner
                );
                Err(param.error(ErrorKind::BadParameter, message, "wrong number of values"))
            }
        }
    }

    /// Something that has to be there.
    pub(crate) fn require<T>(&self, name: &'static str, value: Option<T>) -> Result<T> {
        value.ok_or_else(|| {
            let message = format!("{} needs a parameter `{name}`", self.owner);
            let error = self.error(
                ErrorKind::MissingParameter,
                message,
                &format!("`{name}` is required"),
            );
            let unused = self.list.iter().filter(|p| !p.used.get());
            match nearest(name, unused.map(|p| p.name.as_str())) {
                Some(near) => error.help(format!("it has `{near}`; was that meant?")),
                None => error,
            }
        })
    }

    /// Marks parameters as seen that mean nothing to us and do not change the scene.
    pub(crate) fn ignore(&self, names: &[&'static str]) {
        self.asked.borrow_mut().extend(names);
        for param in self
            .list
            .iter()
            .filter(|p| names.contains(&p.name.as_str()))
        {
            param.used.set(true);
        }
    }

    /// Marks all parameters as seen, those of something that is left out.
    pub(crate) fn ignore_all(&self) {
        self.list.iter().for_each(|p| p.used.set(true));
    }

    /// The parameters that nobody asked for, each with the nearest name that somebody asked for.
    pub(crate) fn unused(&self) -> Vec<(&Param, Option<&'static str>)> {
        let asked = self.asked.borrow();
        let unused = self.list.iter().filter(|p| !p.used.get());
        unused
            .map(|p| (&**p, nearest(&p.name, asked.iter().copied())))
            .collect()
    }
}

/// Reads `values` behind the declaration `"type name"`.
fn parse_param(lexer: &mut Lexer, declaration: Token) -> Result<Param> {
    let text = lexer.unquote(declaration)?;
    let syntax = |message: String, label: &str| {
        lexer.error(ErrorKind::Syntax, message, declaration.span, label)
    };
    let mut words = text.split_ascii_whitespace();
    let (Some(type_name), Some(name), None) = (words.next(), words.next(), words.next()) else {
        return Err(syntax(
            format!("`{}` is not a parameter declaration", shorten(&text)),
            "expected \"type name\"",
        ));
    };
    let Some(&(_, ty)) = TYPES.iter().find(|(n, _)| *n == type_name) else {
        let names = TYPES.iter().map(|(n, _)| *n);
        return Err(syntax(
            format!("unknown parameter type `{}`", shorten(type_name)),
            "expected a type such as `float`, `point3` or `rgb`",
        )
        .suggest(nearest(type_name, names)));
    };
    let name = name.to_owned();
    let (values, value_span) = parse_values(lexer, ty, &name, declaration)?;
    Ok(Param {
        ty,
        name,
        values,
        source: Arc::clone(lexer.source()),
        span: declaration.span,
        value_span,
        used: Cell::new(false),
    })
}

fn parse_values(
    lexer: &mut Lexer,
    ty: Type,
    name: &str,
    declaration: Token,
) -> Result<(Values, Span)> {
    let missing = |lexer: &Lexer| {
        lexer.error(
            ErrorKind::Syntax,
            format!("parameter `{name}` has no value"),
            declaration.span,
            "expected a value or `[` behind it",
        )
    };
    let first = lexer.next()?.ok_or_else(|| missing(lexer))?;
    let mut values = match ty {
        Type::Bool => Values::Bools(Vec::new()),
        Type::String | Type::Texture => Values::Strings(Vec::new()),
        _ => Values::Numbers(Vec::new()),
    };
    match first.kind {
        TokenKind::Close => return Err(missing(lexer)),
        TokenKind::Word | TokenKind::Quoted => {
            push_value(lexer, ty, name, &mut values, first)?;
            return Ok((values, first.span));
        }
        TokenKind::Open => {}
    }
    loop {
        let Some(token) = lexer.next()? else {
            return Err(lexer.error(
                ErrorKind::Syntax,
                format!("the values of `{name}` are not closed by `]`"),
                first.span,
                "opened here",
            ));
        };
        match token.kind {
            TokenKind::Close => return Ok((values, first.span.to(token.span))),
            TokenKind::Open => {
                return Err(lexer.error(
                    ErrorKind::Syntax,
                    "`[` inside `[ ]`",
                    token.span,
                    "expected a value or `]`",
                ));
            }
            TokenKind::Word | TokenKind::Quoted => {
                push_value(lexer, ty, name, &mut values, token)?;
            }
        }
    }
}

fn push_value(
    lexer: &Lexer,
    ty: Type,
    name: &str,
    values: &mut Values,
    token: Token,
) -> Result<()> {
    let quoted = token.kind == TokenKind::Quoted;
    if quoted
        && ty == Type::Spectrum
        && let Values::Numbers(n) = values
        && n.is_empty()
    {
        *values = Values::Strings(Vec::new());
    }
    let expected = match values {
        Values::Bools(list) => {
            let text = if quoted {
                lexer.unquote(token)?
            } else {
                lexer.source().text(token.span)
            };
            match text.parse() {
                Ok(value) => {
                    list.push(value);
                    return Ok(());
                }
                Err(_) => "expected `true` or `false`",
            }
        }
        Values::Strings(list) if quoted => {
            list.push(lexer.unquote(token)?);
            return Ok(());
        }
        Values::Strings(_) => "expected a string in quotes",
        Values::Numbers(_) if quoted => "expected a number",
        Values::Numbers(list) => {
            let value = lexer.number(token)?;
            if ty != Type::Integer || is_i32(value) {
                list.push(value);
                return Ok(());
            }
            "expected an integer of 32 bits"
        }
    };
    let text = shorten(&lexer.source().text(token.span));
    let message = format!("`{text}` is no value for parameter `{name}`");
    Err(lexer.error(ErrorKind::BadParameter, message, token.span, expected))
}

#[allow(
    clippy::float_cmp,
    reason = "asks whether the number is an integer, exactly"
)]
fn is_i32(value: f64) -> bool {
    value == value.trunc() && value.abs() <= f64::from(i32::MAX)
}
