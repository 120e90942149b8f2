//! The objects that deform, brought to the scene's time.

use super::evaluate::{self, Vertices};
use super::pose::Pose;
use crate::instances::NodeHierarchy;
use crate::objects::Objects;
use crate::sequences::Moved;
use bth_format::SceneView;
use bth_format::error::{Code, Error, Result};
use bth_format::layout::*;
use std::time::{Duration, Instant};

/// The deformers of a file's scene at a time.
#[derive(Debug, Default)]
pub(crate) struct Deformers {
    /// For each deformer the pose of its object; empty before the first update.
    poses: Vec<Pose>,
    /// For each object whether its vertices are in world space, since a skin moves them; empty where none are.
    skinned: Vec<bool>,
    /// For each object its deformer, or `NONE`; empty where none deforms.
    of_object: Vec<u32>,
}

/// What an update of the deformers did.
#[derive(Debug, Default)]
pub(crate) struct Deformed {
    /// Objects that have other positions now, ascending by their deformers.
    pub(crate) objects: Vec<u32>,
    /// The poses of all deformers.
    poses: Vec<Pose>,
    /// The greatest expected cost of one of these objects relative to that of its compiled positions; 1 without any.
    pub(crate) cost_ratio: f64,
    /// Time to compute the positions and refit the objects.
    pub(crate) time: Duration,
}

impl Deformers {
    /// The deformers of a checked scene of a number of objects.
    pub(crate) fn new(view: &SceneView<'_>, objects: u32) -> Deformers {
        let mut deformers = Deformers::default();
        if view.deformers.is_empty() {
            return deformers;
        }
        deformers.of_object = vec![NONE; objects as usize];
        deformers.skinned = vec![false; objects as usize];
        for (row, deformer) in view.deformers.iter().enumerate() {
            deformers.of_object[deformer.object as usize] = row as u32;
            deformers.skinned[deformer.object as usize] = deformer.skin != NONE;
        }
        deformers
    }

    /// Whether any object deforms.
    pub(crate) fn is_empty(&self) -> bool {
        self.of_object.is_empty()
    }

    /// Whether the vertices of an object are in world space, since a skin moves them.
    pub(crate) fn is_skinned(&self, object: u32) -> bool {
        self.skinned.get(object as usize).copied().unwrap_or(false)
    }

    /// The pose of an object; `None` if none deforms it.
    pub(crate) fn pose_of(&self, object: u32) -> Option<&Pose> {
        self.poses.get(*self.of_object.get(object as usize)? as usize)
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let pose = |pose: &Pose| {
            size_of_val(pose.weights.as_slice())
                + pose.joints.as_ref().map_or(0, |j| size_of_val(j.as_slice()))
        };
        self.poses.iter().map(pose).sum::<usize>()
            + size_of_val(self.skinned.as_slice())
            + size_of_val(self.of_object.as_slice())
    }

    /// Gives the objects whose pose differs from that of the last update, or that have got another hierarchy of `moved`, their positions,
    /// by the nodes of a hierarchy as at a time.
    /// [`Self::keep`] or [`Self::undo`] has to follow.
    ///
    /// # Errors
    /// `BTH-S002` if a position would not be finite, with the node; `BTH-O001` if there is not enough memory. Nothing has changed then.
    pub(crate) fn update(
        &self,
        objects: &mut Objects,
        (hierarchy, seconds): (&NodeHierarchy, f64),
        moved: &Moved,
    ) -> Result<Deformed> {
        let mut deformed = Deformed { cost_ratio: 1.0, ..Deformed::default() };
        let Some(file) = objects.sole_file().filter(|_| !self.is_empty()).cloned() else {
            return Ok(deformed);
        };
        let Some(view) = file.scene() else { return Ok(deformed) };
        let start = Instant::now();
        for (row, deformer) in view.deformers.iter().enumerate() {
            let pose = Pose::of(&view, deformer, hierarchy, seconds);
            let differs = self.poses.get(row) != Some(&pose);
            deformed.poses.push(pose);
            let can_be_hit = file.object_header(deformer.object).root != NONE;
            if !(differs || moved.is_replaced(deformer.object)) || !can_be_hit {
                continue;
            }
            let deforming = objects.deforming(deformer.object)?;
            let base = file.object(deformer.object)?.positions;
            let vertices = Vertices { base, deformation: file.deformation(deformer.object) };
            evaluate::positions(vertices, &deformed.poses[row], deforming.staged_mut());
            deforming.check_staged().map_err(|_| {
                let at = size_of::<Deformer>() as u64 * row as u64;
                let name = view.node_name(deformer.node).escape_debug();
                let found = format!("others: node \"{name}\" at {seconds} s");
                let error =
                    Error::within_file(Code::NotFinite, kind::DEFORMERS, at, "finite positions", found);
                file.locate(error, NONE)
            })?;
            deformed.objects.push(deformer.object);
        }
        for object in &deformed.objects {
            let deforming = objects.deforming(*object)?;
            deforming.refit_staged();
            deformed.cost_ratio = deformed.cost_ratio.max(deforming.cost_ratio());
        }
        deformed.time = start.elapsed();
        Ok(deformed)
    }

    /// Keeps the poses of an update.
    pub(crate) fn keep(&mut self, deformed: Deformed) {
        if !deformed.poses.is_empty() {
            self.poses = deformed.poses;
        }
    }

    /// Gives the objects of an update the positions that they had before it.
    pub(crate) fn undo(&self, objects: &mut Objects, deformed: &Deformed) {
        for object in &deformed.objects {
            if let Ok(deforming) = objects.deforming(*object) {
                deforming.undo();
            }
        }
    }
}
