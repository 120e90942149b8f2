//! The positions and attributes of the source, where the file keeps them: BTH-F140 and BTH-F141.

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
    match view.positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        None => Ok(()),
        Some(row) => {
            let found = format!("{:?}", view.positions[row]);
            Err(Error::within(Code::Positions, kind::POSITIONS, 12 * row as u64, "a finite position", found))
        }
    }
}

/// BTH-F140: every number in a table of triangles is below `rows`.
fn rows(section: u32, table: &[[u32; 3]], rows: usize) -> Result<()> {
    match table.iter().flatten().position(|v| *v as usize >= rows) {
        None => Ok(()),
        Some(i) => {
            let found = format!("{}", table[i / 3][i % 3]);
            Err(Error::within(Code::SourceRows, section, 4 * i as u64, format!("a row below {rows}"), found))
        }
    }
}
