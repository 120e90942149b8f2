//! The geometry of one object whose indices have been checked.

use super::report::Report;
use super::{free, source, tet_leaf, tree};
use crate::error::Result;
use crate::object::ObjectView;

/// Checks BTH-F201 to BTH-F209 and adds the object to a report. Offsets of errors count from the start of the section.
pub(super) fn check(view: &ObjectView, report: &mut Report) -> Result<()> {
    let marks = tree::check(view)?;
    for (row, leaf) in view.tet_leaves.iter().enumerate() {
        tet_leaf::check(view, row, leaf)?;
        report.tets += u64::from(leaf.tets);
    }
    source::check_dropped(view, &marks)?;
    source::check_displacement(view)?;
    free::check(view)?;
    report.tet_leaves += view.tet_leaves.len() as u64;
    report.triangles += u64::from(view.header.triangles - view.header.dropped);
    report.dropped += u64::from(view.header.dropped);
    report.compared_with_source += u32::from(!view.triangles.is_empty());
    Ok(())
}
