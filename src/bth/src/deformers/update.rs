//! The objects that deform, brought to a time: of a file's scene, or of the subscenes of a scene builder.

use super::evaluate::{self, Vertices};
use super::pose::Pose;
use crate::instances::NodeHierarchy;
use crate::objects::Objects;
use bth_format::error::{Code, Error, Result};
use bth_format::layout::*;
use bth_format::{File, SceneView};
use std::collections::{HashMap, HashSet};
use std::time::{Duration, Instant};

/// What deforms the objects of a scene, by their index.
#[derive(Debug, Default)]
pub(crate) struct Deformers {
    /// For each object that a deformer deforms whether a skin does, so that its vertices are in world space.
    skinned: HashMap<u32, bool>,
    /// The poses of the last update.
    poses: HashMap<u32, Pose>,
}

/// The poses of objects that are to be refitted, with their positions staged.
#[derive(Debug, Default)]
pub(crate) struct Posed(pub(crate) Vec<(u32, Pose)>);

/// What an update of a file's deformers did.
#[derive(Debug)]
pub(crate) struct Deformed {
    /// Objects that have other positions now.
    pub(crate) objects: Vec<u32>,
    posed: Posed,
    /// The greatest expected cost of one of these objects relative to that of its compiled positions; 1 without any.
    pub(crate) cost_ratio: f64,
    /// Time to compute the positions and refit the objects.
    pub(crate) time: Duration,
}

impl Deformers {
    /// Adds the deformers of a file whose first object has an index.
    pub(crate) fn add(&mut self, view: &SceneView<'_>, first_object: u32) {
        let rows = view.deformers.iter();
        self.skinned.extend(rows.map(|deformer| (first_object + deformer.object, deformer.skin != NONE)));
    }

    /// Whether no object deforms.
    pub(crate) fn is_empty(&self) -> bool {
        self.skinned.is_empty()
    }

    /// Whether the vertices of an object are in world space, since a skin moves them.
    pub(crate) fn is_skinned(&self, object: u32) -> bool {
        !self.skinned.is_empty() && self.skinned.get(&object).copied().unwrap_or(false)
    }

    /// The objects whose vertices are in world space.
    pub(crate) fn skinned_objects(&self) -> HashSet<u32> {
        self.skinned.iter().filter(|(_, skinned)| **skinned).map(|(object, _)| *object).collect()
    }

    /// The pose of an object; `None` if none deforms it.
    pub(crate) fn pose_of(&self, object: u32) -> Option<&Pose> {
        self.poses.get(&object)
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        let rows =
            size_of::<(u32, Pose)>() * self.poses.len() + size_of::<(u32, bool)>() * self.skinned.len();
        rows + self.poses.values().map(Pose::bytes).sum::<usize>()
    }

    /// Stages new positions of the objects of a file whose pose differs from that of the last update, by the nodes of a hierarchy as at
    /// a time. The objects of the file start at `first_object`; those that `skips` names keep what they have.
    ///
    /// # Errors
    /// `BTH-S002` if a position would not be finite, with the node; `BTH-O001` if there is not enough memory.
    pub(crate) fn stage(
        &self,
        objects: &mut Objects,
        (file, first_object): (&File, u32),
        (hierarchy, seconds): (&NodeHierarchy, f64),
        skips: &dyn Fn(u32) -> bool,
    ) -> Result<Posed> {
        let mut posed = Posed::default();
        let Some(view) = file.scene() else { return Ok(posed) };
        for (row, deformer) in view.deformers.iter().enumerate() {
            let object = first_object + deformer.object;
            let pose = Pose::of(&view, deformer, hierarchy, seconds);
            let can_be_hit = file.object_header(deformer.object).root != NONE;
            if self.poses.get(&object) == Some(&pose) || !can_be_hit || skips(object) {
                continue;
            }
            let deforming = objects.deforming(object)?;
            let base = file.object(deformer.object)?.positions;
            let vertices = Vertices { base, deformation: file.deformation(deformer.object) };
            evaluate::positions(vertices, &pose, deforming.staged_mut());
            deforming.stage_normals_of_file();
            deforming.check_staged().map_err(|_| {
                let at = size_of::<Deformer>() as u64 * row as u64;
                let name = view.node_name(deformer.node).escape_debug();
                let found = format!("others: node \"{name}\" at {seconds} s");
                let error =
                    Error::within_file(Code::NotFinite, kind::DEFORMERS, at, "finite positions", found);
                file.locate(error, NONE)
            })?;
            posed.0.push((object, pose));
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
        let (posed, time) = (Posed::default(), Duration::ZERO);
        let mut deformed = Deformed { objects: Vec::new(), posed, cost_ratio: 1.0, time };
        let Some(file) = objects.sole_file().filter(|_| !self.is_empty()).cloned() else {
            return Ok(deformed);
        };
        let start = Instant::now();
        deformed.posed = self.stage(objects, (&file, 0), (hierarchy, seconds), &|_| false)?;
        for (object, _) in &deformed.posed.0 {
            let deforming = objects.deforming(*object)?;
            deforming.refit_staged();
            deformed.cost_ratio = deformed.cost_ratio.max(deforming.cost_ratio());
            deformed.objects.push(*object);
        }
        deformed.time = start.elapsed();
        Ok(deformed)
    }

    /// Keeps the poses of an update.
    pub(crate) fn keep(&mut self, Posed(poses): Posed) {
        self.poses.extend(poses);
    }
}

impl Deformed {
    /// Gives the objects the positions that they had before the update.
    pub(crate) fn undo(&self, objects: &mut Objects) {
        for object in &self.objects {
            if let Ok(deforming) = objects.deforming(*object) {
                deforming.undo();
            }
        }
    }

    /// The poses of the objects.
    pub(crate) fn into_posed(self) -> Posed {
        self.posed
    }
}
