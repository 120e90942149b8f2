//! Scenes whose instances the caller places: the objects of several files, moved at run time.
//!
//! Changes are staged. A commit makes all of them visible, or none if it fails. The staged state is
//! here ([`instances`] of single objects, [`groups`], [`subscenes`] of whole files). The committed
//! state is in the [`Scene`], so rays reach instances of callers and of files in the same way.

mod groups;
mod ids;
mod instances;
mod positions;
mod subscenes;

pub use self::groups::Content;

use self::ids::FreeIds;
use self::instances::StagedInstance;
use self::subscenes::Subscene;
use crate::scene::Scene;
use crate::update::Update;
use bth_format::{Code, Error};

/// Max number of instances: their indices are stored next to kinds of nodes in 32 bits.
const MAX_INSTANCES: usize = 1 << 30;

/// Makes a [`Scene`] of the objects of several files, and moves its instances at run time.
///
/// The builder holds the scene: [`Self::scene`] returns it, and it answers all queries. Instances
/// are added, moved, hidden and removed by calls that only note what is to be; [`Self::commit`]
/// then places what has changed and updates the top level. Nothing is compiled or built for the
/// objects, whose files are shared with the scenes that they were added from.
///
/// Instances are named by an id, which stays the same until the instance is removed, and which is
/// the instance of hits ([`PrimitiveRef`](crate::rays::PrimitiveRef)) where there are no groups
/// ([`Self::add_group`]). A commit frees the ids of
/// removed instances; the lowest free id is used first.
///
/// ```
/// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
/// let mut builder = bth::SceneBuilder::new();
/// let tree = builder.add(&bth::from_bytes(CUBE)?);
/// let stone = builder.add(&bth::from_bytes(CUBE)?);
/// let at = |x: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
/// let mut trees = Vec::new();
/// for i in 0..100 {
///     trees.push(builder.instance(tree, &at(i as f32))?);
/// }
/// builder.instance(stone, &at(-3.0))?;
/// builder.commit()?;
///
/// let ray = bth::rays::Ray::new([7.0, 0.5, 9.0], [0.0, 0.0, -1.0]);
/// let hit = builder.scene().nearest(&ray).expect("a tree is there");
/// builder.set_transform(hit.primitive.instance, &at(7.5))?;
/// builder.remove(trees[0])?;
/// let update = builder.commit()?;
/// assert_eq!(update.visible, 100);
/// # Ok::<(), bth::Error>(())
/// ```
#[derive(Debug)]
pub struct SceneBuilder {
    scene: Scene,
    /// For each id the instance as it is to be.
    instances: Vec<StagedInstance>,
    /// The ids of instances that differ from the scene.
    changed: Vec<u32>,
    instance_ids: FreeIds,
    /// For each id the subscene; `None` if it was removed.
    subscenes: Vec<Option<Subscene>>,
    subscene_ids: FreeIds,
    /// The objects that get new positions.
    repositioned: Vec<u32>,
}

impl Default for SceneBuilder {
    fn default() -> SceneBuilder {
        SceneBuilder::new()
    }
}

impl SceneBuilder {
    /// A scene without objects and instances.
    pub fn new() -> SceneBuilder {
        SceneBuilder {
            scene: Scene::of_several_files(),
            instances: Vec::new(),
            changed: Vec::new(),
            instance_ids: FreeIds::default(),
            subscenes: Vec::new(),
            subscene_ids: FreeIds::default(),
            repositioned: Vec::new(),
        }
    }

    /// Adds the objects of another scene, without instances of them. Returns the index of the
    /// first: the object with index `i` there has index `first + i` here ([`Scene::file_of`] leads
    /// back). The files are shared and stay open as long as one of the scenes does; masks and the
    /// time of the other scene have no effect here.
    pub fn add(&mut self, scene: &Scene) -> u32 {
        self.scene.add_objects(scene)
    }

    /// The scene as it was last committed, with all objects that were added.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene as it was last committed, which then cannot be changed any more.
    pub fn into_scene(self) -> Scene {
        self.scene
    }

    /// Like [`Scene::set_instance_mask`]: takes effect at once, without a commit. The mask of an
    /// instance that is removed is dropped.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such instance.
    pub fn set_instance_mask(&mut self, instance: u32, mask: u32) -> Result<(), Error> {
        self.staged(instance)?;
        self.scene.masks_mut().set_instance(instance, mask);
        Ok(())
    }

    /// Like [`Scene::set_group_mask`]: takes effect at once, without a commit.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, or if it has no such group.
    pub fn set_group_mask(&mut self, object: u32, group: u32, mask: u32) -> Result<(), Error> {
        self.check_object(object)?;
        let count = self.scene.group_count(object);
        if group >= count {
            let expected = format!("a group of object {object} below {count}");
            return Err(Error::of_call(Code::NoSuchObject, expected, format!("{group}")));
        }
        self.scene.masks_mut().set_group(object, group, mask);
        Ok(())
    }

    /// Makes all changes since the last commit visible: gives objects their new positions, places
    /// the instances that changed, and updates the top level. If instances only moved, the boxes of
    /// the top level are computed again; if instances came, went, were hidden or became visible, or
    /// [`Update::cost_ratio`] would exceed its bound, it is built again. With the feature `rayon`,
    /// the threads of the current pool share the work of some thousand instances or more. The
    /// answers of queries depend on none of this.
    ///
    /// # Errors
    /// `BTH-S001` if the transform of a visible instance cannot be inverted, `BTH-S002` if the
    /// transform, the world box or the position of a vertex that a file's skins and morph targets
    /// move is not finite in `f32`. The error gives the instance or the node. The scene is then
    /// unchanged, and so are the changes that wait for a commit: correct the transform, or hide or
    /// remove the instance, and commit again.
    pub fn commit(&mut self) -> Result<Update, Error> {
        let mut nodes = 0;
        for subscene in self.subscenes.iter_mut().flatten() {
            let (instances, changed) = (&mut self.instances, &mut self.changed);
            let moved = |id: u32| instances[id as usize].mark(id, changed);
            nodes += subscene.evaluate(self.scene.objects(), moved);
        }
        let staged = self.stage_poses()?;
        let refitted = self.refit_objects();
        let skinned = self.scene.world().map(|world| world.animation.skinned_objects()).unwrap_or_default();
        let (scene, instances, subscenes) = (&mut self.scene, &self.instances, &self.subscenes);
        let (objects, world) = scene.objects_and_world_mut();
        let Some(world) = world else { return Ok(Update::default()) };
        let new = |id: u32| instances[id as usize].placed_in(objects, subscenes, &skinned);
        let update = match world.change(objects, instances.len(), &self.changed, &new) {
            Ok(update) => Update { nodes, ..update }.with_refit(refitted),
            Err(failed) => {
                self.undo_refit();
                self.unstage_poses(&staged);
                return Err(failed.error(&self.describe(failed.instance)));
            }
        };
        for id in self.changed.drain(..) {
            self.instances[id as usize].changed = false;
        }
        for id in self.instance_ids.commit() {
            self.scene.masks_mut().set_instance(id, u32::MAX);
        }
        self.subscene_ids.commit();
        self.repositioned.clear();
        if let (_, Some(world)) = self.scene.parts_mut() {
            world.animation.keep(staged);
        }
        Ok(update)
    }

    fn check_object(&self, object: u32) -> Result<(), Error> {
        let count = self.scene.object_count();
        if object < count {
            return Ok(());
        }
        let expected = format!("an object below {count}, the number of those that were added");
        Err(Error::of_call(Code::NoSuchObject, expected, format!("{object}")))
    }
}

#[cfg(test)]
mod tests;
