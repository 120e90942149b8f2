//! What keys change: mode, frame, camera, and what goes on while time passes.

use super::state::App;
use crate::messages::note;
use crate::window::camera::ViewCamera;
use crate::window::keys::{self, Action};
use crate::window::playback::Playback;
use glam::DVec3;
use std::time::Duration;
use winit::event_loop::ActiveEventLoop;

/// Fraction of the scene's diagonal that keys move the camera in a second.
const SPEED: f64 = 0.15;
/// Factor of the speed while Shift is down.
const FAST: f64 = 5.0;

impl App<'_> {
    /// Sets the scene to the frame of the playback.
    fn set_frame(&mut self) {
        let frame = self.playback.frame();
        self.frame_error = self.content.scene.set_frame(frame).err().map(|e| e.to_string());
        self.renderer.restart(self.playback.is_playing() || self.drag.is_some());
    }

    /// Performs the action of a key.
    pub(super) fn act(&mut self, action: Action, events: &ActiveEventLoop) {
        match action {
            Action::Mode(mode) => {
                self.mode = mode;
                self.renderer.set_mode(mode);
            }
            Action::TogglePlayback => {
                self.playback.toggle(self.start.elapsed());
                self.renderer.restart(self.playback.is_playing());
            }
            Action::Step(by) => self.seek(|playback| playback.step(by)),
            Action::First => self.seek(|playback| playback.scrub(0.0)),
            Action::Last => self.seek(|playback| playback.scrub(1.0)),
            Action::NextCamera => {
                let cameras = self.content.scene.description().map_or(0, |view| view.cameras.len() as u32);
                let current = match self.view {
                    ViewCamera::Scene(row) => Some(row),
                    ViewCamera::Initial => self.content.setup.scene_camera_row(),
                    ViewCamera::Free(_) => None,
                };
                if cameras > 0 {
                    self.view = ViewCamera::Scene(current.map_or(0, |row| (row + 1) % cameras));
                    self.renderer.restart(false);
                }
            }
            Action::Reset => {
                self.view = ViewCamera::Initial;
                self.renderer.restart(false);
            }
            Action::Save => {
                // While a scene plays, no picture is ever refined to all its samples.
                if self.playback.is_playing() {
                    self.act(Action::TogglePlayback, events);
                }
                self.save_requested = true;
                let saved = if self.renderer.is_done(self.samples) { self.save() } else { Ok(()) };
                self.check(events, saved);
            }
            Action::Help => {
                note(keys::HELP.trim_end());
            }
            Action::Close => events.exit(),
        }
    }

    /// Moves the playback, and sets the scene if that changed the frame.
    pub(super) fn seek(&mut self, go: impl Fn(&mut Playback) -> bool) {
        if go(&mut self.playback) {
            self.set_frame();
        }
    }

    /// Continues playing, and moves the camera by the keys that are down.
    pub(super) fn advance(&mut self, now: Duration) {
        if self.playback.advance(now) {
            self.set_frame();
        }
        if !self.keys_down.is_empty() {
            let direction: DVec3 = self
                .keys_down
                .iter()
                .filter_map(|key| keys::fly_direction(*key))
                .map(DVec3::from_array)
                .sum();
            let speed = SPEED * self.content.setup.bounds.diagonal() * if self.shift { FAST } else { 1.0 };
            let by = direction * speed * now.saturating_sub(self.last_flight).as_secs_f64();
            self.last_flight = now;
            self.controller().fly(by);
            self.renderer.restart(true);
        }
    }
}
