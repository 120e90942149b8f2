//! Arrays of numpy to rays.

use crate::numbers::{Bound1, Number, Numbers, Rows, Vectors};
use bth::TraceRay;
use bth::rays::{PrimitiveRef, Ray, Ray64, Start, StartRay};
use numpy::PyReadonlyArray1;
use numpy::ndarray::ArrayView1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::marker::PhantomData;
use std::ops::Range;

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
            crate::rays::Given::Origins64($rays) => $do,
            crate::rays::Given::Starts($rays) => $do,
            crate::rays::Given::Starts64($rays) => $do,
        }
    };
}
pub(crate) use with_rays;

/// The rays of a call, of either kind, and with answers of either type.
pub(crate) enum Given<'a> {
    Origins(OriginRays<'a, f32>),
    Origins64(OriginRays<'a, f64>),
    Starts(StartRays<'a, f32>),
    Starts64(StartRays<'a, f64>),
}

/// Rays of a call, which may be shared between threads.
pub(crate) trait Rays: Copy + Sync {
    type Ray: TraceRay;
    /// The type of t in answers.
    type Number: Number;

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
    rays64: Vec<Ray64>,
    starts: Vec<StartRay>,
}

/// Rays with origins.
#[derive(Clone, Copy)]
pub(crate) struct OriginRays<'a, N> {
    origins: Rows<'a>,
    directions: Rows<'a>,
    tmin: Numbers<'a>,
    tmax: Numbers<'a>,
    number: PhantomData<N>,
}

/// Rays that start on surfaces. They are rays of f32, also where answers are f64.
#[derive(Clone, Copy)]
pub(crate) struct StartRays<'a, N> {
    starts: Starts<'a>,
    directions: Rows<'a>,
    tmax: Numbers<'a>,
    number: PhantomData<N>,
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
    /// The rays. All arrays must have one length. Where one of them is f64, answers are.
    pub(crate) fn given(&self) -> PyResult<Given<'_>> {
        let is_double = self.directions.rows()?.is_double() || self.tmax.numbers().is_double();
        let Some(start) = &self.start else {
            let rays = self.origin_rays()?;
            let is_double = is_double || rays.origins.is_double() || rays.tmin.is_double();
            return Ok(if is_double { Given::Origins64(self.origin_rays()?) } else { Given::Origins(rays) });
        };
        Ok(match is_double {
            true => Given::Starts64(self.start_rays(start)?),
            false => Given::Starts(self.start_rays(start)?),
        })
    }

    /// The rays with origins, in numbers of either type.
    pub(crate) fn origin_rays<N>(&self) -> PyResult<OriginRays<'_, N>> {
        let Some(origins) = &self.origins else { return Err(PyValueError::new_err("expected origins")) };
        let (origins, directions) = (origins.rows()?, self.directions.rows()?);
        let (tmin, tmax) = (self.tmin.numbers(), self.tmax.numbers());
        let lengths = [Some(directions.len()), tmin.len(), tmax.len()];
        one_length(origins.len(), &lengths)?;
        Ok(OriginRays { origins, directions, tmin, tmax, number: PhantomData })
    }

    fn start_rays<'a, N>(&'a self, start: &'a StartArrays<'_>) -> PyResult<StartRays<'a, N>> {
        let (starts, directions, tmax) = (start.starts()?, self.directions.rows()?, self.tmax.numbers());
        one_length(starts.len(), &[Some(directions.len()), tmax.len()])?;
        Ok(StartRays { starts, directions, tmax, number: PhantomData })
    }
}

/// Fails if an array has another length than `count`. `None` is one number for all.
fn one_length(count: usize, lengths: &[Option<usize>]) -> PyResult<()> {
    match lengths.iter().flatten().all(|&length| length == count) {
        true => Ok(()),
        false => Err(PyValueError::new_err("the arrays of rays differ in length")),
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

/// Implements [`Rays`] for rays with origins in numbers of one type.
macro_rules! origin_rays {
    ($number:ty, $ray:ident, $buffer:ident) => {
        impl Rays for OriginRays<'_, $number> {
            type Ray = $ray;
            type Number = $number;

            fn len(&self) -> usize {
                self.origins.len()
            }

            fn read(&self, range: Range<usize>, rays: &mut Vec<$ray>) {
                rays.resize(range.len(), $ray::new([0.0; 3], [0.0; 3]));
                self.origins.each(range.clone(), |i, origin| rays[i].origin = origin);
                self.directions.each(range.clone(), |i, direction| rays[i].direction = direction);
                self.tmin.each(range.clone(), |i, t| rays[i].tmin = t);
                self.tmax.each(range, |i, t| rays[i].tmax = t);
            }

            fn buffer<'b>(&self, buffers: &'b mut Buffers) -> &'b mut Vec<$ray> {
                &mut buffers.$buffer
            }
        }
    };
}
origin_rays!(f32, Ray, rays);
origin_rays!(f64, Ray64, rays64);

impl<N: Number> Rays for StartRays<'_, N> {
    type Ray = StartRay;
    type Number = N;

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
