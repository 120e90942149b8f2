//! A content-addressed store of compiled results.
//!
//! A [`Key`] names everything that a result depends on and nothing else; a [`Record`] names the
//! content of a key; the content is named by its own hash. Both are written once, whole, and
//! checked whenever they are read, so any number of processes may use one folder, also on network
//! file systems, and no damaged entry is served. Locks only save work that another process is doing
//! already, and keep what is mapped from being evicted.
//!
//! ```text
//! FOLDER/v1/keys/ab/abcd…     records, named by their key's hash
//! FOLDER/v1/blobs/ef/ef01…    contents, named by their BLAKE3
//! FOLDER/v1/locks/            one empty file for each key that is being worked on
//! FOLDER/v1/last/             the last key of each source, to explain misses
//! FOLDER/v1/tally             statistics: hits, misses and evictions, a line for each process
//! ```

mod evict;
mod files;
mod fingerprint;
mod inventory;
mod key;
mod last_keys;
mod locate;
mod lock;
mod record;
mod remote;
#[cfg(feature = "s3")]
mod remote_s3;
mod statistics;
mod store;

pub use bth_files::Digest;
pub use evict::Evicted;
pub use inventory::{Cleared, Entry, Inventory, Verification};
pub use key::Key;
pub use locate::{DEFAULT_CAP, folder, parse_bytes};
pub use lock::WorkLock;
pub use record::Record;
pub use remote::{Folder, Remote};
#[cfg(feature = "s3")]
pub use remote_s3::S3;
pub use statistics::Statistics;
pub use store::{Pin, Store};
