//! The objects that deform, brought to a time: of a file's scene, or of the subscenes of a scene builder.

use super::by_object::ByObject;
use super::evaluate::{self, Vertices};
use super::pose::{Pose, SkinMatrices};
use super::sequences::Sequences;
use crate::clock;
use crate::nodes::NodeHierarchy;
use crate::objects::Objects;
use bth_format::error::{Code, Error, Result};
use bth_format::layout::*;
use bth_format::{File, FramePosition};
use std::collections::HashSet;
use std::time::Duration;

/// What deforms the objects of a scene, by their index.
#[derive(Debug, Default)]
pub(crate) struct Deformers {
    /// For each object that a deformer deforms whether a skin does, so that its vertices are in world space.
    skinned: ByObject<bool>,
    /// The poses of the last update.
    poses: ByObject<Pose>,
    /// The objects whose vertices move by themselves.
    sequences: Sequences,
}

/// Objects that are to be refitted: their positions are staged.
#[derive(Debug, Default)]
pub(crate) struct Posed {
    /// The objects, each once.
    pub(crate) objects: Vec<u32>,
    poses: Vec<(u32, Pose)>,
    moved: Vec<(u32, FramePosition)>,
}

/// What an update of a file's deformers did.
#[derive(Debug)]
pub(crate) struct Deformed {
    pub(crate) posed: Posed,
    /// The greatest expected cost of one of these objects relative to that of its compiled positions; 1 without any.
    pub(crate) cost_ratio: f64,
    /// Time to compute the positions and refit the objects.
    pub(crate) time: Duration,
}

impl Posed {
    /// Adds the objects of another file.
    pub(crate) fn extend(&mut self, other: Posed) {
        self.objects.extend(other.objects);
        self.poses.extend(other.poses);
        self.moved.extend(other.moved);
    }
}

impl Deformers {
    /// Adds the deformers and sequences of a file with scene sections, whose first object has an index.
    pub(crate) fn add(&mut self, file: &File, first_object: u32) {
        let Some(view) = file.scene() else { return };
        let rows = view.deformers.iter();
        self.skinned.extend(rows.map(|deformer| (first_object + deformer.object, deformer.skin != NONE)));
        self.sequences.add(file, first_object);
    }

    /// Whether no object deforms.
    pub(crate) fn is_empty(&self) -> bool {
        self.skinned.rows().is_empty() && self.sequences.is_empty()
    }

    /// Whether the vertices of an object are in world space, since a skin moves them.
    pub(crate) fn is_skinned(&self, object: u32) -> bool {
        self.skinned.get(object).copied().unwrap_or(false)
    }

    /// The objects whose vertices are in world space.
    pub(crate) fn skinned_objects(&self) -> HashSet<u32> {
        self.skinned.rows().iter().filter(|row| row.1).map(|row| row.0).collect()
    }

    /// The pose of an object; `None` if none deforms it.
    pub(crate) fn pose_of(&self, object: u32) -> Option<&Pose> {
        self.poses.get(object)
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let (skinned, poses) = (self.skinned.rows(), self.poses.rows());
        let of_poses: usize = poses.iter().map(|(_, pose)| pose.bytes()).sum();
        size_of_val(skinned) + size_of_val(poses) + of_poses + self.sequences.bytes()
    }

    /// Stages new positions of the objects of a file whose pose or time has changed since the last
    /// update, by the nodes of a hierarchy as at a time. The objects of the file start at
    /// `first_object`; those that `skips` names keep their positions.
    ///
    /// # Errors
    /// `BTH-S002` if a position would not be finite, with the node; `BTH-O001` if there is not enough
    /// memory. No positions but the staged ones have changed then.
    pub(crate) fn stage(
        &self,
        objects: &mut Objects,
        (file, first_object): (&File, u32),
        (hierarchy, seconds): (&NodeHierarchy, f64),
        skips: &dyn Fn(u32) -> bool,
    ) -> Result<Posed> {
        let moved = self.sequences.stage(objects, (file, first_object), seconds, skips)?;
        let mut posed = Posed { objects: moved.iter().map(|row| row.0).collect(), poses: Vec::new(), moved };
        let Some(view) = file.scene() else { return Ok(posed) };
        let mut matrices = SkinMatrices::new(&view, hierarchy);
        for (row, deformer) in view.deformers.iter().enumerate() {
            let object = first_object + deformer.object;
            let can_be_hit = file.object_header(deformer.object).root != NONE;
            if !can_be_hit || skips(object) {
                continue;
            }
            let pose = Pose::of(&mut matrices, deformer, seconds);
            if self.poses.get(object) == Some(&pose) {
                continue;
            }
            if let Err(error) = stage_pose(objects, (file, deformer.object), object, &pose) {
                if error.code() != Code::NewPositions {
                    return Err(error);
                }
                let at = size_of::<Deformer>() as u64 * row as u64;
                let name = view.node_name(deformer.node);
                let found = format!("others: node \"{}\" at {seconds} s", name.escape_debug());
                let error =
                    Error::within_file(Code::NotFinite, kind::DEFORMERS, at, "finite positions", found);
                return Err(file.locate(error, NONE));
            }
            posed.poses.push((object, pose));
            // No other deformer has the object (BTH-F180), and it has no frames (BTH-F186).
            posed.objects.push(object);
        }
        Ok(posed)
    }

    /// Gives the objects of a scene that is a file their positions by the nodes of its hierarchy as at a time. [`Self::keep`] or
    /// [`Deformed::undo`] has to follow.
    ///
    /// # Errors
    /// As [`Self::stage`]. Nothing has changed then.
    pub(crate) fn update(
        &self,
        objects: &mut Objects,
        hierarchy: &NodeHierarchy,
        seconds: f64,
    ) -> Result<Deformed> {
        let mut deformed = Deformed { posed: Posed::default(), cost_ratio: 1.0, time: Duration::ZERO };
        let Some(file) = objects.sole_file().filter(|_| !self.is_empty()).cloned() else {
            return Ok(deformed);
        };
        let start = clock::now();
        deformed.posed = self.stage(objects, (&file, 0), (hierarchy, seconds), &|_| false)?;
        for object in &deformed.posed.objects {
            let deforming = objects.deforming(*object)?;
            deforming.refit_staged();
            deformed.cost_ratio = deformed.cost_ratio.max(deforming.cost_ratio());
        }
        deformed.time = clock::elapsed(start);
        Ok(deformed)
    }

    /// Keeps the poses and states of an update.
    pub(crate) fn keep(&mut self, posed: Posed) {
        self.poses.extend(posed.poses);
        self.sequences.keep(posed.moved);
    }
}

/// Stages the positions of an object in a pose. `file` and `row` are its file and its index there.
fn stage_pose(objects: &mut Objects, (file, row): (&File, u32), object: u32, pose: &Pose) -> Result<()> {
    let deforming = objects.deforming(object)?;
    let vertices = Vertices { base: file.object(row)?.positions, deformation: file.deformation(row) };
    evaluate::positions(vertices, pose, deforming.staged_mut());
    deforming.stage_normals_of_file();
    deforming.check_staged()
}

impl Deformed {
    /// Gives the objects the positions that they had before the update.
    pub(crate) fn undo(self, objects: &mut Objects) {
        for object in self.posed.objects {
            if let Ok(deforming) = objects.deforming(object) {
                deforming.undo();
            }
        }
    }
}
