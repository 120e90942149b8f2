//! What the window shows, and through which camera.

use super::camera_controller::CameraController;
use crate::args::Args;
use crate::camera::{Camera, SceneSetup, scene_camera};
use bth::Scene;
use std::path::Path;

/// The camera in use.
#[derive(Clone, Copy, Debug)]
pub(super) enum ViewCamera {
    /// The camera that the options chose, which may move with the scene.
    Initial,
    /// The camera in this row of the scene's table.
    Scene(u32),
    /// The camera that the user moves.
    Free(CameraController),
}

/// What the window shows.
pub(crate) struct Content<'a> {
    pub(crate) scene: &'a mut Scene,
    pub(crate) file: &'a Path,
    pub(crate) setup: SceneSetup,
    /// Frames per second.
    pub(crate) rate: f64,
}

impl ViewCamera {
    /// The camera at the time to which the scene is set, for the size of the options.
    pub(super) fn camera(self, content: &Content<'_>, args: &Args) -> Camera {
        match self {
            ViewCamera::Initial => content.setup.camera(content.scene, args).with_aspect_of(args.size),
            ViewCamera::Scene(row) => scene_camera(content.scene, row, args),
            ViewCamera::Free(controller) => controller.camera(args.size),
        }
    }
}
