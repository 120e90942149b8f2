//! Subscenes of a scene builder: files that are placed as a whole, with their hierarchy and
//! animation.

use super::SceneBuilder;
use super::instances::StagedInstance;
use crate::instances::{InstanceRow, NewInstance, object_of_group};
use crate::nodes::{Affine, NodeHierarchy};
use crate::objects::Objects;
use crate::scene::motion::check_time;
use bth_format::groups::Groups;
use bth_format::layout::{Instance, NONE};
use bth_format::{Code, Error, SceneView};
use std::collections::HashSet;

/// Where a subscene is, at which time, and whether it is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SubscenePose {
    /// Rows of four.
    pub(super) transform: [f64; 12],
    pub(super) seconds: f64,
    pub(super) visible: bool,
}

/// A file whose instances are placed as a whole.
#[derive(Debug)]
pub(super) struct Subscene {
    /// Index in the scene of the first object of the file.
    pub(super) first_object: u32,
    /// For each instance of the file its id in the scene.
    pub(super) ids: Vec<u32>,
    /// The nodes of the file as at `evaluated`; `None` for a file without scene sections.
    hierarchy: Option<NodeHierarchy>,
    /// What the caller wants.
    pub(super) pose: SubscenePose,
    /// What the nodes were evaluated for; `None` before the first time.
    evaluated: Option<SubscenePose>,
}

impl Subscene {
    /// A subscene of the file that begins with an object. It has no ids yet.
    pub(super) fn new(objects: &Objects, first_object: u32, transform: [f64; 12]) -> Subscene {
        let view = scene(objects, first_object);
        let seconds = view.map_or(0.0, |view| f64::from(view.scene[0].first_frame) / view.scene[0].rate);
        Subscene {
            first_object,
            ids: Vec::new(),
            hierarchy: view.map(|view| NodeHierarchy::new(&view, 0)),
            pose: SubscenePose { transform, seconds, visible: true },
            evaluated: None,
        }
    }

    /// The instances of the file, and the number of its groups. Its groups have the numbers from
    /// `first_group` on.
    pub(super) fn instances(
        objects: &Objects,
        first_object: u32,
        first_group: u32,
    ) -> (Vec<StagedInstance>, u32) {
        let row = |object: u32, node: u32| StagedInstance { object, node, ..StagedInstance::REMOVED };
        let Some(view) = scene(objects, first_object) else {
            let (file, _) = objects.locate(first_object).expect("an object of the scene");
            let all = first_object..first_object + file.object_count();
            return (all.map(|object| row(object, NONE)).collect(), 0);
        };
        let groups = Groups::of(&view);
        let count = groups.as_ref().map_or(0, Groups::world);
        let group_of = |node: u32| groups.as_ref().map_or(count, |groups| groups.of_node(node));
        let staged = |instance: &Instance| {
            let shown = instance.group().map(|node| object_of_group(first_group + group_of(node)));
            let within = Some(group_of(instance.node)).filter(|group| *group < count);
            StagedInstance {
                within: within.map_or(NONE, |group| first_group + group),
                ..row(shown.unwrap_or(first_object + instance.object), instance.node)
            }
        };
        (view.instances.iter().map(staged).collect(), count)
    }

    /// Evaluates the nodes for the pose, and calls `moved` with the id of each instance that has to
    /// be placed again. Returns the number of nodes that moved.
    pub(super) fn evaluate(&mut self, objects: &Objects, mut moved: impl FnMut(u32)) -> usize {
        let former = self.evaluated.replace(self.pose);
        if former == Some(self.pose) {
            return 0;
        }
        let all =
            former.is_none_or(|former| SubscenePose { seconds: self.pose.seconds, ..former } != self.pose);
        let (Some(view), Some(hierarchy)) = (scene(objects, self.first_object), &mut self.hierarchy) else {
            self.ids.iter().filter(|_| all).for_each(|id| moved(*id));
            return 0;
        };
        let nodes = hierarchy.update(&view, self.pose.seconds, all);
        let ids = self.ids.iter().zip(view.instances);
        ids.filter(|(_, row)| hierarchy.moved(row.node)).for_each(|(id, _)| moved(*id));
        nodes
    }

    /// The nodes of the file as evaluated; `None` for a file without scene sections.
    pub(super) fn hierarchy(&self) -> Option<&NodeHierarchy> {
        self.hierarchy.as_ref()
    }

    /// The transform of a node of the file to world space as evaluated, and whether it is visible.
    /// An object that is `skinned` is not moved by its node, and a node in a group (`in_group`) not
    /// by the subscene.
    pub(super) fn node(
        &self,
        objects: &Objects,
        node: u32,
        (skinned, in_group): (bool, bool),
    ) -> (Affine, bool) {
        let outer = if in_group { Affine::IDENTITY } else { Affine::from_rows(&self.pose.transform) };
        match (scene(objects, self.first_object), &self.hierarchy) {
            (_, Some(hierarchy)) if skinned => (outer, self.pose.visible && !hierarchy.invisible(node)),
            (Some(view), Some(hierarchy)) => {
                let inner = hierarchy.to_world(&view, node);
                // The product with the identity may change the sign of a zero.
                let to_world = if outer == Affine::IDENTITY { inner } else { outer.times(&inner) };
                (to_world, self.pose.visible && !hierarchy.hidden(node))
            }
            _ => (outer, self.pose.visible),
        }
    }
}

impl StagedInstance {
    /// The instance as it is to be in the scene.
    pub(super) fn placed_in(
        &self,
        objects: &Objects,
        subscenes: &[Option<Subscene>],
        skinned: &HashSet<u32>,
    ) -> NewInstance {
        let StagedInstance { object, within, subscene, node, visible, .. } = *self;
        let owner = subscenes.get(subscene as usize).and_then(Option::as_ref);
        let (to_world, shown) = match owner {
            Some(owner) => owner.node(objects, node, (skinned.contains(&object), within != NONE)),
            None => (Affine::from_rows(&self.transform), true),
        };
        NewInstance { row: InstanceRow { object, within, node, to_world }, visible: visible && shown }
    }
}

/// The scene sections of the file of an object.
fn scene(objects: &Objects, object: u32) -> Option<SceneView<'_>> {
    objects.locate(object).and_then(|(file, _)| file.scene())
}

/// Subscenes: files that are placed as a whole.
impl SceneBuilder {
    /// Adds an instance of each instance of a file, placed by the nodes and tracks of the file and
    /// then by `transform`, as at the first frame of the file. A file without scene sections has
    /// one instance of each object. Groups of the file become groups of the scene, for this
    /// subscene alone. `first_object` is what [`Self::add`] returned. Returns the id
    /// of the subscene; a file may have any number of subscenes, each with its own time. All of
    /// them share the objects that the file's skins and morph targets deform; the time of the
    /// subscene with the lowest id decides their pose. For other poses, add the file again.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, or it is not the first of its file; `BTH-S005` if
    /// there are too many instances.
    pub fn subscene<T: Copy + Into<f64>>(
        &mut self,
        first_object: u32,
        transform: &[T; 12],
    ) -> Result<u32, Error> {
        self.check_object(first_object)?;
        let (_, row) = self.scene.file_of(first_object);
        if row != 0 {
            let expected = "the first object of a file".to_owned();
            let found = format!("object {first_object}, which is number {row} of its file");
            return Err(Error::of_call(Code::NoSuchObject, expected, found));
        }
        let first_group = self.scene.world().map_or(0, |world| world.group_count());
        let (rows, groups) = Subscene::instances(self.scene.objects(), first_object, first_group);
        self.check_capacity(rows.len())?;
        (0..groups).for_each(|_| _ = self.add_group());
        let id = self.subscene_ids.take().unwrap_or_else(|| {
            self.subscenes.push(None);
            (self.subscenes.len() - 1) as u32
        });
        let mut subscene = Subscene::new(self.scene.objects(), first_object, transform.map(Into::into));
        let staged = |row: StagedInstance| StagedInstance { subscene: id, visible: true, ..row };
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

    /// Sets the transform from the world space of a subscene's file to the world space of the
    /// scene; see [`Self::instance`].
    ///
    /// # Errors
    /// `BTH-S003` if there is no such subscene.
    pub fn set_subscene_transform<T: Copy + Into<f64>>(
        &mut self,
        subscene: u32,
        transform: &[T; 12],
    ) -> Result<(), Error> {
        self.pose(subscene)?.transform = transform.map(Into::into);
        Ok(())
    }

    /// Sets the time of a subscene in seconds, as [`Scene::set_seconds`](crate::Scene::set_seconds)
    /// does for a file. Others keep theirs.
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

    fn pose(&mut self, subscene: u32) -> Result<&mut SubscenePose, Error> {
        let found = self.subscenes.get_mut(subscene as usize).and_then(Option::as_mut);
        found.map(|subscene| &mut subscene.pose).ok_or_else(|| no_subscene(subscene))
    }
}

fn no_subscene(subscene: u32) -> Error {
    let expected = "a subscene that was added and not removed";
    Error::of_call(Code::NoSuchInstance, expected, format!("{subscene}"))
}
