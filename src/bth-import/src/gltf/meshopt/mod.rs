//! Decompresses buffer views (EXT_meshopt_compression and KHR_meshopt_compression) by the crate
//! `meshopt`.
//!
//! The decoder is safe for untrusted streams but trusts the sizes it is called with, and its result
//! is allocated before it looks at the stream. So sizes are checked first against the extension's
//! rules and against the smallest stream that can hold as many elements: a decoded view has at most
//! 1024 times the bytes of its stream.

mod check;
#[cfg(feature = "meshopt")]
mod decoder;
#[cfg(all(test, feature = "meshopt"))]
mod tests;

use self::check::CheckedSizes;
use crate::gltf::schema::MeshoptCompression;

/// True if this build has the decoder (cargo feature `meshopt`, which needs a C++ compiler).
pub(super) const AVAILABLE: bool = cfg!(feature = "meshopt");

/// The bytes of a compressed view.
///
/// # Errors
/// What was expected and what was found, when the properties or the stream do not follow the
/// extension.
pub(super) fn decode(stream: &[u8], compression: &MeshoptCompression) -> Result<Vec<u8>, String> {
    let decoded = decoder::decode(stream, CheckedSizes::of(stream, compression)?);
    decoded.map_err(|message| format!("expected a stream of meshoptimizer, found: {message}"))
}

#[cfg(not(feature = "meshopt"))]
mod decoder {
    use super::check::CheckedSizes;

    /// Not reached: `buffer` refuses compressed views first in a build without the decoder.
    pub(super) fn decode(_: &[u8], sizes: CheckedSizes) -> Result<Vec<u8>, String> {
        let CheckedSizes { mode, filter, count, stride } = sizes;
        Err(format!("{mode:?} {filter:?}, {count} by {stride} bytes, which this build does not decode"))
    }
}
