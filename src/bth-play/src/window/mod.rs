//! The interactive viewer: what is rendered as for pictures, a sample of each pixel at a time, in a window.

mod app;
mod canvas;
mod keys;
mod pilot;
mod playback;
mod screen;

use crate::args::Args;
use crate::failure::Failure;
use crate::sequence;
use crate::stage::Stage;
use app::App;
use bth::Scene;
use rayon::ThreadPool;
use serde::Serialize;
use std::path::Path;
use winit::event_loop::EventLoop;

/// What the window showed until it was closed.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Shown {
    /// Pictures shown.
    pub(crate) pictures: u64,
    /// From the first picture on, wall clock.
    pub(crate) seconds: f64,
    /// Frame of the last picture.
    pub(crate) frame: i32,
    /// Mode of the last picture.
    pub(crate) mode: &'static str,
    /// Size of the window.
    pub(crate) width: u32,
    /// Its height.
    pub(crate) height: u32,
}

/// Shows a scene in a window until it is closed.
///
/// # Errors
/// If there is no display, or the file lacks what the mode needs.
pub(crate) fn show(scene: &mut Scene, file: &Path, args: &Args, pool: &ThreadPool) -> Result<Shown, Failure> {
    let (whole, rate) = sequence::range(scene);
    let (first, last) = sequence::wanted(scene, file, args, None)?;
    let stage = pool.install(|| Stage::new(scene, file, args, whole))?;
    scene.set_frame(first)?;
    let events =
        EventLoop::new().map_err(|e| Failure::Window(format!("no window can be opened: {}", what(&e))))?;
    let mut app = App::new(scene, file, args, pool, stage, (first, last), rate);
    events.run_app(&mut app).map_err(|e| Failure::Window(format!("the window stopped working: {e}")))?;
    app.finish()
}

/// An error without the place in the sources of the library where it arose.
fn what(error: &dyn std::fmt::Display) -> String {
    let text = error.to_string();
    match text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")) {
        Some((_, what)) => what.to_owned(),
        None => text,
    }
}
