//! The interactive viewer: frames are rendered as for pictures, one sample of each pixel at a time,
//! in a window.

mod app;
mod camera;
mod keys;
mod playback;
mod progressive;
mod screen;
mod summary;

pub(crate) use summary::WindowSummary;

use crate::args::Args;
use crate::camera::SceneSetup;
use crate::failure::Failure;
use crate::render::{frame_range, frames_to_show, light_factor};
use app::App;
use bth::Scene;
use camera::Content;
use rayon::ThreadPool;
use std::path::Path;
use winit::event_loop::EventLoop;

/// Shows a scene in a window until it is closed.
///
/// # Errors
/// If there is no display, or the file lacks what the mode needs.
pub(crate) fn show(
    scene: &mut Scene,
    file: &Path,
    args: &Args,
    pool: &ThreadPool,
) -> Result<WindowSummary, Failure> {
    let (whole, rate) = frame_range(scene);
    let (first, last) = frames_to_show(scene, file, args, None)?;
    let setup = pool.install(|| SceneSetup::new(scene, file, args, whole))?;
    let factor = pool.install(|| light_factor(scene, file, &setup, args, whole))?;
    scene.set_frame(first)?;
    let events = EventLoop::new()
        .map_err(|e| Failure::Window(format!("no window can be opened: {}", without_source_location(&e))))?;
    let mut app = App::new(Content { scene, file, setup, rate, factor }, args, pool, (first, last));
    events.run_app(&mut app).map_err(|e| Failure::Window(format!("the window stopped working: {e}")))?;
    app.finish()
}

/// The text of an error of the window library without the location in its source code.
fn without_source_location(error: &dyn std::fmt::Display) -> String {
    let text = error.to_string();
    match text.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")) {
        Some((_, what)) => what.to_owned(),
        None => text,
    }
}
