//! Where the nodes are at a time: tracks, then the hierarchy from the top, only what moved.

use super::SceneView;
use super::affine::Affine;
use super::tracks;
use crate::layout::*;

/// State of a node: it moved in the last update.
const MOVED: u8 = 1;
/// State of a node: it or a node above it is hidden.
const HIDDEN: u8 = 2;

/// The hierarchy at a time.
#[derive(Debug)]
pub(crate) struct Pose {
    /// Value of each track; NaN before the first update.
    values: Vec<[f64; 4]>,
    /// Per node [`MOVED`] and [`HIDDEN`].
    state: Vec<u8>,
    /// Per node its row in `world`, or `NONE`: only nodes with children keep their transform.
    world_row: Vec<u32>,
    world: Vec<Affine>,
    /// Per node its first track; one more at the end.
    first_track: Vec<u32>,
}

impl Pose {
    /// Of a checked scene; nothing is placed before the first update.
    pub(crate) fn new(view: &SceneView<'_>) -> Pose {
        let mut world_row = vec![NONE; view.nodes.len()];
        let mut rows = 0;
        for parent in view.nodes.iter().map(|n| n.parent).filter(|p| *p != NONE) {
            let row = &mut world_row[parent as usize];
            if *row == NONE {
                *row = rows;
                rows += 1;
            }
        }
        let first_track = if view.tracks.is_empty() {
            Vec::new()
        } else {
            let first = |node: usize| view.tracks.partition_point(|t| (t.node as usize) < node) as u32;
            (0..=view.nodes.len()).map(first).collect()
        };
        Pose {
            values: vec![[f64::NAN; 4]; view.tracks.len()],
            state: vec![0; view.nodes.len()],
            world_row,
            world: vec![Affine::IDENTITY; rows as usize],
            first_track,
        }
    }

    /// Moves to a time; returns how many nodes moved, were hidden or came to sight. With `all` every node counts.
    pub(crate) fn update(&mut self, view: &SceneView<'_>, seconds: f64, all: bool) -> usize {
        let mut moved = 0;
        for row in 0..view.nodes.len() {
            let changed = self.evaluate(view, row, seconds);
            let node = &view.nodes[row];
            let above = match node.parent {
                NONE => 0,
                parent => self.state[parent as usize],
            };
            let before = self.state[row] & HIDDEN;
            if !(all || changed || above & MOVED != 0) {
                self.state[row] = before;
                continue;
            }
            moved += 1;
            let hidden = above & HIDDEN != 0 || !self.is_seen(view, row as u32);
            self.state[row] = MOVED | if hidden { HIDDEN } else { 0 };
            if self.world_row[row] != NONE {
                let world = self.below(view, node.parent, &self.local(view, row as u32));
                self.world[self.world_row[row] as usize] = world;
            }
        }
        moved
    }

    /// Whether a node moved, was hidden or came to sight in the last update.
    pub(crate) fn moved(&self, node: u32) -> bool {
        self.state[node as usize] & MOVED != 0
    }

    /// Whether a node or one above it is hidden.
    pub(crate) fn hidden(&self, node: u32) -> bool {
        self.state[node as usize] & HIDDEN != 0
    }

    /// From a node's space to the world.
    pub(crate) fn world(&self, view: &SceneView<'_>, node: u32) -> Affine {
        match self.world_row[node as usize] {
            NONE => self.below(view, view.nodes[node as usize].parent, &self.local(view, node)),
            row => self.world[row as usize],
        }
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.values.as_slice())
            + size_of_val(self.state.as_slice())
            + size_of_val(self.world_row.as_slice())
            + size_of_val(self.world.as_slice())
            + size_of_val(self.first_track.as_slice())
    }

    fn below(&self, view: &SceneView<'_>, parent: u32, local: &Affine) -> Affine {
        if parent == NONE { *local } else { self.world(view, parent).times(local) }
    }

    fn tracks_of(&self, node: usize) -> std::ops::Range<usize> {
        match self.first_track.get(node..node + 2) {
            Some(ends) => ends[0] as usize..ends[1] as usize,
            None => 0..0,
        }
    }

    /// Evaluates the tracks of a node; whether one has another value than before.
    fn evaluate(&mut self, view: &SceneView<'_>, node: usize, seconds: f64) -> bool {
        let mut changed = false;
        for i in self.tracks_of(node) {
            let value = tracks::value(view, &view.tracks[i], seconds);
            changed |= value != self.values[i];
            self.values[i] = value;
        }
        changed
    }

    /// From a node's space to its parent's, with the values of its tracks.
    fn local(&self, view: &SceneView<'_>, row: u32) -> Affine {
        let node = &view.nodes[row as usize];
        if node.flags & NODE_MATRIX != 0 {
            Affine::of_matrix(node)
        } else {
            Affine::from_parts(&self.parts(view, row))
        }
    }

    fn parts(&self, view: &SceneView<'_>, row: u32) -> [f64; 10] {
        let node = &view.nodes[row as usize];
        let mut parts: [f64; 10] = std::array::from_fn(|i| node.transform[i]);
        for i in self.tracks_of(row as usize) {
            let value = self.values[i];
            match Property::from_code(view.tracks[i].property) {
                Some(Property::Translation) => parts[..3].copy_from_slice(&value[..3]),
                Some(Property::Rotation) => parts[3..7].copy_from_slice(&value),
                Some(Property::Scale) => parts[7..].copy_from_slice(&value[..3]),
                Some(Property::Visible) | None => {}
            }
        }
        parts
    }

    /// Whether a node's own flag, its track of visibility and its scale let it be seen.
    fn is_seen(&self, view: &SceneView<'_>, row: u32) -> bool {
        let node = &view.nodes[row as usize];
        let is_visible = |i: &usize| view.tracks[*i].property == Property::Visible as u32;
        let seen = match self.tracks_of(row as usize).find(is_visible) {
            Some(track) => self.values[track][0] != 0.0,
            None => node.flags & NODE_HIDDEN == 0,
        };
        seen && if node.flags & NODE_MATRIX != 0 {
            !Affine::of_matrix(node).is_zero()
        } else {
            !self.parts(view, row)[7..].contains(&0.0)
        }
    }
}
