//! Every cap in one place. What is beyond one is refused, and never cut.

/// Bytes of a manifest file.
pub const MAX_MANIFEST: u64 = 1 << 30;
/// Bytes of a name; the compiled file's limit too.
pub const MAX_NAME: usize = 4096;
/// Bytes of a path within the manifest's folder: what systems take at most.
pub const MAX_PATH: usize = 4096;
