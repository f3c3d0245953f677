//! Typed access to the JSON of a glTF file, with errors that name the place.

use super::json::{Node, Value};
use crate::diagnostics::{ErrorKind, Result, SceneError, Source};

/// The document and its text.
pub(super) struct Document<'a> {
    pub(super) source: &'a Source,
    pub(super) root: Node,
}

/// The lists at the top, which are looked up often.
const LISTS: &[&str] = &[
    "accessors",
    "animations",
    "asset",
    "bufferViews",
    "buffers",
    "cameras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "samplers",
    "scene",
    "scenes",
    "skins",
    "textures",
];

impl<'a> Document<'a> {
    /// A document; the known keys at the top come first, so that others cost nothing.
    pub(super) fn new(source: &'a Source, mut root: Node) -> Self {
        if let Value::Object(list) = &mut root.value {
            list.sort_by_key(|(key, _)| !LISTS.contains(&key.as_str()));
        }
        Self { source, root }
    }

    /// An error at a value.
    pub(super) fn error(
        &self,
        kind: ErrorKind,
        message: impl Into<String>,
        node: &Node,
        label: &str,
    ) -> SceneError {
        SceneError::new(kind, message).at(self.source, node.span, label)
    }

    fn wrong_type(&self, key: &str, node: &Node, expected: &str) -> SceneError {
        let message = format!("`{key}` is {}, expected {expected}", node.value.kind());
        self.error(ErrorKind::BadParameter, message, node, "wrong type")
    }

    /// The value of a key, if the object has it.
    pub(super) fn get<'n>(&self, node: &'n Node, key: &str) -> Option<&'n Node> {
        match &node.value {
            Value::Object(list) => list.iter().find(|(k, _)| k == key).map(|(_, n)| n),
            _ => None,
        }
    }

    pub(super) fn object<'n>(&self, node: &'n Node, key: &str) -> Result<Option<&'n Node>> {
        match self.get(node, key) {
            Some(n) if !matches!(n.value, Value::Object(_)) => {
                Err(self.wrong_type(key, n, "an object"))
            }
            other => Ok(other),
        }
    }

    /// The elements of an array; none if there is no such key.
    pub(super) fn array<'n>(&self, node: &'n Node, key: &str) -> Result<&'n [Node]> {
        match self.get(node, key) {
            None => Ok(&[]),
            Some(n) => match &n.value {
                Value::Array(list) => Ok(list),
                _ => Err(self.wrong_type(key, n, "an array")),
            },
        }
    }

    /// The elements of an array at the top.
    pub(super) fn list(&self, key: &str) -> Result<&[Node]> {
        self.array(&self.root, key)
    }

    pub(super) fn number(&self, node: &Node, key: &str) -> Result<Option<f64>> {
        match self.get(node, key) {
            None => Ok(None),
            Some(n) => match n.value {
                Value::Number(v) => Ok(Some(v)),
                _ => Err(self.wrong_type(key, n, "a number")),
            },
        }
    }

    pub(super) fn bool(&self, node: &Node, key: &str) -> Result<bool> {
        match self.get(node, key) {
            None => Ok(false),
            Some(n) => match n.value {
                Value::Bool(v) => Ok(v),
                _ => Err(self.wrong_type(key, n, "a boolean")),
            },
        }
    }

    pub(super) fn string<'n>(&self, node: &'n Node, key: &str) -> Result<Option<&'n str>> {
        match self.get(node, key) {
            None => Ok(None),
            Some(n) => match &n.value {
                Value::String(v) => Ok(Some(v)),
                _ => Err(self.wrong_type(key, n, "a string")),
            },
        }
    }

    /// A count or an offset.
    pub(super) fn size(&self, node: &Node, key: &str) -> Result<Option<usize>> {
        match self.get(node, key) {
            None => Ok(None),
            Some(n) => self.as_size(key, n).map(Some),
        }
    }

    fn as_size(&self, key: &str, node: &Node) -> Result<usize> {
        match node.value {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                clippy::float_cmp,
                reason = "checked to be a whole number below 2^53"
            )]
            Value::Number(v) if v >= 0.0 && v == v.trunc() && v < 9e15 => Ok(v as usize),
            Value::Number(v) => {
                let message = format!("`{key}` is {v}, expected a whole number");
                Err(self.error(ErrorKind::OutOfRange, message, node, ""))
            }
            _ => Err(self.wrong_type(key, node, "a number")),
        }
    }

    /// The index of an element of a list at the top, checked.
    pub(super) fn index(&self, node: &Node, key: &str, list: &str) -> Result<Option<usize>> {
        match self.get(node, key) {
            None => Ok(None),
            Some(n) => self.as_index(key, n, list).map(Some),
        }
    }

    /// A value as the index of an element of a list at the top, checked.
    pub(super) fn as_index(&self, key: &str, node: &Node, list: &str) -> Result<usize> {
        let index = self.as_size(key, node)?;
        let count = self.list(list)?.len();
        if index < count {
            return Ok(index);
        }
        let message = format!("`{key}` refers to number {index} of `{list}`");
        let label = format!("there are {count}, counted from 0");
        Err(self.error(ErrorKind::BadMesh, message, node, &label))
    }

    /// An array of `N` numbers.
    pub(super) fn vector<const N: usize>(
        &self,
        node: &Node,
        key: &str,
    ) -> Result<Option<[f64; N]>> {
        let Some(n) = self.get(node, key) else {
            return Ok(None);
        };
        let list = self.array(node, key)?;
        if list.len() != N {
            let message = format!("`{key}` has {} values, expected {N}", list.len());
            return Err(self.error(
                ErrorKind::BadParameter,
                message,
                n,
                "wrong number of values",
            ));
        }
        let mut values = [0.0; N];
        for (slot, n) in values.iter_mut().zip(list) {
            match n.value {
                Value::Number(v) => *slot = v,
                _ => return Err(self.wrong_type(key, n, "numbers")),
            }
        }
        Ok(Some(values))
    }

    /// Something that has to be there.
    pub(super) fn require<T>(&self, value: Option<T>, node: &Node, key: &str) -> Result<T> {
        value.ok_or_else(|| {
            let message = format!("`{key}` is missing");
            self.error(ErrorKind::MissingParameter, message, node, "in this object")
        })
    }
}
