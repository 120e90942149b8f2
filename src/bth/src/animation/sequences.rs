//! Objects whose vertices move by themselves: positions between the frames of a sequence.
//!
//! Format: "Sequences". A coordinate between two frames is computed in f64 and rounded once, so it
//! has the same bits on every machine.

use super::animated_file::AnimatedFile;
use crate::objects::Objects;
use crate::parallel::Tasks;
use bth_format::error::Result;
use bth_format::{File, FramePosition};
use std::collections::BTreeMap;

/// How positions are computed.
const TASKS: Tasks = Tasks { rows: 1 << 13, min_rows: 1 << 14 };

/// The time for which objects are compiled: their first frame.
const COMPILED: FramePosition = FramePosition { frame: 0, share: 0.0 };

/// The objects of a scene whose vertices move by themselves.
#[derive(Debug, Default)]
pub(super) struct Sequences {
    /// The objects with frames, by their index, and the times that they show.
    objects: BTreeMap<u32, FramePosition>,
}

impl Sequences {
    /// Adds the objects of a file whose first object has an index. They show their first frames.
    pub(super) fn add(&mut self, file: &File, first_object: u32) {
        for object in 0..file.object_count() {
            if !file.sequence(object).times.is_empty() {
                self.objects.insert(first_object + object, COMPILED);
            }
        }
    }

    /// Returns true if no vertices move by themselves.
    pub(super) fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Bytes of the rows.
    pub(super) fn bytes(&self) -> usize {
        self.objects.len() * size_of::<(u32, FramePosition)>()
    }

    /// Stages the positions of the objects of a file. Returns the objects whose positions change,
    /// with their times. Objects that `skips` names keep their positions.
    ///
    /// # Errors
    /// `BTH-O001` if there is not enough memory.
    pub(super) fn stage(
        &self,
        objects: &mut Objects,
        at: AnimatedFile<'_>,
        skips: &dyn Fn(u32) -> bool,
    ) -> Result<Vec<(u32, FramePosition)>> {
        let AnimatedFile { file, first_object, seconds, .. } = at;
        let mut moved = Vec::new();
        for (&object, &before) in self.objects.range(first_object..first_object + file.object_count()) {
            let row = object - first_object;
            let at = file.sequence(row).locate(seconds);
            if at == before || skips(object) {
                continue;
            }
            positions(file, row, at, objects.own_positions(object)?.staged_mut());
            moved.push((object, at));
        }
        Ok(moved)
    }

    /// Keeps the times of objects.
    pub(super) fn keep(&mut self, moved: Vec<(u32, FramePosition)>) {
        self.objects.extend(moved);
    }
}

/// Stores the positions of an object between two frames.
fn positions(file: &File, object: u32, at: FramePosition, into: &mut [[f32; 3]]) {
    let (sequence, rows) = (file.sequence(object), into.len());
    TASKS.for_each(into, |first, into| sequence.positions_at(at, (rows, first), into));
}
