//! Queries that return several hits of a ray, or a number of them.

use crate::conditions::Conditions;
use crate::numbers::Number;
use crate::output::{Job, Parts, chunks, chunks_of, numbers};
use crate::rays::{RayArrays, Rays, with_rays};
use crate::scene::NativeScene;
use crate::work::Watch;
use bth::Crossings;
use bth::rays::{Hit, PrimitiveRef};
use numpy::{PyArray1, PyReadwriteArray1};
use pyo3::prelude::*;

/// Arrays of t, u, v, instance and triangle.
type Columns<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
);

/// A hit with its t as it is returned.
#[derive(Clone, Copy)]
struct Found<N> {
    t: N,
    u: f32,
    v: f32,
    primitive: PrimitiveRef,
}

/// All hits of rays, or the nearest `most` of each: their number for each ray, and the hits of all
/// rays one after the other.
#[pyfunction]
pub(crate) fn all_hits<'py>(
    py: Python<'py>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    most: Option<usize>,
    conditions: Conditions,
    threads: usize,
    mut counts: PyReadwriteArray1<'_, u64>,
) -> PyResult<Columns<'py>> {
    with_rays!(rays, rays => {
        let counts = numbers(&mut counts, rays.len())?;
        all_hits_of(py, scene, rays, most, conditions, threads, counts)
    })
}

fn all_hits_of<'py, S: Rays>(
    py: Python<'py>,
    scene: &NativeScene,
    rays: S,
    most: Option<usize>,
    conditions: Conditions,
    threads: usize,
    counts: &mut [u64],
) -> PyResult<Columns<'py>> {
    let (scene, conditions) = (scene.get()?, conditions.checked()?);
    let mut parts = Parts::new(rays.len());
    let jobs = parts.jobs(counts);
    let each =
        |scene: &bth::Scene, (range, (counts, mut found)): Job<'_, Found<S::Number>>, watch: &Watch<'_>| {
            if found.is_full() {
                return;
            }
            let (mut read, mut of_ray, mut listed) = (Vec::new(), Vec::new(), Vec::new());
            rays.read(range.clone(), &mut read);
            conditions.each::<S>(scene, range.start, &read, watch, |i, ray, accept| {
                match most {
                    None => scene.all_hits(ray, accept, &mut of_ray),
                    Some(most) => scene.nearest_hits(ray, most, accept, &mut of_ray),
                }
                counts[i] = of_ray.len() as u64;
                listed.clear();
                listed.extend(of_ray.iter().map(|hit| {
                    let Hit { u, v, primitive, .. } = *hit;
                    Found { t: S::Number::t(scene, ray, hit), u, v, primitive }
                }));
                S::Number::sort(&mut listed, |found| found.t);
                found.append(&listed);
            });
        };
    scene.run(py, conditions.threads(threads), jobs, each)?;
    conditions.finish()?;
    Ok((
        parts.column(py, |h| h.t)?.into_any(),
        parts.column(py, |h| h.u)?,
        parts.column(py, |h| h.v)?,
        parts.column(py, |h| h.primitive.instance)?,
        parts.column(py, |h| h.primitive.triangle)?,
    ))
}

/// Number of hits of rays.
#[pyfunction]
pub(crate) fn count(
    py: Python<'_>,
    scene: &NativeScene,
    rays: RayArrays<'_>,
    conditions: Conditions,
    threads: usize,
    mut out: PyReadwriteArray1<'_, u64>,
) -> PyResult<()> {
    with_rays!(rays, rays => {
        let out = numbers(&mut out, rays.len())?;
        count_of(py, scene, rays, conditions, threads, out)
    })
}

fn count_of<S: Rays>(
    py: Python<'_>,
    scene: &NativeScene,
    rays: S,
    conditions: Conditions,
    threads: usize,
    out: &mut [u64],
) -> PyResult<()> {
    let (scene, conditions) = (scene.get()?, conditions.checked()?);
    scene.run(py, conditions.threads(threads), chunks_of(out), |scene, (range, counts), watch| {
        let mut read = Vec::new();
        rays.read(range.clone(), &mut read);
        conditions.each::<S>(scene, range.start, &read, watch, |i, ray, accept| {
            counts[i] = scene.count_hits(ray, accept) as u64;
        });
    })?;
    conditions.finish()
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
    with_rays!(rays, rays => {
        let scene = scene.get()?;
        let (mut count, mut winding) = (numbers(&mut count, rays.len())?, numbers(&mut winding, rays.len())?);
        let jobs = chunks(rays.len(), |rows| {
            let part = "a result for each ray";
            (count.split_off_mut(..rows).expect(part), winding.split_off_mut(..rows).expect(part))
        });
        scene.run(py, threads, jobs, |scene, (range, (count, winding)), watch| {
            let mut read = Vec::new();
            rays.read(range, &mut read);
            let mut found = vec![Crossings::default(); read.len()];
            watch.in_parts(read.len(), |part| scene.crossings_batch(&read[part.clone()], &mut found[part]));
            for (i, found) in found.iter().enumerate() {
                (count[i], winding[i]) = (found.count, found.winding);
            }
        })
    })
}
