//! One worker process: its start, requests to it, and its end after a failure, a deadline or the
//! last request.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bth_tetgen_protocol::{
    Error as ProtocolError, PROTOCOL, Reply, Request, Tetrahedra, read_frame, write_frame,
};

use bth_import::error::Result;
use bth_import::monitor::Monitor;

use super::failure::AttemptError;

/// How to start a worker.
#[derive(Clone, Debug)]
pub(super) struct Setup {
    /// The program.
    pub(super) program: PathBuf,
    /// Its limit of address space, bytes.
    pub(super) memory: u64,
}

/// Interval between checks for cancellation while a worker is busy.
const CANCEL_INTERVAL: Duration = Duration::from_millis(100);
/// Time limit for the greeting of a worker.
const START: Duration = Duration::from_secs(20);

/// A running worker. It ends when this value is dropped, or with this process, however that ends.
pub(super) struct Worker {
    child: Child,
    /// TetGen's version.
    pub(super) tetgen: String,
    requests: Option<Sender<Vec<u8>>>,
    replies: Receiver<std::result::Result<Reply, ProtocolError>>,
    io_thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts a worker and waits for its greeting. The worker ends with the calling thread.
    ///
    /// # Errors
    /// The outer error is cancellation, the inner one the reason for which the worker did not
    /// start.
    pub(super) fn start(
        setup: &Setup,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Self, AttemptError>> {
        let fail = |what: &str, error: &dyn std::fmt::Display| {
            Ok(Err(AttemptError::Start(format!("{}: {what}: {error}", setup.program.display()))))
        };
        let mut command = Command::new(&setup.program);
        command.args(["--memory", &setup.memory.to_string(), "--parent", &std::process::id().to_string()]);
        // TetGen opens no files here; a version that did would write them in the folder for
        // temporary files, not in the user's. A missing folder must not keep the worker from
        // starting.
        let folder = std::env::temp_dir();
        if folder.is_dir() {
            command.current_dir(folder);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        // The worker does not receive interrupts from the terminal; the compiler receives them and
        // ends its workers.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return fail("cannot be started", &error),
        };
        let (requests, outbox) = channel::<Vec<u8>>();
        let (inbox, replies) = channel();
        let mut to = child.stdin.take().expect("stdin was piped");
        let mut from = child.stdout.take().expect("stdout was piped");
        // The pipes are served by a separate thread, which may block; killing the process unblocks
        // it.
        let serve = move || {
            let mut receive = || Reply::from_bytes(&read_frame(&mut from)?);
            if inbox.send(receive()).is_err() {
                return;
            }
            while let Ok(bytes) = outbox.recv() {
                let reply = write_frame(&mut to, &bytes).and_then(|()| receive());
                if inbox.send(reply).is_err() {
                    return;
                }
            }
        };
        let mut worker =
            Self { child, tetgen: String::new(), requests: Some(requests), replies, io_thread: None };
        match std::thread::Builder::new().spawn(serve) {
            Ok(io_thread) => worker.io_thread = Some(io_thread),
            Err(error) => return fail("cannot be served by a thread", &error),
        }
        Ok(match worker.wait(START, monitor)? {
            Ok(Reply::Hello { protocol: PROTOCOL, tetgen }) => {
                worker.tetgen = tetgen;
                Ok(worker)
            }
            Ok(Reply::Hello { protocol, .. }) => {
                return fail("does not fit", &format!("protocol {PROTOCOL} expected, {protocol} found"));
            }
            Ok(_) => return fail("does not fit", &"no hello"),
            Err(error) => return fail("does not work", &error),
        })
    }

    /// Sends a request and waits for the answer. After any failure the worker must be dropped.
    ///
    /// # Errors
    /// The outer error is cancellation, the inner one the failure of the attempt.
    pub(super) fn ask(
        &mut self,
        request: &Request,
        deadline: Duration,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Tetrahedra, AttemptError>> {
        let sent = self.requests.as_ref().is_some_and(|to| to.send(request.to_bytes()).is_ok());
        if !sent {
            return Ok(Err(self.exit_error()));
        }
        Ok(match self.wait(deadline, monitor)? {
            Ok(Reply::Done(done)) => Ok(done),
            Ok(Reply::Failed { failure, text }) => Err(AttemptError::Failed(failure, text)),
            Ok(Reply::Hello { .. }) => Err(AttemptError::Answer("a second hello".into())),
            Err(error) => Err(error),
        })
    }

    fn wait(
        &mut self,
        deadline: Duration,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Reply, AttemptError>> {
        let start = Instant::now();
        loop {
            monitor.check()?;
            let left = deadline.saturating_sub(start.elapsed());
            match self.replies.recv_timeout(left.min(CANCEL_INTERVAL)) {
                Ok(Ok(reply)) => return Ok(Ok(reply)),
                Ok(Err(ProtocolError::End | ProtocolError::Io(_))) => return Ok(Err(self.exit_error())),
                Ok(Err(error)) => return Ok(Err(AttemptError::Answer(error.to_string()))),
                Err(RecvTimeoutError::Disconnected) => return Ok(Err(self.exit_error())),
                Err(RecvTimeoutError::Timeout) if left <= CANCEL_INTERVAL => {
                    return Ok(Err(AttemptError::TimedOut));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The error for a process whose pipe has closed, with its exit status.
    fn exit_error(&mut self) -> AttemptError {
        let _ = self.child.kill();
        AttemptError::Died(match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // The process may be busy or hang. It is killed at once because it has no state that would
        // be lost.
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.requests = None;
        if let Some(io_thread) = self.io_thread.take() {
            let _ = io_thread.join();
        }
    }
}
