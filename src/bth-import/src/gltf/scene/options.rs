//! What of a glTF scene is imported, and what was found in it.

use bth_scene::Frames;
use serde::Serialize;

/// Which animations of a document are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Chosen {
    /// The first of the document, if it has some.
    #[default]
    First,
    /// All; of two that move the same property of a node, the first.
    All,
    /// None: nodes stay at rest.
    None,
    /// One, by name or number.
    One(String),
}

/// What of a glTF file becomes a manifest.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Scene by name or number; by default the document's.
    pub scene: Option<String>,
    /// Animations.
    pub animation: Chosen,
    /// Frames per second.
    pub rate: f64,
    /// Whether skins and morph targets that the animations move deform their meshes; else these stay at rest.
    pub deform: bool,
    /// Whether the parts of deforming meshes that a joint moves rigidly become instances, which are placed and never refitted.
    pub rigid_parts: bool,
    /// Whether what would be ignored with a warning is an error: animations of other things than nodes and weights.
    pub strict: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            scene: None,
            animation: Chosen::First,
            rate: Frames::default().rate,
            deform: true,
            rigid_parts: false,
            strict: false,
        }
    }
}

/// What was found in a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Name or number of the scene.
    pub scene: String,
    /// Nodes of the manifest.
    pub nodes: u64,
    /// Nodes that place an object.
    pub instances: u64,
    /// Meshes that are used.
    pub objects: u64,
    /// Names or numbers of the animations that are read.
    pub animations: Vec<String>,
    /// Names or numbers of the animations that are left out.
    pub animations_left_out: Vec<String>,
    /// Objects that deform.
    pub deformers: u64,
    /// Instances of parts that joints move rigidly.
    pub rigid_parts: u64,
    /// Animated properties of nodes.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// Messages about what was ignored.
    pub ignored: Vec<String>,
    /// Row of the manifest's nodes for each node of the document.
    #[serde(skip)]
    pub node_rows: Vec<Option<usize>>,
}
