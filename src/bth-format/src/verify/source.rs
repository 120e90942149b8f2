//! The stored triangles compared with the source's, where the file keeps positions.

use super::triangle_set::TriangleSet;
use crate::error::{Code, Error, Result};
use crate::exact::is_zero_area;
use crate::layout::*;
use crate::object::{ObjectView, relative_to_anchor};
use std::mem::offset_of;

/// The place of a stored triangle in the file, and the code of the invariant that ties it to the
/// source there.
#[derive(Clone, Copy)]
pub(super) struct Stored {
    /// [`Code::LeafSource`] or [`Code::FaceSource`].
    pub(super) code: Code,
    pub(super) section: u32,
    /// Byte of the section.
    pub(super) at: u64,
}

/// BTH-F201 or BTH-F202, and BTH-F207: a stored triangle has the corners of its source triangle,
/// bit for bit, and an area unless the object is deformable.
pub(super) fn check_corners(
    view: &ObjectView,
    id: u32,
    corners: [[f32; 3]; 3],
    stored: Stored,
) -> Result<()> {
    let Some(source) = source_corners(view, id) else { return Ok(()) };
    let Stored { code, section, at } = stored;
    if source.map(|p| p.map(f32::to_bits)) != corners.map(|p| p.map(f32::to_bits)) {
        let expected = format!("triangle {id}: {source:?}");
        return Err(Error::within(code, section, at, expected, format!("{corners:?}")));
    }
    if !view.is_deformable() && has_zero_area(view, id, source) {
        let found = format!("triangle {id} of zero area");
        return Err(Error::within(Code::ZeroArea, section, at, "triangles that can be hit", found));
    }
    Ok(())
}

/// Corners of a source triangle, on the grid if there is one; `None` where the file does not keep
/// them.
fn source_corners(view: &ObjectView, id: u32) -> Option<[[f32; 3]; 3]> {
    let corners = view.triangles.get(id as usize)?.map(|v| view.positions[v as usize]);
    Some(view.grid.map_or(corners, |grid| corners.map(|p| grid.nearest(p))))
}

/// Returns true if a source triangle has zero area, given its corners in f32.
fn has_zero_area(view: &ObjectView, id: u32, corners: [[f32; 3]; 3]) -> bool {
    view.exact.corners(id).map_or_else(|| is_zero_area(corners), is_zero_area)
}

/// BTH-F203 and BTH-F207: as many triangles are skipped as the header says, and all of these have
/// zero area.
pub(super) fn check_dropped(view: &ObjectView, placed: &TriangleSet) -> Result<()> {
    let left_out = view.header.triangles as usize - placed.len();
    if left_out != view.header.dropped as usize {
        let at = offset_of!(Object, dropped) as u64;
        let expected = format!("{} triangles in no leaf", view.header.dropped);
        return Err(Error::within(Code::Coverage, kind::OBJECT, at, expected, format!("{left_out}")));
    }
    // Without kept triangles there is nothing to compare, and the header's count must not bound a
    // loop.
    for id in (0..view.triangles.len()).filter(|id| !placed.has(*id as u32)) {
        let id = id as u32;
        if source_corners(view, id).is_some_and(|corners| !has_zero_area(view, id, corners)) {
            let found = format!("triangle {id}, which has an area, in no leaf");
            let expected = "triangles of zero area to be left out";
            return Err(Error::within(Code::ZeroArea, kind::TRIANGLES, 12 * u64::from(id), expected, found));
        }
    }
    Ok(())
}

/// BTH-F211: positions in f32 are the exact ones, rounded once.
pub(super) fn check_rounding(view: &ObjectView) -> Result<()> {
    let rows = view.positions.iter().zip(view.exact.positions());
    for (row, (found, exact)) in rows.enumerate() {
        let expected = [0, 1, 2].map(|k| relative_to_anchor(exact[k], view.anchor[k]));
        if expected.map(f32::to_bits) != found.map(f32::to_bits) {
            let (at, expected) = (12 * row as u64, format!("{expected:?}"));
            let found = format!("{found:?}");
            return Err(Error::within(Code::ExactRounding, kind::POSITIONS, at, expected, found));
        }
    }
    Ok(())
}

/// BTH-F208: no position of the source is farther from its point of the grid than the header says.
pub(super) fn check_displacement(view: &ObjectView) -> Result<()> {
    let Some(grid) = &view.grid else { return Ok(()) };
    let most = f64::from(view.header.displacement);
    for (row, position) in view.positions.iter().enumerate() {
        let found = distance(*position, grid.nearest(*position));
        if found > most {
            let (at, expected) = (12 * row as u64, format!("at most {most} from the grid"));
            return Err(Error::within(Code::Displacement, kind::POSITIONS, at, expected, format!("{found}")));
        }
    }
    Ok(())
}

/// Distance of two points in `f64`, with a relative error of about 2^-51.
fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let squares = [0, 1, 2].map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2));
    squares.iter().sum::<f64>().sqrt()
}
