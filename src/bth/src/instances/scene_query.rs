//! What a batch of rays through instances asks for.

use super::enter_object::ObjectRays;
use super::progress::Progress;
use super::scene_batch::SceneBatch;
use crate::object;
use crate::query::sink::Visit;
use bth_format::object::ObjectView;

/// Visits of the instances of an object by rays of a batch.
#[derive(Clone, Copy)]
pub(super) struct ObjectVisits<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) object: &'a ObjectView<'a>,
    pub(super) visits: &'a [Visit],
}

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
