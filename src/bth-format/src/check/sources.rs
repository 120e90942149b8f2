//! The positions and attributes of the source, where the file keeps them: BTH-F140 and BTH-F141.

use super::rows::{check_all, is_finite};
use crate::error::{Code, Error, Result};
use crate::layout::kind;
use crate::object::ObjectView;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    rows(kind::TRIANGLES, view.triangles, view.positions.len())?;
    let (normals, uvs) = (view.normals.len(), view.uvs.len());
    if normals != 0 && uvs != 0 && normals != uvs {
        let expected = format!("{normals} rows, as many as normals");
        return Err(Error::within(Code::SourceRows, kind::UVS, 0, expected, format!("{uvs}")));
    }
    rows(kind::CORNERS, view.corners, normals.max(uvs))?;
    check_all(Code::Positions, kind::POSITIONS, view.positions, |p| is_finite(p), "a finite position")
}

/// BTH-F140: every number in a table of triangles is below `rows`.
fn rows(section: u32, table: &[[u32; 3]], rows: usize) -> Result<()> {
    let expected = format!("a row below {rows}");
    check_all(Code::SourceRows, section, table.as_flattened(), |v| (*v as usize) < rows, expected)
}
