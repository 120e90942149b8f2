//! A view of the scene sections: typed slices, zero-copy.

use crate::layout::*;
use crate::limits::MAX_NAME;

/// The scene sections of a file. Sections that the file lacks are empty.
#[derive(Clone, Copy, Debug)]
pub struct SceneView<'a> {
    /// Rows of `SCENE`: one, once checked.
    pub scene: &'a [Scene],
    /// The hierarchy, parents before children.
    pub nodes: &'a [Node],
    /// Objects that stand at nodes.
    pub instances: &'a [Instance],
    /// What moves.
    pub tracks: &'a [Track],
    /// Seconds of the tracks' keys.
    pub times: &'a [f64],
    /// Values of the tracks' keys.
    pub values: &'a [f64],
    /// Cameras.
    pub cameras: &'a [Camera],
    /// Lights.
    pub lights: &'a [Light],
    /// Names, one after another.
    pub names: &'a [u8],
}

impl<'a> SceneView<'a> {
    /// A name; `None` when it does not lie within `names` or is not UTF-8, which a check rules out.
    fn name(&self, first: u32, length: u32) -> Option<&'a str> {
        let end = (first as usize).checked_add(length as usize)?;
        std::str::from_utf8(self.names.get(first as usize..end)?).ok()
    }
    /// Name of a node; empty where there is none.
    pub fn node_name(&self, node: u32) -> &'a str {
        self.nodes.get(node as usize).and_then(|n| self.name(n.name, n.name_length)).unwrap_or_default()
    }
    /// Name of a camera; empty where there is none.
    pub fn camera_name(&self, camera: u32) -> &'a str {
        self.cameras.get(camera as usize).and_then(|c| self.name(c.name, c.name_length)).unwrap_or_default()
    }
    /// Name of a light; empty where there is none.
    pub fn light_name(&self, light: u32) -> &'a str {
        self.lights.get(light as usize).and_then(|l| self.name(l.name, l.name_length)).unwrap_or_default()
    }

    /// Whether a name is one.
    pub fn is_name(&self, first: u32, length: u32) -> bool {
        length <= MAX_NAME && self.name(first, length).is_some()
    }

    /// Times and values of a track, which has been checked.
    pub fn keys(&self, track: &Track, values_per_key: usize) -> (&'a [f64], &'a [f64]) {
        let (time, value) = (track.first_time as usize, track.first_value as usize);
        let keys = track.keys as usize;
        (&self.times[time..time + keys], &self.values[value..value + keys * values_per_key])
    }
}
