//! The typed parameters of directives, such as `"float radius" [ 2 ] "rgb L" [ 1 1 1 ]`: their
//! syntax, and functions that read one of them by its name and check its type and its number of
//! values.

use super::lexer::{Lexer, Token, TokenKind};
use linelit_assembly::{ErrorKind, Location, Result, SceneError, Source, Span, nearest, shorten};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

/// The declared type of a parameter; types that v3 and v4 name differently are one type.
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

/// The names of the types; if a type has two names, messages use the first.
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

/// The largest number of parameters of one directive; pbrt's longest lists have about twenty.
const MAX_PARAMETERS: usize = 500;

impl Type {
    /// Returns the name of the type that messages use.
    fn name(self) -> &'static str {
        let named = TYPES.iter().find(|(_, ty)| *ty == self);
        named.map_or("", |(name, _)| name)
    }

    /// Returns the number of values in one element of this type, such as three for a point.
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

/// One parameter with its position in the file.
#[derive(Clone, Debug)]
pub(crate) struct Param {
    pub(crate) ty: Type,
    pub(crate) name: String,
    pub(crate) values: Values,
    pub(crate) source: Arc<Source>,
    /// The position of the quoted declaration.
    pub(crate) span: Span,
    /// The position of the values with their brackets.
    value_span: Span,
    /// Whether the parameter was read or ignored on purpose.
    used: Cell<bool>,
}

impl Param {
    /// Returns the location of the declaration, for messages.
    pub(crate) fn at(&self) -> Location<'_> {
        self.source.at(self.span)
    }

    /// Returns the location of the `k`-th value, for messages.
    pub(crate) fn at_value(&self, k: usize) -> Location<'_> {
        self.source.at(self.value_span(k))
    }

    /// Returns the error for a value that is not valid for this parameter.
    pub(crate) fn bad(&self, message: impl Into<String>, label: &str) -> SceneError {
        self.at().error(ErrorKind::BadParameter, message, label)
    }

    /// Returns the position of the `k`-th value, found by reading the values again; only messages
    /// need it.
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

    /// Returns the values, if they are numbers; otherwise an empty slice.
    pub(crate) fn numbers(&self) -> &[f64] {
        match &self.values {
            Values::Numbers(n) => n,
            _ => &[],
        }
    }

    /// Returns the values, if they are strings; otherwise an empty slice.
    pub(crate) fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(s) => s,
            _ => &[],
        }
    }
}

/// The parameters of one directive. Reading one marks it as used, so that there can be a warning
/// about those that no one reads.
#[derive(Clone, Debug)]
pub(crate) struct Params {
    /// The owner of the parameters, for messages: "shape `sphere`".
    pub(crate) owner: String,
    pub(crate) source: Arc<Source>,
    /// The position of the directive and its name.
    pub(crate) span: Span,
    pub(crate) list: Vec<Rc<Param>>,
    /// The names of parameters that the reader has requested so far, for suggestions.
    asked: RefCell<Vec<&'static str>>,
}

impl Params {
    /// Reads the parameters after a directive, until a token that is not a string.
    pub(crate) fn parse(lexer: &mut Lexer, owner: String, span: Span) -> Result<Self> {
        let mut list: Vec<Rc<Param>> = Vec::new();
        while let Some(token) = lexer.peek()? {
            if token.kind != TokenKind::Quoted {
                break;
            }
            // Read one parameter, which must not be the second of its name and type.
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

    /// Returns the location of the directive, for messages.
    pub(crate) fn at(&self) -> Location<'_> {
        self.source.at(self.span)
    }

    /// Creates an error that points at the directive.
    pub(crate) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        label: &str,
    ) -> SceneError {
        self.at().error(kind, message, label)
    }

    /// Returns the parameter of this name, of any type, without marking it as used; `None` if there
    /// is none.
    pub(crate) fn named(&self, name: &str) -> Option<&Param> {
        self.list.iter().map(|p| &**p).find(|p| p.name == name)
    }

    /// Returns whether there is a parameter of this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.named(name).is_some()
    }

    /// Adds the parameters of `defaults` whose names the directive does not have.
    pub(crate) fn add_defaults(&mut self, defaults: &[Rc<Param>]) {
        for param in defaults {
            if !self.has(&param.name) {
                param.used.set(true);
                self.list.push(Rc::clone(param));
            }
        }
    }

    /// Returns the parameter of this name, if there is one; it must have one of the types.
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

    /// Returns the parameter of this name, if there is one; it must have one of the types, and a
    /// single element.
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

    /// Returns the error for a parameter with a wrong number of values.
    pub(crate) fn wrong_count(&self, param: &Param, what: impl fmt::Display) -> SceneError {
        let message = format!("parameter `{}` of {} {what}", param.name, self.owner);
        param.bad(message, "wrong number of values")
    }

    /// Returns the number of this name, if it is given.
    pub(crate) fn float(&self, name: &'static str) -> Result<Option<f64>> {
        let param = self.single(name, &[Type::Float, Type::Integer])?;
        Ok(param.map(|p| p.numbers()[0]))
    }

    /// Returns the number of this name, or a default.
    pub(crate) fn float_or(&self, name: &'static str, default: f64) -> Result<f64> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    /// Returns the number of this name, which must be greater than zero, or a default.
    pub(crate) fn positive_or(&self, name: &'static str, default: f64) -> Result<f64> {
        let value = self.float_or(name, default)?;
        if value > 0.0 {
            return Ok(value);
        }
        let owner = &self.owner;
        let message = format!("parameter `{name}` of {owner} must be positive, not {value}");
        Err(self.range_error(&[name], message, "must be greater than 0"))
    }

    /// Returns the error for a number out of its range. It points at the first of these parameters
    /// that is given, or at the directive.
    pub(crate) fn range_error(&self, names: &[&str], message: String, label: &str) -> SceneError {
        let given = self.list.iter().find(|p| names.contains(&p.name.as_str()));
        match given {
            Some(p) => p.at_value(0).error(ErrorKind::OutOfRange, message, label),
            None => self.error(ErrorKind::OutOfRange, message, label),
        }
    }

    /// Returns the integer of this name, if it is given.
    pub(crate) fn integer(&self, name: &'static str) -> Result<Option<i32>> {
        let param = self.single(name, &[Type::Integer])?;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "checked to be an i32 when parsed"
        )]
        Ok(param.map(|p| p.numbers()[0] as i32))
    }

    /// Returns the switch of this name, or a default.
    pub(crate) fn bool_or(&self, name: &'static str, default: bool) -> Result<bool> {
        let param = self.single(name, &[Type::Bool])?;
        Ok(match param.map(|p| &p.values) {
            Some(Values::Bools(b)) => b[0],
            _ => default,
        })
    }

    /// Returns the string of this name, if it is given.
    pub(crate) fn string(&self, name: &'static str) -> Result<Option<&str>> {
        let param = self.text(name)?;
        Ok(param.map(|p| p.strings()[0].as_str()))
    }

    /// Returns the value of a string parameter that must be one of the words in a table; `what`
    /// names it in messages.
    pub(crate) fn choice<T: Copy>(
        &self,
        name: &'static str,
        what: &str,
        words: &[(&str, T)],
    ) -> Result<Option<T>> {
        let word = self.string(name)?;
        word.map(|word| self.pick(what, word, words)).transpose()
    }

    /// Returns the value of a word of the directive, which must be in a table; `what` names it in
    /// messages.
    pub(crate) fn pick<T: Copy>(&self, what: &str, word: &str, words: &[(&str, T)]) -> Result<T> {
        let found = words.iter().find(|(known, _)| *known == word);
        let unknown = || self.unknown(what, word, words.iter().map(|(known, _)| *known));
        found.map(|(_, value)| *value).ok_or_else(unknown)
    }

    /// Returns the error for an unknown name, with a suggestion.
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

    /// Returns the parameter of this name, if it is given; it must be one string.
    pub(crate) fn text(&self, name: &'static str) -> Result<Option<&Param>> {
        self.single(name, &[Type::String])
    }

    /// Returns the list of numbers of this name, if it is given. Its length must be a multiple of
    /// the type's arity (or of `multiple`, for plain floats).
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

    /// Returns the `N` numbers of this name, if they are given.
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

    /// Unwraps the value of a parameter that has to be given; the error is about a missing one.
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

    /// Marks the parameters with these names as used, so that there is no warning about them. It is
    /// for parameters that do not change the scene here.
    pub(crate) fn ignore(&self, names: &[&'static str]) {
        self.asked.borrow_mut().extend(names);
        let ignored = |p: &&Rc<Param>| names.contains(&p.name.as_str());
        let ignored = self.list.iter().filter(ignored);
        ignored.for_each(|p| p.used.set(true));
    }

    /// Calls [`Params::ignore`] with names that are separated by blanks.
    pub(crate) fn ignore_all_of(&self, names: &'static str) {
        self.ignore(&names.split(' ').collect::<Vec<_>>());
    }

    /// Marks all parameters as used, for a directive that is left out.
    pub(crate) fn ignore_all(&self) {
        self.list.iter().for_each(|p| p.used.set(true));
    }

    /// Returns the parameters that were not used, each with the most similar name that was
    /// requested.
    pub(crate) fn unused(&self) -> Vec<(&Param, Option<&'static str>)> {
        let asked = self.asked.borrow();
        let unused = self.list.iter().filter(|p| !p.used.get());
        unused
            .map(|p| (&**p, nearest(&p.name, asked.iter().copied())))
            .collect()
    }
}

/// Reads a parameter, whose declaration `"type name"` is the last token.
fn parse_param(lexer: &mut Lexer, declaration: Token) -> Result<Param> {
    // Split the declaration into type and name.
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
    // Read the values.
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

/// Reads the values of a parameter: one without brackets, or any number in brackets.
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
    // Read a single value.
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
    // Read values up to the closing bracket.
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

/// Adds the value of a token to the values of a parameter, if it has the right type.
fn push_value(
    lexer: &Lexer,
    ty: Type,
    name: &str,
    values: &mut Values,
    token: Token,
) -> Result<()> {
    // The first value of a spectrum may be a name instead of a number.
    let quoted = token.kind == TokenKind::Quoted;
    if quoted
        && ty == Type::Spectrum
        && let Values::Numbers(n) = values
        && n.is_empty()
    {
        *values = Values::Strings(Vec::new());
    }
    // Convert the value, or find out which kind was expected.
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

/// Returns whether a number is an integer of 32 bits.
#[allow(
    clippy::float_cmp,
    reason = "asks whether the number is an integer, exactly"
)]
fn is_i32(value: f64) -> bool {
    value == value.trunc() && value.abs() <= f64::from(i32::MAX)
}
