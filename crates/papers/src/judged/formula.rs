//! Formulas of claims, such as `sqrt(variance[strips/A/mis] / variance[strips/A/average])`, and a
//! reader for them by recursive descent.
//!
//! `statistic[cell]` is a statistic of the cell with this path, one number for each of the cell's
//! numbers of samples; `special[function/name]` is a number that a function of its own measures.
//! The operators `-`, `*` and `/` combine numbers pairwise. `sqrt` applies to each number. `first`,
//! `last`, `pooled` (the geometric mean), `largest`, `smallest` and `farthest(x, a…)` (the one of
//! a… farthest from x) make one number of several.

use crate::measured::{Measured, largest, smallest};
use anyhow::{Context as _, Result, bail, ensure};
use serde::Deserialize;

/// A formula that can be evaluated.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct Formula {
    text: String,
    root: Node,
}

/// A node of a formula's tree.
#[derive(Clone, Debug, PartialEq)]
enum Node {
    Number(f64),
    /// The name of a statistic, and a cell's path.
    Statistic(String, String),
    Call(String, Vec<Node>),
    Binary(char, Box<[Node; 2]>),
}

/// A source of the statistics that formulas refer to, each of a cell with a path.
pub(super) trait Figures {
    fn find(&self, statistic: &str, cell: &str) -> Result<Vec<Measured>>;
}

impl Formula {
    /// Returns the formula as it was written.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Returns the names of statistics and the paths that the formula refers to.
    pub(super) fn asks(&self) -> impl Iterator<Item = (&str, &str)> {
        let mut waiting = vec![&self.root];
        std::iter::from_fn(move || {
            loop {
                match waiting.pop()? {
                    Node::Number(_) => (),
                    Node::Statistic(what, cell) => return Some((what.as_str(), cell.as_str())),
                    Node::Call(_, list) => waiting.extend(list),
                    Node::Binary(_, both) => waiting.extend(&**both),
                }
            }
        })
    }

    /// Returns whether the formula depends on a time.
    pub(super) fn is_timed(&self) -> bool {
        let timed = |(what, cell): (&str, &str)| {
            ["seconds", "cost"].contains(&what) || cell.contains("/time of")
        };
        self.asks().any(timed)
    }

    /// Returns the number that the formula evaluates to.
    pub(super) fn evaluate(&self, figures: &impl Figures) -> Result<Measured> {
        let all = evaluate(&self.root, figures).with_context(|| format!("`{}`", self.text))?;
        match all[..] {
            [one] => Ok(one),
            _ => bail!("`{}` is {} numbers", self.text, all.len()),
        }
    }
}

/// Evaluates a node to one or more numbers.
fn evaluate(node: &Node, figures: &impl Figures) -> Result<Vec<Measured>> {
    match node {
        Node::Number(value) => Ok(vec![Measured::exact(*value)]),
        Node::Statistic(what, cell) => figures.find(what, cell),
        // Apply an operator to numbers pairwise.
        Node::Binary(operator, both) => {
            let (a, b) = (evaluate(&both[0], figures)?, evaluate(&both[1], figures)?);
            ensure!(a.len() == b.len(), "{} numbers beside {}", a.len(), b.len());
            let apply = |(a, b): (&Measured, &Measured)| match operator {
                '-' => a.minus(*b),
                '*' => a.times(*b),
                _ => a.over(*b),
            };
            Ok(a.iter().zip(&b).map(apply).collect())
        }
        // Apply a function: `sqrt` to each number, the others to all numbers together.
        Node::Call(name, list) => {
            let mut all = Vec::new();
            for argument in list {
                all.extend(evaluate(argument, figures)?);
            }
            if name == "sqrt" {
                return Ok(all
                    .into_iter()
                    .map(|m| m.map(|v| v.max(0.0).sqrt()))
                    .collect());
            }
            let one = match (name.as_str(), &all[..]) {
                ("first", [first, ..]) => Some(*first),
                ("last", [.., last]) => Some(*last),
                ("pooled", all) => Measured::pooled(all),
                ("largest", all) => largest(all.iter().copied()),
                ("smallest", all) => smallest(all.iter().copied()),
                ("farthest", [from, rest @ ..]) => {
                    let distance = |m: &&Measured| (m.value - from.value).abs();
                    let found = rest
                        .iter()
                        .max_by(|a, b| distance(a).total_cmp(&distance(b)));
                    found.copied()
                }
                _ => bail!("there is no function `{name}`"),
            };
            Ok(vec![one.with_context(|| format!("`{name}` of nothing"))?])
        }
    }
}

impl TryFrom<String> for Formula {
    type Error = anyhow::Error;

    fn try_from(text: String) -> Result<Self> {
        let mut reader = Reader { rest: &text };
        let root = reader
            .sum()
            .with_context(|| format!("the formula `{text}`"))?;
        let rest = reader.rest.trim();
        ensure!(
            rest.is_empty(),
            "`{rest}` is too much in the formula `{text}`"
        );
        Ok(Self { text, root })
    }
}

/// A reader of formulas: the rest of the text, which is still to be read.
struct Reader<'t> {
    rest: &'t str,
}

impl<'t> Reader<'t> {
    /// Skips spaces, and reads the next character if it is one of the characters `among`; otherwise
    /// `None`.
    fn next(&mut self, among: &str) -> Option<char> {
        self.rest = self.rest.trim_start();
        let c = self.rest.chars().next().filter(|c| among.contains(*c))?;
        self.rest = &self.rest[c.len_utf8()..];
        Some(c)
    }

    /// Returns the text up to a character, which is skipped.
    fn until(&mut self, sign: char) -> Result<&'t str> {
        let (text, rest) = self
            .rest
            .split_once(sign)
            .with_context(|| format!("no `{sign}`"))?;
        self.rest = rest;
        Ok(text)
    }

    /// Reads products, separated by `-`.
    fn sum(&mut self) -> Result<Node> {
        let mut left = self.product()?;
        while let Some(operator) = self.next("-") {
            left = Node::Binary(operator, Box::new([left, self.product()?]));
        }
        Ok(left)
    }

    /// Reads factors, separated by `*` or `/`.
    fn product(&mut self) -> Result<Node> {
        let mut left = self.factor()?;
        while let Some(operator) = self.next("*/") {
            left = Node::Binary(operator, Box::new([left, self.factor()?]));
        }
        Ok(left)
    }

    /// Reads a sum in parentheses, a number, a statistic with its path in brackets, or a function
    /// with its arguments.
    fn factor(&mut self) -> Result<Node> {
        // A sum in parentheses.
        if self.next("(").is_some() {
            let inner = self.sum()?;
            ensure!(self.next(")").is_some(), "no `)`");
            return Ok(inner);
        }
        // A word: a number, or the name of a statistic or function.
        self.rest = self.rest.trim_start();
        let end = |c: char| !(c.is_alphanumeric() || "._".contains(c));
        let length = self.rest.find(end).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(length);
        self.rest = rest;
        if let Ok(number) = word.parse() {
            return Ok(Node::Number(number));
        }
        // A statistic and its path.
        if self.next("[").is_some() {
            return Ok(Node::Statistic(
                word.to_owned(),
                self.until(']')?.to_owned(),
            ));
        }
        // A function and its arguments.
        ensure!(
            self.next("(").is_some(),
            "`{word}` is neither number nor function"
        );
        let mut list = vec![self.sum()?];
        while self.next(",").is_some() {
            list.push(self.sum()?);
        }
        ensure!(self.next(")").is_some(), "no `)`");
        Ok(Node::Call(word.to_owned(), list))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fixed;

    impl Figures for Fixed {
        fn find(&self, statistic: &str, cell: &str) -> Result<Vec<Measured>> {
            let list: &[f64] = match (statistic, cell) {
                ("variance", "a/b c") => &[8.0, 2.0],
                ("variance", "a/d") => &[2.0, 0.125],
                _ => bail!("no {statistic} of {cell}"),
            };
            Ok(list.iter().map(|v| Measured::exact(*v)).collect())
        }
    }

    fn value(text: &str) -> Result<f64> {
        Ok(Formula::try_from(text.to_owned())?.evaluate(&Fixed)?.value)
    }

    #[test]
    fn formulas_are_read_as_they_are_written() {
        for (text, want) in [
            ("first(variance[a/b c] / variance[a/d])", 4.0),
            ("last(variance[a/b c] / variance[a/d])", 16.0),
            ("pooled(variance[a/b c] / variance[a/d])", 8.0),
            ("sqrt(16) - 1 - 0.5", 2.5),
            ("12 / (2 * 3)", 2.0),
            ("largest(1, variance[a/d], 1.5)", 2.0),
            ("farthest(1, 0.5, 3)", 3.0),
        ] {
            let found = value(text).unwrap();
            assert!((found - want).abs() < 1e-12, "{text}: {found}");
        }
        for text in [
            "variance[a/d]",
            "1 +",
            "what(1)",
            "variance[a/d",
            "rank[a/d]",
            "1 2",
        ] {
            assert!(value(text).is_err(), "{text}");
        }
    }
}
