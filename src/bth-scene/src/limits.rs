//! Every limit of manifests. Input beyond a limit is refused, never truncated.

/// Bytes of a manifest file.
pub const MAX_MANIFEST: u64 = 1 << 30;
/// Bytes of a name; the compiled file's limit too.
pub const MAX_NAME: usize = 4096;
/// Bytes of a path within the manifest's folder: the limit of common systems.
pub const MAX_PATH: usize = 4096;
