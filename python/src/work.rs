//! Runs the chunks of a call on threads without the interpreter's lock, and lets signals through.

use pyo3::exceptions::PyRecursionError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// How often a call looks for signals such as Ctrl-C. It takes the interpreter's lock for
/// this.
const SIGNALS_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    /// The number of the process, and true if handlers of signals run on this thread there.
    static HANDLES_SIGNALS: Cell<Option<(u32, bool)>> = const { Cell::new(None) };
    /// How many calls this thread is in: more than one where a filter or the handler of a signal
    /// uses a scene.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Returns true if this thread is inside of a call, as a filter, or the handler of a signal that
/// interrupts one.
pub(crate) fn is_inside_call() -> bool {
    DEPTH.get() > 0
}

/// How many calls may be inside of one another. Each takes up to 30 KiB of the stack, less than
/// Python's own limit assumes.
const DEEPEST: u32 = 32;

/// Counts a call for as long as it exists.
struct Inside;

impl Inside {
    /// Fails in a filter that calls itself, before the stack ends.
    fn new() -> PyResult<Inside> {
        if DEPTH.get() >= DEEPEST {
            let message = format!(
                "expected at most {DEEPEST} calls inside of one another, got more: does a filter call itself?"
            );
            return Err(PyRecursionError::new_err(message));
        }
        DEPTH.set(DEPTH.get() + 1);
        Ok(Inside)
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        DEPTH.set(DEPTH.get() - 1);
    }
}

/// Number of processors that this process may use.
#[pyfunction]
pub(crate) fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// A lock whose holder cannot leave what it guards half changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// The threads that all calls share, one for each processor. A child process after a fork has none
/// of its parent's threads, so it starts its own.
pub(crate) fn pool() -> Arc<ThreadPool> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let process = std::process::id();
    let mut pool = lock(&POOL);
    if let Some((of, pool)) = &*pool
        && *of == process
    {
        return pool.clone();
    }
    let threads = ThreadPoolBuilder::new().thread_name(|i| format!("bth-{i}")).num_threads(processors());
    let new = Arc::new(threads.build().expect("threads can be started"));
    // To drop the parent's would wait for threads that do not exist here.
    std::mem::forget(pool.replace((process, new.clone())));
    new
}

/// Notes whether handlers of signals run on this thread: on Python's main thread, which after a
/// fork is the one that forked. To be called before [`check_signals`], while the thread has the
/// interpreter's lock.
pub(crate) fn note_thread(py: Python<'_>) {
    let process = std::process::id();
    if HANDLES_SIGNALS.get().is_none_or(|(of, _)| of != process) {
        // Without the answer signals are looked for.
        let is_main = is_main_thread(py).unwrap_or(true);
        HANDLES_SIGNALS.set(Some((process, is_main)));
    }
}

fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    main.eq(threading.call_method0("get_ident")?)
}

/// Lets the handlers of signals run, if this is the thread on which they do. Fails with the
/// exception that one raises. Other threads stay away from the interpreter, which may have ended by
/// now.
pub(crate) fn check_signals() -> PyResult<()> {
    match HANDLES_SIGNALS.get() {
        Some((_, false)) => Ok(()),
        _ => Python::try_attach(|py| py.check_signals()).unwrap_or(Ok(())),
    }
}

/// Waiting for what another thread does, with a look for signals every now and then.
pub(crate) struct Pauses {
    looked: Instant,
}

impl Pauses {
    /// How long a pause is.
    const LENGTH: Duration = Duration::from_micros(100);

    pub(crate) fn new() -> Pauses {
        Pauses { looked: Instant::now() }
    }

    /// Waits. Fails with the exception that the handler of a signal raises.
    pub(crate) fn pause(&mut self) -> PyResult<()> {
        std::thread::sleep(Self::LENGTH);
        if self.looked.elapsed() > SIGNALS_EVERY {
            check_signals()?;
            self.looked = Instant::now();
        }
        Ok(())
    }
}

/// What a job asks while it works, since some take much longer than the time after which a call
/// looks for signals.
pub(crate) struct Watch<'a>(Kind<'a>);

enum Kind<'a> {
    /// The job is on the caller's thread, which looks for signals itself: when it last did, and the
    /// exception that a handler has raised.
    Caller { looked: Cell<Instant>, failure: RefCell<Option<PyErr>> },
    /// The job is on a thread of the pool, to which the caller's says that it stops.
    Pool(&'a AtomicBool),
}

impl Watch<'_> {
    fn of_caller() -> Self {
        Watch(Kind::Caller { looked: Cell::new(Instant::now()), failure: RefCell::new(None) })
    }

    /// Returns true if the call ends early, so that the rest of the job has no use.
    pub(crate) fn is_over(&self) -> bool {
        match &self.0 {
            Kind::Pool(stop) => stop.load(Ordering::Relaxed),
            Kind::Caller { looked, failure } => {
                if failure.borrow().is_some() {
                    return true;
                }
                if looked.get().elapsed() > SIGNALS_EVERY {
                    let found = check_signals().err();
                    looked.set(Instant::now());
                    *failure.borrow_mut() = found;
                }
                failure.borrow().is_some()
            }
        }
    }

    /// Calls `work` with the parts of `count` rows one after the other, until the call ends early.
    /// Rows that lie together are answered fastest in one part, so parts grow as long as they take
    /// little time.
    pub(crate) fn in_parts(&self, rows: usize, mut work: impl FnMut(Range<usize>)) {
        let mut part = 0..rows.min(4);
        while !part.is_empty() && !self.is_over() {
            let start = Instant::now();
            work(part.clone());
            let share = SIGNALS_EVERY.as_secs_f64() / start.elapsed().as_secs_f64();
            let next = (part.len() as f64 * share.min(4.0)) as usize;
            part = part.end..rows.min(part.end + next.max(1));
        }
    }

    fn finish(self) -> PyResult<()> {
        match self.0 {
            Kind::Caller { failure, .. } => failure.into_inner().map_or(Ok(()), Err),
            Kind::Pool(_) => Ok(()),
        }
    }
}

/// Calls `work` with each of the jobs, on up to `threads` threads without the interpreter's lock.
/// One thread is the caller's own, which must not have the lock either. Ends early with the
/// exception that the handler of a signal raises; then some of the jobs have not been done, or not
/// to their ends.
pub(crate) fn run<J: Send>(
    threads: usize,
    jobs: Vec<J>,
    work: impl Fn(J, &Watch<'_>) + Sync + Send,
) -> PyResult<()> {
    let threads = threads.min(jobs.len());
    let queue = Mutex::new(jobs.into_iter());
    let next = || lock(&queue).next();
    let _inside = Inside::new()?;
    if threads <= 1 { alone(&next, &work) } else { together(threads, &next, &work) }
}

/// Does all jobs on the caller's thread.
fn alone<J>(next: &impl Fn() -> Option<J>, work: &impl Fn(J, &Watch<'_>)) -> PyResult<()> {
    let watch = Watch::of_caller();
    while !watch.is_over()
        && let Some(job) = next()
    {
        work(job, &watch);
    }
    watch.finish()
}

/// How many threads are still at work.
#[derive(Default)]
struct Working {
    count: Mutex<usize>,
    changed: Condvar,
}

/// Counts a thread as being at work for as long as it exists.
struct AtWork<'a>(&'a Working);

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        *lock(&self.0.count) -= 1;
        self.0.changed.notify_one();
    }
}

/// Does all jobs on threads of the pool, while the caller's waits for them and looks for signals.
fn together<J: Send>(
    threads: usize,
    next: &(impl Fn() -> Option<J> + Sync),
    work: &(impl Fn(J, &Watch<'_>) + Sync),
) -> PyResult<()> {
    let pool = pool();
    let stop = AtomicBool::new(false);
    let working = Working { count: Mutex::new(threads), ..Working::default() };
    let mut outcome = Ok(());
    pool.in_place_scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|_| {
                let _at_work = AtWork(&working);
                while !stop.load(Ordering::Relaxed)
                    && let Some(job) = next()
                {
                    work(job, &Watch(Kind::Pool(&stop)));
                }
            });
        }
        outcome = wait(&working, &stop);
    });
    outcome
}

/// Waits until no thread is at work, looking for signals.
fn wait(working: &Working, stop: &AtomicBool) -> PyResult<()> {
    let mut outcome = Ok(());
    let mut count = lock(&working.count);
    while *count > 0 {
        let (guard, waited) = working
            .changed
            .wait_timeout(count, SIGNALS_EVERY)
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        count = guard;
        if waited.timed_out() && *count > 0 && outcome.is_ok() {
            drop(count);
            outcome = check_signals();
            stop.store(outcome.is_err(), Ordering::Relaxed);
            count = lock(&working.count);
        }
    }
    outcome
}

/// Runs something that stops soon after `cancelled` is set on another thread, without the
/// interpreter's lock. `look` is called every now and then with the interpreter; if it fails, or
/// the handler of a signal does, `cancelled` is set.
pub(crate) fn run_cancellable<T: Send>(
    py: Python<'_>,
    cancelled: &AtomicBool,
    work: impl FnOnce() -> T + Send,
    look: impl Fn(Python<'_>) -> PyResult<()> + Sync + Send,
) -> PyResult<T> {
    let _inside = Inside::new()?;
    note_thread(py);
    py.detach(|| {
        std::thread::scope(|scope| {
            let worker = scope.spawn(work);
            let mut failure = None;
            let mut pause = Duration::from_millis(1);
            while !worker.is_finished() {
                std::thread::sleep(pause);
                pause = (pause * 2).min(SIGNALS_EVERY);
                if failure.is_none()
                    && pause == SIGNALS_EVERY
                    && let Some(Err(error)) =
                        Python::try_attach(|py| py.check_signals().and_then(|()| look(py)))
                {
                    failure = Some(error);
                    cancelled.store(true, Ordering::Relaxed);
                }
            }
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            failure.map_or(Ok(result), Err)
        })
    })
}
