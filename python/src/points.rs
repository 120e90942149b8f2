//! Queries by points: containment, winding numbers, closest points and distances.

use crate::numbers::{Number, Rows, Vectors};
use crate::output::{HitArrays, chunks, chunks_of, numbers, split_off};
use crate::scene::NativeScene;
use bth::rays::Hit;
use bth::{Closest, Closest64, Feature, Scene};
use numpy::{Element, PyReadwriteArray1};
use pyo3::prelude::*;
use std::ops::Range;

/// The points of a range.
fn read<N: Number>(points: Rows<'_>, range: Range<usize>) -> Vec<[N; 3]> {
    let mut read = vec![[N::default(); 3]; range.len()];
    points.each(range, |i, point| read[i] = point);
    read
}

/// Stores a number for each point. `N` is the type of the array of points.
fn store_each<N: Number, T: Element + Send>(
    py: Python<'_>,
    scene: &NativeScene,
    points: Rows<'_>,
    threads: usize,
    out: &Bound<'_, PyAny>,
    query: impl Fn(&Scene, &[[N; 3]], &mut [T]) + Sync + Send,
) -> PyResult<()> {
    let mut out: PyReadwriteArray1<'_, T> = out.extract()?;
    let jobs = chunks_of(numbers(&mut out, points.len())?);
    scene.get()?.run(py, threads, jobs, |scene, (range, out), watch| {
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
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    match points.rows()? {
        points @ Rows::Single(_) => store_each(py, scene, points, threads, out, Scene::contains_batch),
        points @ Rows::Double(_) => store_each(py, scene, points, threads, out, Scene::contains_batch_f64),
    }
}

/// Stores winding numbers of points.
#[pyfunction]
pub(crate) fn winding(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    match points.rows()? {
        points @ Rows::Single(_) => store_each(py, scene, points, threads, out, Scene::winding_batch),
        points @ Rows::Double(_) => store_each(py, scene, points, threads, out, Scene::winding_batch_f64),
    }
}

/// Stores signed distances of points, negative inside, in the numbers of the points.
#[pyfunction]
pub(crate) fn signed_distance(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    match points.rows()? {
        points @ Rows::Single(_) => store_each(py, scene, points, threads, out, Scene::signed_distance_batch),
        points @ Rows::Double(_) => {
            store_each(py, scene, points, threads, out, Scene::signed_distance_batch_f64)
        }
    }
}

/// Stores closest points within a radius, in the numbers of the points: their distances in the
/// column of t; their positions, three numbers a point; and on what of the triangle they lie, a
/// [`bth::Feature::code`]. `out` has the arrays of hits, positions and features.
#[pyfunction]
pub(crate) fn closest(
    py: Python<'_>,
    scene: &NativeScene,
    points: Vectors<'_>,
    radius: f64,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    match points.rows()? {
        points @ Rows::Single(_) => closest_of::<Closest>(py, scene, points, radius, threads, out),
        points @ Rows::Double(_) => closest_of::<Closest64>(py, scene, points, radius, threads, out),
    }
}

fn closest_of<C: ClosestPoint>(
    py: Python<'_>,
    scene: &NativeScene,
    points: Rows<'_>,
    radius: f64,
    threads: usize,
    out: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let mut hits = HitArrays::<C::Number>::of(&out.get_item(0)?)?;
    let mut positions: PyReadwriteArray1<'_, C::Number> = out.get_item(1)?.extract()?;
    let mut features: PyReadwriteArray1<'_, u8> = out.get_item(2)?.extract()?;
    let mut columns = hits.columns(points.len())?;
    let mut positions = numbers(&mut positions, points.len() * 3)?;
    let mut features = numbers(&mut features, points.len())?;
    let jobs = chunks(points.len(), |rows| {
        (columns.split_off(rows), split_off(&mut positions, rows * 3), split_off(&mut features, rows))
    });
    let radius = C::Number::of(radius);
    scene.get()?.run(py, threads, jobs, |scene, (range, (mut columns, positions, features)), watch| {
        let points = read(points, range);
        let mut found = vec![None; points.len()];
        watch.in_parts(points.len(), |part| {
            C::query(scene, &points[part.clone()], radius, &mut found[part]);
        });
        let hits: Vec<Hit> = found.iter().map(|c: &Option<C>| c.map_or(Hit::MISS, |c| c.hit())).collect();
        columns.store(&hits, |i, _| found[i].map_or(C::Number::of(f64::INFINITY), |c| c.distance()));
        let (rows, _) = positions.as_chunks_mut::<3>();
        for (i, found) in found.iter().enumerate() {
            rows[i] = found.map_or([C::Number::of(f64::NAN); 3], |c| c.point());
            features[i] = found.map_or(0, |c| c.feature().code() as u8);
        }
    })
}

/// A closest point in f32 or f64.
trait ClosestPoint: Copy + Send {
    type Number: Number;

    fn query(scene: &Scene, points: &[[Self::Number; 3]], radius: Self::Number, found: &mut [Option<Self>]);

    fn distance(&self) -> Self::Number;

    fn point(&self) -> [Self::Number; 3];

    fn feature(&self) -> Feature;

    /// Triangle and weights.
    fn hit(&self) -> Hit;
}

/// Implements [`ClosestPoint`] by a query of [`Scene`].
macro_rules! closest_point {
    ($closest:ty, $number:ty, $query:ident) => {
        impl ClosestPoint for $closest {
            type Number = $number;

            fn query(scene: &Scene, points: &[[$number; 3]], radius: $number, found: &mut [Option<Self>]) {
                scene.$query(points, radius, found);
            }

            fn distance(&self) -> $number {
                self.distance
            }

            fn point(&self) -> [$number; 3] {
                self.point
            }

            fn feature(&self) -> Feature {
                self.feature
            }

            fn hit(&self) -> Hit {
                let (u, v) = (self.u as f32, self.v as f32);
                Hit { u, v, primitive: self.primitive, ..Hit::MISS }
            }
        }
    };
}
closest_point!(Closest, f32, closest_batch);
closest_point!(Closest64, f64, closest_batch_f64);
