//! Groups of nodes, which are placed as a whole: which nodes and instances belong to which, and how
//! many instances there are once all groups are written out. Specification: "Groups of nodes".

use crate::layout::*;
use crate::limits::MAX_PATH;
use crate::view::SceneView;

/// The groups of a scene, numbered in the order of their nodes.
#[derive(Clone, Debug)]
pub struct Groups {
    /// For each node the number of the group in which it is, or of the world.
    of_node: Vec<u32>,
    world: u32,
}

/// What a group, or the world, holds once the groups in it are written out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WrittenOut {
    /// Number of instances of objects.
    pub instances: u32,
    /// Max number of instances on the way to one of an object, that one included.
    pub levels: u32,
}

impl Groups {
    /// The groups of a scene, whose nodes have been checked; `None` if it has no groups.
    pub fn of(view: &SceneView<'_>) -> Option<Groups> {
        let parent = |node: &Node| (node.parent != NONE).then_some(node.parent);
        Groups::of_rows(view.nodes.iter().map(|node| (parent(node), node.flags & NODE_GROUP != 0)))
    }

    /// The groups of nodes, parents first, each given by its parent and true for the first node of
    /// a group; `None` without groups.
    pub fn of_rows(nodes: impl Iterator<Item = (Option<u32>, bool)> + Clone) -> Option<Groups> {
        let world = nodes.clone().filter(|(_, is_group)| *is_group).count() as u32;
        if world == 0 {
            return None;
        }
        let (mut of_node, mut next): (Vec<u32>, u32) = (Vec::with_capacity(nodes.size_hint().0), 0);
        for (parent, is_group) in nodes {
            of_node.push(match parent {
                None if is_group => {
                    next += 1;
                    next - 1
                }
                None => world,
                Some(parent) => of_node[parent as usize],
            });
        }
        Some(Groups { of_node, world })
    }

    /// The number of the group in which a node is; [`Self::world`] if it is in none. The first node
    /// of a group is in it.
    pub fn of_node(&self, node: u32) -> u32 {
        self.of_node[node as usize]
    }

    /// Number of groups, which is also the number of the world.
    pub fn world(&self) -> u32 {
        self.world
    }

    /// What each group and then the world holds, if each group only has instances of groups with a
    /// lower number. Calls `first` with each row of `instances` and the number of its first
    /// instance among the instances of its group.
    ///
    /// # Errors
    /// What is found if that exceeds the limits.
    pub fn written_out(
        &self,
        instances: &[Instance],
        mut first: impl FnMut(usize, u32),
    ) -> Result<Vec<WrittenOut>, String> {
        let mut groups = vec![WrittenOut::default(); self.world as usize + 1];
        for (row, instance) in instances.iter().enumerate() {
            let shown = match instance.group() {
                Some(node) => groups[self.of_node(node) as usize],
                None => WrittenOut { instances: 1, levels: 0 },
            };
            let group = &mut groups[self.of_node(instance.node) as usize];
            first(row, group.instances);
            group.levels = group.levels.max(shown.levels + 1);
            if group.levels > MAX_PATH {
                return Err(format!("{} levels", group.levels));
            }
            let sum = group.instances.checked_add(shown.instances).filter(|sum| *sum < NONE);
            group.instances = sum.ok_or("more")?;
        }
        Ok(groups)
    }

    /// Gives each row the number of its first instance; returns what [`Self::written_out`] does.
    ///
    /// # Errors
    /// As [`Self::written_out`].
    pub fn number(&self, instances: &mut [Instance]) -> Result<Vec<WrittenOut>, String> {
        let mut numbers = Vec::with_capacity(instances.len());
        let groups = self.written_out(instances, |_, first| numbers.push(first))?;
        instances.iter_mut().zip(numbers).for_each(|(instance, first)| instance.first = first);
        Ok(groups)
    }
}
