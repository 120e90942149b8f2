//! Skins and deformers: what moves the vertices of objects.

use crate::error::{Result, code};
use crate::model::{Deformer, Skin};
use crate::names::Names;
use crate::table::Table;
use std::collections::HashSet;

/// Keys of a skin.
pub(crate) const SKIN_KEYS: &[&str] = &["name", "joints", "inverse_binds"];
/// Keys of a deformer.
pub(crate) const DEFORMER_KEYS: &[&str] = &["node", "object", "skin", "weights"];

/// Reads a skin.
pub(crate) fn skin(table: &Table<'_>, nodes: &Names) -> Result<Skin> {
    let joints_value = table.need("joints")?;
    let joints = joints_value.array()?.iter().map(|v| nodes.row(v)).collect::<Result<Vec<_>>>()?;
    if joints.is_empty() {
        return Err(joints_value.not_allowed("at least one node", "none"));
    }
    let inverse_binds = match table.get("inverse_binds") {
        None => None,
        Some(value) => {
            let matrices = value.array()?;
            if matrices.len() != joints.len() {
                let expected = format!("a matrix for each of {} joints", joints.len());
                return Err(value.not_allowed(&expected, matrices.len()));
            }
            Some(matrices.iter().map(|v| v.matrix()).collect::<Result<Vec<_>>>()?)
        }
    };
    Ok(Skin { name: table.need("name")?.string()?.to_owned(), joints, inverse_binds })
}

/// Reads the deformers of a manifest. No two have the same node or the same object.
pub(crate) fn deformers(
    tables: &[Table<'_>],
    nodes: &Names,
    objects: &Names,
    skins: &Names,
) -> Result<Vec<Deformer>> {
    let (mut seen_nodes, mut seen_objects) = (HashSet::new(), HashSet::new());
    let one = |table: &Table<'_>| {
        let (node_value, object_value) = (table.need("node")?, table.need("object")?);
        let (node, object) = (nodes.row(&node_value)?, objects.row(&object_value)?);
        for (value, is_new, what) in [
            (&node_value, seen_nodes.insert(node), "node"),
            (&object_value, seen_objects.insert(object), "object"),
        ] {
            if !is_new {
                let message = format!("the {what} \"{}\" has a deformer already", value.string()?);
                return Err(value.error(code::CONFLICT, message, "keep one of them"));
            }
        }
        let weights = match table.get("weights") {
            Some(value) => value.array()?.iter().map(|v| v.number()).collect::<Result<Vec<_>>>()?,
            None => Vec::new(),
        };
        let skin = table.get("skin").map(|v| skins.row(&v)).transpose()?;
        Ok(Deformer { node, object, skin, weights })
    };
    tables.iter().map(one).collect()
}
