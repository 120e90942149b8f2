//! The node hierarchy and the transforms of its nodes at a time. An update evaluates the animation
//! tracks and multiplies the transforms from the roots down, for the nodes that moved only.
//!
//! Values of tracks are not stored: whether a node moved follows from the keys around the old and
//! the new time.

use super::affine::Affine;
use super::tracks;
use bth_format::SceneView;
use bth_format::layout::*;

/// Bit of a node's state: it moved, was hidden or became visible in the last update.
const MOVED: u8 = 1;
/// Bit of a node's state: it or an ancestor is hidden, by its visibility or by its scale.
const HIDDEN: u8 = 2;
/// Bit of a node's state: it or an ancestor is hidden by its visibility.
const INVISIBLE: u8 = 4;

/// The node hierarchy at a time.
#[derive(Debug)]
pub(crate) struct NodeHierarchy {
    /// Time of the last update; NaN before the first.
    seconds: f64,
    /// The nodes before this one do not move, and nothing is stored of them.
    first: u32,
    /// For each other node [`MOVED`] and [`HIDDEN`].
    state: Vec<u8>,
    /// The nodes with children, ascending. Only their transforms are stored.
    parents: Vec<u32>,
    /// For each node of `parents` its transform to world space.
    to_world: Vec<Affine>,
    /// For each node from the first that moves the index of its first track, with a further element
    /// at the end; empty without tracks.
    first_track: Vec<u32>,
}

impl NodeHierarchy {
    /// The hierarchy of a scene, before the first update. Nodes before `first` have no tracks, and
    /// no parents among the others.
    pub(crate) fn new(view: &SceneView<'_>, first: u32) -> NodeHierarchy {
        let nodes = &view.nodes[first as usize..];
        let mut is_parent = vec![false; nodes.len()];
        for node in nodes.iter().filter(|node| node.parent != NONE) {
            is_parent[(node.parent - first) as usize] = true;
        }
        let mut parents = Vec::with_capacity(is_parent.iter().filter(|is_parent| **is_parent).count());
        parents.extend((0..nodes.len() as u32).filter(|i| is_parent[*i as usize]).map(|i| first + i));
        let first_track = if view.tracks.is_empty() {
            Vec::new()
        } else {
            let first_of = |node: usize| view.tracks.partition_point(|t| (t.node as usize) < node) as u32;
            (first as usize..=view.nodes.len()).map(first_of).collect()
        };
        NodeHierarchy {
            seconds: f64::NAN,
            first,
            state: vec![0; nodes.len()],
            to_world: vec![Affine::IDENTITY; parents.len()],
            parents,
            first_track,
        }
    }

    /// A hierarchy in which nothing moves.
    pub(crate) fn at_rest() -> NodeHierarchy {
        let (seconds, first, state) = (f64::NAN, u32::MAX, Vec::new());
        NodeHierarchy {
            seconds,
            first,
            state,
            parents: Vec::new(),
            to_world: Vec::new(),
            first_track: Vec::new(),
        }
    }

    /// Sets the time in seconds, and returns the number of nodes that moved, were hidden or became
    /// visible. With `all`, all nodes are evaluated and counted.
    pub(crate) fn update(&mut self, view: &SceneView<'_>, seconds: f64, all: bool) -> usize {
        let previous = std::mem::replace(&mut self.seconds, seconds);
        let (mut moved, mut next_parent_row) = (0, 0);
        let first = self.first as usize;
        for row in first..view.nodes.len() {
            let is_parent = self.parents.get(next_parent_row) == Some(&(row as u32));
            let parent_row = next_parent_row;
            next_parent_row += usize::from(is_parent);
            let changed = !all && self.differs(view, row, previous);
            let node = &view.nodes[row];
            let parent_state = match node.parent {
                NONE => 0,
                parent => self.state[parent as usize - first],
            };
            if !(all || changed || parent_state & MOVED != 0) {
                self.state[row - first] &= HIDDEN | INVISIBLE;
                continue;
            }
            moved += 1;
            let invisible = parent_state & INVISIBLE != 0 || !self.is_visible(view, row as u32);
            let hidden = invisible || parent_state & HIDDEN != 0 || !self.has_size(view, row as u32);
            self.state[row - first] =
                MOVED | if hidden { HIDDEN } else { 0 } | if invisible { INVISIBLE } else { 0 };
            if is_parent {
                self.to_world[parent_row] =
                    self.child_to_world(view, node.parent, &self.local(view, row as u32));
            }
        }
        moved
    }

    /// Returns true if a node moved, was hidden or became visible in the last update.
    pub(crate) fn moved(&self, node: u32) -> bool {
        self.state[(node - self.first) as usize] & MOVED != 0
    }

    /// Returns true if the visibility of a node or of an ancestor hides it, whatever their scales
    /// are.
    pub(crate) fn invisible(&self, node: u32) -> bool {
        self.state[(node - self.first) as usize] & INVISIBLE != 0
    }

    /// Returns true if a node or an ancestor is hidden.
    pub(crate) fn hidden(&self, node: u32) -> bool {
        self.state[(node - self.first) as usize] & HIDDEN != 0
    }

    /// Like [`Self::hidden`], of any node.
    pub(crate) fn hidden_of(&self, view: &SceneView<'_>, mut node: u32) -> bool {
        if node >= self.first {
            return self.hidden(node);
        }
        loop {
            if self.hides(view, node) {
                return true;
            }
            match view.nodes[node as usize].parent {
                NONE => return false,
                parent => node = parent,
            }
        }
    }

    /// Returns true if a node hides itself and what is below it, whatever is above.
    fn hides(&self, view: &SceneView<'_>, node: u32) -> bool {
        !(self.is_visible(view, node) && self.has_size(view, node))
    }

    /// The transform from a node's space to world space.
    pub(crate) fn to_world(&self, view: &SceneView<'_>, node: u32) -> Affine {
        match self.parents.binary_search(&node) {
            Ok(row) => self.to_world[row],
            Err(_) => self.child_to_world(view, view.nodes[node as usize].parent, &self.local(view, node)),
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.state.as_slice())
            + size_of_val(self.parents.as_slice())
            + size_of_val(self.to_world.as_slice())
            + size_of_val(self.first_track.as_slice())
    }

    /// The transform to world space of a child of `parent`, given its transform to the parent's
    /// space.
    fn child_to_world(&self, view: &SceneView<'_>, parent: u32, local: &Affine) -> Affine {
        if parent == NONE { *local } else { self.to_world(view, parent).times(local) }
    }

    /// Indices of the tracks of a node.
    fn tracks_of(&self, node: usize) -> std::ops::Range<usize> {
        let at = node.checked_sub(self.first as usize);
        match at.and_then(|at| self.first_track.get(at..at + 2)) {
            Some(ends) => ends[0] as usize..ends[1] as usize,
            None => 0..0,
        }
    }

    /// Returns true if a track of a node, other than its track of weights, may have another value
    /// than at the time `previous`.
    fn differs(&self, view: &SceneView<'_>, node: usize, previous: f64) -> bool {
        let weights = Property::Weights as u32;
        let mut tracks = self.tracks_of(node).map(|i| &view.tracks[i]).filter(|t| t.property != weights);
        tracks.any(|track| tracks::differs(view, track, previous, self.seconds))
    }

    /// The transform from a node's space to its parent's, with the values of the node's tracks.
    fn local(&self, view: &SceneView<'_>, row: u32) -> Affine {
        let node = &view.nodes[row as usize];
        if node.flags & NODE_MATRIX != 0 {
            Affine::from_rows(&node.transform)
        } else {
            Affine::from_parts(&self.parts(view, row))
        }
    }

    /// Translation, rotation and scale of a node, with the values of its tracks.
    fn parts(&self, view: &SceneView<'_>, row: u32) -> [f64; 10] {
        let node = &view.nodes[row as usize];
        let mut parts: [f64; 10] = std::array::from_fn(|i| node.transform[i]);
        for i in self.tracks_of(row as usize) {
            let value = tracks::value(view, &view.tracks[i], self.seconds);
            match Property::from_code(view.tracks[i].property) {
                Some(Property::Translation) => parts[..3].copy_from_slice(&value[..3]),
                Some(Property::Rotation) => parts[3..7].copy_from_slice(&value),
                Some(Property::Scale) => parts[7..].copy_from_slice(&value[..3]),
                Some(Property::Visible | Property::Weights) | None => {}
            }
        }
        parts
    }

    /// Returns true if a node is visible by its flag or its track of visibility.
    fn is_visible(&self, view: &SceneView<'_>, row: u32) -> bool {
        match self.value_of(view, row, Property::Visible) {
            Some(value) => value[0] != 0.0,
            None => view.nodes[row as usize].flags & NODE_HIDDEN == 0,
        }
    }

    /// Returns true if the scale of a node is not zero.
    fn has_size(&self, view: &SceneView<'_>, row: u32) -> bool {
        let node = &view.nodes[row as usize];
        if node.flags & NODE_MATRIX != 0 {
            return !Affine::from_rows(&node.transform).is_zero();
        }
        let scale = [node.transform[7], node.transform[8], node.transform[9]];
        let value = self.value_of(view, row, Property::Scale);
        !value.map_or(scale, |value| [value[0], value[1], value[2]]).contains(&0.0)
    }

    /// The value of a node's track of a property, if it has one.
    fn value_of(&self, view: &SceneView<'_>, row: u32, property: Property) -> Option<[f64; 4]> {
        let mut tracks = self.tracks_of(row as usize).map(|i| &view.tracks[i]);
        let track = tracks.find(|track| track.property == property as u32)?;
        Some(tracks::value(view, track, self.seconds))
    }
}
