//! Groups of triangles, their materials and names: BTH-F142 to BTH-F144.

use crate::error::{Code, Error, Result};
use crate::layout::{Group, GroupRun, Material, NONE, kind};
use crate::names::{checked, is_name};
use crate::object::ObjectView;
use std::mem::offset_of;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    runs(view)?;
    let labels = checked(view.labels);
    for (row, group) in view.groups.iter().enumerate() {
        let at = size_of::<Group>() * row;
        if group.material != NONE && group.material as usize >= view.materials.len() {
            let expected = format!("a row below {} or NONE", view.materials.len());
            let at = at + offset_of!(Group, material);
            return error(Code::Group, kind::GROUPS, at, expected, format!("{}", group.material));
        }
        zero(kind::GROUPS, at + offset_of!(Group, reserved), group.reserved == 0)?;
        label(labels, kind::GROUPS, at, (group.name, group.name_length))?;
    }
    for (row, material) in view.materials.iter().enumerate() {
        let at = size_of::<Material>() * row;
        zero(kind::MATERIALS, at + offset_of!(Material, reserved), material.reserved == [0; 2])?;
        label(labels, kind::MATERIALS, at, (material.name, material.name_length))?;
    }
    Ok(())
}

/// BTH-F142.
fn runs(view: &ObjectView) -> Result<()> {
    let (runs, triangles) = (view.group_runs, view.header.triangles);
    let wanted = !view.groups.is_empty() && triangles > 0;
    if wanted == runs.is_empty() {
        let expected = if wanted { "runs of triangles" } else { "none without groups or triangles" };
        return error(
            Code::GroupRuns,
            kind::GROUP_RUNS,
            0,
            String::from(expected),
            format!("{} rows", runs.len()),
        );
    }
    for (row, run) in runs.iter().enumerate() {
        let ascends = match row.checked_sub(1) {
            None => run.first == 0,
            Some(before) => runs[before].first < run.first,
        };
        if !ascends || run.first >= triangles || run.group as usize >= view.groups.len() {
            let expected = format!(
                "ascending triangles from 0 and below {triangles}, and a group below {}",
                view.groups.len()
            );
            let at = size_of::<GroupRun>() * row;
            return error(Code::GroupRuns, kind::GROUP_RUNS, at, expected, format!("{run:?}"));
        }
    }
    Ok(())
}

/// BTH-F143 of a reserved field.
fn zero(kind: u32, at: usize, is_zero: bool) -> Result<()> {
    if is_zero {
        return Ok(());
    }
    error(Code::Group, kind, at, "zeros".into(), "other numbers".into())
}

/// BTH-F144.
fn label(labels: &str, kind: u32, at: usize, (first, length): (u32, u32)) -> Result<()> {
    if is_name(labels, first, length) {
        return Ok(());
    }
    let expected = String::from("a name of at most 4096 bytes within LABELS");
    error(Code::Label, kind, at, expected, format!("{:?}", (first, length)))
}

fn error(code: Code, kind: u32, at: usize, expected: String, found: String) -> Result<()> {
    Err(Error::within(code, kind, at as u64, expected, found))
}
