//! New positions of objects in a scene builder: staged by a call, refitted by a commit.

use super::SceneBuilder;
use crate::clock;
use crate::deform::Deforming;
use crate::deformers::Posed;
use crate::update::Update;
use bth_format::Error;
use std::collections::HashSet;

impl SceneBuilder {
    /// Gives an object new positions, as [`Scene::set_positions`](crate::Scene::set_positions), which the next commit makes visible
    /// in all instances of the object. Of several calls for one object before a commit, the last one counts. Other objects of
    /// the same file, and the same object of another scene, keep theirs.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S006` if it was not compiled with `--deformable`, `BTH-S007` if the number of
    /// positions is wrong or one is not finite, `BTH-O001` if there is not enough memory. Nothing is changed then.
    pub fn set_positions(&mut self, object: u32, positions: &[[f32; 3]]) -> Result<(), Error> {
        self.stage_positions(object, |deforming| deforming.stage(positions))
    }

    /// As [`Self::set_positions`], with positions at a share of the way between those at two times, as
    /// [`Scene::set_positions_between`](crate::Scene::set_positions_between) has them.
    ///
    /// # Errors
    /// As [`Self::set_positions`], for both ends, and `BTH-S007` if `share` is not from 0 to 1. Nothing is changed then.
    pub fn set_positions_between(
        &mut self,
        object: u32,
        ends: [&[[f32; 3]]; 2],
        share: f64,
    ) -> Result<(), Error> {
        self.stage_positions(object, |deforming| deforming.stage_between(ends, share))
    }

    fn stage_positions(
        &mut self,
        object: u32,
        stage: impl FnOnce(&mut Deforming) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.check_object(object)?;
        stage(self.scene.objects_mut().deforming(object)?)?;
        if !self.deformed.contains(&object) {
            self.deformed.push(object);
        }
        Ok(())
    }

    /// Stages the positions that sequences, skins and morph targets of files give their objects at the times of the subscenes, but for
    /// objects to which the caller gives others. Of several subscenes of one file, which have the same objects, the one of least id
    /// decides.
    ///
    /// # Errors
    /// As [`Self::commit`]. Nothing is staged then.
    pub(super) fn stage_poses(&mut self) -> Result<Posed, Error> {
        let mut posed = Posed::default();
        if self.scene.world().is_none_or(|world| world.deformers.is_empty()) {
            return Ok(posed);
        }
        let mut seen = HashSet::new();
        for subscene in self.subscenes.iter().flatten() {
            let Some(evaluated) = subscene.evaluated().filter(|_| seen.insert(subscene.first_object)) else {
                continue;
            };
            let by_caller = &self.deformed;
            let (objects, world) = self.scene.parts_mut();
            let file = objects.locate(subscene.first_object).map(|(file, _)| file.clone());
            let (Some(world), Some(file)) = (world, file) else { continue };
            let skips = |object: u32| by_caller.contains(&object);
            let file = (&file, subscene.first_object);
            posed.extend(world.deformers.stage(objects, file, evaluated, &skips)?);
        }
        self.deformed.extend(&posed.objects);
        Ok(posed)
    }

    /// Forgets what [`Self::stage_poses`] has staged.
    pub(super) fn unstage_poses(&mut self, posed: &Posed) {
        self.deformed.retain(|object| !posed.objects.contains(object));
    }

    /// Refits the objects that get new positions, and notes that their instances have changed.
    pub(super) fn refit_objects(&mut self) -> Update {
        let mut update = Update { deformed: self.deformed.len(), ..Update::default() };
        if self.deformed.is_empty() {
            return update;
        }
        let start = clock::now();
        let mut greatest: f64 = 0.0;
        for object in &self.deformed {
            if let Ok(deforming) = self.scene.objects_mut().deforming(*object) {
                deforming.refit_staged();
                greatest = greatest.max(deforming.cost_ratio());
            }
        }
        (update.deformed_cost_ratio, update.refit) = (greatest, clock::elapsed(start));
        self.forget_boxes();
        for (id, staged) in self.instances.iter_mut().enumerate() {
            if self.deformed.contains(&staged.object) {
                staged.mark(id as u32, &mut self.changed);
            }
        }
        update
    }

    /// Undoes [`Self::refit_objects`]. The new positions are staged again.
    pub(super) fn undo_refit(&mut self) {
        for object in &self.deformed {
            if let Ok(deforming) = self.scene.objects_mut().deforming(*object) {
                deforming.undo();
            }
        }
        self.forget_boxes();
    }

    fn forget_boxes(&mut self) {
        if let (_, Some(world)) = self.scene.objects_and_world_mut() {
            world.forget_parts(&self.deformed);
        }
    }
}
