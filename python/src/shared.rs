//! A scene that several threads use: many trace it, one at a time changes it, and any may close it.

use crate::state::State;
use crate::work::{self, Pauses, Watch};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, RwLock, RwLockReadGuard, TryLockError};

/// A scene that is open. It is freed when it has been closed and no call uses it any more.
pub(crate) struct OpenScene {
    scene: RwLock<State>,
    /// Threads that wait to change the scene; others let them go first.
    changing: AtomicU32,
}

impl OpenScene {
    pub(crate) fn new(scene: bth::Scene) -> Arc<OpenScene> {
        Arc::new(OpenScene { scene: RwLock::new(State::File(Box::new(scene))), changing: AtomicU32::new(0) })
    }

    /// The scene for queries. Not for threads that hold the interpreter's lock: whoever changes the
    /// scene needs it. Fails with the exception that the handler of a signal raises while others
    /// change the scene.
    pub(crate) fn read(&self) -> PyResult<RwLockReadGuard<'_, State>> {
        let mut pauses = Pauses::new();
        // A filter or the handler of a signal is inside of a call, perhaps of this scene: it must
        // not wait for whom that call keeps waiting.
        while self.changing.load(Ordering::Relaxed) > 0 && !work::is_inside_call() {
            pauses.pause()?;
        }
        loop {
            // Not `read`, which may panic or wait for ever on a thread that has the lock already,
            // such as the thread of a filter.
            if let Some(scene) = self.try_read() {
                return Ok(scene);
            }
            pauses.pause()?;
        }
    }

    fn try_read(&self) -> Option<RwLockReadGuard<'_, State>> {
        match self.scene.try_read() {
            Ok(scene) => Some(scene),
            Err(TryLockError::Poisoned(scene)) => Some(scene.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    /// Does the same as [`Self::read`] for a thread that holds the interpreter's lock.
    pub(crate) fn read_attached(&self, py: Python<'_>) -> PyResult<RwLockReadGuard<'_, State>> {
        work::note_thread(py);
        loop {
            if let Some(scene) = self.try_read() {
                return Ok(scene);
            }
            py.detach(|| self.read().map(drop))?;
        }
    }

    /// Calls `work` with the scene and each of the jobs, on up to `threads` threads, as
    /// [`work::run`] does. The scene does not change before all are done.
    pub(crate) fn run<J: Send>(
        &self,
        py: Python<'_>,
        threads: usize,
        jobs: Vec<J>,
        work: impl Fn(&bth::Scene, J, &Watch<'_>) + Sync + Send,
    ) -> PyResult<()> {
        work::note_thread(py);
        py.detach(|| {
            let guard = self.read()?;
            let scene: &bth::Scene = &guard;
            work::run(threads, jobs, |job, watch| work(scene, job, watch))
        })
    }

    /// Changes the scene when no query uses it any more.
    pub(crate) fn change<T: Send>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut State) -> T + Send,
    ) -> PyResult<T> {
        if work::is_inside_call() {
            let message = "a scene cannot be changed by a filter or a progress function, nor by the handler of a signal that interrupts a call of this package";
            return Err(PyRuntimeError::new_err(message));
        }
        work::note_thread(py);
        self.changing.fetch_add(1, Ordering::Relaxed);
        let result = py.detach(|| {
            // Not `write`, after whose call readers would wait, the handlers of signals too.
            let mut pauses = Pauses::new();
            let mut scene = loop {
                match self.scene.try_write() {
                    Ok(scene) => break scene,
                    Err(TryLockError::Poisoned(scene)) => break scene.into_inner(),
                    Err(TryLockError::WouldBlock) => pauses.pause()?,
                }
            };
            let state = &mut *scene;
            Ok(work::pool().install(|| change(state)))
        });
        self.changing.fetch_sub(1, Ordering::Relaxed);
        result
    }
}

/// The scene of a Python object, until it is closed.
pub(crate) struct Handle(Mutex<Option<Arc<OpenScene>>>);

impl Handle {
    pub(crate) fn new(scene: bth::Scene) -> Handle {
        Handle(Mutex::new(Some(OpenScene::new(scene))))
    }

    /// The scene, which stays open for as long as the caller holds it.
    pub(crate) fn get(&self) -> PyResult<Arc<OpenScene>> {
        work::lock(&self.0).clone().ok_or_else(|| PyValueError::new_err("the scene is closed"))
    }

    /// Closes the scene. Calls that use it end first.
    pub(crate) fn close(&self) {
        let scene = work::lock(&self.0).take();
        drop(scene);
    }

    pub(crate) fn is_closed(&self) -> bool {
        work::lock(&self.0).is_none()
    }
}
