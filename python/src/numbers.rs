//! Arrays of numpy as numbers of f32 or f64, a chunk at a time, so that what is converted stays in
//! the cache until it is traced.

use bth::rays::Hit;
use bth::{Scene, TraceRay};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{Element, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::Range;

/// Number of rays or points of a chunk: enough that rays are traced together well, and few enough
/// that they and their hits fit into a core's cache.
pub(crate) const CHUNK: usize = 4096;

/// f32 or f64: the numbers of a query and of its answers.
pub(crate) trait Number: Element + Copy + Default + From<f32> + Into<f64> + Send + Sync {
    /// The number, rounded if it must be.
    fn of(number: f64) -> Self;

    /// The t of a ray's hit.
    fn t<R: TraceRay>(scene: &Scene, ray: &R, hit: &Hit) -> Self;

    /// Sorts hits, which are in the order of their t in f32, by their t.
    fn sort<T>(hits: &mut [T], t: impl Fn(&T) -> Self);
}

impl Number for f32 {
    #[inline(always)]
    fn of(number: f64) -> f32 {
        number as f32
    }

    #[inline(always)]
    fn t<R: TraceRay>(_scene: &Scene, _ray: &R, hit: &Hit) -> f32 {
        hit.t
    }

    #[inline(always)]
    fn sort<T>(_hits: &mut [T], _t: impl Fn(&T) -> f32) {}
}

impl Number for f64 {
    #[inline(always)]
    fn of(number: f64) -> f64 {
        number
    }

    fn t<R: TraceRay>(scene: &Scene, ray: &R, hit: &Hit) -> f64 {
        scene.hit_f64(ray, hit).t
    }

    fn sort<T>(hits: &mut [T], t: impl Fn(&T) -> f64) {
        hits.sort_by(|a, b| t(a).total_cmp(&t(b)));
    }
}

/// A borrowed array of three numbers a row, in either precision.
#[derive(FromPyObject)]
pub(crate) enum Vectors<'py> {
    Single(PyReadonlyArray2<'py, f32>),
    Double(PyReadonlyArray2<'py, f64>),
}

/// A number for all rays, or an array with one for each.
#[derive(FromPyObject)]
pub(crate) enum Bound1<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
    Same(f64),
}

/// A view of rows that may be shared between threads.
#[derive(Clone, Copy)]
pub(crate) enum Rows<'a> {
    Single(ArrayView2<'a, f32>),
    Double(ArrayView2<'a, f64>),
}

/// A view of numbers that may be shared between threads.
#[derive(Clone, Copy)]
pub(crate) enum Numbers<'a> {
    Single(ArrayView1<'a, f32>),
    Double(ArrayView1<'a, f64>),
    Same(f64),
}

impl Vectors<'_> {
    /// The rows, which must have three numbers.
    pub(crate) fn rows(&self) -> PyResult<Rows<'_>> {
        let (rows, columns) = match self {
            Self::Single(a) => (Rows::Single(a.as_array()), a.as_array().ncols()),
            Self::Double(a) => (Rows::Double(a.as_array()), a.as_array().ncols()),
        };
        if columns != 3 {
            return Err(PyValueError::new_err(format!("expected three numbers a row, got {columns}")));
        }
        Ok(rows)
    }
}

impl Rows<'_> {
    pub(crate) fn is_double(&self) -> bool {
        matches!(self, Self::Double(_))
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Single(a) => a.nrows(),
            Self::Double(a) => a.nrows(),
        }
    }

    /// Calls `put` with the row within the range and the three numbers of each row of it.
    #[inline(always)]
    pub(crate) fn each<N: Number>(&self, range: Range<usize>, put: impl FnMut(usize, [N; 3])) {
        match self {
            Self::Single(a) => each_row(a, range, N::from, put),
            Self::Double(a) => each_row(a, range, N::of, put),
        }
    }
}

#[inline(always)]
fn each_row<T: Copy, N>(
    rows: &ArrayView2<'_, T>,
    range: Range<usize>,
    convert: impl Fn(T) -> N,
    mut put: impl FnMut(usize, [N; 3]),
) {
    if let Some(numbers) = rows.as_slice() {
        let (numbers, _) = numbers[range.start * 3..range.end * 3].as_chunks::<3>();
        for (i, &row) in numbers.iter().enumerate() {
            put(i, row.map(&convert));
        }
        return;
    }
    for (i, row) in range.enumerate() {
        put(i, [0, 1, 2].map(|column| convert(rows[[row, column]])));
    }
}

impl Bound1<'_> {
    /// The numbers.
    pub(crate) fn numbers(&self) -> Numbers<'_> {
        match self {
            Self::Single(a) => Numbers::Single(a.as_array()),
            Self::Double(a) => Numbers::Double(a.as_array()),
            Self::Same(x) => Numbers::Same(*x),
        }
    }
}

impl Numbers<'_> {
    /// True for an array of f64. One number takes the type of the arrays.
    pub(crate) fn is_double(&self) -> bool {
        matches!(self, Self::Double(_))
    }

    /// How many there are; `None` for one number for all.
    pub(crate) fn len(&self) -> Option<usize> {
        match self {
            Self::Single(a) => Some(a.len()),
            Self::Double(a) => Some(a.len()),
            Self::Same(_) => None,
        }
    }

    /// Calls `put` with the row within the range and the number of each row of it.
    #[inline(always)]
    pub(crate) fn each<N: Number>(&self, range: Range<usize>, mut put: impl FnMut(usize, N)) {
        match self {
            Self::Single(a) => range.enumerate().for_each(|(i, row)| put(i, a[row].into())),
            Self::Double(a) => range.enumerate().for_each(|(i, row)| put(i, N::of(a[row]))),
            Self::Same(x) => (0..range.len()).for_each(|i| put(i, N::of(*x))),
        }
    }
}
