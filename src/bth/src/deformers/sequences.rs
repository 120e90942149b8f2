//! Objects whose vertices move by themselves: positions between the frames of a sequence, and the hierarchy that applies at a time.
//!
//! Format: "Sequences". A coordinate between two frames is computed in f64 and rounded once, so it has the same bits on every machine.

use super::by_object::ByObject;
use crate::deform::Deforming;
use crate::objects::Objects;
use bth_format::error::Result;
use bth_format::{File, FramePosition};

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

    /// The state of an object of a file at a time.
    fn at(file: &File, object: u32, seconds: f64) -> State {
        let sequence = file.sequence(object);
        State { at: sequence.locate(seconds), segment: sequence.segment(seconds).unwrap_or(0) }
    }
}

/// The objects of a scene whose vertices move by themselves.
#[derive(Debug, Default)]
pub(super) struct Sequences {
    /// The objects with frames or segments, by their index, and their states.
    objects: ByObject<State>,
}

/// Objects that are brought to other states: their positions are staged, their hierarchies replaced.
#[derive(Debug, Default)]
pub(super) struct Moved {
    /// The objects and their states.
    states: Vec<(u32, State)>,
    /// Those of them that have got another hierarchy, which is fitted to the compiled positions, and what they had before.
    replaced: Vec<(u32, Option<Box<Deforming>>)>,
}

impl Moved {
    /// The objects.
    pub(super) fn objects(&self) -> impl Iterator<Item = u32> {
        self.states.iter().map(|(object, _)| *object)
    }

    /// Whether an object is among them, of those of one file, which ascend.
    pub(super) fn has(&self, object: u32) -> bool {
        self.states.binary_search_by_key(&object, |row| row.0).is_ok()
    }

    /// Whether an object, of those of one file, has got another hierarchy.
    pub(super) fn is_replaced(&self, object: u32) -> bool {
        self.replaced.binary_search_by_key(&object, |row| row.0).is_ok()
    }

    /// Adds the objects of others.
    pub(super) fn extend(&mut self, other: Moved) {
        self.states.extend(other.states);
        self.replaced.extend(other.replaced);
    }

    /// Gives the objects the hierarchies that they had before.
    pub(super) fn put_back(&mut self, objects: &mut Objects) {
        for (object, before) in self.replaced.drain(..) {
            objects.replace_deforming(object, before);
        }
    }
}

impl Sequences {
    /// Adds the objects of a file whose first object has an index; they are as they were compiled.
    pub(super) fn add(&mut self, file: &File, first_object: u32) {
        for object in 0..file.object_count() {
            let sequence = file.sequence(object);
            if !sequence.times.is_empty() || !sequence.segments.is_empty() {
                self.objects.insert(first_object + object, State::COMPILED);
            }
        }
    }

    /// Whether no vertices move by themselves.
    pub(super) fn is_empty(&self) -> bool {
        self.objects.rows().is_empty()
    }

    /// Bytes of the states.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.objects.rows())
    }

    /// Brings the objects of a file to their states at a time: stages their positions and replaces their hierarchies. The objects of
    /// the file start at `first_object`; those that `skips` names keep what they have. The objects are refitted by the caller, but for
    /// those without frames.
    ///
    /// # Errors
    /// `BTH-O001` if there is not enough memory. Nothing has changed then.
    pub(super) fn stage(
        &self,
        objects: &mut Objects,
        (file, first_object): (&File, u32),
        seconds: f64,
        skips: &dyn Fn(u32) -> bool,
    ) -> Result<Moved> {
        let mut moved = Moved::default();
        for &(object, before) in self.objects.range(first_object, first_object + file.object_count()) {
            let state = State::at(file, object - first_object, seconds);
            if state == before || skips(object) {
                continue;
            }
            if let Err(error) = stage(objects, (file, first_object), object, (before, state), &mut moved) {
                moved.put_back(objects);
                return Err(error);
            }
            moved.states.push((object, state));
        }
        Ok(moved)
    }

    /// Keeps the states of objects.
    pub(super) fn keep(&mut self, moved: Moved) {
        self.objects.extend(moved.states);
    }
}

/// Brings an object from one state to another.
fn stage(
    objects: &mut Objects,
    (file, first_object): (&File, u32),
    object: u32,
    (before, state): (State, State),
    moved: &mut Moved,
) -> Result<()> {
    let row = object - first_object;
    let sequence = file.sequence(row);
    if state.segment != before.segment {
        let segment = row + sequence.segments[state.segment].object;
        let deforming = Box::new(Deforming::of_segment(file, row, segment)?);
        moved.replaced.push((object, objects.replace_deforming(object, Some(deforming))));
    }
    if !sequence.times.is_empty() {
        positions(file, row, state.at, objects.deforming(object)?.staged_mut());
    }
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
