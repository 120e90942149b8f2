//! The sections of groups of triangles, and of the names of objects.

use super::{FileBuilder, Names};
use crate::error::Result;
use bth_format::layout::*;
use bth_import::Groups;

/// The rows of an object's groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GroupParts {
    /// Groups.
    pub groups: Vec<Group>,
    /// Which triangles belong to which group.
    pub runs: Vec<GroupRun>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Names of groups and materials.
    pub labels: Vec<u8>,
}

impl GroupParts {
    /// The rows of a mesh's groups.
    pub fn of(groups: &Groups) -> Self {
        let mut names = Names::default();
        let group = |group: &bth_import::Group, names: &mut Names| {
            let (name, name_length) = names.add(&group.name);
            Group { name, name_length, material: group.material.unwrap_or(NONE), reserved: 0 }
        };
        let material = |name: &String, names: &mut Names| {
            let (name, name_length) = names.add(name);
            Material { name, name_length, reserved: [0; 2] }
        };
        let rows = groups.groups.iter().map(|row| group(row, &mut names)).collect();
        let materials = groups.materials.iter().map(|name| material(name, &mut names)).collect();
        let runs = groups.runs.iter().map(|&[first, group]| GroupRun { first, group }).collect();
        Self { groups: rows, runs, materials, labels: names.bytes }
    }

    /// Adds the sections of an object that have rows.
    pub(super) fn write<'a>(&'a self, builder: &mut FileBuilder<'a>, object: u32) -> Result<()> {
        builder.rows(kind::GROUPS, object, &self.groups)?;
        builder.rows(kind::GROUP_RUNS, object, &self.runs)?;
        builder.rows(kind::MATERIALS, object, &self.materials)?;
        builder.rows(kind::LABELS, object, &self.labels)?;
        Ok(())
    }
}

/// Adds the names of a file's objects, in order; nothing for a file without objects.
///
/// # Errors
/// `BTH-X031` when they exist already.
pub fn object_names(
    builder: &mut FileBuilder<'_>,
    names: impl IntoIterator<Item = impl AsRef<str>>,
) -> Result<()> {
    let mut text = Names::default();
    let mut rows = Vec::new();
    for name in names {
        let (first, length) = text.add(name.as_ref());
        rows.extend([first, length].map(u32::to_le_bytes));
    }
    if !rows.is_empty() {
        let stride = size_of::<ObjectName>() as u32;
        builder.section(kind::OBJECT_NAMES, NONE, stride, rows.into_flattened())?;
    }
    if !text.bytes.is_empty() {
        builder.section(kind::OBJECT_LABELS, NONE, 1, text.bytes)?;
    }
    Ok(())
}
