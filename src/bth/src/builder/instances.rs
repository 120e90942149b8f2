//! Instances of single objects in a scene builder.

use super::{MAX_INSTANCES, SceneBuilder};
use bth_format::layout::NONE;
use bth_format::{Code, Error};

/// An instance as it is to be after the next commit.
#[derive(Clone, Copy, Debug)]
pub(super) struct StagedInstance {
    /// Rows of four; without meaning for an instance of a subscene.
    pub(super) transform: [f64; 12],
    /// Index of its object, or `NONE` if the instance was removed.
    pub(super) object: u32,
    /// The group in which it is, or `NONE`.
    pub(super) within: u32,
    /// The subscene to which it belongs, or `NONE`.
    pub(super) subscene: u32,
    /// Its node in the file of the subscene, or `NONE`.
    pub(super) node: u32,
    pub(super) visible: bool,
    /// True if it is in the list of the changed ones.
    pub(super) changed: bool,
}

impl StagedInstance {
    /// No instance.
    pub(super) const REMOVED: StagedInstance = StagedInstance {
        transform: [0.0; 12],
        object: NONE,
        within: NONE,
        subscene: NONE,
        node: NONE,
        visible: false,
        changed: false,
    };

    /// Adds the instance to those that have changed.
    pub(super) fn mark(&mut self, id: u32, changed: &mut Vec<u32>) {
        if !self.changed {
            self.changed = true;
            changed.push(id);
        }
    }
}

impl SceneBuilder {
    /// Adds an instance of an object; returns its id. `transform` maps object space to world space:
    /// the rows of a 3×4 matrix, one after the other, that is applied to columns (x, y, z, 1). It
    /// may scale, shear and mirror. Its numbers are `f32` or `f64` and are not rounded.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S005` if there are too many instances.
    /// [`Self::commit`] decides whether the transform can be used.
    pub fn instance<T: Copy + Into<f64>>(&mut self, object: u32, transform: &[T; 12]) -> Result<u32, Error> {
        self.check_object(object)?;
        self.check_capacity(1)?;
        let transform = transform.map(Into::into);
        let staged = StagedInstance { transform, object, visible: true, ..StagedInstance::REMOVED };
        Ok(self.stage(staged))
    }

    /// Sets the transform of an instance; see [`Self::instance`].
    ///
    /// # Errors
    /// `BTH-S003` if there is no such instance, `BTH-S004` if it belongs to a subscene.
    pub fn set_transform<T: Copy + Into<f64>>(
        &mut self,
        instance: u32,
        transform: &[T; 12],
    ) -> Result<(), Error> {
        self.set_transforms(&[instance], std::slice::from_ref(transform))
    }

    /// Sets the transforms of many instances. If an instance is given several times, its last
    /// transform counts.
    ///
    /// # Errors
    /// The error of [`Self::set_transform`] for the first instance that has one. No transform is
    /// set then.
    ///
    /// # Panics
    /// If there are not as many transforms as instances.
    pub fn set_transforms<T: Copy + Into<f64>>(
        &mut self,
        instances: &[u32],
        transforms: &[[T; 12]],
    ) -> Result<(), Error> {
        assert_eq!(instances.len(), transforms.len(), "as many transforms as instances");
        instances.iter().try_for_each(|id| self.check_own(*id))?;
        for (&id, transform) in instances.iter().zip(transforms) {
            let staged = &mut self.instances[id as usize];
            staged.transform = transform.map(Into::into);
            staged.mark(id, &mut self.changed);
        }
        Ok(())
    }

    /// Hides an instance from all queries, or shows it again. It keeps its id and its transform,
    /// which may be any while it is hidden. An instance of a subscene is visible if the subscene
    /// and its nodes are, too.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such instance.
    pub fn set_visible(&mut self, instance: u32, visible: bool) -> Result<(), Error> {
        self.staged(instance)?;
        let staged = &mut self.instances[instance as usize];
        staged.visible = visible;
        staged.mark(instance, &mut self.changed);
        Ok(())
    }

    /// Removes an instance. Its id is not used for another one before the next commit has
    /// succeeded.
    ///
    /// # Errors
    /// The errors of [`Self::set_transform`].
    pub fn remove(&mut self, instance: u32) -> Result<(), Error> {
        self.check_own(instance)?;
        self.unstage(instance);
        Ok(())
    }

    /// An instance that was not removed.
    pub(super) fn staged(&self, instance: u32) -> Result<&StagedInstance, Error> {
        let staged = self.instances.get(instance as usize).filter(|staged| staged.object != NONE);
        staged.ok_or_else(|| {
            let found = format!("{instance}");
            Error::of_call(Code::NoSuchInstance, "an instance that was added and not removed", found)
        })
    }

    /// Checks that there is an instance, and that it belongs to no subscene.
    fn check_own(&self, instance: u32) -> Result<(), Error> {
        match self.staged(instance)?.subscene {
            NONE => Ok(()),
            subscene => Err(Error::of_call(
                Code::PlacedByFile,
                "an instance that the caller places",
                format!("instance {instance} of subscene {subscene}"),
            )),
        }
    }

    /// Checks that some more instances can be added.
    pub(super) fn check_capacity(&self, count: usize) -> Result<(), Error> {
        let total = self.instances.len() - self.instance_ids.len() + count;
        if total <= MAX_INSTANCES {
            return Ok(());
        }
        let expected = format!("at most {MAX_INSTANCES} instances");
        Err(Error::of_call(Code::TooManyInstances, expected, format!("{total}")))
    }

    /// Adds an instance; returns its id.
    pub(super) fn stage(&mut self, staged: StagedInstance) -> u32 {
        let id = self.instance_ids.take().unwrap_or_else(|| {
            self.instances.push(StagedInstance::REMOVED);
            (self.instances.len() - 1) as u32
        });
        let slot = &mut self.instances[id as usize];
        *slot = StagedInstance { changed: slot.changed, ..staged };
        slot.mark(id, &mut self.changed);
        id
    }

    /// Removes an instance.
    pub(super) fn unstage(&mut self, id: u32) {
        let slot = &mut self.instances[id as usize];
        *slot = StagedInstance { changed: slot.changed, ..StagedInstance::REMOVED };
        slot.mark(id, &mut self.changed);
        self.instance_ids.release(id);
    }

    /// Words for an instance that cannot be placed.
    pub(super) fn describe(&self, instance: u32) -> String {
        let staged = &self.instances[instance as usize];
        let Some(Some(subscene)) = self.subscenes.get(staged.subscene as usize) else {
            return format!("instance {instance}, transform {:?}", staged.transform);
        };
        let (file, _) = self.scene.file_of(staged.object);
        let name = file.scene().map_or("", |view| view.node_name(staged.node)).escape_debug();
        let (id, pose) = (staged.subscene, &subscene.pose);
        format!(
            "instance {instance} at node \"{name}\" of subscene {id} at {} s, transform {:?}",
            pose.seconds, pose.transform
        )
    }
}
