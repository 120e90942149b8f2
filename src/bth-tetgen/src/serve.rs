//! Requests in, replies out.

use std::io::{self, BufWriter, Read, Write};

use bth_tetgen_protocol::{
    Error, Failure, Fault, PROTOCOL, Reply, Request, Tetrahedra, read_frame, write_frame,
};

use crate::tetgen;

/// Answers requests until the input ends.
///
/// # Errors
/// When the compiler is gone, or sends what is no frame.
pub(crate) fn serve(mut input: impl Read, output: impl Write) -> io::Result<()> {
    let mut output = BufWriter::with_capacity(1 << 16, output);
    let send =
        |output: &mut _, reply: &Reply| write_frame(output, &reply.to_bytes()).map_err(io::Error::other);
    send(&mut output, &hello())?;
    loop {
        let frame = match read_frame(&mut input) {
            Ok(frame) => frame,
            Err(Error::End) => return Ok(()),
            Err(error) => return Err(io::Error::other(error)),
        };
        let reply = match Request::from_bytes(&frame) {
            Ok(Request::Job(job)) => {
                drop(frame);
                match tetgen::tetrahedralize(&job) {
                    Ok(done) => Reply::Done(done),
                    Err((failure, text)) => Reply::Failed { failure, text },
                }
            }
            Ok(Request::Fault(Fault::Garble)) => {
                write_frame(&mut output, b"no reply").map_err(io::Error::other)?;
                continue;
            }
            Ok(Request::Fault(fault)) => misbehave(fault),
            Err(error) => Reply::Failed { failure: Failure::Request, text: error.to_string() },
        };
        match send(&mut output, &reply) {
            Ok(()) => {}
            // A reply that no frame can hold is a failed job; the pipe still works.
            Err(error) if reply_is_too_long(&error) => {
                send(&mut output, &Reply::Failed { failure: Failure::Memory, text: error.to_string() })?;
            }
            Err(error) => return Err(error),
        }
    }
}

fn reply_is_too_long(error: &io::Error) -> bool {
    error.get_ref().and_then(|e| e.downcast_ref::<Error>()).is_some_and(|e| matches!(e, Error::TooLong(_)))
}

fn hello() -> Reply {
    Reply::Hello { protocol: PROTOCOL, tetgen: tetgen::VERSION.into() }
}

fn misbehave(fault: Fault) -> Reply {
    match fault {
        Fault::Greet | Fault::Garble => hello(),
        Fault::Invent => Reply::Done(Tetrahedra { points: vec![[0.5; 3]; 4], tets: vec![[0, 1, 2, 3]] }),
        Fault::Fail(failure) => Reply::Failed { failure, text: "as planted".into() },
        Fault::Crash => std::process::abort(),
        Fault::Hang => loop {
            std::thread::park();
        },
        Fault::Hog => {
            let mut hoard: Vec<Vec<u8>> = Vec::new();
            loop {
                let mut block = Vec::new();
                if block.try_reserve_exact(1 << 24).is_err() {
                    break;
                }
                block.resize(1 << 24, 1);
                hoard.push(block);
            }
            Reply::Failed { failure: Failure::Memory, text: format!("took {} blocks", hoard.len()) }
        }
    }
}
