//! Triangles that are in memory already.

use crate::error::{Place, Result};
use crate::import::weld_and_count;
use crate::mesh::{Mesh, Report, Wanted};
use crate::monitor::Monitor;
use crate::raw::{check_rows, check_triangles};
use crate::rounding::{self, Rounded};
use crate::source::{INDEX, NON_FINITE, input_error};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;

/// Name of the format in reports about triangles from memory.
pub const MEMORY_FORMAT: &str = "memory";

/// Positions in memory.
#[derive(Clone, Copy, Debug)]
pub enum PositionRows<'a> {
    /// In f32.
    F32(&'a [[f32; 3]]),
    /// In f64. [`Wanted::positions`] decides if they are rounded.
    F64(&'a [[f64; 3]]),
}

impl PositionRows<'_> {
    /// Number of positions.
    pub fn len(&self) -> usize {
        match self {
            PositionRows::F32(rows) => rows.len(),
            PositionRows::F64(rows) => rows.len(),
        }
    }

    /// Returns true if there are no positions.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A mesh of triangles in memory, welded (but with [`Wanted::vertices`]) and counted as the faces
/// of a file are. Row i of `triangles` has the id i. `name` names the mesh in messages.
///
/// # Errors
/// `BTH-I005` for an index that is not a row of `positions`, `BTH-I004` for a corner that is not
/// finite, each with the triangle's row; `BTH-L001` and `BTH-L002` beyond the limits of the format;
/// cancellation.
pub fn import_triangles(
    name: &Path,
    positions: PositionRows<'_>,
    triangles: &[[u32; 3]],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    monitor.stage("import", Some(triangles.len() as u64));
    check_triangles(triangles.len() as u64)?;
    check_rows(positions.len() as u64)?;
    check_indices(name, positions.len(), triangles)?;
    let wanted = wanted.into();
    let (rows, rounded) = match positions {
        PositionRows::F32(rows) => (Cow::Borrowed(rows), Rounded::default()),
        PositionRows::F64(exact) => {
            let rows: Vec<[f32; 3]> = exact.par_iter().map(|p| p.map(|x| x as f32)).collect();
            let again = || exact.to_vec();
            let positions = wanted.kept_positions();
            let rounded = rounding::check((&rows, triangles), Some(&again), positions, monitor);
            (Cow::Owned(rows), rounded)
        }
    };
    let (corners, all) = (triangles.to_vec(), wanted.vertices);
    let welded = weld_and_count(&[&rows], rounded.exact, corners, None, all, monitor, |_, row| {
        let triangle = triangles.iter().position(|corners| corners.contains(&(row as u32)));
        let message = format!("expected finite coordinates, found {:?} at position {row}", rows[row]);
        let hint = "leave out the triangles with positions that are not finite";
        input_error(NON_FINITE, place(name, triangle.unwrap_or_default()), message, hint)
    })?;
    monitor.advance(triangles.len() as u64);
    let report = Report {
        format: MEMORY_FORMAT.to_owned(),
        rounding: rounded.rounding,
        avoided_rounding: rounded.avoided,
        ..welded.report
    };
    Ok((welded.mesh, report))
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
