//! The key under which an object of a scene is cached.

use super::context::Context;
use super::sources::SourcePart;
use crate::cached::{MeshSummary, ObjectKeys};
use bth_cache::Key;

/// The key of an object, if it may be kept, whose costs the scene's rays do not weight.
pub(super) fn object_key(mesh: &MeshSummary, part: SourcePart, context: &Context<'_>) -> Option<Key> {
    if mesh.deformation.is_none() {
        return context.keys.as_ref().map(|keys| keys.of(mesh, None));
    }
    let options = context.options.of_deforming();
    let clip = part.clip();
    context.tetgen.as_ref().map(|tetgen| ObjectKeys::new(&options, tetgen).of(mesh, clip.as_ref()))
}
