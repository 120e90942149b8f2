//! Cameras: projection of picture points to rays, and the placement of a camera by options, by the scene, or in a room.

mod bounds;
mod exterior;
mod interior;
mod projection;
mod scene_camera;
mod setup;

pub(crate) use bounds::SceneBounds;
pub(crate) use projection::{Camera, CameraRay, up_vector};
pub(crate) use scene_camera::scene_camera;
pub(crate) use setup::SceneSetup;
