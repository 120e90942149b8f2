//! Arrays of numpy to rays and points, a chunk at a time, so that what is converted stays in the cache until it is traced.

use bth::rays::{PrimitiveRef, Ray};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::Range;

/// Number of rays or points of a chunk: enough that rays are traced together well, and few enough that they and their hits fit
/// into a core's cache.
pub(crate) const CHUNK: usize = 4096;

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
    Same(f32),
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
    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Single(a) => a.nrows(),
            Self::Double(a) => a.nrows(),
        }
    }

    /// Calls `put` with the row within the range and the three numbers of each row of it, rounded to f32.
    #[inline(always)]
    pub(crate) fn each(&self, range: Range<usize>, put: impl FnMut(usize, [f32; 3])) {
        match self {
            Self::Single(a) => each_row(a, range, |x| x, put),
            Self::Double(a) => each_row(a, range, |x| x as f32, put),
        }
    }
}

#[inline(always)]
fn each_row<T: Copy>(
    rows: &ArrayView2<'_, T>,
    range: Range<usize>,
    to_f32: impl Fn(T) -> f32,
    mut put: impl FnMut(usize, [f32; 3]),
) {
    if let Some(numbers) = rows.as_slice() {
        let (numbers, _) = numbers[range.start * 3..range.end * 3].as_chunks::<3>();
        for (i, &row) in numbers.iter().enumerate() {
            put(i, row.map(&to_f32));
        }
        return;
    }
    for (i, row) in range.enumerate() {
        put(i, [to_f32(rows[[row, 0]]), to_f32(rows[[row, 1]]), to_f32(rows[[row, 2]])]);
    }
}

impl Bound1<'_> {
    /// The numbers.
    pub(crate) fn numbers(&self) -> Numbers<'_> {
        match self {
            Self::Single(a) => Numbers::Single(a.as_array()),
            Self::Double(a) => Numbers::Double(a.as_array()),
            Self::Same(x) => Numbers::Same(*x as f32),
        }
    }
}

impl Numbers<'_> {
    /// How many there are; `None` for one number for all.
    pub(crate) fn len(&self) -> Option<usize> {
        match self {
            Self::Single(a) => Some(a.len()),
            Self::Double(a) => Some(a.len()),
            Self::Same(_) => None,
        }
    }

    /// Calls `put` with the row within the range and the number of each row of it, rounded to f32.
    #[inline(always)]
    pub(crate) fn each(&self, range: Range<usize>, mut put: impl FnMut(usize, f32)) {
        match self {
            Self::Single(a) => range.enumerate().for_each(|(i, row)| put(i, a[row])),
            Self::Double(a) => range.enumerate().for_each(|(i, row)| put(i, a[row] as f32)),
            Self::Same(x) => (0..range.len()).for_each(|i| put(i, *x)),
        }
    }
}

/// The arrays of a call that hold its rays.
#[derive(FromPyObject)]
pub(crate) struct RayArrays<'py> {
    #[pyo3(item(0))]
    origins: Vectors<'py>,
    #[pyo3(item(1))]
    directions: Vectors<'py>,
    #[pyo3(item(2))]
    tmin: Bound1<'py>,
    #[pyo3(item(3))]
    tmax: Bound1<'py>,
}

/// Rays that may be shared between threads.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'a> {
    origins: Rows<'a>,
    directions: Rows<'a>,
    tmin: Numbers<'a>,
    tmax: Numbers<'a>,
}

impl RayArrays<'_> {
    /// The rays. All arrays must have one length.
    pub(crate) fn rays(&self) -> PyResult<Rays<'_>> {
        let rays = Rays {
            origins: self.origins.rows()?,
            directions: self.directions.rows()?,
            tmin: self.tmin.numbers(),
            tmax: self.tmax.numbers(),
        };
        let count = rays.len();
        let same = |n: Option<usize>| n.is_none_or(|n| n == count);
        if same(Some(rays.directions.len())) && same(rays.tmin.len()) && same(rays.tmax.len()) {
            Ok(rays)
        } else {
            Err(PyValueError::new_err("origins, directions, tmin and tmax differ in length"))
        }
    }
}

impl Rays<'_> {
    /// Number of rays.
    pub(crate) fn len(&self) -> usize {
        self.origins.len()
    }

    /// The rays of a range.
    pub(crate) fn read(&self, range: Range<usize>, rays: &mut Vec<Ray>) {
        rays.resize(range.len(), Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 });
        self.origins.each(range.clone(), |i, origin| rays[i].origin = origin);
        self.directions.each(range.clone(), |i, direction| rays[i].direction = direction);
        self.tmin.each(range.clone(), |i, t| rays[i].tmin = t);
        self.tmax.each(range, |i, t| rays[i].tmax = t);
    }
}

/// The triangles on which the rays of a call start: two arrays, of instances and of triangles.
pub(crate) type StartArrays<'py> = (PyReadonlyArray1<'py, u32>, PyReadonlyArray1<'py, u32>);

/// Triangles on which rays start, that may be shared between threads.
#[derive(Clone, Copy)]
pub(crate) struct Starts<'a> {
    instances: ArrayView1<'a, u32>,
    triangles: ArrayView1<'a, u32>,
}

impl<'a> Starts<'a> {
    /// The triangles of so many rays.
    pub(crate) fn new(arrays: &'a StartArrays<'_>, rays: usize) -> PyResult<Starts<'a>> {
        let starts = Starts { instances: arrays.0.as_array(), triangles: arrays.1.as_array() };
        if starts.instances.len() == rays && starts.triangles.len() == rays {
            Ok(starts)
        } else {
            Err(PyValueError::new_err(format!("start: expected {rays} triangles, one for each ray")))
        }
    }

    /// The triangles of a range of rays.
    pub(crate) fn read(&self, range: Range<usize>, starts: &mut Vec<PrimitiveRef>) {
        starts.clear();
        starts
            .extend(range.map(|i| PrimitiveRef { instance: self.instances[i], triangle: self.triangles[i] }));
    }
}
