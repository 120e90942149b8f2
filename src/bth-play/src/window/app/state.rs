//! The state of the window.

use crate::args::{Args, Mode};
use crate::camera::{Camera, up_vector};
use crate::failure::Failure;
use crate::output::Picture;
use crate::render::shutter;
use crate::window::camera::CameraController;
use crate::window::camera::{Content, ViewCamera};
use crate::window::playback::Playback;
use crate::window::progressive::ProgressiveRenderer;
use crate::window::screen::Screen;
use crate::window::summary::WindowSummary;
use bth::rays::Hit;
use glam::DVec2;
use rayon::ThreadPool;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

/// What dragging the pointer does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Drag {
    Orbit,
    Pan,
    Scrub,
}

/// The state of the window.
pub(crate) struct App<'a> {
    pub(super) content: Content<'a>,
    pub(super) pool: &'a ThreadPool,
    pub(super) renderer: ProgressiveRenderer,
    pub(super) playback: Playback,
    pub(super) view: ViewCamera,
    pub(super) mode: Mode,
    /// The window, once the event loop has created it.
    pub(super) screen: Option<Screen>,
    /// The last finished picture.
    pub(super) picture: Option<Picture>,
    /// Samples per pixel to which the picture is refined.
    pub(super) samples: u32,
    /// Pictures after which the window closes.
    pub(super) picture_limit: Option<u64>,
    pub(super) screenshot: Option<PathBuf>,
    /// True if the next finished picture is to be saved.
    pub(super) save_requested: bool,
    /// Keys that are down and move the camera.
    pub(super) keys_down: Vec<KeyCode>,
    pub(super) shift: bool,
    /// Pixels from the upper left.
    pub(super) pointer: DVec2,
    pub(super) drag: Option<Drag>,
    /// When the window was created. Other times are relative to it.
    pub(super) start: Instant,
    /// When keys last moved the camera.
    pub(super) last_flight: Duration,
    /// When the pictures of the last second were shown.
    pub(super) shown_at: Vec<Duration>,
    /// Pictures shown.
    pub(super) pictures: u64,
    /// Why the current frame cannot be set; shown in the title.
    pub(super) frame_error: Option<String>,
    /// Why the window closes, if it is an error.
    pub(super) failure: Option<Failure>,
}

/// Smallest distance from the camera to what it turns around, relative to the scene's diagonal.
const NEAREST: f64 = 1e-6;

impl<'a> App<'a> {
    /// A window that plays the frames of `range` at `rate` frames per second.
    pub(crate) fn new(content: Content<'a>, args: &Args, pool: &'a ThreadPool, range: (i32, i32)) -> Self {
        // Samples are the same as for -o, so that the window converges to what it writes.
        let samples = args.spp.max(args.window_frames.unwrap_or(0));
        let args = args.with_samples(samples);
        let renderer = ProgressiveRenderer::new(&args, shutter(content.scene, &args));
        let playback = Playback::new(range, content.rate);
        Self {
            content,
            pool,
            renderer,
            playback,
            view: ViewCamera::Initial,
            mode: args.mode,
            screen: None,
            picture: None,
            samples,
            picture_limit: args.window_frames.map(u64::from),
            screenshot: args.screenshot.clone(),
            save_requested: false,
            keys_down: Vec::new(),
            shift: false,
            pointer: DVec2::ZERO,
            drag: None,
            start: Instant::now(),
            last_flight: Duration::ZERO,
            shown_at: Vec::new(),
            pictures: 0,
            frame_error: None,
            failure: None,
        }
    }

    /// A summary of what was shown.
    ///
    /// # Errors
    /// The error that closed the window, if one did.
    pub(crate) fn finish(self) -> Result<WindowSummary, Failure> {
        let (width, height) = self.renderer.size();
        match self.failure {
            Some(failure) => Err(failure),
            None => Ok(WindowSummary {
                pictures: self.pictures,
                seconds: self.start.elapsed().as_secs_f64(),
                frame: self.playback.frame(),
                mode: self.mode.name(),
                width,
                height,
            }),
        }
    }

    /// Closes the window if an operation failed.
    pub(super) fn check(&mut self, events: &ActiveEventLoop, result: Result<(), Failure>) {
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
            events.exit();
        }
    }

    /// The camera at the time to which the scene is set.
    pub(super) fn camera(&self) -> Camera {
        self.view.camera(&self.content, &self.renderer.args())
    }

    /// The controller of the camera; the user takes over the current camera if another one was in
    /// use.
    pub(super) fn controller(&mut self) -> &mut CameraController {
        if !matches!(self.view, ViewCamera::Free(_)) {
            let camera = self.camera();
            let vertical = up_vector(self.renderer.args().up());
            self.view = ViewCamera::Free(CameraController::new(camera, vertical, self.distance(&camera)));
        }
        match &mut self.view {
            ViewCamera::Free(controller) => controller,
            ViewCamera::Initial | ViewCamera::Scene(_) => unreachable!("assigned above"),
        }
    }

    /// Distance to the hit in the middle of the picture, or else to the middle of the scene.
    fn distance(&self, camera: &Camera) -> f64 {
        let ray = camera.ray(DVec2::ZERO).to_ray();
        let mut hit = [Hit::MISS];
        self.content.scene.batch(&[ray]).nearest(&mut hit);
        let bounds = &self.content.setup.bounds;
        let diagonal = bounds.diagonal();
        if hit[0].is_hit() {
            f64::from(hit[0].t).max(NEAREST * diagonal)
        } else {
            (bounds.center() - camera.eye).length().max(0.1 * diagonal)
        }
    }
}
