//! Scenes of instances that move.

mod view;

pub use view::SceneView;
