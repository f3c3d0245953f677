//! Typed parameter lists: `"float radius" [ 2 ] "rgb L" [ 1 1 1 ]`.

use super::lexer::{Lexer, Token, TokenKind};
use linelit_assembly::{ErrorKind, Location, Result, SceneError, Source, Span, nearest, shorten};
use std::cell::{Cell, RefCell};
use std::fmt;
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

/// The names of the types; of two the first is used in messages.
const TYPES: &[(&str, Type)] = &[
    ("bool", Type::Bool),
    ("integer", Type::Integer),
    ("float", Type::Float),
    ("point2", Type::Point2),
    ("vector2", Type::Vector2),
    ("point", Type::Point3),
    ("point3", Type::Point3),
    ("vector", Type::Vector3),
    ("vector3", Type::Vector3),
    ("normal", Type::Normal),
    ("normal3", Type::Normal),
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
    fn name(self) -> &'static str {
        let named = TYPES.iter().find(|(_, ty)| *ty == self);
        named.map_or("", |(name, _)| name)
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
    /// The declaration, to point at.
    pub(crate) fn at(&self) -> Location<'_> {
        self.source.at(self.span)
    }

    /// The `k`-th value, to point at.
    pub(crate) fn at_value(&self, k: usize) -> Location<'_> {
        self.source.at(self.value_span(k))
    }

    /// A value that is not one for this parameter.
    pub(crate) fn bad(&self, message: impl Into<String>, label: &str) -> SceneError {
        self.at().error(ErrorKind::BadParameter, message, label)
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

/// The parameters of one directive. Reading one marks it as used, so that the rest can be
/// named in a warning.
#[derive(Clone, Debug)]
pub(crate) struct Params {
    /// The owner of the parameters, for messages: "shape `sphere`".
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
            let is_same = |p: &Rc<Param>| p.name == param.name && p.ty == param.ty;
            if list.iter().any(is_same) {
                let message = format!("parameter `{}` is given twice", param.name);
                return Err(param.bad(message, "second time"));
            }
            if list.len() >= MAX_PARAMETERS {
                let message = format!("more than {MAX_PARAMETERS} parameters");
                let at = param.at();
                return Err(at.error(ErrorKind::Limit, message, "one too many"));
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

    /// The directive, to point at.
    pub(crate) fn at(&self) -> Location<'_> {
        self.source.at(self.span)
    }

    /// An error that points at the directive.
    pub(crate) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: &str,
    ) -> SceneError {
        self.at().error(kind, message, label)
    }

    /// The parameter of that name, whatever its type.
    pub(crate) fn named(&self, name: &str) -> Option<&Param> {
        self.list.iter().map(|p| &**p).find(|p| p.name == name)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.named(name).is_some()
    }

    /// Adds those of `defaults` that are not given.
    pub(crate) fn add_defaults(&mut self, defaults: &[Rc<Param>]) {
        for param in defaults {
            if !self.has(&param.name) {
                param.used.set(true);
                self.list.push(Rc::clone(param));
            }
        }
    }

    /// The parameter of that name, which must have one of the types.
    pub(crate) fn find(&self, name: &'static str, types: &[Type]) -> Result<Option<&Param>> {
        self.asked.borrow_mut().push(name);
        let Some(param) = self.named(name) else {
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
        Err(param.bad(message, "wrong type"))
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
        let values = if arity == 1 { "value" } else { "values" };
        Err(self.wrong_count(param, format!("takes {arity} {values}, got {count}")))
    }

    /// A parameter with another number of values than it takes.
    pub(crate) fn wrong_count(&self, param: &Param, what: impl fmt::Display) -> SceneError {
        let message = format!("parameter `{}` of {} {what}", param.name, self.owner);
        param.bad(message, "wrong number of values")
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
        let owner = &self.owner;
        let message = format!("parameter `{name}` of {owner} must be positive, not {value}");
        Err(self.range_error(&[name], message, "must be greater than 0"))
    }

    /// A number that is out of its range, at the first that is given of some parameters.
    pub(crate) fn range_error(&self, names: &[&str], message: String, label: &str) -> SceneError {
        let given = self.list.iter().find(|p| names.contains(&p.name.as_str()));
        match given {
            Some(p) => p.at_value(0).error(ErrorKind::OutOfRange, message, label),
            None => self.error(ErrorKind::OutOfRange, message, label),
        }
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

    /// Returns the value of a parameter that is one of some words.
    pub(crate) fn choice<T: Copy>(
        &self,
        name: &'static str,
        what: &str,
        words: &[(&str, T)],
    ) -> Result<Option<T>> {
        let word = self.string(name)?;
        word.map(|word| self.pick(what, word, words)).transpose()
    }

    /// Returns the value of a word of the directive.
    pub(crate) fn pick<T: Copy>(&self, what: &str, word: &str, words: &[(&str, T)]) -> Result<T> {
        let found = words.iter().find(|(known, _)| *known == word);
        let unknown = || self.unknown(what, word, words.iter().map(|(known, _)| *known));
        found.map(|(_, value)| *value).ok_or_else(unknown)
    }

    /// The error for a name that nobody defined.
    pub(crate) fn unknown<'a>(
        &self,
        what: &str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> SceneError {
        let name = shorten(name);
        let error = self.error(
            ErrorKind::UnknownName,
            format!("unknown {what} `{name}`"),
            "",
        );
        error.suggest(nearest(&name, known))
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
        let what = format!("has {count} numbers, which is not a multiple of {arity}");
        Err(self.wrong_count(param, what))
    }

    /// Returns as many numbers as asked for, or `None`.
    pub(crate) fn fixed<const N: usize>(
        &self,
        name: &'static str,
        types: &[Type],
    ) -> Result<Option<[f64; N]>> {
        let Some(param) = self.find(name, types)? else {
            return Ok(None);
        };
        let count = param.numbers().len();
        let values = <[f64; N]>::try_from(param.numbers());
        let wrong = |_| self.wrong_count(param, format!("takes {N} values, got {count}"));
        values.map(Some).map_err(wrong)
    }

    /// Something that has to be there.
    pub(crate) fn require<T>(&self, name: &'static str, value: Option<T>) -> Result<T> {
        value.ok_or_else(|| {
            let message = format!("{} needs a parameter `{name}`", self.owner);
            let label = format!("`{name}` is required");
            let error = self.error(ErrorKind::MissingParameter, message, &label);
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
        let ignored = |p: &&Rc<Param>| names.contains(&p.name.as_str());
        let ignored = self.list.iter().filter(ignored);
        ignored.for_each(|p| p.used.set(true));
    }

    /// [`Params::ignore`] of names with blanks between.
    pub(crate) fn ignore_all_of(&self, names: &'static str) {
        self.ignore(&names.split(' ').collect::<Vec<_>>());
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
    let syntax = |lexer: &Lexer, message: String, span, label: &str| {
        Err(lexer.error(ErrorKind::Syntax, message, span, label))
    };
    let missing = |lexer: &Lexer| {
        let message = format!("parameter `{name}` has no value");
        syntax(
            lexer,
            message,
            declaration.span,
            "expected a value or `[` behind it",
        )
    };
    let Some(first) = lexer.next()? else {
        return missing(lexer);
    };
    let mut values = match ty {
        Type::Bool => Values::Bools(Vec::new()),
        Type::String | Type::Texture => Values::Strings(Vec::new()),
        _ => Values::Numbers(Vec::new()),
    };
    match first.kind {
        TokenKind::Close => return missing(lexer),
        TokenKind::Word | TokenKind::Quoted => {
            push_value(lexer, ty, name, &mut values, first)?;
            return Ok((values, first.span));
        }
        TokenKind::Open => {}
    }
    loop {
        let Some(token) = lexer.next()? else {
            let message = format!("the values of `{name}` are not closed by `]`");
            return syntax(lexer, message, first.span, "opened here");
        };
        match token.kind {
            TokenKind::Close => return Ok((values, first.span.to(token.span))),
            TokenKind::Open => {
                let message = "`[` inside `[ ]`".to_owned();
                return syntax(lexer, message, token.span, "expected a value or `]`");
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
            if let Ok(value) = text.parse() {
                list.push(value);
                return Ok(());
            }
            "expected `true` or `false`"
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
