//! New positions of objects in a scene builder: staged by a call, refitted by a commit.

use super::SceneBuilder;
use crate::animation::{AnimatedFile, StagedPoses};
use crate::clock;
use crate::refit::{OwnPositions, Refitted};
use bth_format::Error;
use std::collections::HashSet;

impl SceneBuilder {
    /// Gives an object new positions, as [`Scene::set_positions`](crate::Scene::set_positions),
    /// which the next commit makes visible in all instances of the object. Of several calls for one
    /// object before a commit, the last one counts. Other objects of the same file, and the same
    /// object of another scene, keep theirs.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S006` if it was not compiled with
    /// `--deformable`, `BTH-S007` if the number of positions is wrong or one is not finite,
    /// `BTH-O001` if there is not enough memory. Nothing is changed then.
    pub fn set_positions(&mut self, object: u32, positions: &[[f32; 3]]) -> Result<(), Error> {
        self.stage_positions(object, |own| own.stage(positions))
    }

    /// Like [`Self::set_positions`], but interpolates between the positions at two times, in the
    /// same way as [`Scene::set_positions_between`](crate::Scene::set_positions_between).
    ///
    /// # Errors
    /// The errors of [`Self::set_positions`] for both ends, and `BTH-S007` if `share` is not from 0
    /// to 1. Nothing is changed then.
    pub fn set_positions_between(
        &mut self,
        object: u32,
        ends: [&[[f32; 3]]; 2],
        share: f64,
    ) -> Result<(), Error> {
        self.stage_positions(object, |own| own.stage_between(ends, share))
    }

    fn stage_positions(
        &mut self,
        object: u32,
        stage: impl FnOnce(&mut OwnPositions) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.check_object(object)?;
        stage(self.scene.objects_mut().own_positions(object)?)?;
        if !self.repositioned.contains(&object) {
            self.repositioned.push(object);
        }
        Ok(())
    }

    /// Stages the positions that the sequences, skins and morph targets of files give their objects
    /// at the times of the subscenes, except for objects that the caller gives new positions.
    /// Several subscenes of one file have the same objects; the lowest id wins.
    ///
    /// # Errors
    /// The errors of [`Self::commit`]. Nothing is staged then.
    pub(super) fn stage_poses(&mut self) -> Result<StagedPoses, Error> {
        let mut staged = StagedPoses::default();
        if self.scene.world().is_none_or(|world| world.animation.is_empty()) {
            return Ok(staged);
        }
        let mut seen = HashSet::new();
        for subscene in self.subscenes.iter().flatten() {
            let first_object = subscene.first_object;
            let Some(hierarchy) = subscene.hierarchy().filter(|_| seen.insert(first_object)) else {
                continue;
            };
            let skips = |object: u32| self.repositioned.contains(&object);
            let (objects, world) = self.scene.parts_mut();
            let file = objects.locate(first_object).map(|(file, _)| file.clone());
            let (Some(world), Some(file)) = (world, file) else { continue };
            let at = AnimatedFile { file: &file, first_object, hierarchy, seconds: subscene.pose.seconds };
            staged.extend(world.animation.stage(objects, at, &skips)?);
        }
        self.repositioned.extend(&staged.objects);
        Ok(staged)
    }

    /// Forgets what [`Self::stage_poses`] has staged.
    pub(super) fn unstage_poses(&mut self, staged: &StagedPoses) {
        self.repositioned.retain(|object| !staged.objects.contains(object));
    }

    /// Refits the objects that get new positions, and marks their instances as changed.
    pub(super) fn refit_objects(&mut self) -> Refitted {
        let start = clock::now();
        let refitted = self.scene.objects_mut().refit(&self.repositioned, start);
        self.forget_boxes();
        if !self.repositioned.is_empty() {
            for (id, staged) in self.instances.iter_mut().enumerate() {
                if self.repositioned.contains(&staged.object) {
                    staged.mark(id as u32, &mut self.changed);
                }
            }
        }
        refitted
    }

    /// Undoes [`Self::refit_objects`]. The new positions are staged again.
    pub(super) fn undo_refit(&mut self) {
        self.scene.objects_mut().undo_refit(&self.repositioned);
        self.forget_boxes();
    }

    fn forget_boxes(&mut self) {
        if let (_, Some(world)) = self.scene.objects_and_world_mut() {
            world.forget_parts(&self.repositioned);
        }
    }
}
