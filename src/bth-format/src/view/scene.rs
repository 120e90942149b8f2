//! The scene sections as typed slices, zero-copy.

use crate::layout::*;
use crate::names;

section_view! {
    /// The scene sections of a file. Sections that the file lacks are empty. Specification:
    /// "Scenes".
    SceneView {
        /// Rows of `SCENE`: exactly one after the check.
        scene: Scene = SCENE,
        /// The hierarchy, parents before children.
        nodes: Node = NODES,
        /// Objects placed at nodes.
        instances: Instance = INSTANCES,
        /// Animated properties, ascending by node and property.
        tracks: Track = TRACKS,
        /// Times of the tracks' keys, in seconds.
        times: f64 = TIMES,
        /// Values of the tracks' keys.
        values: f64 = VALUES,
        /// Cameras.
        cameras: Camera = CAMERAS,
        /// Lights.
        lights: Light = LIGHTS,
        /// Bytes of the names of nodes, cameras and lights.
        names: u8 = NAMES,
        /// Objects that deform, ascending by node.
        deformers: Deformer = DEFORMERS,
        /// Skins of the deformers.
        skins: Skin = SKINS,
        /// Joints of the skins.
        skin_joints: SkinJoint = SKIN_JOINTS,
        /// Weights of the deformers' morph targets, before tracks.
        morph_weights: f64 = MORPH_WEIGHTS,
        /// Trees over the rows of groups, and of the world. Not checked with the other sections.
        trees: Tree = TREES,
        /// The nodes of the trees.
        tree_lines: CacheLine = TREE_LINES,
    }
}

impl<'a> SceneView<'a> {
    fn name(&self, first: u32, length: u32) -> Option<&'a str> {
        names::name(self.names, first, length)
    }
    /// Name of the node of a row; empty where it has none or the row does not exist.
    pub fn node_name(&self, node: u32) -> &'a str {
        self.nodes.get(node as usize).and_then(|n| self.name(n.name, n.name_length)).unwrap_or_default()
    }
    /// Name of the camera of a row; empty where it has none or the row does not exist.
    pub fn camera_name(&self, camera: u32) -> &'a str {
        self.cameras.get(camera as usize).and_then(|c| self.name(c.name, c.name_length)).unwrap_or_default()
    }
    /// Name of the light of a row; empty where it has none or the row does not exist.
    pub fn light_name(&self, light: u32) -> &'a str {
        self.lights.get(light as usize).and_then(|l| self.name(l.name, l.name_length)).unwrap_or_default()
    }

    /// The deformer whose weights a node's track of weights gives.
    pub fn deformer_of(&self, node: u32) -> Option<&'a Deformer> {
        let row = self.deformers.binary_search_by_key(&node, |deformer| deformer.node).ok()?;
        self.deformers.get(row)
    }

    /// Numbers of a value of a track; 0 for unknown properties and for weights of a node without a
    /// deformer.
    pub fn width_of(&self, track: &Track) -> usize {
        let property = Property::from_code(track.property);
        let weights = || self.deformer_of(track.node).map_or(0, |deformer| deformer.weights as usize);
        property.map_or(0, |property| property.width().unwrap_or_else(weights))
    }

    /// Times and values of a track, given the numbers per key. Panics where they do not lie within
    /// their sections, which the check rules out (BTH-F156).
    pub fn keys(&self, track: &Track, numbers_per_key: usize) -> (&'a [f64], &'a [f64]) {
        let (time, value) = (track.first_time as usize, track.first_value as usize);
        let keys = track.keys as usize;
        (&self.times[time..time + keys], &self.values[value..value + keys * numbers_per_key])
    }
}
