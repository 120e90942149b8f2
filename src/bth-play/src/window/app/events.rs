//! The events of the window: keys, the pointer, and when there is time to render.

use super::state::{App, Drag};
use crate::failure::Failure;
use crate::window::keys;
use crate::window::screen::{GRIP, Screen};
use glam::DVec2;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::PhysicalKey;
use winit::window::{Window, WindowId};

/// Pixels that count as a notch of the wheel, for devices that scroll by pixels.
const PIXELS_PER_NOTCH: f64 = 40.0;

impl App<'_> {
    fn key(&mut self, event: &KeyEvent, events: &ActiveEventLoop) {
        let PhysicalKey::Code(code) = event.physical_key else { return };
        let pressed = event.state == ElementState::Pressed;
        if keys::fly_direction(code).is_some() {
            self.keys_down.retain(|key| *key != code);
            if pressed {
                if self.keys_down.is_empty() {
                    self.last_flight = self.start.elapsed();
                }
                self.keys_down.push(code);
            }
        } else if let (true, Some(action)) = (pressed, keys::action(code, self.shift)) {
            self.act(action, events);
        }
    }

    /// Handles a movement of the pointer to a point, pixels from the upper left.
    fn move_pointer(&mut self, at: DVec2) {
        let by = (at - self.pointer) / f64::from(self.renderer.size().1);
        self.pointer = at;
        match self.drag {
            None => return,
            Some(Drag::Orbit) => self.controller().orbit(by),
            Some(Drag::Pan) => self.controller().pan(by),
            Some(Drag::Scrub) => {
                let part = at.x / f64::from(self.renderer.size().0);
                return self.seek(|playback| playback.scrub(part));
            }
        }
        self.renderer.restart(true);
    }

    fn press(&mut self, button: MouseButton, pressed: bool) {
        if !pressed {
            self.drag = None;
            return;
        }
        let low = self.pointer.y > f64::from(self.renderer.size().1) - GRIP;
        self.drag = match button {
            MouseButton::Left if low && self.playback.is_animated() => Some(Drag::Scrub),
            MouseButton::Left if !self.shift => Some(Drag::Orbit),
            MouseButton::Left | MouseButton::Right | MouseButton::Middle => Some(Drag::Pan),
            _ => None,
        };
        if self.drag == Some(Drag::Scrub) {
            self.move_pointer(self.pointer);
        }
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let (width, height) = self.renderer.size();
        let wanted = Window::default_attributes()
            .with_title(format!("{} - bth-play", self.content.file.display()))
            .with_inner_size(PhysicalSize::new(width, height));
        let screen = events
            .create_window(wanted)
            .map_err(|e| Failure::Window(format!("no window can be opened: {e}")))
            .and_then(Screen::new);
        let result = screen.map(|screen| {
            let size = screen.window.inner_size();
            self.renderer.resize((size.width.max(1), size.height.max(1)));
            self.screen = Some(screen);
        });
        self.check(events, result);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => {
                self.renderer.resize((size.width.max(1), size.height.max(1)));
            }
            WindowEvent::RedrawRequested => {
                let shown = self.show();
                self.check(events, shown);
            }
            WindowEvent::Focused(false) => self.keys_down.clear(),
            WindowEvent::ModifiersChanged(modifiers) => self.shift = modifiers.state().shift_key(),
            WindowEvent::KeyboardInput { event, .. } => self.key(&event, events),
            WindowEvent::CursorMoved { position, .. } => {
                self.move_pointer(DVec2::new(position.x, position.y))
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.press(button, state == ElementState::Pressed);
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(y),
                    MouseScrollDelta::PixelDelta(by) => by.y / PIXELS_PER_NOTCH,
                };
                self.controller().dolly(notches);
                self.renderer.restart(true);
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_none() || self.failure.is_some() {
            return;
        }
        self.advance(self.start.elapsed());
        if !self.renderer.is_done(self.samples) {
            let drawn = self.draw(events);
            self.check(events, drawn);
        }
        let busy =
            !self.renderer.is_done(self.samples) || self.playback.is_playing() || !self.keys_down.is_empty();
        // While a refined scene plays, only the time of its next frame has to be awaited.
        events.set_control_flow(match busy {
            true if self.renderer.is_done(self.samples) => {
                ControlFlow::WaitUntil(Instant::now() + Duration::from_millis(4))
            }
            true => ControlFlow::Poll,
            false => ControlFlow::Wait,
        });
    }
}
