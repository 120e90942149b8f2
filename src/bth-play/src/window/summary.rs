//! What a window showed, for the report.

use serde::Serialize;

/// What a window showed until it was closed.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct WindowSummary {
    /// Pictures shown.
    pub(crate) pictures: u64,
    /// Wall clock, from the first picture on.
    pub(crate) seconds: f64,
    /// Frame of the last picture.
    pub(crate) frame: i32,
    /// Mode of the last picture.
    pub(crate) mode: String,
    /// Width of the window, pixels.
    pub(crate) width: u32,
    /// Height of the window, pixels.
    pub(crate) height: u32,
}
