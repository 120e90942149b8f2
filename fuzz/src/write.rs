//! The builder of files, from the sources of `bth-compile`. The rest of that crate is not fuzzed,
//! and would take a quarter of the build.
#![allow(dead_code)]

#[path = "../../src/bth-compile/src/write/builder.rs"]
mod builder;
#[path = "../../src/bth-compile/src/write/bytes.rs"]
mod bytes;
#[path = "../../src/bth-compile/src/write/content.rs"]
mod content;
#[path = "../../src/bth-compile/src/write/disk.rs"]
mod disk;
#[path = "../../src/bth-compile/src/write/whole.rs"]
mod whole;

pub use builder::FileBuilder;
use bytes::Bytes;
use disk::DiskFile;

fn read_failed(error: &std::io::Error) -> crate::error::Error {
    crate::error::Error::Internal { code: "BTH-X030", message: error.to_string() }
}
