//! Shadow and ambient-occlusion rays: any-hit rays of a batch of samples, traced together.

use super::chance::Chance;
use super::context::FrameContext;
use super::visibility;
use bth::TraceRay;

/// A batch of any-hit rays: from hits, or from points that no triangle holds.
#[derive(Debug)]
pub(crate) struct OcclusionRays<R> {
    rays: Vec<R>,
    chances: Vec<Chance>,
}

impl<R: TraceRay> OcclusionRays<R> {
    pub(crate) fn new() -> Self {
        Self { rays: Vec::new(), chances: Vec::new() }
    }

    pub(crate) fn push(&mut self, ray: R, chance: Chance) {
        self.rays.push(ray);
        self.chances.push(chance);
    }

    /// Number of rays.
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether each ray is blocked.
    pub(crate) fn trace(&self, frame: &FrameContext<'_>) -> Vec<bool> {
        let mut blocked = vec![false; self.rays.len()];
        visibility::any(frame, &self.rays, &self.chances, &mut blocked);
        blocked
    }
}
