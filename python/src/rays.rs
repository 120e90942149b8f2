//! Arrays of numpy to rays and points, a chunk at a time, so that what is converted stays in the
//! cache until it is traced.

use bth::TraceRay;
use bth::rays::{PrimitiveRef, Ray, Start, StartRay};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::Range;

/// Number of rays or points of a chunk: enough that rays are traced together well, and few enough
/// that they and their hits fit into a core's cache.
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

    /// Calls `put` with the row within the range and the three numbers of each row of it, rounded
    /// to f32.
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

/// The arrays of a call that hold its rays: with origins, or with starts.
#[derive(FromPyObject)]
pub(crate) struct RayArrays<'py> {
    #[pyo3(item(0))]
    origins: Option<Vectors<'py>>,
    #[pyo3(item(1))]
    directions: Vectors<'py>,
    #[pyo3(item(2))]
    tmin: Bound1<'py>,
    #[pyo3(item(3))]
    tmax: Bound1<'py>,
    #[pyo3(item(4))]
    start: Option<StartArrays<'py>>,
}

/// Points of surfaces at which rays start.
#[derive(FromPyObject)]
pub(crate) struct StartArrays<'py> {
    #[pyo3(item(0))]
    instance: PyReadonlyArray1<'py, u32>,
    #[pyo3(item(1))]
    triangle: PyReadonlyArray1<'py, u32>,
    #[pyo3(item(2))]
    u: PyReadonlyArray1<'py, f32>,
    #[pyo3(item(3))]
    v: PyReadonlyArray1<'py, f32>,
}

/// Evaluates an expression with the rays of a call, of whichever kind they are.
macro_rules! with_rays {
    ($given:expr, $rays:ident => $do:expr) => {
        match $given.given()? {
            crate::rays::Given::Origins($rays) => $do,
            crate::rays::Given::Starts($rays) => $do,
        }
    };
}
pub(crate) use with_rays;

/// The rays of a call, of either kind.
pub(crate) enum Given<'a> {
    Origins(OriginRays<'a>),
    Starts(StartRays<'a>),
}

/// Rays of a call, which may be shared between threads.
pub(crate) trait Rays: Copy + Sync {
    type Ray: TraceRay;

    /// Number of rays.
    fn len(&self) -> usize;

    /// Replaces `rays` by the rays of a range.
    fn read(&self, range: Range<usize>, rays: &mut Vec<Self::Ray>);

    /// The buffer for rays of this kind.
    fn buffer<'b>(&self, buffers: &'b mut Buffers) -> &'b mut Vec<Self::Ray>;
}

/// Buffers for the rays of a chunk.
#[derive(Default)]
pub(crate) struct Buffers {
    rays: Vec<Ray>,
    starts: Vec<StartRay>,
}

/// Rays with origins.
#[derive(Clone, Copy)]
pub(crate) struct OriginRays<'a> {
    origins: Rows<'a>,
    directions: Rows<'a>,
    tmin: Numbers<'a>,
    tmax: Numbers<'a>,
}

/// Rays that start on surfaces.
#[derive(Clone, Copy)]
pub(crate) struct StartRays<'a> {
    starts: Starts<'a>,
    directions: Rows<'a>,
    tmax: Numbers<'a>,
}

/// Points of surfaces, which may be shared between threads.
#[derive(Clone, Copy)]
pub(crate) struct Starts<'a> {
    instance: ArrayView1<'a, u32>,
    triangle: ArrayView1<'a, u32>,
    u: ArrayView1<'a, f32>,
    v: ArrayView1<'a, f32>,
}

impl RayArrays<'_> {
    /// The rays. All arrays must have one length.
    pub(crate) fn given(&self) -> PyResult<Given<'_>> {
        let (directions, tmax) = (self.directions.rows()?, self.tmax.numbers());
        let count = directions.len();
        let same = |n: Option<usize>| n.is_none_or(|n| n == count);
        let (given, fits) = match (&self.origins, &self.start) {
            (Some(origins), None) => {
                let (origins, tmin) = (origins.rows()?, self.tmin.numbers());
                let fits = origins.len() == count && same(tmin.len());
                (Given::Origins(OriginRays { origins, directions, tmin, tmax }), fits)
            }
            (None, Some(start)) => {
                let starts = start.starts()?;
                (Given::Starts(StartRays { starts, directions, tmax }), starts.len() == count)
            }
            _ => return Err(PyValueError::new_err("expected either origins or starts")),
        };
        match fits && same(tmax.len()) {
            true => Ok(given),
            false => Err(PyValueError::new_err("the arrays of rays differ in length")),
        }
    }
}

impl StartArrays<'_> {
    /// The points. All arrays must have one length.
    pub(crate) fn starts(&self) -> PyResult<Starts<'_>> {
        let (instance, triangle) = (self.instance.as_array(), self.triangle.as_array());
        let starts = Starts { instance, triangle, u: self.u.as_array(), v: self.v.as_array() };
        let count = starts.len();
        match triangle.len() == count && starts.u.len() == count && starts.v.len() == count {
            true => Ok(starts),
            false => Err(PyValueError::new_err("start: its arrays differ in length")),
        }
    }
}

impl Starts<'_> {
    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.instance.len()
    }

    /// The point of a row.
    #[inline(always)]
    pub(crate) fn get(&self, row: usize) -> Start {
        let primitive = PrimitiveRef { instance: self.instance[row], triangle: self.triangle[row] };
        Start { primitive, u: self.u[row], v: self.v[row] }
    }
}

impl Rays for OriginRays<'_> {
    type Ray = Ray;

    fn len(&self) -> usize {
        self.origins.len()
    }

    fn read(&self, range: Range<usize>, rays: &mut Vec<Ray>) {
        let none = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 };
        rays.resize(range.len(), none);
        self.origins.each(range.clone(), |i, origin| rays[i].origin = origin);
        self.directions.each(range.clone(), |i, direction| rays[i].direction = direction);
        self.tmin.each(range.clone(), |i, t| rays[i].tmin = t);
        self.tmax.each(range, |i, t| rays[i].tmax = t);
    }

    fn buffer<'b>(&self, buffers: &'b mut Buffers) -> &'b mut Vec<Ray> {
        &mut buffers.rays
    }
}

impl Rays for StartRays<'_> {
    type Ray = StartRay;

    fn len(&self) -> usize {
        self.starts.len()
    }

    fn read(&self, range: Range<usize>, rays: &mut Vec<StartRay>) {
        rays.clear();
        rays.extend(range.clone().map(|row| self.starts.get(row).ray([0.0; 3])));
        self.directions.each(range.clone(), |i, direction| rays[i].direction = direction);
        self.tmax.each(range, |i, t| rays[i].tmax = t);
    }

    fn buffer<'b>(&self, buffers: &'b mut Buffers) -> &'b mut Vec<StartRay> {
        &mut buffers.starts
    }
}
