//! The messages between the compiler and its tetrahedralization worker.
//!
//! The worker is a separate program (TetGen is under the AGPL, keeps static state and can crash or
//! hang), reached through its standard input and output. Both sides send frames: a `u32` length,
//! little-endian, then that many bytes; the first byte is the message's tag. The worker sends
//! [`Reply::Hello`] first; then every request gets one reply.
//!
//! Neither side trusts the other: no length leads to an allocation beyond what has arrived, and
//! bytes that are no message are an [`Error`], never a panic.
#![warn(missing_docs)]

mod frame;
mod message;

pub use frame::{MAX_FRAME, read_frame, write_frame};
pub use message::{Failure, Fault, Job, PROTOCOL, Reply, Request, Tetrahedra};

/// Why a message could not be sent or understood.
#[derive(Debug)]
pub enum Error {
    /// The other side is gone, or the system failed.
    Io(std::io::Error),
    /// The stream ended between two frames.
    End,
    /// A frame of this many bytes exceeds [`MAX_FRAME`].
    TooLong(u64),
    /// The bytes are no message; names the part that does not fit.
    Malformed(&'static str),
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Error::Io(error) => write!(f, "{error}"),
            Error::End => write!(f, "the stream ended"),
            Error::TooLong(bytes) => write!(f, "a frame of {bytes} bytes, expected at most {MAX_FRAME}"),
            Error::Malformed(part) => write!(f, "malformed message: {part}"),
        }
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Error::Io(error)
    }
}
