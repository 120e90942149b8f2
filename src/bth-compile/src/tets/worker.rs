//! One worker process: started, asked, and ended when it dies, hangs or is no longer needed.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bth_tetgen_protocol::{
    Error as ProtocolError, PROTOCOL, Reply, Request, Tetrahedra, read_frame, write_frame,
};

use crate::error::Result;
use crate::monitor::Monitor;

use super::report::Trouble;

/// How to start a worker.
#[derive(Clone, Debug)]
pub(super) struct Setup {
    /// The program.
    pub(super) program: PathBuf,
    /// Its limit of address space, bytes.
    pub(super) memory: u64,
}

/// How often cancellation is looked at while a worker works.
const GLANCE: Duration = Duration::from_millis(100);
/// Time for a worker to say hello.
const START: Duration = Duration::from_secs(20);

/// A running worker. It ends with this value, or with this process, however that ends.
pub(super) struct Worker {
    child: Child,
    /// TetGen's version.
    pub(super) tetgen: String,
    requests: Option<Sender<Vec<u8>>>,
    replies: Receiver<std::result::Result<Reply, ProtocolError>>,
    talker: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts a worker and waits for its hello. The worker dies with the thread that calls.
    ///
    /// # Errors
    /// Outer: cancelled. Inner: why it did not start.
    pub(super) fn start(setup: &Setup, monitor: &dyn Monitor) -> Result<std::result::Result<Self, Trouble>> {
        let fail = |what: &str, error: &dyn std::fmt::Display| {
            Ok(Err(Trouble::Start(format!("{}: {what}: {error}", setup.program.display()))))
        };
        let mut command = Command::new(&setup.program);
        command.args(["--memory", &setup.memory.to_string(), "--parent", &std::process::id().to_string()]);
        // Its TetGen opens no files; one that did would leave them where others look after them.
        command
            .current_dir(std::env::temp_dir())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        // An interrupt from the terminal is for the compiler, which then ends its workers.
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
        // A thread of its own may block on the pipes; killing the process unblocks it.
        let talker = std::thread::spawn(move || {
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
        });
        let mut worker =
            Self { child, tetgen: String::new(), requests: Some(requests), replies, talker: Some(talker) };
        Ok(match worker.wait(START, monitor)? {
            Ok(Reply::Hello { protocol: PROTOCOL, tetgen }) => {
                worker.tetgen = tetgen;
                Ok(worker)
            }
            Ok(Reply::Hello { protocol, .. }) => {
                return fail("does not fit", &format!("protocol {PROTOCOL} expected, {protocol} found"));
            }
            Ok(_) => return fail("does not fit", &"no hello"),
            Err(trouble) => return fail("does not work", &trouble),
        })
    }

    /// Sends a request and waits for the answer. After any failure the worker must be dropped.
    ///
    /// # Errors
    /// Outer: cancelled. Inner: what went wrong.
    pub(super) fn ask(
        &mut self,
        request: &Request,
        deadline: Duration,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Tetrahedra, Trouble>> {
        let sent = self.requests.as_ref().is_some_and(|to| to.send(request.to_bytes()).is_ok());
        if !sent {
            return Ok(Err(self.obituary()));
        }
        Ok(match self.wait(deadline, monitor)? {
            Ok(Reply::Done(done)) => Ok(done),
            Ok(Reply::Failed { failure, text }) => Err(Trouble::Failed(failure, text)),
            Ok(Reply::Hello { .. }) => Err(Trouble::Answer("a second hello".into())),
            Err(trouble) => Err(trouble),
        })
    }

    fn wait(
        &mut self,
        deadline: Duration,
        monitor: &dyn Monitor,
    ) -> Result<std::result::Result<Reply, Trouble>> {
        let start = Instant::now();
        loop {
            monitor.check()?;
            let left = deadline.saturating_sub(start.elapsed());
            match self.replies.recv_timeout(left.min(GLANCE)) {
                Ok(Ok(reply)) => return Ok(Ok(reply)),
                Ok(Err(ProtocolError::End | ProtocolError::Io(_))) => return Ok(Err(self.obituary())),
                Ok(Err(error)) => return Ok(Err(Trouble::Answer(error.to_string()))),
                Err(RecvTimeoutError::Disconnected) => return Ok(Err(self.obituary())),
                Err(RecvTimeoutError::Timeout) if left <= GLANCE => return Ok(Err(Trouble::TimedOut)),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// How the process ended, now that its pipe has.
    fn obituary(&mut self) -> Trouble {
        let _ = self.child.kill();
        Trouble::Died(match self.child.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It may be in the midst of a job, or hang: there is nothing to save.
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.requests = None;
        if let Some(talker) = self.talker.take() {
            let _ = talker.join();
        }
    }
}
