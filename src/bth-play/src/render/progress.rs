//! Progress on a terminal.

use super::tile::tile_count;
use crate::args::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A bar that counts tiles, shown only where standard error is a terminal.
pub(super) struct Progress(ProgressBar);

impl Progress {
    /// A bar for the tiles of a number of frames, each sampled at a number of times.
    pub(super) fn new(frames: usize, times: usize, args: &Args) -> Self {
        let tiles = u64::from(tile_count(args.size)) * frames as u64 * times as u64;
        let visible = std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(tiles), target);
        let style = ProgressStyle::with_template(
            "rendering {bar:30} {human_pos}/{human_len} tiles  {msg}  {eta} left",
        );
        let bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
        if frames > 1 {
            bar.set_message(format!("{frames} frames"));
        }
        Self(bar)
    }

    /// Counts a finished tile.
    pub(super) fn tile_done(&self) {
        self.0.inc(1);
    }

    /// Redraws the bar after a frame.
    pub(super) fn frame_done(&self) {
        self.0.tick();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
