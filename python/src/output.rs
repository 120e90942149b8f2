//! Hits to arrays of numpy that the caller has allocated, split into the parts of the chunks.

use crate::numbers::CHUNK;
use bth::rays::Hit;
use numpy::{Element, IntoPyArray, PyArray1, PyReadwriteArray1};
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// A mutable array of `count` numbers.
pub(crate) fn numbers<'a, T: Element>(
    array: &'a mut PyReadwriteArray1<'_, T>,
    count: usize,
) -> PyResult<&'a mut [T]> {
    let numbers =
        array.as_slice_mut().map_err(|_| PyValueError::new_err("an array of results is not contiguous"))?;
    match numbers.len() == count {
        true => Ok(numbers),
        false => Err(PyValueError::new_err(format!("an array of results has not the length {count}"))),
    }
}

/// The arrays of a call for its hits: t, u, v, instance, triangle.
pub(crate) struct HitArrays<'py, N: Element> {
    t: PyReadwriteArray1<'py, N>,
    u: PyReadwriteArray1<'py, f32>,
    v: PyReadwriteArray1<'py, f32>,
    instance: PyReadwriteArray1<'py, u32>,
    triangle: PyReadwriteArray1<'py, u32>,
}

impl<'py, N: Element> HitArrays<'py, N> {
    /// The arrays of a tuple.
    pub(crate) fn of(arrays: &Bound<'py, PyAny>) -> PyResult<Self> {
        let (t, u, v) = (arrays.get_item(0)?, arrays.get_item(1)?, arrays.get_item(2)?);
        let (instance, triangle) = (arrays.get_item(3)?, arrays.get_item(4)?);
        Ok(HitArrays {
            t: t.extract()?,
            u: u.extract()?,
            v: v.extract()?,
            instance: instance.extract()?,
            triangle: triangle.extract()?,
        })
    }
}

/// Where the hits of some rays go.
pub(crate) struct HitColumns<'a, N> {
    t: &'a mut [N],
    u: &'a mut [f32],
    v: &'a mut [f32],
    instance: &'a mut [u32],
    triangle: &'a mut [u32],
}

impl<N: Element> HitArrays<'_, N> {
    /// The columns for `count` hits.
    pub(crate) fn columns(&mut self, count: usize) -> PyResult<HitColumns<'_, N>> {
        Ok(HitColumns {
            t: numbers(&mut self.t, count)?,
            u: numbers(&mut self.u, count)?,
            v: numbers(&mut self.v, count)?,
            instance: numbers(&mut self.instance, count)?,
            triangle: numbers(&mut self.triangle, count)?,
        })
    }
}

impl<'a, N> HitColumns<'a, N> {
    /// Splits off the first rows.
    pub(crate) fn split_off(&mut self, rows: usize) -> HitColumns<'a, N> {
        HitColumns {
            t: split_off(&mut self.t, rows),
            u: split_off(&mut self.u, rows),
            v: split_off(&mut self.v, rows),
            instance: split_off(&mut self.instance, rows),
            triangle: split_off(&mut self.triangle, rows),
        }
    }

    /// Stores as many hits as there are rows. `t_of` returns the t of a row's hit.
    pub(crate) fn store(&mut self, hits: &[Hit], t_of: impl Fn(usize, &Hit) -> N) {
        // Column by column, so that each is one loop over adjacent numbers.
        self.t.iter_mut().zip(hits).enumerate().for_each(|(i, (t, hit))| *t = t_of(i, hit));
        self.u.iter_mut().zip(hits).for_each(|(u, hit)| *u = hit.u);
        self.v.iter_mut().zip(hits).for_each(|(v, hit)| *v = hit.v);
        self.instance.iter_mut().zip(hits).for_each(|(i, hit)| *i = hit.primitive.instance);
        self.triangle.iter_mut().zip(hits).for_each(|(i, hit)| *i = hit.primitive.triangle);
    }
}

/// Splits off the first rows.
pub(crate) fn split_off<'a, T>(rows: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    rows.split_off_mut(..count).expect("as many rows as the caller has counted")
}

/// The chunks of `count` rays, each with its part of the results, which `part` splits off.
pub(crate) fn chunks<T>(count: usize, mut part: impl FnMut(usize) -> T) -> Vec<(Range<usize>, T)> {
    (0..count)
        .step_by(CHUNK)
        .map(|first| {
            let range = first..(first + CHUNK).min(count);
            let part = part(range.len());
            (range, part)
        })
        .collect()
}

/// The chunks of a call with results in one array.
pub(crate) fn chunks_of<T>(mut results: &mut [T]) -> Vec<(Range<usize>, &mut [T])> {
    chunks(results.len(), |rows| split_off(&mut results, rows))
}

/// What the chunks of a call find, where that may be more than there is memory for.
pub(crate) struct Parts<T> {
    parts: Vec<Vec<T>>,
    is_full: AtomicBool,
}

/// Where a chunk puts what it finds.
pub(crate) struct Part<'a, T> {
    found: &'a mut Vec<T>,
    is_full: &'a AtomicBool,
}

/// A chunk of a call that counts and lists results.
pub(crate) type Job<'a, T> = (Range<usize>, (&'a mut [u64], Part<'a, T>));

impl<T: Copy> Parts<T> {
    /// No results yet of `count` rays or regions.
    pub(crate) fn new(count: usize) -> Parts<T> {
        Parts {
            parts: (0..count.div_ceil(CHUNK)).map(|_| Vec::new()).collect(),
            is_full: AtomicBool::new(false),
        }
    }

    /// The chunks of a call, each with its part of the counts and of the results.
    pub(crate) fn jobs<'a>(&'a mut self, mut counts: &'a mut [u64]) -> Vec<Job<'a, T>> {
        let is_full = &self.is_full;
        let mut rest = self.parts.iter_mut().map(|found| Part { found, is_full });
        chunks(counts.len(), |rows| {
            (split_off(&mut counts, rows), rest.next().expect("a part for each chunk"))
        })
    }

    /// One number of each result. Fails if there was or is not enough memory.
    pub(crate) fn column<'py, N: Element>(
        &self,
        py: Python<'py>,
        number: impl Fn(&T) -> N,
    ) -> PyResult<Bound<'py, PyArray1<N>>> {
        let full = || PyMemoryError::new_err("there is not enough memory for all that is found");
        if self.is_full.load(Ordering::Relaxed) {
            return Err(full());
        }
        let mut column = Vec::new();
        column.try_reserve_exact(self.parts.iter().map(Vec::len).sum()).map_err(|_| full())?;
        column.extend(self.parts.iter().flatten().map(number));
        Ok(column.into_pyarray(py))
    }
}

impl<T: Copy> Part<'_, T> {
    /// True if there was not enough memory, so that the call fails anyway.
    pub(crate) fn is_full(&self) -> bool {
        self.is_full.load(Ordering::Relaxed)
    }

    /// Appends results. If there is no memory for them, frees all of the chunk.
    pub(crate) fn append(&mut self, found: &[T]) {
        if self.is_full() {
            return;
        }
        match self.found.try_reserve(found.len()) {
            Ok(()) => self.found.extend_from_slice(found),
            Err(_) => {
                self.is_full.store(true, Ordering::Relaxed);
                *self.found = Vec::new();
            }
        }
    }
}
