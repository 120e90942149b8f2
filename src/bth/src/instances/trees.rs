//! The trees of a scene as a file may hold them ([`super::stored`] reads them).

use super::World;
use super::top_level::TopLevel;
use super::world::scene_of;
use crate::objects::Objects;
use bth_format::SceneView;
use bth_format::groups::Groups;
use bth_format::layout::{CacheLine, Instance, NONE, Tree};
use bth_format::limits::MAX_STORED_LEVELS;

/// The trees over the rows of a scene's groups, if no node in them moves, and of its world, if it
/// does not either. They are what a file may hold. Empty where it may not.
#[derive(Debug, Default)]
pub struct Trees {
    /// Rows of `TREES`.
    pub trees: Vec<Tree>,
    /// Rows of `TREE_LINES`.
    pub lines: Vec<CacheLine>,
}

impl Trees {
    /// Adds a tree. What is known of its group is in `of`.
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
        self.lines.extend_from_slice(top.nodes().0);
    }
}

impl World {
    /// The trees that the file of the scene may hold. Its instances have been placed by the whole
    /// boxes of objects.
    pub(crate) fn trees(&self, objects: &Objects) -> Trees {
        let (view, mut trees) = (scene_of(objects), Trees::default());
        if !self.may_be_stored(objects, &view) {
            return trees;
        }
        let groups = Groups::of(&view);
        let (count, nodes) = (groups.as_ref().map_or(0, Groups::world), view.nodes.len() as u32);
        let group_of = |node: u32| groups.as_ref().map_or(0, |groups| groups.of_node(node));
        // Tracks ascend by node, and groups come before the world.
        let moves = view.tracks.first().is_some_and(|track| group_of(track.node) < count);
        if moves || !(0..nodes).is_sorted_by_key(group_of) {
            return trees;
        }
        let mut end_node = 0;
        let placed =
            |rows: &[u32]| rows.iter().filter(|row| self.placements[**row as usize].is_some()).count();
        for (number, group) in (0..count).zip(self.groups().into_iter().flat_map(|groups| groups.each())) {
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
        }
        if view.tracks.is_empty() {
            let all = (0..view.instances.len() as u32).collect::<Vec<_>>();
            let rows = self.groups().map_or(&*all, |groups| groups.world_rows());
            let instances = self.instance_count();
            let of = Tree { rows: rows.len() as u32, instances, end_node: nodes, ..EMPTY };
            trees.add(&self.top, placed(rows), of);
        }
        trees
    }

    /// Returns true if files may hold trees of the scene.
    fn may_be_stored(&self, objects: &Objects, view: &SceneView<'_>) -> bool {
        let mut levels: Vec<u32> = Vec::with_capacity(view.nodes.len());
        for node in view.nodes {
            let above = if node.parent == NONE { 0 } else { levels[node.parent as usize] };
            levels.push(above + 1);
        }
        let can_be_hit = |row: &Instance| row.group().is_some() || objects.header(row.object).root != NONE;
        self.animation.is_empty()
            && !objects.any_exact()
            && levels.iter().all(|levels| *levels <= MAX_STORED_LEVELS)
            && view.instances.iter().all(can_be_hit)
    }
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
