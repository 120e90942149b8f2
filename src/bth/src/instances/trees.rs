//! The trees of a scene as a file may hold them ([`super::stored`] reads them).

use super::World;
use super::top_level::TopLevel;
use super::world::scene_of;
use crate::objects::Objects;
use bth_format::SceneView;
use bth_format::error::Result;
use bth_format::groups::Groups;
use bth_format::layout::{CacheLine, Instance, NONE, Tree};
use bth_format::limits::MAX_STORED_LEVELS;

/// The trees over the rows of a scene's groups before the first that moves, and of its world, if
/// nothing moves. They are what a file may hold. Empty where it may not.
#[derive(Debug, Default)]
pub struct Trees {
    /// Rows of `TREES`.
    pub trees: Vec<Tree>,
    /// Rows of `TREE_LINES`.
    pub lines: Vec<CacheLine>,
    /// True if a reader of the file needs to know
    /// [`FEATURE_FIRST_TREES`](bth_format::layout::FEATURE_FIRST_TREES).
    pub first_only: bool,
}

impl Trees {
    /// Adds a tree without its lines. What is known of its group is in `of`.
    fn add(&mut self, top: &TopLevel, visible: usize, of: Tree) {
        let before = self.trees.last();
        self.trees.push(Tree {
            first_line: self.lines.len() as u32,
            lines: top.nodes().0.len() as u32,
            depth: top.depth,
            first_row: before.map_or(0, |tree| tree.first_row + tree.rows),
            visible: visible as u32,
            extent: top.extent,
            origin_slack: top.origin_slack,
            ..of
        });
    }
}

impl World {
    /// Checks that the visible instances of a file can be placed at the first frame of its scene.
    /// Returns the trees that the file may hold. The boxes of
    /// rows hold whole objects.
    ///
    /// # Errors
    /// The errors of [`Self::new`].
    pub(crate) fn first_trees(objects: &Objects) -> Result<Trees> {
        let Some(file) = objects.sole_file() else { return Ok(Trees::default()) };
        let Some(view) = file.check_scene()? else { return Ok(Trees::default()) };
        if Groups::of(&view).is_some() || !view.deformers.is_empty() {
            return Ok(World::new(objects)?.map(|world| world.trees(objects)).unwrap_or_default());
        }
        // Placements would take four times the memory of the boxes.
        let boxes = World::first_boxes(objects, &view)?;
        let mut trees = Trees::default();
        if view.tracks.is_empty() && may_be_stored(objects, &view) {
            let (mut top, visible) = (TopLevel::default(), boxes.len());
            top.build_over(boxes);
            let (rows, end_node) = (view.instances.len() as u32, view.nodes.len() as u32);
            trees.add(&top, visible, Tree { rows, instances: rows, end_node, ..EMPTY });
            trees.lines = top.into_lines();
        }
        Ok(trees)
    }

    /// The trees of a scene with groups.
    fn trees(&self, objects: &Objects) -> Trees {
        let (view, mut trees) = (scene_of(objects), Trees::default());
        if !self.animation.is_empty() || !may_be_stored(objects, &view) {
            return trees;
        }
        let groups = Groups::of(&view);
        let (count, nodes) = (groups.as_ref().map_or(0, Groups::world), view.nodes.len() as u32);
        let group_of = |node: u32| groups.as_ref().map_or(0, |groups| groups.of_node(node));
        if !(0..nodes).is_sorted_by_key(group_of) {
            return trees;
        }
        // Tracks ascend by node, and groups come before the world. A group only shows groups before
        // it, so that no group before the first with a track moves.
        let still = view.tracks.first().map_or(count, |track| group_of(track.node));
        let mut end_node = 0;
        let placed =
            |rows: &[u32]| rows.iter().filter(|row| self.placements[**row as usize].is_some()).count();
        for (number, group) in
            (0..still.min(count)).zip(self.groups().into_iter().flat_map(|groups| groups.each()))
        {
            while end_node < nodes && group_of(end_node) == number {
                end_node += 1;
            }
            let of = Tree {
                magnitude: group.magnitude,
                condition: group.condition,
                rows: group.rows.len() as u32,
                instances: group.count,
                end_node,
                ..EMPTY
            };
            trees.add(&group.top, placed(&group.rows), of);
            trees.lines.extend_from_slice(group.top.nodes().0);
        }
        match self.groups().filter(|_| view.tracks.is_empty()) {
            Some(groups) => {
                let (rows, instances) = (groups.world_rows(), self.instance_count());
                let of = Tree { rows: rows.len() as u32, instances, end_node: nodes, ..EMPTY };
                trees.add(&self.top, placed(rows), of);
                trees.lines.extend_from_slice(self.top.nodes().0);
            }
            None => {
                let rows = trees.trees.last().map_or(0, |last| last.first_row + last.rows);
                trees.first_only = still < count || rows as usize == view.instances.len();
            }
        }
        trees
    }
}

/// Returns true if files may hold trees of a scene that deforms nothing.
fn may_be_stored(objects: &Objects, view: &SceneView<'_>) -> bool {
    let mut levels: Vec<u32> = Vec::with_capacity(view.nodes.len());
    for node in view.nodes {
        let above = if node.parent == NONE { 0 } else { levels[node.parent as usize] };
        levels.push(above + 1);
    }
    let can_be_hit = |row: &Instance| row.group().is_some() || objects.header(row.object).root != NONE;
    !objects.any_exact()
        && levels.iter().all(|levels| *levels <= MAX_STORED_LEVELS)
        && view.instances.iter().all(can_be_hit)
}

/// A tree without rows.
const EMPTY: Tree = Tree {
    magnitude: 0.0,
    condition: 1.0,
    first_line: 0,
    lines: 0,
    depth: 0,
    first_row: 0,
    rows: 0,
    visible: 0,
    instances: 0,
    extent: 0.0,
    origin_slack: 0.0,
    end_node: 0,
    reserved: [0; 2],
};
