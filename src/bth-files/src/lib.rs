//! Files as the compiler and its cache use them: content hashes ([`Digest`]), writes that leave a
//! whole file or none ([`replace`], [`write_once`]), files without a name ([`nameless`],
//! [`mapped`]), the check that a path is a regular file ([`regular_file`]), text that terminals
//! may show ([`printable`]), errors as programs report them ([`Diagnosis`]), and signals that end
//! a program ([`signals`]).

mod atomic;
mod diagnosis;
mod digest;
mod mapped;
mod printable;
mod regular;
pub mod signals;

pub use atomic::{SUFFIX, create_folders, nameless, replace, write_once, write_once_by};
pub use diagnosis::Diagnosis;
pub use digest::Digest;
pub use mapped::mapped;
pub use printable::printable;
pub use regular::regular_file;
