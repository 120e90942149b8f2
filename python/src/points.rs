//! Queries by points: containment, winding numbers, closest points and distances.

use crate::output::{HitArrays, chunks, chunks_of, numbers, split_off};
use crate::rays::Vectors;
use crate::scene::NativeScene;
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef};
use numpy::{Element, PyReadwriteArray1};
use pyo3::prelude::*;
use std::ops::Range;

/// The points of a range.
fn read(points: crate::rays::Rows<'_>, range: Range<usize>) -> Vec<[f32; 3]> {
    let mut read = vec![[0.0; 3]; range.len()];
    points.each(range, |i, point| read[i] = point);
    read
}

/// Stores a number for each point.
fn store_each<T: Element + Send>(
    py: Python<'_>,
    scene: &NativeScene,
    points: &Vectors<'_>,
    threads: usize,
    out: &mut PyReadwriteArray1<'_, T>,
    query: impl Fn(&Scene, &[[f32; 3]], &mut [T]) + Sync,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let jobs = chunks_of(numbers(out, points.len())?);
    scene.run(py, threads, jobs, |scene, (range, out), watch| {
        let points = read(points, range);
        watch.in_parts(points.len(), |part| query(scene, &points[part.clone()], &mut out[part]));
    })
}

/// Stores which points lie inside of closed surfaces.
#[pyfunction]
pub(crate) fn contains(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    store_each(py, scene, &points, threads, &mut out, Scene::contains_batch)
}

/// Stores winding numbers of points.
#[pyfunction]
pub(crate) fn winding(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, i32>,
) -> PyResult<()> {
    store_each(py, scene, &points, threads, &mut out, Scene::winding_batch)
}

/// Stores signed distances of points, negative inside.
#[pyfunction]
pub(crate) fn signed_distance(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, f32>,
) -> PyResult<()> {
    store_each(py, scene, &points, threads, &mut out, Scene::signed_distance_batch)
}

/// Stores closest points within a radius: their distances in the column of t; their positions,
/// three numbers a point; and on what of the triangle they lie, a [`bth::Feature::code`].
#[pyfunction]
pub(crate) fn closest(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    radius: f32,
    threads: usize,
    mut out: HitArrays<'_>,
    mut positions: PyReadwriteArray1<'_, f32>,
    mut features: PyReadwriteArray1<'_, u8>,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.rows()?);
    let mut columns = out.columns(points.len())?;
    let mut positions = numbers(&mut positions, points.len() * 3)?;
    let mut features = numbers(&mut features, points.len())?;
    let jobs = chunks(points.len(), |rows| {
        (columns.split_off(rows), split_off(&mut positions, rows * 3), split_off(&mut features, rows))
    });
    scene.run(py, threads, jobs, |scene, (range, (mut columns, positions, features)), watch| {
        let points = read(points, range);
        let mut found = vec![None; points.len()];
        watch.in_parts(points.len(), |part| {
            scene.closest_batch(&points[part.clone()], radius, &mut found[part]);
        });
        let hit = |c: &Option<bth::Closest>| match c {
            Some(c) => Hit { t: c.distance, u: c.u, v: c.v, primitive: c.primitive },
            None => Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: PrimitiveRef::NONE },
        };
        columns.store(&found.iter().map(hit).collect::<Vec<_>>());
        let (rows, _) = positions.as_chunks_mut::<3>();
        for (i, found) in found.iter().enumerate() {
            rows[i] = found.map_or([f32::NAN; 3], |c| c.point);
            features[i] = found.map_or(0, |c| c.feature.code() as u8);
        }
    })
}
