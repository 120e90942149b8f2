//! What the window shows, and what changes that.

mod events;

use crate::args::{Args, Mode};
use crate::camera::{self, Camera};
use crate::failure::Failure;
use crate::picture::Picture;
use crate::report;
use crate::stage::Stage;
use crate::window::Shown;
use crate::window::canvas::Canvas;
use crate::window::keys::{self, Action};
use crate::window::pilot::Pilot;
use crate::window::playback::Playback;
use crate::window::screen::Screen;
use bth::Scene;
use bth::rays::{Hit, Ray};
use glam::{DVec2, DVec3};
use rayon::ThreadPool;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

/// Part of the scene's diagonal that is flown in a second.
const SPEED: f64 = 0.15;
/// Times faster with Shift.
const FASTER: f64 = 5.0;

/// What the pointer drags.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drag {
    Orbit,
    Pan,
    Scrub,
}

/// Whose camera it is.
#[derive(Clone, Copy, Debug)]
enum View {
    /// The stage's, which may move with the scene.
    Stage,
    /// That of a row of the scene's cameras.
    Carried(u32),
    /// The user's.
    Free(Pilot),
}

/// The state of the window.
pub(crate) struct App<'a> {
    scene: &'a mut Scene,
    file: &'a Path,
    pool: &'a ThreadPool,
    stage: Stage,
    canvas: Canvas,
    playback: Playback,
    view: View,
    mode: Mode,
    screen: Option<Screen>,
    picture: Option<Picture>,
    /// Samples to refine to.
    samples: u32,
    /// Pictures after which the window closes.
    most: Option<u64>,
    screenshot: Option<PathBuf>,
    /// The next picture that is not coarse is to be saved.
    save: bool,
    down: Vec<KeyCode>,
    shift: bool,
    pointer: DVec2,
    drag: Option<Drag>,
    start: Instant,
    /// When keys were last flown with.
    flown: Duration,
    /// When the last pictures were shown.
    shown_at: Vec<Duration>,
    pictures: u64,
    /// What keeps the frame from being shown.
    trouble: Option<String>,
    failure: Option<Failure>,
}

impl<'a> App<'a> {
    pub(crate) fn new(
        scene: &'a mut Scene,
        file: &'a Path,
        args: &Args,
        pool: &'a ThreadPool,
        stage: Stage,
        range: (i32, i32),
        rate: f64,
    ) -> Self {
        Self {
            scene,
            file,
            pool,
            stage,
            canvas: Canvas::new(args),
            playback: Playback::new(range, rate),
            view: View::Stage,
            mode: args.mode,
            screen: None,
            picture: None,
            samples: args.spp.max(args.window_frames.unwrap_or(0)),
            most: args.window_frames.map(u64::from),
            screenshot: args.screenshot.clone(),
            save: false,
            down: Vec::new(),
            shift: false,
            pointer: DVec2::ZERO,
            drag: None,
            start: Instant::now(),
            flown: Duration::ZERO,
            shown_at: Vec::new(),
            pictures: 0,
            trouble: None,
            failure: None,
        }
    }

    /// What was shown, or why the window closed.
    pub(crate) fn finish(self) -> Result<Shown, Failure> {
        let (width, height) = self.canvas.size();
        match self.failure {
            Some(failure) => Err(failure),
            None => Ok(Shown {
                pictures: self.pictures,
                seconds: self.start.elapsed().as_secs_f64(),
                frame: self.playback.frame(),
                mode: self.mode.name(),
                width,
                height,
            }),
        }
    }

    /// Ends the window when something failed.
    fn check(&mut self, events: &ActiveEventLoop, result: Result<(), Failure>) {
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
            events.exit();
        }
    }

    fn camera(&self) -> Camera {
        let args = self.canvas.args();
        match self.view {
            View::Stage => self.stage.camera(self.scene, &args).reshaped(args.size),
            View::Carried(row) => camera::carried(self.scene, row, &args),
            View::Free(pilot) => pilot.camera(args.size),
        }
    }

    /// The camera as the user's own, from where it is.
    fn pilot(&mut self) -> &mut Pilot {
        if !matches!(self.view, View::Free(_)) {
            let camera = self.camera();
            let vertical = camera::vertical(self.canvas.args().up);
            self.view = View::Free(Pilot::new(camera, vertical, self.distance(&camera)));
        }
        match &mut self.view {
            View::Free(pilot) => pilot,
            View::Stage | View::Carried(_) => unreachable!("made so above"),
        }
    }

    /// To what is in the middle of the picture, else to the middle of the scene.
    fn distance(&self, camera: &Camera) -> f64 {
        let sight = camera.sight(DVec2::ZERO);
        let ray = Ray {
            origin: sight.origin.as_vec3().to_array(),
            tmin: sight.range.0 as f32,
            direction: sight.direction.as_vec3().to_array(),
            tmax: sight.range.1 as f32,
        };
        let mut hit = [Hit::MISS];
        self.scene.nearest_batch(&[ray], None, &mut hit);
        let diagonal = self.stage.space.diagonal();
        if hit[0].is_hit() {
            f64::from(hit[0].t).max(1e-6 * diagonal)
        } else {
            (self.stage.space.center() - camera.eye).length().max(0.1 * diagonal)
        }
    }

    /// Shows the frame of the playback.
    fn set_frame(&mut self) {
        let frame = self.playback.frame();
        self.trouble = self.scene.set_frame(frame).err().map(|e| e.to_string());
        self.canvas.restart(self.playback.is_playing() || self.drag.is_some());
    }

    fn act(&mut self, action: Action, events: &ActiveEventLoop) {
        match action {
            Action::Mode(mode) => {
                self.mode = mode;
                self.canvas.set_mode(mode);
            }
            Action::Toggle => {
                self.playback.toggle(self.start.elapsed());
                self.canvas.restart(self.playback.is_playing());
            }
            Action::Step(by) => self.seek(|playback| playback.step(by)),
            Action::First => self.seek(|playback| playback.scrub(0.0)),
            Action::Last => self.seek(|playback| playback.scrub(1.0)),
            Action::NextCamera => {
                let cameras = self.scene.description().map_or(0, |view| view.cameras.len() as u32);
                let now = match self.view {
                    View::Carried(row) => Some(row),
                    View::Stage => self.stage.carrier(),
                    View::Free(_) => None,
                };
                if cameras > 0 {
                    self.view = View::Carried(now.map_or(0, |row| (row + 1) % cameras));
                    self.canvas.restart(false);
                }
            }
            Action::Reset => {
                self.view = View::Stage;
                self.canvas.restart(false);
            }
            Action::Save => {
                // Of a scene that goes on, no picture would ever be finished.
                if self.playback.is_playing() {
                    self.act(Action::Toggle, events);
                }
                self.save = true;
                let saved = if self.canvas.is_done(self.samples) { self.save() } else { Ok(()) };
                self.check(events, saved);
            }
            Action::Help => {
                report::note(keys::HELP.trim_end());
            }
            Action::Close => events.exit(),
        }
    }

    fn seek(&mut self, go: impl Fn(&mut Playback) -> bool) {
        if go(&mut self.playback) {
            self.set_frame();
        }
    }

    /// What goes on by itself: playing and flying.
    fn advance(&mut self, now: Duration) {
        if self.playback.advance(now) {
            self.set_frame();
        }
        if !self.down.is_empty() {
            let direction: DVec3 =
                self.down.iter().filter_map(|key| keys::flight(*key)).map(DVec3::from_array).sum();
            let speed = SPEED * self.stage.space.diagonal() * if self.shift { FASTER } else { 1.0 };
            let by = direction * speed * now.saturating_sub(self.flown).as_secs_f64();
            self.flown = now;
            self.pilot().fly(by);
            self.canvas.restart(true);
        }
    }

    /// Draws for a moment, and shows what is finished.
    fn draw(&mut self, events: &ActiveEventLoop) -> Result<(), Failure> {
        let camera = self.camera();
        let drawn = self.canvas.draw(self.scene, self.file, &self.stage, camera, self.pool)?;
        let Some(picture) = drawn else { return Ok(()) };
        self.picture = Some(picture);
        self.show()?;
        self.pictures += 1;
        self.count_shown();
        self.entitle();
        let ended = self.most.is_some_and(|most| self.pictures >= most);
        // What P asks for has all the samples that were asked for.
        if self.save && self.canvas.is_done(self.samples) || ended && self.screenshot.is_some() {
            self.save()?;
        }
        if ended {
            events.exit();
        }
        Ok(())
    }

    fn save(&mut self) -> Result<(), Failure> {
        self.save = false;
        let Some(picture) = &self.picture else { return Ok(()) };
        let path = self.screenshot.clone().unwrap_or_else(|| "bth-play.png".into());
        picture.write(&path)?;
        report::note(&format!("wrote {}", path.display()));
        Ok(())
    }

    fn show(&mut self) -> Result<(), Failure> {
        let bar = self.playback.moves().then(|| {
            let (first, last) = self.playback.range();
            let whole = f64::from(last) - f64::from(first) + 1.0;
            (f64::from(self.playback.frame()) - f64::from(first) + 1.0) / whole
        });
        match (&mut self.screen, &self.picture) {
            (Some(screen), Some(picture)) => screen.show(picture, self.canvas.size(), bar),
            _ => Ok(()),
        }
    }

    fn count_shown(&mut self) {
        let now = self.start.elapsed();
        self.shown_at.retain(|at| now.saturating_sub(*at) < Duration::from_secs(1));
        self.shown_at.push(now);
    }

    /// Pictures a second, by those of the last second.
    fn rate(&self) -> f64 {
        match (self.shown_at.first(), self.shown_at.last()) {
            (Some(first), Some(last)) if last > first => {
                (self.shown_at.len() - 1) as f64 / (*last - *first).as_secs_f64()
            }
            _ => 0.0,
        }
    }

    fn entitle(&self) {
        let Some(screen) = &self.screen else { return };
        let name = self.file.file_name().unwrap_or_default().to_string_lossy();
        let (_, last) = self.playback.range();
        let mut title = format!(
            "{name} - bth-play - frame {} of {last} - {} - {:.1} fps - {} of {} samples",
            self.playback.frame(),
            self.mode.name(),
            self.rate(),
            self.canvas.samples(),
            self.samples,
        );
        if let Some(trouble) = &self.trouble {
            title = format!("{title} - {trouble}");
        }
        screen.window.set_title(&title);
    }
}
