//! Progress on a terminal.

use crate::args::Args;
use crate::frame::TILE;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A bar that counts tiles; none where standard error is no terminal.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// For so many frames.
    pub(crate) fn new(frames: &[i32], args: &Args) -> Self {
        let (width, height) = args.size;
        let tiles = u64::from(width.div_ceil(TILE)) * u64::from(height.div_ceil(TILE)) * frames.len() as u64;
        let visible = std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(tiles), target);
        let style = ProgressStyle::with_template(
            "rendering {bar:30} {human_pos}/{human_len} tiles  {msg}  {eta} left",
        );
        let bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
        if frames.len() > 1 {
            bar.set_message(format!("{} frames", frames.len()));
        }
        Self(bar)
    }

    /// A tile is done.
    pub(crate) fn tile_done(&self) {
        self.0.inc(1);
    }

    /// Ends a frame.
    pub(crate) fn done(&self) {
        self.0.tick();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
