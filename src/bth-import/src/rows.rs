//! Rows of attributes.

/// Row of an attribute that a corner does not have.
pub(super) const NONE: u32 = u32::MAX;
