//! Warnings of options that change nothing, and of files that show nothing.

use crate::args::{Args, Mode};
use crate::camera::SceneSetup;
use bth::Scene;

/// What a person who looks at the pictures might wonder about.
pub(super) fn of(scene: &Scene, args: &Args, setup: &SceneSetup) -> Vec<String> {
    let mode = args.mode.name();
    let mut warnings = Vec::new();
    if setup.bounds.is_empty() {
        warnings.push(match scene.description() {
            Some(_) => "no frame shows a triangle, so the pictures are empty".to_owned(),
            None => "the model has no triangles, so the picture is empty".to_owned(),
        });
    }
    // Rays have origins of f32.
    if !setup.camera(scene, args).eye.as_vec3().is_finite() {
        warnings.push(format!(
            "the camera is farther from the origin than f32 numbers reach ({:e}), so it sees nothing",
            f32::MAX
        ));
    }
    if args.bounces.is_some() && args.mode != Mode::Path {
        warnings.push(format!("--bounces changes nothing: it is for --mode path, found --mode {mode}"));
    }
    if args.scale.is_some() && args.mode != Mode::Steps {
        warnings.push(format!("--scale changes nothing: it is for --mode steps, found --mode {mode}"));
    }
    if args.fov.is_some() && setup.is_orthographic(scene) {
        warnings.push("--fov changes nothing: the scene's camera is orthographic".to_owned());
    }
    warnings
}
