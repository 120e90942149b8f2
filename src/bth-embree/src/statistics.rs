//! Counts of who answered what, printed at exit if `BTH_EMBREE_STATISTICS` is set.
#![allow(unsafe_code)] // Registers a function for the exit of the process.

use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;

/// What is counted.
#[derive(Clone, Copy, Debug)]
#[repr(usize)]
pub(crate) enum Kind {
    Geometries,
    Commits,
    /// Commits that took what an earlier one had built.
    CachedCommits,
    Rays,
    PointQueries,
}

const KINDS: [&str; 5] = ["geometries", "commits", "commits from the cache", "rays", "point queries"];

/// Who answered.
#[derive(Clone, Copy, Debug)]
#[repr(usize)]
pub(crate) enum Who {
    Bth,
    Fallback,
}

/// Number and nanoseconds, by kind and by who answered.
static COUNTS: [[[AtomicU64; 2]; 2]; KINDS.len()] =
    [const { [const { [const { AtomicU64::new(0) }; 2] }; 2] }; KINDS.len()];

/// Instances that cannot be hit, since their transform has no inverse.
static FLAT_INSTANCES: AtomicU64 = AtomicU64::new(0);

/// Returns true if somebody wants to know.
#[inline(always)]
pub(crate) fn wanted() -> bool {
    static WANTED: OnceLock<bool> = OnceLock::new();
    *WANTED.get_or_init(|| {
        let wanted = std::env::var_os("BTH_EMBREE_STATISTICS").is_some_and(|value| value != "0");
        if wanted {
            // SAFETY: `print` takes and returns nothing, and may run at the exit of the process.
            unsafe { libc::atexit(print) };
        }
        wanted
    })
}

/// Does something and counts it, with the time that it takes.
#[inline(always)]
pub(crate) fn counted<T>(kind: Kind, who: Who, count: u64, work: impl FnOnce() -> T) -> T {
    if !wanted() {
        return work();
    }
    let start = Instant::now();
    let result = work();
    let [number, time] = &COUNTS[kind as usize][who as usize];
    number.fetch_add(count, Relaxed);
    time.fetch_add(start.elapsed().as_nanos() as u64, Relaxed);
    result
}

/// Counts what takes no time.
pub(crate) fn count(kind: Kind, who: Who, count: u64) {
    counted(kind, who, count, || ());
}

/// Counts an instance whose transform has no inverse.
pub(crate) fn count_flat_instance() {
    FLAT_INSTANCES.fetch_add(1, Relaxed);
}

/// Writes a line for the user.
pub(crate) fn note(line: &str) {
    // Nobody can be told if standard error is closed.
    let _ = writeln!(std::io::stderr(), "{line}");
}

extern "C" fn print() {
    let mut text = format!("{:<24}{:>16}{:>12}{:>16}{:>12}", "bth-embree", "by bth", "s", "by Embree", "s");
    for (name, [ours, theirs]) in KINDS.iter().zip(&COUNTS) {
        let cell = |[number, time]: &[AtomicU64; 2]| (number.load(Relaxed), time.load(Relaxed) as f64 / 1e9);
        let ((a, a_time), (b, b_time)) = (cell(ours), cell(theirs));
        text += &format!("\n{name:<24}{a:>16}{a_time:>12.3}{b:>16}{b_time:>12.3}");
    }
    let flat = FLAT_INSTANCES.load(Relaxed);
    if flat > 0 {
        text += &format!("\n{flat} instances cannot be hit: their transforms have no inverse");
    }
    note(&text);
}
