//! Queries by rays: the nearest hit, and whether there is one.

use crate::conditions::Conditions;
use crate::errors::start_error;
use crate::numbers::Number;
use crate::output::{HitArrays, chunks, chunks_of, numbers};
use crate::rays::{Buffers, RayArrays, Rays, StartArrays, with_rays};
use crate::scene::NativeScene;
use bth::rays::Hit;
use numpy::PyReadwriteArray1;
use pyo3::prelude::*;
use std::cell::RefCell;

/// What a thread needs for a chunk, kept from chunk to chunk.
#[derive(Default)]
struct Scratch {
    buffers: Buffers,
    hits: Vec<Hit>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Nearest hits of rays, into arrays.
#[pyfunction]
pub(crate) fn nearest(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    conditions: Conditions,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    with_rays!(rays, rays => nearest_of(py, scene, rays, conditions, threads, out))
}

fn nearest_of<S: Rays>(
    py: Python<'_>,
    scene: &NativeScene,
    rays: S,
    conditions: Conditions,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let (scene, conditions) = (scene.get()?, conditions.checked()?);
    let mut out = HitArrays::<S::Number>::of(out)?;
    let mut columns = out.columns(rays.len())?;
    let jobs = chunks(rays.len(), |rows| columns.split_off(rows));
    scene.run(py, conditions.threads(threads), jobs, |scene, (range, mut columns), watch| {
        let mut scratch = SCRATCH.take();
        let Scratch { buffers, hits } = &mut scratch;
        let read = rays.buffer(buffers);
        rays.read(range.clone(), read);
        hits.resize(range.len(), Hit::MISS);
        if conditions.filter.is_none() {
            scene.batch(read).accept(&conditions.accept).nearest(hits);
        } else {
            conditions.each::<S>(scene, range.start, read, watch, |i, ray, accept| {
                hits[i] = scene.nearest_accepted(ray, accept).unwrap_or(Hit::MISS);
            });
        }
        columns.store(hits, |i, hit| Number::t(scene, &read[i], hit));
        SCRATCH.set(scratch);
    })?;
    conditions.finish()
}

/// Stores which rays hit anything.
#[pyfunction]
pub(crate) fn any(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    conditions: Conditions,
    threads: usize,
    out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    with_rays!(rays, rays => any_of(py, scene, rays, conditions, threads, out))
}

fn any_of<S: Rays>(
    py: Python<'_>,
    scene: &NativeScene,
    rays: S,
    conditions: Conditions,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    let (scene, conditions) = (scene.get()?, conditions.checked()?);
    let jobs = chunks_of(numbers(&mut out, rays.len())?);
    scene.run(py, conditions.threads(threads), jobs, |scene, (range, found), watch| {
        let mut scratch = SCRATCH.take();
        let read = rays.buffer(&mut scratch.buffers);
        rays.read(range.clone(), read);
        if conditions.filter.is_none() {
            scene.batch(read).accept(&conditions.accept).any(found);
        } else {
            conditions.each::<S>(scene, range.start, read, watch, |i, ray, accept| {
                found[i] = scene.any_accepted(ray, accept);
            });
        }
        SCRATCH.set(scratch);
    })?;
    conditions.finish()
}

/// Fails if rays cannot start at one of the points, and says why.
#[pyfunction]
pub(crate) fn check_start(py: Python<'_>, scene: &NativeScene, start: StartArrays<'_>) -> PyResult<()> {
    let starts = start.starts()?;
    let bad = scene.with(py, |scene| {
        let failure = |row: usize| scene.check_start(&starts.get(row)).err().map(|error| (row, error));
        (0..starts.len()).find_map(failure)
    })?;
    match bad {
        None => Ok(()),
        Some((row, error)) => Err(start_error((starts.len() > 1).then_some(row), &error)),
    }
}
