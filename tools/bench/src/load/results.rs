//! What `load` measured, as it is written to JSON.

use super::files::PageCache;
use super::probe::StartTimes;
use crate::args::Start;
use crate::output::Head;
use crate::rays::View;
use crate::rivals::embree;
use crate::rounds::median;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// First rays that were traced.
    pub rays: usize,
    /// In the order of the command line.
    pub models: Vec<ModelStarts>,
}

/// What was measured on a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelStarts {
    /// Name without folder.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Where the camera stood.
    pub view: View,
    /// Bytes of our compiled files.
    pub file_bytes: BTreeMap<&'static str, usize>,
    /// What could not be measured, and why.
    pub left_out: Vec<(String, String)>,
    /// One for each number of threads.
    pub runs: Vec<StartsRun>,
}

/// All starts on so many threads.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StartsRun {
    /// Threads that built, where a build can use them, and traced.
    pub threads: usize,
    /// By name, in the order of the tables.
    pub starts: Vec<(String, Times)>,
}

/// Medians of a start's times and bytes; see [`StartTimes`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    /// Seconds until rays could be traced.
    pub ready_s: f64,
    /// Seconds until the first hit.
    pub first_hit_s: f64,
    /// Seconds until all rays were traced.
    pub total_s: f64,
    /// CPU seconds of all threads until then.
    pub cpu_s: f64,
    /// Bytes that were read from storage, where the system counts them.
    pub storage_bytes: Option<u64>,
    /// Seconds for a whole picture, where one is traced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_s: Option<f64>,
}

impl Times {
    /// The medians over at least one start.
    pub(super) fn medians(probed: &[StartTimes]) -> Times {
        let of =
            |field: fn(&StartTimes) -> f64| median(probed.iter().map(field).collect()).unwrap_or(f64::NAN);
        let storage: Option<Vec<f64>> = probed.iter().map(|p| p.storage_bytes.map(|b| b as f64)).collect();
        Times {
            ready_s: of(|p| p.ready_s),
            first_hit_s: of(|p| p.first_hit_s),
            total_s: of(|p| p.total_s),
            cpu_s: of(|p| p.cpu_s),
            storage_bytes: storage.and_then(median).map(|b| b as u64),
            frame_s: probed.iter().map(|p| p.frame_s).collect::<Option<Vec<f64>>>().and_then(median),
        }
    }
}

impl StartsRun {
    /// The time of Embree's build over that of a start; both include the first rays.
    pub(super) fn faster(&self, name: &str) -> Option<f64> {
        let total = |name: &str| self.starts.iter().find(|(n, _)| n == name).map(|(_, t)| t.total_s);
        Some(total(embree::NAME)? / total(name)?)
    }
}

/// A way to start.
#[derive(Clone, Debug)]
pub(super) struct StartCase {
    /// Its name in tables.
    pub(super) name: String,
    /// The name of our structure; empty for rivals.
    pub(super) structure: &'static str,
    /// How the program starts.
    pub(super) start: Start,
    /// The state of the page cache before the start.
    pub(super) cache: PageCache,
    /// The file that it reads.
    pub(super) file: PathBuf,
    /// Size of the file in bytes, if it is a compiled file; else 0.
    pub(super) file_bytes: usize,
}

impl StartCase {
    pub(super) fn of_file(
        structure: &'static str,
        start: Start,
        cache: PageCache,
        file: PathBuf,
        file_bytes: usize,
    ) -> StartCase {
        let name = format!("{structure} {} {}", start.name(), cache.name());
        StartCase { name, structure, start, cache, file, file_bytes }
    }

    /// A rival's build. Its triangles are in memory before the clock starts, so the page cache does not matter.
    pub(super) fn of_rival(start: Start, file: PathBuf) -> StartCase {
        let name = start.name().replace('-', " ");
        StartCase { name, structure: "", start, cache: PageCache::Warm, file, file_bytes: 0 }
    }
}
