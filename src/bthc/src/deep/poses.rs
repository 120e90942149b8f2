//! The scenes in which an object is traced: it alone, at rest or as the deformers of its file
//! deform it.

use crate::failure::Failure;
use crate::output;
use bth::{Code, Scene, SceneBuilder};

const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Seconds at which an object is traced: the first, a middle and the last frame where its file
/// deforms it, else `None` once.
pub(super) fn of(scene: &Scene, object: u32) -> Vec<Option<f64>> {
    let Some(view) = scene.description().filter(|view| view.deformers.iter().any(|d| d.object == object))
    else {
        return vec![None];
    };
    let [first, last] = [view.scene[0].first_frame, view.scene[0].last_frame].map(f64::from);
    let mut frames = vec![first, (0.5 * (first + last)).floor(), last];
    frames.dedup();
    frames.into_iter().map(|frame| Some(frame / view.scene[0].rate)).collect()
}

/// A scene of one visible instance, and its id: the object by itself and at its place, where the
/// runtime rounds no ray, with the positions that it has at `seconds` if these are given. `None`,
/// after a warning, for an object that reaches so far that no instance of it can be placed.
///
/// # Errors
/// Those of [`SceneBuilder::commit`].
pub(super) fn alone(
    scene: &Scene,
    object: u32,
    seconds: Option<f64>,
) -> Result<Option<(Scene, u32)>, Failure> {
    let mut builder = SceneBuilder::new();
    let first = builder.add(scene);
    if let Some(seconds) = seconds {
        let whole = builder.subscene(first, &IDENTITY)?;
        builder.set_subscene_seconds(whole, seconds)?;
        builder.set_subscene_visible(whole, false)?;
    }
    builder.instance(first + object, &IDENTITY)?;
    match builder.commit() {
        Ok(_) => {
            // It was placed last, behind what groups show.
            let scene = builder.into_scene();
            let instance = scene.instance_count() - 1;
            Ok(Some((scene, instance)))
        }
        Err(error) if error.code() == Code::NotFinite => {
            output::warning(&format!(
                "object {object} is not traced, since it reaches too far for an instance: {error}"
            ));
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}
