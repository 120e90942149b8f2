//! Playback: which frame is shown while the window plays, pauses, steps and scrubs.

use std::time::Duration;

/// The frames of a scene, and which one is shown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Playback {
    first: i32,
    last: i32,
    /// Frames per second.
    rate: f64,
    frame: i32,
    /// While playing: the time at which playing began, and the frame shown at that time.
    playing: Option<(Duration, i32)>,
}

impl Playback {
    /// Paused at the first frame.
    pub(crate) fn new((first, last): (i32, i32), rate: f64) -> Self {
        Self { first, last, rate, frame: first, playing: None }
    }

    /// The frame that is shown.
    pub(crate) fn frame(&self) -> i32 {
        self.frame
    }

    /// First and last frame.
    pub(crate) fn range(&self) -> (i32, i32) {
        (self.first, self.last)
    }

    /// Returns true if there is more than one frame.
    pub(crate) fn is_animated(&self) -> bool {
        self.first < self.last
    }

    /// Returns true if it plays.
    pub(crate) fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// Plays or pauses.
    pub(crate) fn toggle(&mut self, now: Duration) {
        self.playing = match self.playing {
            None if self.is_animated() => Some((now, self.frame)),
            _ => None,
        };
    }

    /// While playing, goes to the frame of a time, in a loop; frames are skipped where they come
    /// faster than they are shown. Returns true if the frame changed.
    pub(crate) fn advance(&mut self, now: Duration) -> bool {
        let Some((since, from)) = self.playing else { return false };
        let elapsed_frames = (now.saturating_sub(since).as_secs_f64() * self.rate) as i64;
        self.set(i64::from(from) + elapsed_frames)
    }

    /// Pauses, and goes forward or back by a number of frames, in a loop. Returns true if the frame
    /// changed.
    pub(crate) fn step(&mut self, by: i32) -> bool {
        self.playing = None;
        self.set(i64::from(self.frame) + i64::from(by))
    }

    /// Pauses at a fraction of the whole, from 0 to 1. Returns true if the frame changed.
    pub(crate) fn scrub(&mut self, part: f64) -> bool {
        self.playing = None;
        let frames = f64::from(self.last) - f64::from(self.first) + 1.0;
        let step = (part.clamp(0.0, 1.0) * frames).min(frames - 1.0) as i64;
        self.set(i64::from(self.first) + step)
    }

    fn set(&mut self, frame: i64) -> bool {
        let (first, before) = (i64::from(self.first), self.frame);
        let count = i64::from(self.last) - first + 1;
        self.frame = (first + (frame - first).rem_euclid(count)) as i32;
        self.frame != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn playing_follows_the_clock_around_the_end_and_goes_on_where_it_paused() {
        let at = Duration::from_millis;
        let mut playback = Playback::new((10, 19), 10.0);
        assert!(!playback.advance(at(500)) && playback.frame() == 10);
        playback.toggle(at(1000));
        assert!(playback.advance(at(1350)) && playback.frame() == 13);
        assert!(!playback.advance(at(1390)), "the same frame still");
        assert!(playback.advance(at(2150)) && playback.frame() == 11);
        playback.toggle(at(2150));
        assert!(!playback.advance(at(9000)) && playback.frame() == 11);
        playback.toggle(at(9000));
        assert!(playback.advance(at(9100)) && playback.frame() == 12);
    }

    #[test]
    fn steps_go_around_and_scrubbing_reaches_both_ends() {
        let mut playback = Playback::new((-2, 5), 24.0);
        assert!(playback.step(-1) && playback.frame() == 5);
        assert!(playback.step(1) && playback.frame() == -2);
        assert!(playback.scrub(1.0) && playback.frame() == 5);
        assert!(playback.scrub(-3.0) && playback.frame() == -2);
        assert!(playback.scrub(0.5) && playback.frame() == 2);
        assert!(!playback.scrub(0.5));
    }

    #[test]
    fn one_frame_does_not_play() {
        let mut playback = Playback::new((3, 3), 24.0);
        playback.toggle(Duration::ZERO);
        assert!(!playback.is_playing() && !playback.step(1) && !playback.scrub(0.9));
    }
}
