//! Overlaps of triangles with boxes and balls.

use crate::output::{Part, Parts, chunks_of, numbers};
use crate::rays::{Bound1, Numbers, Rows, Vectors};
use crate::scene::NativeScene;
use crate::work::Watch;
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

/// A region.
#[derive(Clone, Copy, Default)]
struct Region {
    /// The lower end, or the centre.
    first: [f32; 3],
    upper: [f32; 3],
    /// `None` for a box.
    radius: Option<f32>,
}

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

    /// The regions of a range.
    fn read(&self, range: Range<usize>) -> Vec<Region> {
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
    let (scene, regions) = (scene.get()?, regions.regions()?);
    let jobs = chunks_of(numbers(&mut out, regions.len())?);
    scene.run(py, threads, jobs, |scene, (range, found), watch| {
        for (i, (region, found)) in regions.read(range).iter().zip(found).enumerate() {
            if i % REGIONS == 0 && watch.is_over() {
                return;
            }
            *found = match region.radius {
                None => scene.overlaps_box(region.first, region.upper),
                Some(radius) => scene.overlaps_sphere(region.first, radius),
            };
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
    let (scene, regions) = (scene.get()?, regions.regions()?);
    let rows = numbers(&mut counts, regions.len())?;
    let mut parts = Parts::new(regions.len());
    let jobs = parts.jobs(rows);
    let each = |scene: &bth::Scene,
                (range, (counts, mut all)): (Range<usize>, (&mut [u64], Part<'_, PrimitiveRef>)),
                watch: &Watch<'_>| {
        let (mut triangles, mut listed) = (Vec::new(), 0);
        for (i, (region, count)) in regions.read(range).iter().zip(counts).enumerate() {
            if all.is_full() {
                return;
            }
            if i % REGIONS == 0 || listed > TRIANGLES {
                listed = 0;
                if watch.is_over() {
                    return;
                }
            }
            match region.radius {
                None => scene.triangles_in_box(region.first, region.upper, &mut triangles),
                Some(radius) => scene.triangles_in_sphere(region.first, radius, &mut triangles),
            }
            *count = triangles.len() as u64;
            listed += triangles.len();
            all.append(&triangles);
        }
    };
    scene.run(py, threads, jobs, each)?;
    Ok((parts.column(py, |p| p.instance)?, parts.column(py, |p| p.triangle)?))
}
