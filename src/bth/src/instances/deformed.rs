//! Instances of objects that have got new positions: their boxes change, their transforms do not.

use super::caller::Unplaceable;
use super::placement::Placement;
use super::world::{TransformSource, World};
use crate::objects::Objects;
use crate::update::Update;

impl World {
    /// Computes the world boxes of all visible instances of some objects anew, and refits or rebuilds the top level.
    ///
    /// # Errors
    /// The first instance that cannot be placed. No instance is changed then.
    pub(crate) fn place_again(&mut self, objects: &Objects, deformed: &[u32]) -> Result<Update, Unplaceable> {
        self.forget_parts(deformed);
        let mut placed = Vec::new();
        for (instance, placement) in self.placements.iter().enumerate() {
            let instance = instance as u32;
            let Some(object) = placement.as_ref().map(Placement::object) else { continue };
            if deformed.contains(&object) {
                let to_world = self.row(objects, instance).to_world;
                let parts = self.parts_of(objects, object);
                let placement = Placement::new(&to_world, object, objects.header(object), &parts);
                placed.push((instance, placement.map_err(|error| Unplaceable { instance, error })?));
            }
        }
        let visible = self.placements.iter().flatten().count();
        let mut update = Update { placed: placed.len(), visible, ..Update::default() };
        for (instance, placement) in placed {
            self.placements[instance as usize] = Some(placement);
        }
        if update.placed > 0 {
            self.update_top(true, &mut update);
        }
        Ok(update)
    }

    /// Forgets what is known about the boxes of some objects, which have got others.
    pub(crate) fn forget_parts(&mut self, deformed: &[u32]) {
        if let TransformSource::Caller(caller) = &mut self.source {
            deformed.iter().for_each(|object| caller.forget_parts(*object));
        }
    }
}
