//! Groups of triangles, their materials and names: BTH-F142 to BTH-F144.

use super::rows::{check_fields, check_object_rows};
use crate::error::{Code, Error, Result};
use crate::layout::{Group, GroupRun, Material, NONE, kind};
use crate::names::{checked, is_name};
use crate::object::ObjectView;

const LABEL_EXPECTED: &str = "a name of at most 4096 bytes within LABELS";

pub(super) fn check(view: &ObjectView) -> Result<()> {
    runs(view)?;
    let labels = checked(view.labels);
    let materials = view.materials.len();
    check_object_rows(kind::GROUPS, view.groups, |_, g| {
        check_fields!(Group {
            Group material: g.material == NONE || (g.material as usize) < materials,
                format!("a row below {materials} or NONE"), g.material;
            Group reserved: g.reserved == 0, "zeros", g.reserved;
            Label name: is_name(labels, g.name, g.name_length), LABEL_EXPECTED, (g.name, g.name_length);
        });
        Ok(())
    })?;
    check_object_rows(kind::MATERIALS, view.materials, |_, m| {
        check_fields!(Material {
            Group reserved: m.reserved == [0; 2], "zeros", m.reserved;
            Label name: is_name(labels, m.name, m.name_length), LABEL_EXPECTED, (m.name, m.name_length);
        });
        Ok(())
    })
}

/// BTH-F142.
fn runs(view: &ObjectView) -> Result<()> {
    let (runs, triangles) = (view.group_runs, view.header.triangles);
    let wanted = !view.groups.is_empty() && triangles > 0;
    if wanted == runs.is_empty() {
        let expected = if wanted { "runs of triangles" } else { "none without groups or triangles" };
        let found = format!("{} rows", runs.len());
        return Err(Error::within(Code::GroupRuns, kind::GROUP_RUNS, 0, expected, found));
    }
    check_object_rows(kind::GROUP_RUNS, runs, |row, run| {
        let ascends = match row.checked_sub(1) {
            None => run.first == 0,
            Some(before) => runs[before].first < run.first,
        };
        let (first, groups) = (run.first, view.groups.len());
        check_fields!(GroupRun {
            GroupRuns first: ascends && first < triangles && (run.group as usize) < groups,
                format!("ascending triangles from 0 and below {triangles}, and a group below {groups}"), run;
        });
        Ok(())
    })
}
