//! The deformation sections of an object as typed slices, zero-copy.

use crate::layout::{Deformation, Morph, NONE};

section_view! {
    /// What moves the vertices of an object. Sections that the file lacks are empty. Specification:
    /// "Deformation".
    DeformationView {
        /// One row, or none where nothing moves the vertices.
        rows: Deformation = DEFORMATION,
        /// Joints: for each position [`Deformation::influence_sets`] rows.
        joints: [u16; 4] = JOINTS,
        /// Weights of the joints, in the same order.
        weights: [f32; 4] = JOINT_WEIGHTS,
        /// What the targets add to positions, then, if there are any, what they add to normals.
        morphs: Morph = MORPHS,
        /// Rows of positions or normals of sparse morphs.
        morph_rows: u32 = MORPH_ROWS,
        /// What morphs add.
        deltas: [f32; 3] = MORPH_DELTAS,
    }
}

/// The deltas of a morph. Panics of its methods are ruled out by the check (BTH-F177).
#[derive(Clone, Copy, Debug)]
pub struct MorphDeltas<'a> {
    /// The rows of positions or normals, ascending; `None` where there is a delta for every row.
    pub rows: Option<&'a [u32]>,
    /// The deltas.
    pub deltas: &'a [[f32; 3]],
}

impl<'a> DeformationView<'a> {
    /// The counts; zeros where nothing moves the vertices.
    pub fn counts(&self) -> Deformation {
        let none = Deformation { joints: 0, influence_sets: 0, targets: 0, reserved: 0 };
        self.rows.first().copied().unwrap_or(none)
    }

    /// The deltas of a row of `morphs`.
    ///
    /// # Panics
    /// If there is no such row, or if the sections have not been checked.
    pub fn morph(&self, row: usize) -> MorphDeltas<'a> {
        let Morph { deltas, first_delta, first_row, .. } = self.morphs[row];
        let range = |first: u32| first as usize..first as usize + deltas as usize;
        let rows = (first_row != NONE).then(|| &self.morph_rows[range(first_row)]);
        MorphDeltas { rows, deltas: &self.deltas[range(first_delta)] }
    }

    /// Returns true if targets change normals.
    pub fn has_normal_morphs(&self) -> bool {
        self.morphs.len() > self.counts().targets as usize
    }
}
