//! The objects whose positions change with time, brought to a time: of a file's scene, or of the
//! subscenes of a scene builder.

use super::animated_file::AnimatedFile;
use super::pose::{Pose, SkinMatrices};
use super::positions::{self, Vertices};
use super::sequences::Sequences;
use crate::objects::Objects;
use bth_format::error::{Code, Error, Result};
use bth_format::layout::*;
use bth_format::{File, FramePosition};
use std::collections::{BTreeMap, HashSet};

/// What moves the vertices of the objects of a scene, by the index of the object.
#[derive(Debug, Default)]
pub(crate) struct Animation {
    /// For each object with a deformer whether it has a skin, so that its vertices are in world
    /// space.
    skinned: BTreeMap<u32, bool>,
    /// The poses of the last update.
    poses: BTreeMap<u32, Pose>,
    sequences: Sequences,
}

/// Objects that are to be refitted: their positions are staged.
#[derive(Debug, Default)]
pub(crate) struct StagedPoses {
    /// The objects, each once.
    pub(crate) objects: Vec<u32>,
    poses: Vec<(u32, Pose)>,
    frames: Vec<(u32, FramePosition)>,
}

impl StagedPoses {
    /// Adds the objects of another file.
    pub(crate) fn extend(&mut self, other: StagedPoses) {
        self.objects.extend(other.objects);
        self.poses.extend(other.poses);
        self.frames.extend(other.frames);
    }
}

impl Animation {
    /// Adds the deformers and sequences of a file with scene sections, whose first object has an
    /// index.
    pub(crate) fn add(&mut self, file: &File, first_object: u32) {
        let Some(view) = file.scene() else { return };
        let rows = view.deformers.iter();
        self.skinned.extend(rows.map(|deformer| (first_object + deformer.object, deformer.skin != NONE)));
        self.sequences.add(file, first_object);
    }

    /// Returns true if no vertices move.
    pub(crate) fn is_empty(&self) -> bool {
        self.skinned.is_empty() && self.sequences.is_empty()
    }

    /// Returns true if the vertices of an object are in world space, since a skin moves them.
    pub(crate) fn is_skinned(&self, object: u32) -> bool {
        self.skinned.get(&object).copied().unwrap_or(false)
    }

    /// The objects whose vertices are in world space.
    pub(crate) fn skinned_objects(&self) -> HashSet<u32> {
        self.skinned.iter().filter(|row| *row.1).map(|row| *row.0).collect()
    }

    /// The pose of an object; `None` without a deformer.
    pub(crate) fn pose_of(&self, object: u32) -> Option<&Pose> {
        self.poses.get(&object)
    }

    /// Bytes of the rows on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let of_poses: usize = self.poses.values().map(|pose| size_of::<(u32, Pose)>() + pose.bytes()).sum();
        self.skinned.len() * size_of::<(u32, bool)>() + of_poses + self.sequences.bytes()
    }

    /// Stages the positions of the objects of a file whose pose or time has changed since the last
    /// update. Objects that `skips` names keep their positions. [`Self::keep`] has to follow a
    /// refit.
    ///
    /// # Errors
    /// `BTH-S002` if a position would not be finite, with the node; `BTH-O001` if there is not
    /// enough memory. Only staged positions have changed then.
    pub(crate) fn stage(
        &self,
        objects: &mut Objects,
        at: AnimatedFile<'_>,
        skips: &dyn Fn(u32) -> bool,
    ) -> Result<StagedPoses> {
        let AnimatedFile { file, first_object, hierarchy, seconds } = at;
        let frames = self.sequences.stage(objects, at, skips)?;
        let mut staged =
            StagedPoses { objects: frames.iter().map(|row| row.0).collect(), poses: Vec::new(), frames };
        let Some(view) = file.scene() else { return Ok(staged) };
        let mut matrices = SkinMatrices::new(&view, hierarchy);
        for (row, deformer) in view.deformers.iter().enumerate() {
            let object = first_object + deformer.object;
            let can_be_hit = file.object_header(deformer.object).root != NONE;
            if !can_be_hit || skips(object) {
                continue;
            }
            let pose = Pose::of(&mut matrices, deformer, seconds);
            if self.poses.get(&object) == Some(&pose) {
                continue;
            }
            let own = objects.own_positions(object)?;
            let base = file.object(deformer.object)?.positions;
            let vertices = Vertices { base, deformation: file.deformation(deformer.object) };
            positions::compute(vertices, &pose, own.staged_mut());
            own.stage_normals_of_file();
            if own.check_staged().is_err() {
                let at = size_of::<Deformer>() as u64 * row as u64;
                let name = view.node_name(deformer.node);
                let found = format!("others: node \"{}\" at {seconds} s", name.escape_debug());
                let error =
                    Error::within_file(Code::NotFinite, kind::DEFORMERS, at, "finite positions", found);
                return Err(file.locate(error, NONE));
            }
            staged.poses.push((object, pose));
            // No other deformer has the object (BTH-F180), and it has no frames (BTH-F186).
            staged.objects.push(object);
        }
        Ok(staged)
    }

    /// Keeps the poses and times of an update.
    pub(crate) fn keep(&mut self, staged: StagedPoses) {
        self.poses.extend(staged.poses);
        self.sequences.keep(staged.frames);
    }
}
