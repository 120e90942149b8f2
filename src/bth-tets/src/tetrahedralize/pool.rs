//! The path of the worker program, and a slot for a worker that is replaced after any failure.

use std::path::PathBuf;
use std::time::Duration;

use bth_tetgen_protocol::{Request, Tetrahedra};

use bth_import::error::Result;
use bth_import::monitor::Monitor;

use super::TetOptions;
use super::failure::AttemptError;
use super::worker::{Setup, Worker};

/// File name of the worker program.
const PROGRAM: &str = if cfg!(windows) { "bth-tetgen.exe" } else { "bth-tetgen" };

/// The worker program: named by the options or by `BTH_TETGEN`, else next to this program, else on
/// the `PATH`.
///
/// # Errors
/// A hint for the user when there is no worker.
pub(super) fn find(options: &TetOptions) -> std::result::Result<PathBuf, String> {
    let named = options.worker.clone().or_else(|| std::env::var_os("BTH_TETGEN").map(PathBuf::from));
    if let Some(named) = named {
        // The worker starts in another folder, so a relative path is made absolute.
        return std::path::absolute(&named).ok().filter(|p| p.is_file()).ok_or_else(|| {
            format!(
                "the tetrahedralization worker {} does not exist; everything stays in the BVH",
                named.display()
            )
        });
    }
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join(PROGRAM)));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = beside.into_iter().chain(std::env::split_paths(&path).map(|folder| folder.join(PROGRAM)));
    found.filter_map(|p| std::path::absolute(p).ok()).find(|p| p.is_file()).ok_or_else(|| {
        format!(
            "no tetrahedralization worker {PROGRAM} was found next to this program or on the PATH, so everything \
             stays in the BVH; install it (docs/models.md, \"Tetrahedra\"), or let BTH_TETGEN name it"
        )
    })
}

/// The worker program that compilations will use, and the version of TetGen in it; or a sentence
/// that says why there is no worker.
///
/// # Errors
/// Cancelled.
pub fn worker(
    options: &TetOptions,
    monitor: &dyn Monitor,
) -> Result<std::result::Result<(PathBuf, String), String>> {
    let program = match find(options) {
        Ok(program) => program,
        Err(why) => return Ok(Err(why)),
    };
    let setup = Setup { program: program.clone(), memory: options.memory };
    let started = WorkerSlot::new(&setup).tetgen(monitor)?.map(str::to_owned);
    Ok(started.map(|version| (program, version)).map_err(|error| error.to_string()))
}

/// The tetrahedralizer that a compilation will use: the version of TetGen, or `none` without a
/// worker; `None` when the worker fails.
///
/// # Errors
/// Cancelled.
pub fn version(options: &TetOptions, monitor: &dyn Monitor) -> Result<Option<String>> {
    let Ok(program) = find(options) else { return Ok(Some("none".to_owned())) };
    let setup = Setup { program, memory: options.memory };
    let version = WorkerSlot::new(&setup).tetgen(monitor)?.map(str::to_owned);
    Ok(version.ok())
}

/// A slot for one worker.
pub(super) struct WorkerSlot<'a> {
    setup: &'a Setup,
    worker: Option<Worker>,
    /// Workers started in this slot.
    pub(super) started: u64,
}

impl<'a> WorkerSlot<'a> {
    /// An empty slot.
    pub(super) fn new(setup: &'a Setup) -> Self {
        Self { setup, worker: None, started: 0 }
    }

    /// The version of TetGen. Starts a worker if none runs.
    ///
    /// # Errors
    /// The errors of [`Worker::start`].
    pub(super) fn tetgen(
        &mut self,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<&str, AttemptError>> {
        if self.worker.is_none() {
            match Worker::start(self.setup, monitor)? {
                Ok(worker) => {
                    self.started += 1;
                    self.worker = Some(worker);
                }
                Err(error) => return Ok(Err(error)),
            }
        }
        Ok(Ok(self.worker.as_ref().map_or("", |w| w.tetgen.as_str())))
    }

    /// Sends a request to the worker, which is dropped after any failure.
    ///
    /// # Errors
    /// The errors of [`Worker::ask`].
    pub(super) fn ask(
        &mut self,
        request: &Request,
        deadline: Duration,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Tetrahedra, AttemptError>> {
        if let Err(error) = self.tetgen(monitor)? {
            return Ok(Err(error));
        }
        let Some(mut worker) = self.worker.take() else {
            return Ok(Err(AttemptError::Start("no worker".into())));
        };
        let answer = worker.ask(request, deadline, monitor)?;
        if answer.is_ok() {
            self.worker = Some(worker);
        }
        Ok(answer)
    }
}
