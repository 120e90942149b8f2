//! Files as the compiler and its cache use them: content hashes ([`Digest`]), writes that leave a
//! whole file or none ([`replace`], [`write_once`]), copies of ranges from a file that others may
//! change ([`OpenFile`]), whether there is a file at all ([`regular_file`]), text that terminals
//! may show ([`printable`]), errors as programs report them ([`Diagnosis`]), and signals that end a
//! program ([`signals`]).

mod atomic;
mod diagnosis;
mod digest;
mod open_file;
mod printable;
mod regular;
pub mod signals;

pub use atomic::{SUFFIX, create_folders, replace, replace_file, write_once};
pub use diagnosis::Diagnosis;
pub use digest::Digest;
pub use open_file::{FileState, OpenFile};
pub use printable::printable;
pub use regular::regular_file;
