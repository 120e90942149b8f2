//! Overlaps of triangles with boxes and balls.

use crate::numbers::{Bound1, Number, Numbers, Rows, Vectors};
use crate::output::{Job, Parts, chunks_of, numbers};
use crate::scene::NativeScene;
use bth::Scene;
use bth::rays::PrimitiveRef;
use numpy::{PyArray1, PyReadwriteArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::Range;

/// The arrays of a call: lower and upper ends of boxes, or centres and radii of balls.
#[derive(FromPyObject)]
pub(crate) enum RegionArrays<'py> {
    Boxes {
        #[pyo3(item(0))]
        lower: Vectors<'py>,
        #[pyo3(item(1))]
        upper: Vectors<'py>,
    },
    Balls {
        #[pyo3(item(0))]
        center: Vectors<'py>,
        #[pyo3(item(1))]
        radius: Bound1<'py>,
    },
}

/// Greatest numbers of regions, and of triangles in them, between two looks at whether the call
/// ends early. Most regions take little more time than a look at the clock.
const REGIONS: usize = 16;
const TRIANGLES: usize = 4096;

/// Regions that may be shared between threads.
#[derive(Clone, Copy)]
enum Regions<'a> {
    Boxes(Rows<'a>, Rows<'a>),
    Balls(Rows<'a>, Numbers<'a>),
}

/// A region in f32 or f64.
#[derive(Clone, Copy, Default)]
struct Region<N> {
    /// The lower end, or the centre.
    first: [N; 3],
    upper: [N; 3],
    /// `None` for a box.
    radius: Option<N>,
}

/// The queries about regions, in f32 or f64.
trait Regional: Number {
    fn overlaps(scene: &Scene, region: &Region<Self>) -> bool;

    fn triangles(scene: &Scene, region: &Region<Self>, found: &mut Vec<PrimitiveRef>);
}

/// Implements [`Regional`] by the queries of [`Scene`] about boxes and about balls.
macro_rules! regional {
    ($number:ty, $overlaps_box:ident, $overlaps_ball:ident, $in_box:ident, $in_ball:ident) => {
        impl Regional for $number {
            fn overlaps(scene: &Scene, region: &Region<$number>) -> bool {
                match region.radius {
                    None => scene.$overlaps_box(region.first, region.upper),
                    Some(radius) => scene.$overlaps_ball(region.first, radius),
                }
            }

            fn triangles(scene: &Scene, region: &Region<$number>, found: &mut Vec<PrimitiveRef>) {
                match region.radius {
                    None => scene.$in_box(region.first, region.upper, found),
                    Some(radius) => scene.$in_ball(region.first, radius, found),
                }
            }
        }
    };
}
regional!(f32, overlaps_box, overlaps_sphere, triangles_in_box, triangles_in_sphere);
regional!(f64, overlaps_box_f64, overlaps_sphere_f64, triangles_in_box_f64, triangles_in_sphere_f64);

impl RegionArrays<'_> {
    fn regions(&self) -> PyResult<Regions<'_>> {
        let (regions, one_length) = match self {
            Self::Boxes { lower, upper } => {
                let (lower, upper) = (lower.rows()?, upper.rows()?);
                (Regions::Boxes(lower, upper), lower.len() == upper.len())
            }
            Self::Balls { center, radius } => {
                let (center, radius) = (center.rows()?, radius.numbers());
                (Regions::Balls(center, radius), radius.len().is_none_or(|n| n == center.len()))
            }
        };
        if one_length { Ok(regions) } else { Err(PyValueError::new_err("the arrays differ in length")) }
    }
}

impl Regions<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Boxes(first, _) | Self::Balls(first, _) => first.len(),
        }
    }

    /// True if one of the arrays is f64.
    fn is_double(&self) -> bool {
        match self {
            Self::Boxes(lower, upper) => lower.is_double() || upper.is_double(),
            Self::Balls(center, radius) => center.is_double() || radius.is_double(),
        }
    }

    /// The regions of a range.
    fn read<N: Number>(&self, range: Range<usize>) -> Vec<Region<N>> {
        let mut read = vec![Region::default(); range.len()];
        match self {
            Self::Boxes(lower, upper) => {
                lower.each(range.clone(), |i, lower| read[i].first = lower);
                upper.each(range, |i, upper| read[i].upper = upper);
            }
            Self::Balls(center, radius) => {
                center.each(range.clone(), |i, center| read[i].first = center);
                radius.each(range, |i, radius| read[i].radius = Some(radius));
            }
        }
        read
    }
}

/// Stores which regions overlap triangles.
#[pyfunction]
pub(crate) fn overlaps(
    py: Python<'_>,
    scene: &NativeScene,
    regions: RegionArrays<'_>,
    threads: usize,
    mut out: PyReadwriteArray1<'_, bool>,
) -> PyResult<()> {
    let regions = regions.regions()?;
    let out = numbers(&mut out, regions.len())?;
    match regions.is_double() {
        false => overlaps_in::<f32>(py, scene, regions, threads, out),
        true => overlaps_in::<f64>(py, scene, regions, threads, out),
    }
}

fn overlaps_in<N: Regional>(
    py: Python<'_>,
    scene: &NativeScene,
    regions: Regions<'_>,
    threads: usize,
    out: &mut [bool],
) -> PyResult<()> {
    scene.get()?.run(py, threads, chunks_of(out), |scene, (range, found), watch| {
        for (i, (region, found)) in regions.read::<N>(range).iter().zip(found).enumerate() {
            if i % REGIONS == 0 && watch.is_over() {
                return;
            }
            *found = N::overlaps(scene, region);
        }
    })
}

/// The triangles that overlap regions: the number of each region's, and instances and triangles of
/// all one after the other.
#[pyfunction]
pub(crate) fn triangles_in<'py>(
    py: Python<'py>,
    scene: &NativeScene,
    regions: RegionArrays<'_>,
    threads: usize,
    mut counts: PyReadwriteArray1<'_, u64>,
) -> PyResult<(Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<u32>>)> {
    let regions = regions.regions()?;
    let rows = numbers(&mut counts, regions.len())?;
    let mut parts = Parts::new(regions.len());
    let jobs = parts.jobs(rows);
    match regions.is_double() {
        false => triangles_of::<f32>(py, scene, regions, threads, jobs)?,
        true => triangles_of::<f64>(py, scene, regions, threads, jobs)?,
    }
    Ok((parts.column(py, |p| p.instance)?, parts.column(py, |p| p.triangle)?))
}

fn triangles_of<N: Regional>(
    py: Python<'_>,
    scene: &NativeScene,
    regions: Regions<'_>,
    threads: usize,
    jobs: Vec<Job<'_, PrimitiveRef>>,
) -> PyResult<()> {
    scene.get()?.run(py, threads, jobs, |scene, (range, (counts, mut all)), watch| {
        let (mut triangles, mut listed) = (Vec::new(), 0);
        for (i, (region, count)) in regions.read::<N>(range).iter().zip(counts).enumerate() {
            if all.is_full() {
                return;
            }
            if i % REGIONS == 0 || listed > TRIANGLES {
                listed = 0;
                if watch.is_over() {
                    return;
                }
            }
            N::triangles(scene, region, &mut triangles);
            *count = triangles.len() as u64;
            listed += triangles.len();
            all.append(&triangles);
        }
    })
}
