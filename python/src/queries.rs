//! Queries by rays: the nearest hit, and whether there is one.

use crate::conditions::Conditions;
use crate::output::{HitArrays, chunks, chunks_of, numbers};
use crate::rays::{RayArrays, StartArrays, Starts};
use crate::scene::NativeScene;
use bth::rays::{Hit, PrimitiveRef, Ray};
use numpy::PyReadwriteArray1;
use pyo3::prelude::*;
use std::cell::RefCell;
use std::ops::Range;

/// What a thread needs for a chunk, kept from chunk to chunk.
#[derive(Default)]
struct Scratch {
    rays: Vec<Ray>,
    starts: Vec<PrimitiveRef>,
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
    start: Option<StartArrays<'_>>,
    conditions: Conditions,
    threads: usize,
    mut out: HitArrays<'_>,
) -> PyResult<()> {
    let (scene, rays, conditions) = (scene.get()?, rays.rays()?, conditions.checked()?);
    let starts = start.as_ref().map(|s| Starts::new(s, rays.len())).transpose()?;
    let mut columns = out.columns(rays.len())?;
    let jobs = chunks(rays.len(), |rows| columns.split_off(rows));
    scene.run(py, conditions.threads(threads), jobs, |scene, (range, mut columns), watch| {
        let mut scratch = SCRATCH.take();
        let Scratch { rays: read, starts: from, hits } = &mut scratch;
        rays.read(range.clone(), read);
        hits.resize(range.len(), Hit::MISS);
        let from = read_starts(starts, range.clone(), from);
        if conditions.filter.is_none() {
            scene.batch(read).from(from).accept(&conditions.accept).nearest(hits);
        } else {
            conditions.each(scene, range.start, read, watch, |i, ray, accept| {
                hits[i] = scene.nearest_accepted(ray, accept).unwrap_or(Hit::MISS);
            });
        }
        columns.store(hits);
        SCRATCH.set(scratch);
    })?;
    conditions.finish()
}

/// Whether rays hit anything, into an array.
#[pyfunction]
pub(crate) fn any(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    start: Option<StartArrays<'_>>,
    conditions: Conditions,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    let (scene, rays, conditions) = (scene.get()?, rays.rays()?, conditions.checked()?);
    let starts = start.as_ref().map(|s| Starts::new(s, rays.len())).transpose()?;
    let jobs = chunks_of(numbers(&mut out, rays.len())?);
    scene.run(py, conditions.threads(threads), jobs, |scene, (range, found), watch| {
        let mut scratch = SCRATCH.take();
        let Scratch { rays: read, starts: from, .. } = &mut scratch;
        rays.read(range.clone(), read);
        let from = read_starts(starts, range.clone(), from);
        if conditions.filter.is_none() {
            scene.batch(read).from(from).accept(&conditions.accept).any(found);
        } else {
            conditions.each(scene, range.start, read, watch, |i, ray, accept| {
                found[i] = scene.any_accepted(ray, accept);
            });
        }
        SCRATCH.set(scratch);
    })?;
    conditions.finish()
}

fn read_starts<'a>(
    starts: Option<Starts<'_>>,
    range: Range<usize>,
    read: &'a mut Vec<PrimitiveRef>,
) -> Option<&'a [PrimitiveRef]> {
    starts?.read(range, read);
    Some(read)
}
