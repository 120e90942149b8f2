//! What the end-to-end, conformance and corruption tests share.

pub mod conformance;
pub mod oracle;
