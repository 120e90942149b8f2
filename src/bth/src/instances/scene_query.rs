//! What a batch of rays through instances asks for.

use super::enter_object::ObjectRays;
use super::progress::Progress;
use super::scene_batch::SceneBatch;
use crate::query::sink::Visit;
use bth_format::object::ObjectView;

/// A query over the rays of a batch. The kernels are compiled once for all.
pub(super) trait SceneQuery {
    /// The answers so far.
    fn progress(&self) -> Progress<'_>;
    /// Traces the visits of one object, given memory for their rays in its space.
    fn trace(
        &mut self,
        batch: &SceneBatch<'_>,
        object: &ObjectView<'_>,
        visits: &[Visit],
        object_rays: &mut ObjectRays,
    );
    /// As [`Self::trace`], given the rays in the space of the object.
    fn trace_placed(
        &mut self,
        batch: &SceneBatch<'_>,
        object: &ObjectView<'_>,
        visits: &[Visit],
        object_rays: &ObjectRays,
    );
}
