//! What a batch of rays through instances asks for.

use super::enter_object::ObjectRays;
use super::progress::Progress;
use super::scene_batch::ObjectVisits;
use crate::object;

/// A query over the rays of a batch. The kernels are compiled once for all.
pub(super) trait SceneQuery {
    /// The answers so far.
    fn progress(&self) -> Progress<'_>;
    /// Traces visits one by one.
    fn trace_one_by_one(&mut self, of_object: ObjectVisits<'_>);
    /// Traces visits together, given their rays in the space of the object.
    fn trace_placed(&mut self, of_object: ObjectVisits<'_>, object_rays: &ObjectRays);
    /// Traces visits, given memory for their rays in the space of the object.
    fn trace(&mut self, of_object: ObjectVisits<'_>, object_rays: &mut ObjectRays) {
        if of_object.visits.len() < object::MIN_BATCH {
            return self.trace_one_by_one(of_object);
        }
        object_rays.fill(&of_object, self.progress());
        self.trace_placed(of_object, object_rays);
    }
}
