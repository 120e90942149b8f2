//! Objects whose vertices move by themselves: positions between the frames of a sequence, and the hierarchy that applies at a time.
//!
//! Format: "Sequences". A coordinate between two frames is computed in f64 and rounded once, so it has the same bits on every machine.

use crate::deform::Deforming;
use crate::objects::Objects;
use bth_format::error::Result;
use bth_format::{File, FramePosition};
use std::time::{Duration, Instant};

/// From this number of positions on, several threads compute them.
#[cfg(feature = "rayon")]
const MIN_PARALLEL: usize = 1 << 14;
/// Number of positions of one task.
#[cfg(feature = "rayon")]
const TASK: usize = 1 << 13;

/// The state of an object at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct State {
    at: FramePosition,
    /// Row of its segment; 0 without segments.
    segment: usize,
}

impl State {
    /// The state in which an object is compiled.
    const COMPILED: State = State { at: FramePosition { frame: 0, share: 0.0 }, segment: 0 };

    fn at(file: &File, object: u32, seconds: f64) -> State {
        let sequence = file.sequence(object);
        State { at: sequence.locate(seconds), segment: sequence.segment(seconds).unwrap_or(0) }
    }
}

/// The objects of a file whose vertices move by themselves, at a time.
#[derive(Debug, Default)]
pub(crate) struct Sequences {
    /// Objects with frames or segments, ascending, and their states.
    objects: Vec<(u32, State)>,
}

/// What an update of the sequences did.
#[derive(Debug, Default)]
pub(crate) struct Moved {
    /// Objects that have other positions or another hierarchy now.
    pub(crate) objects: Vec<u32>,
    /// Those of them that have another hierarchy, and what they had before.
    replaced: Vec<(u32, Option<Box<Deforming>>)>,
    /// The states of all objects with frames or segments.
    states: Vec<(u32, State)>,
    /// The greatest expected cost of one of these objects relative to that of its compiled positions; 1 without any.
    pub(crate) cost_ratio: f64,
    /// Time to compute the positions and refit the objects.
    pub(crate) time: Duration,
}

impl Moved {
    /// Whether an object has another hierarchy, which is fitted to the compiled positions.
    pub(crate) fn is_replaced(&self, object: u32) -> bool {
        self.replaced.iter().any(|(replaced, _)| *replaced == object)
    }
}

impl Sequences {
    /// The objects of a file, as they are compiled.
    pub(crate) fn new(file: &File) -> Sequences {
        let moves = |object: &u32| {
            let sequence = file.sequence(*object);
            !sequence.times.is_empty() || !sequence.segments.is_empty()
        };
        Sequences { objects: (0..file.object_count()).filter(moves).map(|o| (o, State::COMPILED)).collect() }
    }

    /// Whether no vertices move by themselves.
    pub(crate) fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.objects.as_slice())
    }

    /// Brings all objects to a time. [`Self::keep`] or [`Self::undo`] has to follow.
    ///
    /// # Errors
    /// `BTH-O001` if there is not enough memory. Nothing has changed then.
    pub(crate) fn update(&self, objects: &mut Objects, seconds: f64) -> Result<Moved> {
        let mut moved = Moved { cost_ratio: 1.0, ..Moved::default() };
        let Some(file) = objects.sole_file().filter(|_| !self.is_empty()).cloned() else { return Ok(moved) };
        let start = Instant::now();
        for &(object, before) in &self.objects {
            let state = State::at(&file, object, seconds);
            moved.states.push((object, state));
            if state == before {
                continue;
            }
            if let Err(error) = bring(&file, object, (before, state), objects, &mut moved) {
                self.undo(objects, moved);
                return Err(error);
            }
        }
        moved.time = start.elapsed();
        Ok(moved)
    }

    /// Keeps the states of an update.
    pub(crate) fn keep(&mut self, moved: Moved) {
        if !moved.states.is_empty() {
            self.objects = moved.states;
        }
    }

    /// Gives the objects of an update what they had before it.
    pub(crate) fn undo(&self, objects: &mut Objects, moved: Moved) {
        for object in &moved.objects {
            if !moved.is_replaced(*object)
                && let Ok(deforming) = objects.deforming(*object)
            {
                deforming.undo();
            }
        }
        for (object, before) in moved.replaced {
            objects.replace_deforming(object, before);
        }
    }
}

/// Brings an object from one state to another.
fn bring(
    file: &File,
    object: u32,
    (before, state): (State, State),
    objects: &mut Objects,
    moved: &mut Moved,
) -> Result<()> {
    let sequence = file.sequence(object);
    if state.segment != before.segment {
        let segment = object + sequence.segments[state.segment].object;
        let deforming = Box::new(Deforming::of_segment(file, object, segment)?);
        moved.replaced.push((object, objects.replace_deforming(object, Some(deforming))));
    }
    if !sequence.times.is_empty() {
        let deforming = objects.deforming(object)?;
        positions(file, object, state.at, deforming.staged_mut());
        deforming.refit_staged();
        moved.cost_ratio = moved.cost_ratio.max(deforming.cost_ratio());
    }
    moved.objects.push(object);
    Ok(())
}

/// Stores the positions of an object between two frames.
fn positions(file: &File, object: u32, at: FramePosition, into: &mut [[f32; 3]]) {
    let (sequence, rows) = (file.sequence(object), into.len());
    #[cfg(feature = "rayon")]
    if rows >= MIN_PARALLEL {
        use rayon::iter::{IndexedParallelIterator, ParallelIterator};
        use rayon::slice::ParallelSliceMut;
        let tasks = into.par_chunks_mut(TASK).enumerate();
        return tasks.for_each(|(task, part)| sequence.positions_at(at, (rows, TASK * task), part));
    }
    sequence.positions_at(at, (rows, 0), into);
}
