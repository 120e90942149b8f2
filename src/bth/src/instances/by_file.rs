//! The instances of a file with scene sections at a time.

use super::group_row::object_of_group;
use super::groups::{self, RowPlace};
use super::placement::{RowBox, Unplaceable};
use super::stored::StoredRows;
use super::top_level::TopLevel;
use super::world::{InstanceRow, NewInstance, TransformSource, World, scene_of};
use crate::animation::{AnimatedFile, StagedPoses};
use crate::clock;
use crate::nodes::affine::Affine;
use crate::nodes::hierarchy::NodeHierarchy;
use crate::objects::Objects;
use crate::update::Update;
use bth_format::SceneView;
use bth_format::error::{Error, Result};
use bth_format::groups::Groups;
use bth_format::layout::*;
use std::sync::Arc;

/// Rows that are placed at a time, so that few placements are in memory twice.
const CHUNK: usize = 1 << 16;

impl World {
    /// The instances of a file at the first frame of its scene; `None` if the objects are not those
    /// of a file with scene sections.
    ///
    /// # Errors
    /// Those of [`File::check_scene`](bth_format::file::File::check_scene) and of [`Self::update`].
    pub(crate) fn new(objects: &Objects) -> Result<Option<World>> {
        let Some(file) = objects.sole_file() else { return Ok(None) };
        let Some(view) = file.check_scene()? else { return Ok(None) };
        let scene = &view.scene[0];
        let seconds = f64::from(scene.first_frame) / scene.rate;
        let world = World::placed_at(objects, &view, seconds);
        world.map(Some).map_err(|failed| unplaceable(objects, seconds, failed))
    }

    /// Like [`Self::new`], with the trees of the file, and without checking anything in the scene
    /// sections. `None` if the file has no trees.
    ///
    /// # Errors
    /// Errors of [`Self::update`].
    pub(crate) fn with_trees(objects: &Objects) -> Result<Option<World>> {
        let Some(file) = objects.sole_file() else { return Ok(None) };
        let (Some(view), Some(stored)) = (file.scene(), StoredRows::of(file)) else { return Ok(None) };
        let [scene] = view.scene else { return Ok(None) };
        let seconds = f64::from(scene.first_frame) / scene.rate;
        let source = TransformSource::File(NodeHierarchy::new(&view, stored.nodes()));
        let rows = &view.instances[stored.rows() as usize..];
        let mut world = World::unplaced(source, seconds, rows.len(), file.object_count());
        let stored = Arc::new(stored);
        world.stored = Some(Arc::clone(&stored));
        let (first_node, in_trees) = (stored.nodes(), stored.groups());
        let moving = Groups::of_rows(view.nodes[first_node as usize..].iter().map(|node| {
            let parent = (node.parent != NONE).then(|| node.parent.saturating_sub(first_node));
            (parent, node.flags & NODE_GROUP != 0)
        }));
        let count = in_trees + moving.as_ref().map_or(0, Groups::world);
        if count > 0 {
            let group_of = |node: u32| match &moving {
                Some(groups) => in_trees + groups.of_node(node - first_node),
                None => in_trees,
            };
            let place = |instance: &Instance| RowPlace {
                object: match instance.group() {
                    Some(node) if node >= first_node => object_of_group(group_of(node)),
                    _ => stored.shown(&view, instance),
                },
                within: group_of(instance.node),
            };
            let groups = groups::Groups::of_file(&stored, rows.iter().map(place), count);
            world.set_groups(groups.expect("a file whose scene has been checked"));
        }
        world.top.first_row = stored.rows();
        if let Some(tree) = stored.trees().last().filter(|_| stored.holds_world()) {
            world.top = TopLevel::stored(file, tree);
        }
        world.evaluate_nodes(objects, seconds, true);
        let placed = world.place_moved(objects, &[], true);
        placed.map_err(|failed| unplaceable(objects, seconds, failed))?;
        Ok(Some(world))
    }

    /// Places the rows that were in trees of the file, so that they can be changed.
    ///
    /// # Errors
    /// The first row that cannot be placed.
    pub(super) fn place_stored(&mut self, objects: &Objects) -> Result<(), Unplaceable> {
        if self.stored.is_none() {
            return Ok(());
        }
        let mut placed = World::placed_at(objects, &scene_of(objects), self.seconds)?;
        placed.traced = std::mem::take(&mut self.traced);
        *self = placed;
        Ok(())
    }

    /// The instances of a file at a time. Its scene has been checked.
    ///
    /// # Errors
    /// The first instance that cannot be placed.
    fn placed_at(objects: &Objects, view: &SceneView<'_>, seconds: f64) -> Result<World, Unplaceable> {
        let file = objects.sole_file().expect("a file with a scene");
        let source = TransformSource::File(NodeHierarchy::new(view, 0));
        let mut world = World::unplaced(source, seconds, view.instances.len(), file.object_count());
        if let Some(groups) = Groups::of(view) {
            let place = |instance: &Instance| RowPlace {
                object: instance
                    .group()
                    .map_or(instance.object, |node| object_of_group(groups.of_node(node))),
                within: groups.of_node(instance.node),
            };
            let groups = groups::Groups::new(view.instances.iter().map(place), groups.world());
            world.set_groups(groups.expect("the check of the scene has counted them"));
        }
        world.animation.add(file, 0);
        world.evaluate_nodes(objects, seconds, true);
        world.place_moved(objects, &[], true)?;
        Ok(world)
    }

    /// The boxes of the visible rows of a scene without groups and deformers at its first frame. It
    /// has been checked.
    ///
    /// # Errors
    /// The errors of [`Self::update`].
    pub(super) fn first_boxes(objects: &Objects, view: &SceneView<'_>) -> Result<Vec<(u32, RowBox)>> {
        let seconds = f64::from(view.scene[0].first_frame) / view.scene[0].rate;
        let source = TransformSource::File(NodeHierarchy::new(view, 0));
        let mut world = World::unplaced(source, seconds, 0, objects.count());
        world.evaluate_nodes(objects, seconds, true);
        let TransformSource::File(hierarchy) = &world.source else { return Ok(Vec::new()) };
        let new = |row: u32| {
            let &Instance { node, object, .. } = &view.instances[row as usize];
            let row = InstanceRow { object, within: NONE, node, to_world: hierarchy.to_world(view, node) };
            NewInstance { row, visible: !hierarchy.hidden(node) }
        };
        let (mut boxes, mut placed) = (Vec::new(), Vec::new());
        let count = view.instances.len() as u32;
        for first in (0..count).step_by(CHUNK) {
            let rows = (first..count.min(first + CHUNK as u32)).collect::<Vec<_>>();
            world.place_all(objects, &rows, &new, &mut placed);
            for (instance, placed) in rows.into_iter().zip(&placed) {
                let failed = |error| unplaceable(objects, seconds, Unplaceable { instance, error });
                let placed = placed.map_err(failed)?;
                boxes.extend(placed.map(|placed| (instance, placed.row_box())));
            }
        }
        Ok(boxes)
    }

    /// An instance of each object, in its place. It has the index of the object.
    ///
    /// # Errors
    /// `BTH-S002` if the box of an object is not finite.
    pub(crate) fn of_objects_in_place(objects: &Objects) -> Result<World> {
        let (mut world, all) = (World::empty(), (0..objects.count()).collect::<Vec<_>>());
        world.add_objects(objects.count());
        let in_place = |object| {
            let row = InstanceRow { object, within: NONE, node: NONE, to_world: Affine::IDENTITY };
            NewInstance { row, visible: true }
        };
        let changed = world.change(objects, all.len(), &all, &in_place);
        changed.map_err(|failed| failed.error(&format!("object {}", failed.instance)))?;
        Ok(world)
    }

    /// Deforms the objects as at the first frame and places their instances again. Does nothing for
    /// a scene whose objects keep their shape.
    ///
    /// # Errors
    /// The errors of [`Self::update`], and `BTH-S006` if an object cannot be given new positions.
    pub(crate) fn deform_first(&mut self, objects: &mut Objects) -> Result<()> {
        if !self.animation.is_empty() {
            self.update(objects, self.seconds)?;
        }
        Ok(())
    }

    /// Sets the time of a file's scene. After an error the scene is unchanged. It has no effect if
    /// the caller places the instances.
    ///
    /// # Errors
    /// `BTH-S001` if the transform of a visible instance is singular, `BTH-S002` if it, the world
    /// box or the position of a vertex is not finite. The error gives the node.
    pub(crate) fn update(&mut self, objects: &mut Objects, seconds: f64) -> Result<Update> {
        if !matches!(self.source, TransformSource::File(_)) {
            return Ok(Update::default());
        }
        let result = self.try_update(objects, seconds);
        match &result {
            Ok(_) => self.seconds = seconds,
            // The instances of the former time have been placed before, so placing them again
            // succeeds.
            Err(_) => {
                self.evaluate_nodes(objects, self.seconds, true);
                let _ = self.place_moved(objects, &[], true);
            }
        }
        result
    }

    /// The errors of [`Self::update`]. After an error the objects are unchanged, but not the nodes
    /// and placements.
    fn try_update(&mut self, objects: &mut Objects, seconds: f64) -> Result<Update> {
        let nodes = self.evaluate_nodes(objects, seconds, false);
        let TransformSource::File(hierarchy) = &self.source else { return Ok(Update::default()) };
        let start = clock::now();
        let staged = match objects.sole_file().filter(|_| !self.animation.is_empty()).cloned() {
            Some(file) => {
                let at = AnimatedFile { file: &file, first_object: 0, hierarchy, seconds };
                self.animation.stage(objects, at, &|_| false)?
            }
            None => StagedPoses::default(),
        };
        let refitted = objects.refit(&staged.objects, start);
        let update = match self.place_moved(objects, &staged.objects, false) {
            Ok(update) => update,
            Err(failed) => {
                self.forget_parts(&staged.objects);
                objects.undo_refit(&staged.objects);
                return Err(unplaceable(objects, seconds, failed));
            }
        };
        self.animation.keep(staged);
        Ok(Update { nodes, ..update }.with_refit(refitted))
    }

    /// Brings the nodes to a time, all of them with `all`; returns the number of those that moved.
    fn evaluate_nodes(&mut self, objects: &Objects, seconds: f64, all: bool) -> usize {
        match &mut self.source {
            TransformSource::File(hierarchy) => hierarchy.update(&scene_of(objects), seconds, all),
            TransformSource::Caller(_) => 0,
        }
    }

    /// Places the instances that moved and the instances of objects that deformed, or with `all`
    /// every instance, and rebuilds the top level.
    ///
    /// # Errors
    /// The first instance that cannot be placed.
    fn place_moved(&mut self, objects: &Objects, deformed: &[u32], all: bool) -> Result<Update, Unplaceable> {
        self.forget_parts(deformed);
        let view = scene_of(objects);
        let mut deforms = vec![false; if deformed.is_empty() { 0 } else { objects.count() as usize }];
        deformed.iter().for_each(|object| deforms[*object as usize] = true);
        let mut update = Update::default();
        let is_skinned =
            |world: &World, of: &Instance| of.group().is_none() && world.animation.is_skinned(of.object);
        let hides = |hierarchy: &NodeHierarchy, of: &Instance, skinned: bool| match skinned {
            // The transform of its node has no effect, so a scale of zero does not hide it.
            true => hierarchy.invisible(of.node),
            false => hierarchy.hidden(of.node),
        };
        let (mut moved, mut placed) = (Vec::new(), Vec::new());
        let first_row = self.first_row();
        for (first, rows) in view.instances[first_row as usize..].chunks(CHUNK).enumerate() {
            let TransformSource::File(hierarchy) = &self.source else { break };
            let first = first_row + (first * CHUNK) as u32;
            moved.clear();
            moved.extend((0..rows.len() as u32).map(|i| first + i).filter(|row| {
                let of = &view.instances[*row as usize];
                let is_placed = self.placements[(*row - first_row) as usize].is_some();
                let moves = match is_skinned(self, of) {
                    true => all || hides(hierarchy, of, true) == is_placed,
                    false => hierarchy.moved(of.node),
                };
                moves
                    || of.group().is_none() && deforms.get(of.object as usize).is_some_and(|deforms| *deforms)
            }));
            let new = |row: u32| {
                let of = &view.instances[row as usize];
                let skinned = is_skinned(self, of);
                let visible = !hides(hierarchy, of, skinned);
                let to_world = match skinned {
                    true => Affine::IDENTITY,
                    false => hierarchy.to_world(&view, of.node),
                };
                let object = if of.group().is_some() { object_of_group(0) } else { of.object };
                NewInstance { row: InstanceRow { object, within: NONE, node: of.node, to_world }, visible }
            };
            self.place_all(objects, &moved, &new, &mut placed);
            let staged: Vec<_> = match self.groups() {
                Some(_) => moved.iter().map(|row| new(*row)).collect(),
                None => Vec::new(),
            };
            for (&instance, placed) in moved.iter().zip(&placed) {
                let placement = placed.map_err(|error| Unplaceable { instance, error })?;
                self.placements[(instance - first_row) as usize] = placement;
            }
            if let Some(groups) = self.groups_mut() {
                for (row, NewInstance { row: InstanceRow { to_world, .. }, visible }) in
                    moved.iter().zip(&staged)
                {
                    groups.stage(*row, to_world, *visible);
                }
            }
            update.placed += moved.len();
        }
        if update.placed > 0 {
            self.update_groups(objects, std::iter::empty())?;
            self.update_top(false, &mut update);
        }
        update.visible = self.visible();
        Ok(update)
    }

    /// The transform from a node's space to world space, as rows of four, and whether the node is
    /// visible.
    ///
    /// # Panics
    /// If there is no such node, as where the caller places the instances.
    pub(crate) fn node(&self, objects: &Objects, node: u32) -> ([[f64; 4]; 3], bool) {
        let TransformSource::File(hierarchy) = &self.source else { panic!("expected a file with nodes") };
        let view = scene_of(objects);
        (hierarchy.to_world(&view, node).rows(), !hierarchy.hidden_of(&view, node))
    }
}

/// The error for an instance that cannot be placed at a time.
fn unplaceable(objects: &Objects, seconds: f64, failed: Unplaceable) -> Error {
    let (view, (code, expected, found)) = (scene_of(objects), failed.error.words());
    let node = view.instances[failed.instance as usize].node;
    let found = format!("{found}: node \"{}\" at {seconds} s", view.node_name(node).escape_debug());
    let offset = u64::from(node) * size_of::<Node>() as u64;
    let error = Error::within_file(code, kind::NODES, offset, expected, found);
    objects.sole_file().expect("a file with nodes").locate(error, NONE)
}
