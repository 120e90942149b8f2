//! The positions of an object at several times, as typed slices, zero-copy.

section_view! {
    /// The frames of an object whose vertices move by themselves. Specification: "Sequences".
    SequenceView {
        /// Seconds of the frames, ascending.
        times: f64 = SEQUENCE_TIMES,
        /// Positions by frame, then by row of `POSITIONS`; object space.
        positions: [f32; 3] = SEQUENCE_POSITIONS,
    }
}

/// Where a time lies among frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramePosition {
    /// The frame before, or the first.
    pub frame: usize,
    /// Share of the way to the next frame, from 0 to below 1; 0 without a next frame.
    pub share: f64,
}

impl<'a> SequenceView<'a> {
    /// Returns where a time lies among the frames, at least one. NaN is before the first.
    pub fn locate(&self, seconds: f64) -> FramePosition {
        let frame = self.times.partition_point(|time| *time <= seconds).saturating_sub(1);
        let (Some(&from), Some(&to)) = (self.times.get(frame), self.times.get(frame + 1)) else {
            return FramePosition { frame, share: 0.0 };
        };
        // Halves, so that no difference of finite times overflows.
        let share = (0.5 * seconds - 0.5 * from) / (0.5 * to - 0.5 * from);
        // Just before a frame the share may be rounded to 1.
        match share >= 1.0 {
            true => FramePosition { frame: frame + 1, share: 0.0 },
            false => FramePosition { frame, share: if share > 0.0 { share } else { 0.0 } },
        }
    }

    /// The positions of a frame; `rows` is the number of rows of `POSITIONS`.
    pub fn frame(&self, frame: usize, rows: usize) -> &'a [[f32; 3]] {
        frame.checked_mul(rows).and_then(|first| self.positions.get(first..)?.get(..rows)).unwrap_or_default()
    }

    /// Stores the positions at a place among the frames, from row `first` on. A coordinate is a +
    /// (b − a) · share in `f64`, rounded once to `f32`, where a and b come from the two frames.
    pub fn positions_at(&self, at: FramePosition, (rows, first): (usize, usize), into: &mut [[f32; 3]]) {
        let from = self.frame(at.frame, rows).get(first..).unwrap_or_default();
        if at.share == 0.0 {
            into.iter_mut().zip(from).for_each(|(into, from)| *into = *from);
            return;
        }
        let to = self.frame(at.frame + 1, rows).get(first..).unwrap_or_default();
        let into = into.as_flattened_mut().iter_mut();
        for ((into, a), b) in into.zip(from.as_flattened()).zip(to.as_flattened()) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            // Adding 0 turns -0 into 0, as in all positions of compiled files.
            *into = (a + (b - a) * at.share) as f32 + 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_lie_between_frames_and_stay_at_the_ends() {
        let view = SequenceView { times: &[-1.0, 0.0, 2.0], ..SequenceView::default() };
        for (seconds, frame, share) in [
            (-1.0, 0, 0.0),
            (-0.25, 0, 0.75),
            (0.0, 1, 0.0),
            (0.5, 1, 0.25),
            (2.0, 2, 0.0),
            (1e300, 2, 0.0),
            (-5.0, 0, 0.0),
            (f64::NEG_INFINITY, 0, 0.0),
            (f64::INFINITY, 2, 0.0),
        ] {
            assert_eq!(view.locate(seconds), FramePosition { frame, share }, "{seconds}");
        }
        assert_eq!(view.locate(f64::NAN), FramePosition { frame: 0, share: 0.0 });
        let view = SequenceView { times: &[-2.0, 1.0], ..SequenceView::default() };
        assert_eq!(view.locate(1f64.next_down()), FramePosition { frame: 1, share: 0.0 });
        let view = SequenceView { times: &[-f64::MAX, f64::MAX], ..SequenceView::default() };
        assert_eq!(view.locate(0.0), FramePosition { frame: 0, share: 0.5 });
    }

    #[test]
    fn positions_move_on_straight_lines_and_are_rounded_once() {
        let positions =
            [[0.0, 1.0, -3e38], [1.0, 1.0, 1.0], [1.0, -0.0, 3e38], [1.0, 2.0, f32::MIN_POSITIVE]];
        let view = SequenceView { times: &[0.0, 1.0], positions: &positions };
        let at = |seconds: f64, first: usize| {
            let mut into = vec![[9.0; 3]; 2 - first];
            view.positions_at(view.locate(seconds), (2, first), &mut into);
            into
        };
        assert_eq!(at(0.0, 0), positions[..2]);
        assert_eq!(at(1.0, 0), positions[2..]);
        assert_eq!(at(0.5, 0), [[0.5, 0.5, 0.0], [1.0, 1.5, 0.5]]);
        assert_eq!(at(0.3, 1), [[1.0, 1.3, 0.7]]);
        let mut other = [[7.0; 3]; 3];
        view.positions_at(FramePosition { frame: 5, share: 0.5 }, (2, 0), &mut other);
        assert_eq!(other, [[7.0; 3]; 3]);
    }
}
