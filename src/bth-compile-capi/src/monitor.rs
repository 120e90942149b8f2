//! A monitor that calls functions of C.

use crate::options::{Options, Progress, Warning};
use compiler::Monitor;
use compiler::error::for_callers;
use std::ffi::{CString, c_void};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// Min time between two calls of the progress function within a stage. Stages check some thousand
/// times a second if they are cancelled.
const INTERVAL: Duration = Duration::from_millis(100);

/// Calls the functions of C one at a time.
pub(crate) struct Callbacks {
    progress: Option<Progress>,
    warning: Option<Warning>,
    /// Name of the stage, its units in all, and the pointer that the functions get.
    state: Mutex<State>,
    done: AtomicU64,
    cancelled: AtomicBool,
}

struct State {
    stage: CString,
    total: u64,
    user: *mut c_void,
    /// When the progress function was last called.
    reported: Instant,
}

// SAFETY: `user` is the only field that is not `Send`. It is only passed to the caller's functions,
// which by the contract of `bth_compile.h` may be called by any thread, and under the lock of
// `state`, so by one at a time.
unsafe impl Send for State {}

impl Callbacks {
    pub(crate) fn new(options: &Options) -> Self {
        Self {
            progress: options.progress,
            warning: options.warning,
            state: Mutex::new(State {
                stage: CString::default(),
                total: 0,
                user: options.user,
                reported: Instant::now(),
            }),
            done: AtomicU64::new(0),
            cancelled: AtomicBool::new(false),
        }
    }

    fn report(&self, state: &mut State) {
        let Some(progress) = self.progress else { return };
        let done = self.done.load(Ordering::Relaxed);
        // SAFETY: the caller gave a function of this type; the name lives until it returns.
        if unsafe { progress(state.user, state.stage.as_ptr(), done, state.total) } != 0 {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        state.reported = Instant::now();
    }

    /// Calls the progress function if the last call is long enough ago.
    fn report_again(&self, state: &mut State) {
        if state.reported.elapsed() >= INTERVAL {
            self.report(state);
        }
    }
}

impl Monitor for Callbacks {
    fn stage(&self, name: &'static str, total: Option<u64>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.stage = CString::new(name).unwrap_or_default();
        state.total = total.unwrap_or(0);
        self.done.store(0, Ordering::Relaxed);
        self.report(&mut state);
    }

    fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        if !self.cancelled.load(Ordering::Relaxed) {
            // While another thread is in a callback this one does not wait for it.
            match self.state.try_lock() {
                Ok(mut state) => self.report_again(&mut state),
                Err(TryLockError::Poisoned(state)) => self.report_again(&mut state.into_inner()),
                Err(TryLockError::WouldBlock) => {}
            }
        }
        self.cancelled.load(Ordering::Relaxed)
    }

    fn warn(&self, message: &str) {
        let Some(warning) = self.warning else { return };
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let message = CString::new(for_callers(message).replace('\0', "?")).unwrap_or_default();
        // SAFETY: the caller gave a function of this type; the message lives until it returns.
        unsafe { warning(state.user, message.as_ptr()) };
    }
}
