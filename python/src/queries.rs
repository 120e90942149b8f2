//! Queries by rays: the nearest hit, whether there is one, and normals at hits.

use crate::output::{HitArrays, chunks, chunks_of, numbers};
use crate::rays::{RayArrays, StartArrays, Starts};
use crate::scene::NativeScene;
use crate::work;
use bth::rays::{Hit, PrimitiveRef, Ray};
use numpy::PyReadwriteArray1;
use numpy::ndarray::{Array2, ArrayView1};
use pyo3::exceptions::{PyIndexError, PyKeyError, PyValueError};
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
    threads: usize,
    mut out: HitArrays<'_>,
) -> PyResult<()> {
    let (scene, rays) = (scene.get()?, rays.rays()?);
    let starts = start.as_ref().map(|s| Starts::new(s, rays.len())).transpose()?;
    let mut columns = out.columns(rays.len())?;
    let jobs = chunks(rays.len(), |rows| columns.split_off(rows));
    work::run(py, threads, jobs, |(range, mut columns)| {
        let mut scratch = SCRATCH.take();
        let Scratch { rays: read, starts: from, hits } = &mut scratch;
        rays.read(range.clone(), read);
        hits.resize(range.len(), Hit::MISS);
        let from = read_starts(starts, range, from);
        scene.read().batch(read).from(from).nearest(hits);
        columns.store(hits);
        SCRATCH.set(scratch);
    })
}

/// Whether rays hit anything, into an array.
#[pyfunction]
pub(crate) fn any(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    start: Option<StartArrays<'_>>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    let (scene, rays) = (scene.get()?, rays.rays()?);
    let starts = start.as_ref().map(|s| Starts::new(s, rays.len())).transpose()?;
    let jobs = chunks_of(numbers(&mut out, rays.len())?);
    work::run(py, threads, jobs, |(range, found)| {
        let mut scratch = SCRATCH.take();
        let Scratch { rays: read, starts: from, .. } = &mut scratch;
        rays.read(range.clone(), read);
        let from = read_starts(starts, range, from);
        scene.read().batch(read).from(from).any(found);
        SCRATCH.set(scratch);
    })
}

fn read_starts<'a>(
    starts: Option<Starts<'_>>,
    range: Range<usize>,
    read: &'a mut Vec<PrimitiveRef>,
) -> Option<&'a [PrimitiveRef]> {
    starts?.read(range, read);
    Some(read)
}

/// Geometric normals in world space, twice as long as the areas of the triangles in object space; zeros for no triangle.
pub(crate) fn normals(
    scene: &bth::Scene,
    instances: ArrayView1<'_, u32>,
    triangles: ArrayView1<'_, u32>,
) -> PyResult<Array2<f64>> {
    if instances.len() != triangles.len() {
        return Err(PyValueError::new_err("as many instances as triangles"));
    }
    let mut normals = Array2::zeros((instances.len(), 3));
    for (row, (&instance, &triangle)) in instances.iter().zip(&triangles).enumerate() {
        let primitive = PrimitiveRef { instance, triangle };
        if primitive == PrimitiveRef::NONE {
            continue;
        }
        if instance >= scene.instance_count() {
            return Err(PyIndexError::new_err(format!("instance {instance} of {}", scene.instance_count())));
        }
        let object = scene.object(scene.object_of(instance));
        if object.triangles.is_empty() {
            return Err(PyKeyError::new_err("the file has been compiled without its geometry"));
        }
        let Some(corners) = object.triangles.get(triangle as usize) else {
            return Err(PyIndexError::new_err(format!("triangle {triangle} of {}", object.header.triangles)));
        };
        let [a, b, c] = corners.map(|v| object.positions[v as usize].map(f64::from));
        let (ab, ac): ([f64; 3], [f64; 3]) =
            (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
        let normal =
            [ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]];
        if !scene.instance(instance).visible {
            continue;
        }
        let world = scene.normal_to_world(instance, normal);
        for k in 0..3 {
            normals[[row, k]] = world[k];
        }
    }
    Ok(normals)
}
