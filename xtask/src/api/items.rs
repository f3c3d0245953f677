//! The public items of a crate, as lines of text.

use super::tokens::Tokens;
use std::collections::BTreeSet;
use std::path::Path;

/// What a crate shows.
#[derive(Default)]
pub(super) struct Items {
    lines: Vec<Line>,
    /// Types and traits that are declared here, and those of them that are public.
    declared: BTreeSet<String>,
    public: BTreeSet<String>,
    /// What could not be read.
    pub(super) problems: Vec<String>,
}

struct Line {
    /// What it is sorted by: the type, or the item itself; that comes first.
    owner: String,
    rank: u8,
    text: String,
    /// Types and traits without which nobody sees it.
    needs: Vec<String>,
}

/// Where an item stands.
#[derive(Clone)]
struct Place<'a> {
    /// The folder of the module's own modules.
    folder: &'a Path,
    /// The public modules around it, each with `::`.
    path: String,
    /// What stands before an item of an `impl` or trait, and whose it is.
    within: Option<(String, Vec<String>)>,
    /// Whether `pub` is understood, as it is in traits.
    all_public: bool,
}

/// One item as its tokens say it.
struct Item<'a> {
    attributes: Vec<String>,
    public: bool,
    keyword: &'a str,
    name: &'a str,
    begin: usize,
    /// Where its head ends: at `{`, `;` or the value.
    head: usize,
    /// Its body in braces, if any.
    body: Option<(usize, usize)>,
}

impl Items {
    /// The items of a crate by its front page.
    pub(super) fn of_crate(front: &Path) -> Self {
        let mut items = Self::default();
        let folder = front.with_file_name("");
        items.file(
            front,
            &Place {
                folder: &folder,
                path: String::new(),
                within: None,
                all_public: false,
            },
        );
        items
    }

    /// The lines in order, without those that nobody outside sees.
    pub(super) fn into_lines(mut self) -> Vec<String> {
        let hidden = |n: &String| self.declared.contains(n) && !self.public.contains(n);
        self.lines.retain(|line| !line.needs.iter().any(hidden));
        let key = |line: &Line| (line.owner.clone(), line.rank, line.text.clone());
        self.lines.sort_by_cached_key(key);
        let mut lines: Vec<String> = self.lines.into_iter().map(|line| line.text).collect();
        lines.dedup();
        lines
    }

    fn file(&mut self, path: &Path, place: &Place<'_>) {
        match std::fs::read_to_string(path) {
            Ok(text) => {
                let tokens = Tokens::of(&text);
                self.block(&tokens, 0, tokens.len(), place);
            }
            Err(error) => self.problems.push(format!("{}: {error}", path.display())),
        }
    }

    /// The items between two places.
    fn block(&mut self, tokens: &Tokens, mut at: usize, end: usize, place: &Place<'_>) {
        while at < end {
            let (item, behind) = Item::read(tokens, at, end);
            at = behind.max(at + 1);
            let gone = |a: &String| a == "cfg(test)" || a == "doc(hidden)";
            if !item.attributes.iter().any(gone) {
                self.item(tokens, &item, at, place);
            }
        }
    }

    fn item(&mut self, tokens: &Tokens, item: &Item<'_>, end: usize, place: &Place<'_>) {
        let public = item.public || place.all_public;
        if matches!(item.keyword, "struct" | "enum" | "trait" | "union") {
            self.declared.insert(item.name.to_owned());
            if public {
                self.public.insert(item.name.to_owned());
            }
        }
        match item.keyword {
            "mod" => self.module(tokens, item, place),
            "impl" => self.implementation(tokens, item, place),
            "macro_rules" => self.macro_definition(tokens, item, place),
            // A macro's call among items: what it makes is in the lines of its definition.
            "" if tokens.at(item.begin + 1) == "!" => {
                let call = tokens.text(item.begin, end);
                self.push(
                    place,
                    item,
                    item.name,
                    call.trim_end_matches(';').to_owned(),
                );
            }
            _ if !public => (),
            "trait" => {
                let head = tokens.text(item.begin, item.head);
                self.push(place, item, item.name, head);
                let needs = vec![item.name.to_owned()];
                let within = Some((format!("{}{}", place.path, item.name), needs));
                self.inside(tokens, item, within, true, place);
            }
            "struct" | "enum" | "union" => self.data(tokens, item, place),
            _ => {
                let mut head = tokens.text(item.begin, item.head);
                if place.all_public && item.body.is_some() {
                    head += " { .. }";
                }
                self.push(place, item, item.name, head);
            }
        }
    }

    /// A line for an item, with the attributes that its users see.
    fn push(&mut self, place: &Place<'_>, item: &Item<'_>, name: &str, head: String) {
        let seen = [
            "cfg(feature",
            "cfg(target",
            "derive",
            "non_exhaustive",
            "deprecated",
            "macro",
        ];
        let seen = |a: &&String| seen.iter().any(|s| a.starts_with(s));
        let mut text = match &place.within {
            Some((within, _)) => format!("{within}: {head}"),
            None => format!("{}{head}", place.path),
        };
        for attribute in item.attributes.iter().filter(seen) {
            text += &format!(" #[{attribute}]");
        }
        let (owner, rank, needs) = match &place.within {
            Some((_, needs)) => (needs.first().cloned(), 1, needs.clone()),
            // Public paths stand together.
            None if item.keyword == "use" => (None, 0, Vec::new()),
            None => (Some(name.to_owned()), 0, Vec::new()),
        };
        let owner = owner.unwrap_or_default();
        self.lines.push(Line {
            owner,
            rank,
            text,
            needs,
        });
    }

    fn module(&mut self, tokens: &Tokens, item: &Item<'_>, place: &Place<'_>) {
        let mut path = place.path.clone();
        if item.public {
            self.push(place, item, item.name, format!("mod {}", item.name));
            path += &format!("{}::", item.name);
        }
        let folder = place.folder.join(item.name);
        let inner = Place {
            folder: &folder,
            path,
            ..place.clone()
        };
        if let Some((from, to)) = item.body {
            return self.block(tokens, from, to, &inner);
        }
        let beside = place.folder.join(format!("{}.rs", item.name));
        let within = folder.join("mod.rs");
        self.file(if beside.exists() { &beside } else { &within }, &inner);
    }

    /// The items in braces.
    fn inside(
        &mut self,
        tokens: &Tokens,
        item: &Item<'_>,
        within: Option<(String, Vec<String>)>,
        all_public: bool,
        place: &Place<'_>,
    ) {
        let inner = Place {
            within,
            all_public,
            ..place.clone()
        };
        if let Some((from, to)) = item.body {
            self.block(tokens, from, to, &inner);
        }
    }

    fn implementation(&mut self, tokens: &Tokens, item: &Item<'_>, place: &Place<'_>) {
        let named = tokens.behind_generics(item.begin + 1);
        let end = tokens
            .find(named, item.head, &["where"])
            .unwrap_or(item.head);
        let of_trait = tokens.find(named, end, &["for"]);
        let first = |from, to| {
            let upper = |i: &usize| tokens.at(*i).starts_with(char::is_uppercase);
            let found = (from..to).find(upper).map(|i| tokens.at(i).to_owned());
            found.into_iter().collect::<Vec<String>>()
        };
        let head = tokens.text(item.begin, item.head);
        let Some(of_trait) = of_trait else {
            let needs = first(named, end);
            let plain = named == item.begin + 1 && end == item.head;
            let before = if plain { tokens.text(named, end) } else { head };
            return self.inside(tokens, item, Some((before, needs)), false, place);
        };
        let mut needs = first(of_trait + 1, end);
        needs.extend(first(named, of_trait));
        // The types that it names; its functions are the trait's.
        let mut types = Vec::new();
        let (mut at, to) = item.body.unwrap_or_default();
        while at < to {
            let (inner, behind) = Item::read(tokens, at, to);
            if inner.keyword == "type" {
                types.push(tokens.text(inner.begin, behind - 1));
            }
            at = behind.max(at + 1);
        }
        let types = if types.is_empty() {
            String::new()
        } else {
            format!(" {{ {} }}", types.join("; "))
        };
        let owner = needs.first().cloned().unwrap_or_default();
        let text = format!("{head}{types}");
        self.lines.push(Line {
            owner,
            rank: 2,
            text,
            needs,
        });
    }

    /// A type, its public fields and its variants.
    fn data(&mut self, tokens: &Tokens, item: &Item<'_>, place: &Place<'_>) {
        let mut head = tokens.text(item.begin, item.head);
        let needs = vec![item.name.to_owned()];
        let inner = Place {
            within: Some((format!("{}{}", place.path, item.name), needs)),
            ..place.clone()
        };
        let tuple = tokens.behind_generics(item.begin + 2);
        if tokens.at(tuple) == "(" {
            let parts = tokens.parts(tuple + 1, tokens.behind(tuple) - 1);
            let fields = parts.into_iter().map(|(from, to)| {
                let field = Item::plain(tokens, from, to);
                if field.public {
                    tokens.text(field.begin, to)
                } else {
                    "_".to_owned()
                }
            });
            let fields = fields.collect::<Vec<_>>().join(", ");
            let behind = tokens.text(tokens.behind(tuple), item.head);
            head = format!("{}({fields}){behind}", tokens.text(item.begin, tuple));
        }
        let (from, to) = item.body.unwrap_or_default();
        let mut private = false;
        for (from, to) in tokens.parts(from, to) {
            let part = Item::plain(tokens, from, to);
            if item.keyword == "enum" || part.public {
                self.push(&inner, &part, "", tokens.text(part.begin, to));
            } else {
                private = true;
            }
        }
        if private {
            head += " { .. }";
        }
        self.push(place, item, item.name, head);
    }

    /// What a macro of ours makes: the heads of the public items and implementations in it, or, of
    /// one that only lists things, all of it. Of an exported one how it is called.
    fn macro_definition(&mut self, tokens: &Tokens, item: &Item<'_>, place: &Place<'_>) {
        let (from, to) = item.body.unwrap_or_default();
        let mut heads = Vec::new();
        if item.attributes.iter().any(|a| a == "macro_export") {
            let mut at = from;
            while at < to {
                heads.push(tokens.text(at, tokens.behind(at)));
                at = tokens.find(at, to, &[";"]).unwrap_or(to) + 1;
            }
        }
        for at in from..to {
            let item = match tokens.at(at) {
                "derive" => true,
                "pub" => tokens.at(at + 1) != "(",
                // Not a type, as in `-> impl Iterator`.
                "impl" => matches!(tokens.at(at - 1), "{" | "}" | "(" | "]" | ";"),
                _ => false,
            };
            if item {
                let end = tokens.find(at, to, &["{", ";", ",", "]"]).unwrap_or(to);
                heads.push(tokens.text(at, end));
            }
        }
        let lists = |i: usize| !matches!(tokens.at(i), "fn" | "match");
        if heads.is_empty() && (from..to).all(lists) {
            heads = vec![tokens.text(from, to)];
        }
        for head in heads {
            let head = format!("macro {}: {head}", item.name);
            self.push(place, item, item.name, head);
        }
    }
}

impl<'a> Item<'a> {
    /// The attributes and visibility before an item, a field or a variant.
    fn plain(tokens: &'a Tokens, mut at: usize, end: usize) -> Self {
        let mut attributes = Vec::new();
        while tokens.at(at) == "#" && at < end {
            let open = if tokens.at(at + 1) == "!" {
                at + 2
            } else {
                at + 1
            };
            attributes.push(tokens.text(open + 1, tokens.behind(open) - 1));
            at = tokens.behind(open);
        }
        let visible = tokens.at(at) == "pub";
        let restricted = visible && tokens.at(at + 1) == "(";
        if visible {
            at = if restricted {
                tokens.behind(at + 1)
            } else {
                at + 1
            };
        }
        Self {
            attributes,
            public: visible && !restricted,
            keyword: "",
            name: "",
            begin: at,
            head: end,
            body: None,
        }
    }

    /// The item that begins there, and what stands behind it.
    fn read(tokens: &'a Tokens, at: usize, end: usize) -> (Self, usize) {
        let mut item = Self::plain(tokens, at, end);
        let mut at = item.begin;
        let qualifier = |i: usize| match tokens.at(i) {
            "unsafe" | "async" | "extern" => true,
            "const" => matches!(tokens.at(i + 1), "fn" | "unsafe" | "async" | "extern"),
            text => text.starts_with('"'),
        };
        while qualifier(at) {
            at += 1;
        }
        let keyword = tokens.at(at);
        let values = ["const", "static", "type", "use"];
        let macro_call = tokens.at(at + 1) == "!";
        let stop = match keyword {
            _ if values.contains(&keyword) => tokens.find(at, end, &[";"]),
            _ => tokens.find(at, end, &["{", ";"]),
        };
        let stop = stop.unwrap_or(end);
        item.head = stop;
        let mut behind = stop + 1;
        if tokens.at(stop) == "{" {
            behind = tokens.behind(stop);
            item.body = Some((stop + 1, behind - 1));
        }
        match keyword {
            "macro_rules" => {
                (item.keyword, item.name) = (keyword, tokens.at(at + 2));
                let open = at + 3;
                item.body = Some((open + 1, tokens.behind(open) - 1));
            }
            _ if macro_call => item.name = keyword,
            _ => {
                (item.keyword, item.name) = (keyword, tokens.at(at + 1));
                // The value of a constant is not its signature.
                if matches!(keyword, "const" | "static") {
                    item.head = tokens.find(at, stop, &["="]).unwrap_or(stop);
                }
            }
        }
        (item, behind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<String> {
        let (mut items, tokens) = (Items::default(), Tokens::of(text));
        let place = Place {
            folder: Path::new(""),
            path: String::new(),
            within: None,
            all_public: false,
        };
        items.block(&tokens, 0, tokens.len(), &place);
        assert!(items.problems.is_empty());
        items.into_lines()
    }

    #[test]
    fn what_is_public_is_seen() {
        let found = lines(
            "pub mod m { pub fn f<T: A>(x: &T) -> [u8; 2] { g() } pub(crate) fn g() {} fn h() {} }
            #[derive(Clone)] /// A.
            pub struct S<'a> { pub a: &'a str, b: u8 }
            impl<'a> S<'a> { #[must_use] pub const fn new() -> Self { S {} } fn hidden() {} }
            impl<'a> Iterator for S<'a> { type Item = u8; fn next(&mut self) -> Option<u8> {} }
            pub enum E { A(u8), B { c: f64 }, #[non_exhaustive] C = 3 }
            pub trait T: Copy { const N: usize; fn needed(&self); fn given(&self) { } }
            pub struct P(pub f64, u8);
            pub const C: [f64; 2] = [1.0, { 2.0 }];
            use a::b; pub use c::{d, e};
            #[cfg(test)] pub mod tests { pub fn t() {} }",
        );
        let expected = "use c::{d, e} | const C: [f64; 2] | enum E | E: A(u8) | E: B { c: f64 } | \
            E: C = 3 #[non_exhaustive] | struct P(f64, _) | struct S<'a> { .. } #[derive(Clone)] | \
            S: a: &'a str | impl<'a> S<'a>: const fn new() -> Self | \
            impl<'a> Iterator for S<'a> { type Item = u8 } | trait T: Copy | T: const N: usize | \
            T: fn given(&self) { .. } | T: fn needed(&self) | m::fn f<T: A>(x: &T) -> [u8; 2] | mod m";
        assert_eq!(found.join(" | "), expected);
    }

    #[test]
    fn what_only_we_see_is_not() {
        let private = "struct S; impl S { pub fn f() {} } impl Clone for S { fn clone() {} }
            trait T {} impl T for u8 {} pub(crate) enum E { A }";
        assert_eq!(lines(private), [""; 0]);
    }

    #[test]
    fn macros_say_what_they_make() {
        let found = lines(
            "macro_rules! m { ($n:ident) => { #[derive(Clone)] pub struct $n { pub a: u8, b: u8 }
                impl $n { fn f() -> impl A { match x {} } } }; }
            m!(X); macro_rules! list { ($m:ident) => { $m! { a, b } }; }
            macro_rules! code { () => { match x {} }; }",
        );
        let expected = "macro list: ($m:ident) => { $m! { a, b } }; | m!(X) | macro m: derive(Clone) | \
            macro m: impl $n | macro m: pub a: u8 | macro m: pub struct $n";
        assert_eq!(found.join(" | "), expected);
    }
}
