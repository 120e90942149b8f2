//! Queries that return several hits of a ray, or a number of them.

use crate::conditions::Conditions;
use crate::output::{Part, Parts, chunks, chunks_of, numbers};
use crate::rays::{RayArrays, Rays, with_rays};
use crate::scene::NativeScene;
use crate::work::Watch;
use bth::Crossings;
use bth::rays::Hit;
use numpy::{PyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use std::ops::Range;

/// Arrays of t, u, v, instance and triangle.
type Columns<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
);

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
        let (scene, conditions) = (scene.get()?, conditions.checked()?);
        let counts = numbers(&mut counts, rays.len())?;
        let mut parts = Parts::new(rays.len());
        let jobs = parts.jobs(counts);
        let each = |scene: &bth::Scene,
                    (range, (counts, mut hits)): (Range<usize>, (&mut [u64], Part<'_, Hit>)),
                    watch: &Watch<'_>| {
            if hits.is_full() {
                return;
            }
            let (mut read, mut of_ray) = (Vec::new(), Vec::new());
            rays.read(range.clone(), &mut read);
            conditions.each(scene, range.start, &read, watch, |i, ray, accept| {
                match most {
                    None => scene.all_hits(ray, accept, &mut of_ray),
                    Some(most) => scene.nearest_hits(ray, most, accept, &mut of_ray),
                }
                counts[i] = of_ray.len() as u64;
                hits.append(&of_ray);
            });
        };
        scene.run(py, conditions.threads(threads), jobs, each)?;
        conditions.finish()?;
        Ok((
            parts.column(py, |h| h.t)?,
            parts.column(py, |h| h.u)?,
            parts.column(py, |h| h.v)?,
            parts.column(py, |h| h.primitive.instance)?,
            parts.column(py, |h| h.primitive.triangle)?,
        ))
    })
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
        let (scene, conditions) = (scene.get()?, conditions.checked()?);
        let jobs = chunks_of(numbers(&mut out, rays.len())?);
        scene.run(py, conditions.threads(threads), jobs, |scene, (range, counts), watch| {
            let mut read = Vec::new();
            rays.read(range.clone(), &mut read);
            conditions.each(scene, range.start, &read, watch, |i, ray, accept| {
                counts[i] = scene.count_hits(ray, accept) as u64;
            });
        })?;
        conditions.finish()
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
