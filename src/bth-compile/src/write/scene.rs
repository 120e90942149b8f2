//! The sections of a scene.

use super::FileBuilder;
use crate::error::Result;
use bth_format::layout::*;

/// The rows of the scene sections.
#[derive(Clone, Debug)]
pub struct SceneParts {
    /// Frames and camera.
    pub scene: Scene,
    /// Parents before children.
    pub nodes: Vec<Node>,
    /// Objects at nodes.
    pub instances: Vec<Instance>,
    /// Tracks, ordered by node and property.
    pub tracks: Vec<Track>,
    /// Times of the tracks' keys, seconds.
    pub times: Vec<f64>,
    /// Values of the tracks' keys.
    pub values: Vec<f64>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Names of all of these.
    pub names: Vec<u8>,
    /// Objects that deform.
    pub deformers: DeformerParts,
}

/// The rows of deformers and their skins.
#[derive(Clone, Debug, Default)]
pub struct DeformerParts {
    /// Deformers, by node.
    pub deformers: Vec<Deformer>,
    /// Skins.
    pub skins: Vec<Skin>,
    /// Joints of the skins.
    pub joints: Vec<SkinJoint>,
    /// Weights of morph targets.
    pub weights: Vec<f64>,
}

/// Adds the sections of a scene that have rows.
///
/// # Errors
/// `BTH-X031` when one exists already.
pub fn scene<'a>(builder: &mut FileBuilder<'a>, parts: &'a SceneParts) -> Result<()> {
    builder.rows(kind::SCENE, NONE, std::slice::from_ref(&parts.scene))?;
    builder.rows(kind::NODES, NONE, &parts.nodes)?;
    builder.rows(kind::INSTANCES, NONE, &parts.instances)?;
    builder.rows(kind::TRACKS, NONE, &parts.tracks)?;
    builder.rows(kind::TIMES, NONE, &parts.times)?;
    builder.rows(kind::VALUES, NONE, &parts.values)?;
    builder.rows(kind::CAMERAS, NONE, &parts.cameras)?;
    builder.rows(kind::LIGHTS, NONE, &parts.lights)?;
    builder.rows(kind::NAMES, NONE, &parts.names)?;
    builder.rows(kind::DEFORMERS, NONE, &parts.deformers.deformers)?;
    builder.rows(kind::SKINS, NONE, &parts.deformers.skins)?;
    builder.rows(kind::SKIN_JOINTS, NONE, &parts.deformers.joints)?;
    builder.rows(kind::MORPH_WEIGHTS, NONE, &parts.deformers.weights)?;
    Ok(())
}
