//! The tables of nodes: parsed with the whole manifest, or one at a time.

use crate::error::{Result, code};
use crate::names::Names;
use crate::table::{Document, Table};
use std::ops::Range;

pub(crate) const NODE_KEYS: &[&str] =
    &["name", "parent", "object", "group", "visible", "translation", "rotation", "scale", "matrix", "look"];

/// The tables of nodes.
pub(crate) enum NodeTables<'a> {
    /// All of them.
    Parsed(Vec<Table<'a>>),
    /// Where each is in the text. One is parsed at a time, since they may be millions.
    Text(Document<'a>, &'a [Range<u32>]),
}

impl<'a> NodeTables<'a> {
    /// The tables of a manifest, whose others are parsed.
    pub(crate) fn new(scene: &Table<'a>, doc: Document<'a>, nodes: &'a [Range<u32>]) -> Result<Self> {
        match (scene.get("nodes"), nodes) {
            (None, nodes) => Ok(Self::Text(doc, nodes)),
            (Some(_), []) => Ok(Self::Parsed(scene.tables("nodes", NODE_KEYS)?)),
            (Some(value), _) => {
                let message = "the nodes are an array and tables `[[nodes]]`";
                Err(value.error(code::SYNTAX, message, "give them in one of the two ways"))
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Parsed(tables) => tables.len(),
            Self::Text(_, nodes) => nodes.len(),
        }
    }

    /// What `read` makes of a table.
    pub(crate) fn with<T>(&self, row: usize, read: impl FnOnce(&Table<'_>) -> Result<T>) -> Result<T> {
        match self {
            Self::Parsed(tables) => read(&tables[row]),
            Self::Text(doc, nodes) => {
                let range = nodes[row].start as usize..nodes[row].end as usize;
                let pieces = [(0, range.start)];
                let doc = Document { pieces: &pieces, ..*doc };
                let root = doc.parse(&doc.text[range])?;
                let tables = Table::new(doc, root.get_ref(), 0..0, &["nodes"])?.tables("nodes", NODE_KEYS)?;
                read(&tables[0])
            }
        }
    }

    /// Their names.
    pub(crate) fn names(&self) -> Result<Names> {
        Names::of("node", self.len(), |row, read| self.with(row, |table| read(table)))
    }
}
