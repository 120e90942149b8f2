//! Subscenes of a scene builder: files that are placed as a whole, with their hierarchy and animation.

use super::SceneBuilder;
use super::instances::StagedInstance;
use super::subscene::{Pose, Subscene};
use crate::motion::check_time;
use bth_format::{Code, Error};

/// Subscenes: files that are placed as a whole.
impl SceneBuilder {
    /// Adds an instance of each instance of a file, placed by the nodes and tracks of the file and then by `transform`, as at the
    /// first frame of the file. A file without scene sections has one instance of each object. `first_object` is what [`Self::add`]
    /// returned. Returns the id of the subscene; a file may have any number of them, each at a time of its own.
    /// Objects that the file's skins and morph targets deform are the same in all of them and deform by the time of the one of least id: add
    /// the file again for others.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, or it is not the first of its file; `BTH-S005` if there are too many instances.
    pub fn subscene(&mut self, first_object: u32, transform: &[f32; 12]) -> Result<u32, Error> {
        self.check_object(first_object)?;
        let (_, row) = self.scene.file_of(first_object);
        if row != 0 {
            let expected = "the first object of a file".to_owned();
            let found = format!("object {first_object}, which is number {row} of its file");
            return Err(Error::of_call(Code::NoSuchObject, expected, found));
        }
        let rows = Subscene::instances(self.scene.objects(), first_object);
        self.check_capacity(rows.len())?;
        let id = self.subscene_ids.take().unwrap_or_else(|| {
            self.subscenes.push(None);
            (self.subscenes.len() - 1) as u32
        });
        let mut subscene = Subscene::new(self.scene.objects(), first_object, *transform);
        let staged = |(object, node): (u32, u32)| StagedInstance {
            object,
            node,
            subscene: id,
            visible: true,
            ..StagedInstance::REMOVED
        };
        subscene.ids = rows.into_iter().map(|row| self.stage(staged(row))).collect();
        self.subscenes[id as usize] = Some(subscene);
        Ok(id)
    }

    /// The ids of a subscene's instances, in the order of the file.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene.
    pub fn subscene_instances(&self, subscene: u32) -> Result<&[u32], Error> {
        let found = self.subscenes.get(subscene as usize).and_then(Option::as_ref);
        found.map(|subscene| subscene.ids.as_slice()).ok_or_else(|| no_subscene(subscene))
    }

    /// Sets the transform from the world space of a subscene's file to that of the scene; see [`Self::instance`].
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene.
    pub fn set_subscene_transform(&mut self, subscene: u32, transform: &[f32; 12]) -> Result<(), Error> {
        self.pose(subscene)?.transform = *transform;
        Ok(())
    }

    /// Sets the time of a subscene in seconds, as [`Scene::set_seconds`](crate::Scene::set_seconds) does for a file. Others keep
    /// theirs.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene, `BTH-S002` if the time is not finite.
    pub fn set_subscene_seconds(&mut self, subscene: u32, seconds: f64) -> Result<(), Error> {
        check_time(seconds)?;
        self.pose(subscene)?.seconds = seconds;
        Ok(())
    }

    /// Hides all instances of a subscene, or shows those that are visible on their own.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene.
    pub fn set_subscene_visible(&mut self, subscene: u32, visible: bool) -> Result<(), Error> {
        self.pose(subscene)?.visible = visible;
        Ok(())
    }

    /// Removes a subscene with its instances.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene.
    pub fn remove_subscene(&mut self, subscene: u32) -> Result<(), Error> {
        self.pose(subscene)?;
        let removed = self.subscenes[subscene as usize].take();
        removed.iter().flat_map(|removed| &removed.ids).for_each(|id| self.unstage(*id));
        self.subscene_ids.release(subscene);
        Ok(())
    }

    fn pose(&mut self, subscene: u32) -> Result<&mut Pose, Error> {
        let found = self.subscenes.get_mut(subscene as usize).and_then(Option::as_mut);
        found.map(|subscene| &mut subscene.pose).ok_or_else(|| no_subscene(subscene))
    }
}

fn no_subscene(subscene: u32) -> Error {
    let expected = "a subscene that was added and not removed";
    Error::of_call(Code::NoSuchInstance, expected, format!("{subscene}"))
}
