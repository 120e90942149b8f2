//! Drawing: rendering for a moment, showing and saving pictures, and the title.

use super::state::App;
use crate::args::SCREENSHOT;
use crate::failure::Failure;
use crate::messages::note;
use std::time::Duration;
use winit::event_loop::ActiveEventLoop;

impl App<'_> {
    /// Renders for a moment, and shows the picture when it got another sample.
    pub(super) fn draw(&mut self, events: &ActiveEventLoop) -> Result<(), Failure> {
        let (frame, view) = (self.playback.frame(), self.view);
        let rendered = self.renderer.render(&mut self.content, frame, view, self.pool)?;
        let Some(picture) = rendered else { return Ok(()) };
        self.picture = Some(picture);
        self.show()?;
        self.pictures += 1;
        self.count_shown();
        self.set_title();
        let ended = self.picture_limit.is_some_and(|limit| self.pictures >= limit);
        // A picture that P saves has all its samples.
        if self.save_requested && self.renderer.is_done(self.samples) || ended && self.screenshot.is_some() {
            self.save()?;
        }
        if ended {
            events.exit();
        }
        Ok(())
    }

    /// Writes the last finished picture.
    pub(super) fn save(&mut self) -> Result<(), Failure> {
        self.save_requested = false;
        let Some(picture) = &self.picture else { return Ok(()) };
        let path = self.screenshot.clone().unwrap_or_else(|| SCREENSHOT.into());
        picture.write(&path)?;
        note(&format!("wrote {}", path.display()));
        Ok(())
    }

    /// Shows the last finished picture.
    pub(super) fn show(&mut self) -> Result<(), Failure> {
        let bar = self.playback.is_animated().then(|| {
            let (first, last) = self.playback.range();
            let whole = f64::from(last) - f64::from(first) + 1.0;
            (f64::from(self.playback.frame()) - f64::from(first) + 1.0) / whole
        });
        match (&mut self.screen, &self.picture) {
            (Some(screen), Some(picture)) => screen.show(picture, self.renderer.size(), bar),
            _ => Ok(()),
        }
    }

    fn count_shown(&mut self) {
        let now = self.start.elapsed();
        self.shown_at.retain(|at| now.saturating_sub(*at) < Duration::from_secs(1));
        self.shown_at.push(now);
    }

    /// Pictures per second, over the last second.
    fn rate(&self) -> f64 {
        match (self.shown_at.first(), self.shown_at.last()) {
            (Some(first), Some(last)) if last > first => {
                (self.shown_at.len() - 1) as f64 / (*last - *first).as_secs_f64()
            }
            _ => 0.0,
        }
    }

    fn set_title(&self) {
        let Some(screen) = &self.screen else { return };
        let name = self.content.file.file_name().unwrap_or_default().to_string_lossy();
        let (_, last) = self.playback.range();
        let mut title = format!(
            "{name} - bth-play - frame {} of {last} - {} - {:.1} fps - {} of {} samples",
            self.playback.frame(),
            self.mode.name(),
            self.rate(),
            self.renderer.samples(),
            self.samples,
        );
        if let Some(error) = &self.frame_error {
            title = format!("{title} - {error}");
        }
        screen.window.set_title(&title);
    }
}
