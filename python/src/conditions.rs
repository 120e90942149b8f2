//! What rays may hit: masks, culling, and filters in Python.

use crate::numbers::Number;
use crate::rays::Rays;
use crate::work::{self, Watch};
use bth::rays::{Hit, Ray};
use bth::{Accept, Cull};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// A hit about which a filter decides.
#[pyclass(frozen, get_all, module = "bth", name = "Candidate")]
pub(crate) struct Candidate {
    /// Index of the ray, in C order.
    ray: usize,
    t: f64,
    u: f32,
    v: f32,
    instance: u32,
    triangle: u32,
    /// As in `bth.Opacity`.
    opacity: u8,
}

#[pymethods]
impl Candidate {
    fn __repr__(&self) -> String {
        let Candidate { ray, t, u, v, instance, triangle, .. } = self;
        format!("<bth.Candidate: ray {ray}, t {t}, u {u}, v {v}, instance {instance}, triangle {triangle}>")
    }
}

/// The conditions of a call: a mask, the side of triangles that rays pass, and a filter or `None`.
#[derive(FromPyObject)]
pub(crate) struct Conditions {
    #[pyo3(item(0))]
    mask: u32,
    #[pyo3(item(1))]
    cull: String,
    #[pyo3(item(2))]
    filter: Option<Py<PyAny>>,
}

impl Conditions {
    /// The conditions for the library.
    pub(crate) fn checked(self) -> PyResult<Checked> {
        let cull = match self.cull.as_str() {
            "none" => Cull::None,
            "back" => Cull::Back,
            "front" => Cull::Front,
            other => {
                let message = format!("cull: expected None, 'back' or 'front', got '{other}'");
                return Err(PyValueError::new_err(message));
            }
        };
        let filter = self.filter.map(|callable| Filter {
            callable,
            failed: AtomicBool::new(false),
            failure: Mutex::new(None),
        });
        Ok(Checked { accept: Accept { mask: self.mask, cull, filter: None }, filter })
    }
}

/// Conditions that are valid.
pub(crate) struct Checked {
    /// All but the filter.
    pub(crate) accept: Accept<'static>,
    pub(crate) filter: Option<Filter>,
}

impl Checked {
    /// Number of threads that a call uses of those it was given: one with a filter, which needs the
    /// interpreter's lock for each hit.
    pub(crate) fn threads(&self, threads: usize) -> usize {
        if self.filter.is_some() { 1 } else { threads }
    }

    /// Calls `query` for each ray with its index within the rays and what it may hit. `first` is
    /// the index of the first ray in the call. After an exception of the filter, and when the call
    /// ends early, skips the rest.
    pub(crate) fn each<S: Rays>(
        &self,
        scene: &bth::Scene,
        first: usize,
        rays: &[S::Ray],
        watch: &Watch<'_>,
        mut query: impl FnMut(usize, &S::Ray, &Accept<'_>),
    ) {
        for (i, ray) in rays.iter().enumerate() {
            // Most rays take less time than a look at the clock.
            if i % 16 == 0 && watch.is_over() {
                return;
            }
            let Some(filter) = &self.filter else {
                query(i, ray, &self.accept);
                continue;
            };
            if filter.failed.load(Ordering::Relaxed) {
                return;
            }
            let t = |hit: &Hit| S::Number::t(scene, ray, hit).into();
            let accepts = |_: &Ray, hit: &Hit| filter.accepts(scene, first + i, hit, t(hit));
            query(i, ray, &Accept { filter: Some(&accepts), ..self.accept });
        }
    }

    /// Fails with the exception that the filter has raised.
    pub(crate) fn finish(self) -> PyResult<()> {
        let failure = self.filter.and_then(|filter| work::lock(&filter.failure).take());
        failure.map_or(Ok(()), Err)
    }
}

/// A filter in Python.
pub(crate) struct Filter {
    callable: Py<PyAny>,
    failed: AtomicBool,
    /// The first exception of the filter.
    failure: Mutex<Option<PyErr>>,
}

impl Filter {
    /// Returns true if a hit at t counts. After an exception none does.
    fn accepts(&self, scene: &bth::Scene, ray: usize, hit: &Hit, t: f64) -> bool {
        if self.failed.load(Ordering::Relaxed) {
            return false;
        }
        let Hit { u, v, primitive, .. } = *hit;
        let opacity = scene.opacity(hit) as u8;
        let candidate =
            Candidate { ray, t, u, v, instance: primitive.instance, triangle: primitive.triangle, opacity };
        Python::attach(|py| self.call(py, candidate)).unwrap_or_else(|error| {
            *work::lock(&self.failure) = Some(error);
            self.failed.store(true, Ordering::Relaxed);
            false
        })
    }

    fn call(&self, py: Python<'_>, candidate: Candidate) -> PyResult<bool> {
        let answer = self.callable.bind(py).call1((candidate,))?;
        // A function without `return` would reject all hits.
        if answer.is_none() {
            return Err(PyTypeError::new_err("filter: expected True or False, got None"));
        }
        answer.is_truthy()
    }
}
