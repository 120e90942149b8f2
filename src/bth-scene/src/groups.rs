//! Groups of nodes: which nodes are in which, and in what order groups come.

use crate::model::Track;
use crate::nodes::Nodes;

/// Max number of nodes with instances on the way to an object, the one of the object included.
const MAX_LEVELS: u32 = 16;

/// The groups of a scene: trees of nodes that nodes show as a whole ([`crate::Node::group`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeGroups {
    /// For each node the first of its tree.
    root: Vec<usize>,
    /// For each first node of a tree its level: 0 for groups that show no groups, above those that
    /// they show for others. `None` for trees of the world and other nodes.
    level: Vec<Option<u32>>,
}

impl NodeGroups {
    /// The groups of nodes without circles of parents; `None` if no node shows a group.
    ///
    /// # Errors
    /// A node that shows a group which shows it again, or which has too many levels.
    pub fn of(nodes: &Nodes) -> Result<Option<NodeGroups>, usize> {
        let instances: Vec<_> =
            nodes.iter().enumerate().filter_map(|(row, node)| Some((row, node.group?))).collect();
        if instances.is_empty() {
            return Ok(None);
        }
        let mut root: Vec<Option<usize>> = vec![None; nodes.len()];
        let mut path = Vec::new();
        for start in 0..nodes.len() {
            let mut at = start;
            let first = loop {
                match (root[at], nodes.parent(at)) {
                    (Some(first), _) => break first,
                    (None, Some(parent)) => {
                        path.push(at);
                        at = parent;
                    }
                    (None, None) => break at,
                }
            };
            root[at] = Some(first);
            path.drain(..).for_each(|node| root[node] = Some(first));
        }
        let root: Vec<usize> = root.into_iter().flatten().collect();
        let mut level = vec![None; nodes.len()];
        instances.iter().for_each(|(_, group)| level[*group] = Some(0));
        // Each round settles the groups of one more level.
        for round in 0..=MAX_LEVELS {
            let mut raised = None;
            for &(node, group) in &instances {
                let above = level[group].map(|level| level + 1);
                let own = &mut level[root[node]];
                if own.is_some() && *own < above {
                    (*own, raised) = (above, Some(node));
                }
            }
            match raised {
                None if level.iter().flatten().all(|level| *level + 2 <= MAX_LEVELS) => break,
                Some(node) if round == MAX_LEVELS => return Err(node),
                None => return Err(instances[0].0),
                Some(_) => {}
            }
        }
        Ok(Some(NodeGroups { root, level }))
    }

    /// Returns true if a node is in a group.
    pub fn is_in_group(&self, node: usize) -> bool {
        self.level[self.root[node]].is_some()
    }

    /// Returns true if a node is the first of a group.
    pub fn is_group(&self, node: usize) -> bool {
        self.level[node].is_some()
    }

    /// A key by which nodes are in order: groups behind those that they show, those in which
    /// something moves behind all others, and the world last. `moves` is made by [`Self::moving`].
    pub fn order(&self, node: usize, moves: &[bool]) -> (bool, u32, usize) {
        let root = self.root[node];
        self.level[root].map_or((true, u32::MAX, 0), |level| (moves[root], level, root))
    }

    /// For the first node of each group if the group moves: a node in it has a track, or shows a
    /// group that moves.
    pub fn moving(&self, nodes: &Nodes, tracks: &[Track]) -> Vec<bool> {
        let mut moves = vec![false; nodes.len()];
        tracks.iter().for_each(|track| moves[self.root[track.node]] = true);
        if tracks.is_empty() {
            return moves;
        }
        let shows: Vec<_> = (0..nodes.len()).filter_map(|row| Some((row, nodes.get(row).group?))).collect();
        // Each round reaches the groups of one more level.
        let mut is_done = false;
        while !std::mem::replace(&mut is_done, true) {
            for (node, shown) in &shows {
                let moved = moves[*shown];
                let own = &mut moves[self.root[*node]];
                is_done &= *own || !moved;
                *own |= moved;
            }
        }
        moves
    }
}
