//! Scene manifests and models as input: `bthc`, in the folder of this program, compiles them into
//! the cache, from which they are mapped.

use crate::failure::Failure;
use crate::interrupt::Part;
use crate::messages;
use bth_cache::{DEFAULT_CAP, Digest, Pin, Store};
use bth_files::Diagnosis;
use bth_format::layout::IDENTIFIER;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Time between two changes of what a terminal shows.
const INTERVAL: Duration = Duration::from_millis(100);
/// Returns true for a file that must be compiled first: by its name and content it is not a
/// compiled file. `bthc` finds out what it is.
pub(crate) fn is_source(path: &Path) -> bool {
    let mut start = [0; IDENTIFIER.len()];
    let read = bth_files::regular_file(path)
        .and_then(|_| std::fs::File::open(path))
        .and_then(|mut file| file.read_exact(&mut start));
    let is_named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bth"));
    !is_named && (read.is_err() || start != IDENTIFIER)
}

/// A compiled source.
pub(crate) struct Compiled {
    /// The compiled file, which the cache does not evict while this lives.
    pub(crate) pin: Pin,
    /// All files that were read for it.
    pub(crate) inputs: Vec<PathBuf>,
    /// The cache, if it is a temporary one; it is removed with this.
    _folder: Option<TemporaryCache>,
}

/// A cache that is removed at the end, also when the program is interrupted.
struct TemporaryCache {
    _part: Part,
    folder: tempfile::TempDir,
}

impl TemporaryCache {
    fn new() -> Result<Self, Failure> {
        let folder = tempfile::Builder::new().prefix("bth-play-").tempdir();
        let folder = folder.map_err(|e| Failure::file(&std::env::temp_dir(), &e))?;
        Ok(TemporaryCache { _part: Part::new(folder.path()), folder })
    }
}

/// The compiled file of a scene or model in the cache, checked; compiled now if the cache lacks it.
/// With `materials` it is compiled with these and with holes by alpha, or without where its
/// materials cannot be read. Where no folder is given and `BTH_NO_CACHE` is set, or the usual
/// folder is not known or cannot be used, the cache is a temporary one.
///
/// # Errors
/// If the source cannot be compiled, or the cache cannot be used.
pub(crate) fn compiled(source: &Path, cache: Option<&Path>, materials: bool) -> Result<Compiled, Failure> {
    let failed = |message: &str| Failure::Source { path: source.into(), message: message.to_owned() };
    let is_off = std::env::var_os("BTH_NO_CACHE").is_some_and(|value| !value.is_empty());
    let (store, temporary) = match cache {
        Some(folder) => (open(folder)?, None),
        None => match bth_cache::folder().filter(|_| !is_off).map(|folder| open(&folder)) {
            Some(Ok(store)) => (store, None),
            found => {
                if let Some(Err(failure)) = found {
                    messages::warn(&format!("going on without the cache: {failure}"));
                }
                let temporary = TemporaryCache::new()?;
                (open(temporary.folder.path())?, Some(temporary))
            }
        },
    };
    let folder = store.folder().to_owned();
    // An entry that is damaged, or evicted before it is pinned, is compiled again.
    for _ in 0..3 {
        let done = match compile(source, &folder, materials) {
            Err(with) if materials && is_of_source(&with) => {
                let done = compile(source, &folder, false)?;
                let what = "its materials cannot be read, so it is shown without them";
                messages::warn(&format!("{}: {what}: {with}", source.display()));
                done
            }
            done => done?,
        };
        let pin = store.find_id(&done.key).and_then(|record| store.pin(&record));
        store.take_notes().iter().for_each(|note| messages::warn(note));
        if let Some(pin) = pin {
            return Ok(Compiled { pin, inputs: done.inputs, _folder: temporary });
        }
    }
    Err(failed("the compiled file does not stay in the cache"))
}

fn open(folder: &Path) -> Result<Store, Failure> {
    Store::open(folder, DEFAULT_CAP).map_err(|e| Failure::file(folder, &format!("cannot be the cache: {e}")))
}

/// What `bthc` made.
struct Done {
    /// Key of the entry.
    key: Digest,
    /// All files that it read.
    inputs: Vec<PathBuf>,
}

/// Returns true if something that is read is at fault, and not the cache.
fn is_of_source(failure: &Failure) -> bool {
    let Failure::Compiler(error) = failure else { return false };
    error.exit_code == 3 || matches!(error.code.as_str(), "BTH-O001" | "BTH-O002")
}

/// Does work, and shows on a terminal for how long.
fn showing_time<T: Send>(what: &str, work: impl FnOnce() -> T + Send) -> T {
    if !std::io::stderr().is_terminal() {
        return work();
    }
    let bar = ProgressBar::new_spinner().with_message(what.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg} {spinner} {elapsed}") {
        bar.set_style(style);
    }
    let has_ended = Mutex::new(false);
    let ended = Condvar::new();
    let done = std::thread::scope(|scope| {
        let show = || {
            let mut has_ended = has_ended.lock().unwrap_or_else(PoisonError::into_inner);
            while !*has_ended {
                bar.tick();
                let waited = ended.wait_timeout(has_ended, INTERVAL).unwrap_or_else(PoisonError::into_inner);
                has_ended = waited.0;
            }
        };
        // Where the system starts no thread, the time does not move.
        let _ = std::thread::Builder::new().spawn_scoped(scope, show);
        let done = work();
        *has_ended.lock().unwrap_or_else(PoisonError::into_inner) = true;
        ended.notify_all();
        done
    });
    bar.finish_and_clear();
    done
}

/// Runs `bthc` to compile into the cache. It ends when this program does, however that ends, since
/// its standard input is closed then.
fn compile(source: &Path, cache: &Path, materials: bool) -> Result<Done, Failure> {
    let failed = |message: String| Failure::Source { path: source.into(), message };
    let bthc = std::env::current_exe()
        .ok()
        .map(|exe| exe.with_file_name(format!("bthc{}", std::env::consts::EXE_SUFFIX)))
        .filter(|bthc| bthc.is_file());
    let Some(bthc) = bthc else {
        return Err(failed("it is not compiled yet, and there is no bthc beside this program".to_owned()));
    };
    let mut command = Command::new(&bthc);
    command.arg("compile").args(["--in-cache", "--json", "--end-with-input", "--cache-dir"]).arg(cache);
    if materials {
        command.args(["--materials", "--lenient-materials", "--alpha", "mask"]);
    }
    command.arg("--").arg(source).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let started = command.spawn().and_then(|mut child| {
        let _open_until_it_ends = child.stdin.take();
        showing_time(&format!("compiling {}", source.display()), || child.wait_with_output())
    });
    let output = started.map_err(|e| failed(format!("{} cannot be started: {e}", bthc.display())))?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    let mut json: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let reported: Option<Diagnosis> = serde_json::from_value(json["error"].take()).ok();
    // An error that is reported as JSON is not printed twice.
    let is_new = |line: &&str| reported.is_none() || !line.starts_with("error: ");
    stderr.lines().filter(is_new).for_each(messages::note);
    if let Some(error) = reported {
        return Err(Failure::Compiler(Box::new(error)));
    }
    if !output.status.success() {
        return Err(failed(format!("{} ended with {}", bthc.display(), output.status)));
    }
    let job = &json["jobs"][0];
    let key = job["cache"]["key"].as_str().and_then(Digest::parse);
    let inputs = job["inputs"].as_array().into_iter().flatten().filter_map(|path| path.as_str());
    match key {
        Some(key) => Ok(Done { key, inputs: inputs.map(PathBuf::from).collect() }),
        None => Err(failed(format!("{} did not name the entry of the compiled file", bthc.display()))),
    }
}
