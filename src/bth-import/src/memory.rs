//! Triangles that are in memory already.

use crate::error::{Place, Result};
use crate::import::weld_and_count;
use crate::mesh::{Mesh, Report, Wanted};
use crate::monitor::Monitor;
use crate::raw::{check_rows, check_triangles};
use crate::source::{INDEX, NON_FINITE, input_error};
use std::path::Path;

/// Name of the format in reports about triangles from memory.
pub const MEMORY_FORMAT: &str = "memory";

/// A mesh of triangles in memory, welded (but with [`Wanted::vertices`]) and counted as the faces
/// of a file are. Row i of `triangles` has the id i. `name` names the mesh in messages.
///
/// # Errors
/// `BTH-I005` for an index that is not a row of `positions`, `BTH-I004` for a corner that is not
/// finite, each with the triangle's row; `BTH-L001` and `BTH-L002` beyond the limits of the format;
/// cancellation.
pub fn import_triangles(
    name: &Path,
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    monitor.stage("import", Some(triangles.len() as u64));
    check_triangles(triangles.len() as u64)?;
    check_rows(positions.len() as u64)?;
    check_indices(name, positions.len(), triangles)?;
    let all = wanted.into().vertices;
    let welded = weld_and_count(&[positions], triangles.to_vec(), None, all, monitor, |_, row| {
        let triangle = triangles.iter().position(|corners| corners.contains(&(row as u32)));
        let message = format!("expected finite coordinates, found {:?} at position {row}", positions[row]);
        let hint = "leave out the triangles with positions that are not finite";
        input_error(NON_FINITE, place(name, triangle.unwrap_or_default()), message, hint)
    })?;
    monitor.advance(triangles.len() as u64);
    Ok((welded.mesh, Report { format: MEMORY_FORMAT.to_owned(), ..welded.report }))
}

fn check_indices(name: &Path, count: usize, triangles: &[[u32; 3]]) -> Result<()> {
    let outside = |index: &u32| *index as usize >= count;
    // The largest index of all is found without a branch for each.
    let greatest = triangles.as_flattened().iter().copied().max();
    if !greatest.is_some_and(|index| outside(&index)) {
        return Ok(());
    }
    let row = triangles.iter().position(|corners| corners.iter().any(outside)).unwrap_or_default();
    let index = triangles[row].into_iter().find(outside).unwrap_or_default();
    let message = format!("index {index} of {count} positions");
    Err(input_error(INDEX, place(name, row), message, "indices count from 0"))
}

/// The place of a triangle.
fn place(name: &Path, row: usize) -> Place {
    Place::Part(name.to_owned(), format!("triangle {row}"))
}
