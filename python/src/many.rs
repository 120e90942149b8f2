//! Queries that return several hits of a ray, or a number of them.

use crate::output::{chunks, chunks_of, numbers};
use crate::rays::RayArrays;
use crate::scene::NativeScene;
use crate::work;
use bth::rays::Hit;
use bth::{Accept, Crossings, Cull};
use numpy::{IntoPyArray, PyArray1, PyReadwriteArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What rays may hit: a mask, and the side of triangles that they pass.
pub(crate) fn accept(mask: u32, cull: &str) -> PyResult<Accept<'static>> {
    let cull = match cull {
        "none" => Cull::None,
        "back" => Cull::Back,
        "front" => Cull::Front,
        other => {
            let message = format!("cull: expected None, 'back' or 'front', got '{other}'");
            return Err(PyValueError::new_err(message));
        }
    };
    Ok(Accept { mask, cull, filter: None })
}

/// Arrays of t, u, v, instance and triangle.
type Columns<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
);

/// All hits of rays, or the nearest `most` of each: the number of each ray's, and those of all rays one after the other.
#[pyfunction]
pub(crate) fn all_hits<'py>(
    py: Python<'py>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    most: Option<usize>,
    mask: u32,
    cull: &str,
    threads: usize,
    mut counts: PyReadwriteArray1<'_, u64>,
) -> PyResult<Columns<'py>> {
    let (scene, rays, accept) = (scene.get()?, rays.rays()?, accept(mask, cull)?);
    let counts = numbers(&mut counts, rays.len())?;
    let mut parts: Vec<Vec<Hit>> = Vec::new();
    parts.resize_with(rays.len().div_ceil(crate::rays::CHUNK), Vec::new);
    let mut rest = parts.iter_mut();
    let mut rows = counts;
    let jobs = chunks(rays.len(), |count| {
        let counts = rows.split_off_mut(..count).expect("a count for each ray");
        (counts, rest.next().expect("a part for each chunk"))
    });
    work::run(py, threads, jobs, |(range, (counts, hits))| {
        let (mut read, mut of_ray) = (Vec::new(), Vec::new());
        rays.read(range, &mut read);
        let scene = scene.read();
        for (ray, count) in read.iter().zip(counts) {
            match most {
                None => scene.all_hits(ray, &accept, &mut of_ray),
                Some(most) => scene.nearest_hits(ray, most, &accept, &mut of_ray),
            }
            *count = of_ray.len() as u64;
            hits.extend_from_slice(&of_ray);
        }
    })?;
    let hits = || parts.iter().flatten();
    Ok((
        hits().map(|h| h.t).collect::<Vec<_>>().into_pyarray(py),
        hits().map(|h| h.u).collect::<Vec<_>>().into_pyarray(py),
        hits().map(|h| h.v).collect::<Vec<_>>().into_pyarray(py),
        hits().map(|h| h.primitive.instance).collect::<Vec<_>>().into_pyarray(py),
        hits().map(|h| h.primitive.triangle).collect::<Vec<_>>().into_pyarray(py),
    ))
}

/// Number of hits of rays.
#[pyfunction]
pub(crate) fn count(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    mask: u32,
    cull: &str,
    threads: usize,
    mut out: PyReadwriteArray1<'_, u64>,
) -> PyResult<()> {
    let (scene, rays, accept) = (scene.get()?, rays.rays()?, accept(mask, cull)?);
    let jobs = chunks_of(numbers(&mut out, rays.len())?);
    work::run(py, threads, jobs, |(range, counts)| {
        let mut read = Vec::new();
        rays.read(range, &mut read);
        let scene = scene.read();
        for (ray, count) in read.iter().zip(counts) {
            *count = scene.count_hits(ray, &accept) as u64;
        }
    })
}

/// Crossings of surfaces by rays: their numbers, and outward ones minus inward ones.
#[pyfunction]
pub(crate) fn crossings(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    threads: usize,
    mut count: PyReadwriteArray1<'_, u32>,
    mut winding: PyReadwriteArray1<'_, i32>,
) -> PyResult<()> {
    let (scene, rays) = (scene.get()?, rays.rays()?);
    let (mut count, mut winding) = (numbers(&mut count, rays.len())?, numbers(&mut winding, rays.len())?);
    let jobs = chunks(rays.len(), |rows| {
        let part = "a result for each ray";
        (count.split_off_mut(..rows).expect(part), winding.split_off_mut(..rows).expect(part))
    });
    work::run(py, threads, jobs, |(range, (count, winding))| {
        let mut read = Vec::new();
        rays.read(range, &mut read);
        let mut found = vec![Crossings::default(); read.len()];
        scene.read().crossings_batch(&read, &mut found);
        for (i, found) in found.iter().enumerate() {
            (count[i], winding[i]) = (found.count, found.winding);
        }
    })
}
