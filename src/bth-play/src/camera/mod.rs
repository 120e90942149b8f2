//! Cameras: projection of picture points to rays, and the placement of a camera by options, by the
//! scene, or in a room.

mod bounds;
mod interior;
mod placement;
mod projection;
mod setup;

pub(crate) use bounds::SceneBounds;
pub(crate) use placement::scene_camera;
pub(crate) use projection::{Camera, CameraRay, front_and_up, up_vector};
pub(crate) use setup::SceneSetup;
