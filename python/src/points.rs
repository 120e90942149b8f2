//! Queries by points: containment, winding numbers, closest points and distances.

use crate::output::{HitArrays, chunks, chunks_of, numbers};
use crate::rays::Vectors;
use crate::scene::NativeScene;
use crate::work;
use bth::rays::{Hit, PrimitiveRef};
use numpy::PyReadwriteArray1;
use pyo3::prelude::*;
use std::ops::Range;

/// The points of a range.
fn read(points: crate::rays::Rows<'_>, range: Range<usize>) -> Vec<[f32; 3]> {
    let mut read = vec![[0.0; 3]; range.len()];
    points.each(range, |i, point| read[i] = point);
    read
}

/// Whether points lie inside of closed surfaces.
#[pyfunction]
pub(crate) fn contains(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let jobs = chunks_of(numbers(&mut out, points.len())?);
    work::run(py, threads, jobs, |(range, inside)| {
        scene.read().contains_batch(&read(points, range), inside);
    })
}

/// Winding numbers of points.
#[pyfunction]
pub(crate) fn winding(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, i32>,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let jobs = chunks_of(numbers(&mut out, points.len())?);
    work::run(py, threads, jobs, |(range, winding)| {
        scene.read().winding_batch(&read(points, range), winding);
    })
}

/// Signed distances of points, negative inside.
#[pyfunction]
pub(crate) fn signed_distance(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, f32>,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let jobs = chunks_of(numbers(&mut out, points.len())?);
    work::run(py, threads, jobs, |(range, distances)| {
        scene.read().signed_distance_batch(&read(points, range), distances);
    })
}

/// Closest points within a radius: in the place of t their distances; and their positions, three numbers a point.
#[pyfunction]
pub(crate) fn closest(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    radius: f32,
    threads: usize,
    mut out: HitArrays<'_>,
    mut positions: PyReadwriteArray1<'_, f32>,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let mut columns = out.columns(points.len())?;
    let mut positions = numbers(&mut positions, points.len() * 3)?;
    let jobs = chunks(points.len(), |rows| {
        (columns.split_off(rows), positions.split_off_mut(..rows * 3).expect("three numbers a point"))
    });
    work::run(py, threads, jobs, |(range, (mut columns, positions))| {
        let points = read(points, range);
        let mut found = vec![None; points.len()];
        scene.read().closest_batch(&points, radius, &mut found);
        let hit = |c: &Option<bth::Closest>| match c {
            Some(c) => Hit { t: c.distance, u: c.u, v: c.v, primitive: c.primitive },
            None => Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: PrimitiveRef::NONE },
        };
        columns.store(&found.iter().map(hit).collect::<Vec<_>>());
        let (rows, _) = positions.as_chunks_mut::<3>();
        for (row, found) in rows.iter_mut().zip(&found) {
            *row = found.map_or([f32::NAN; 3], |c| c.point);
        }
    })
}
