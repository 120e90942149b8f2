//! What the answers of a batch say about its rays while these go through the instances.

use crate::rays::Hit;

/// The answers so far, by ray.
#[derive(Clone, Copy)]
pub(super) enum Progress<'a> {
    /// The nearest hits.
    Nearest(&'a [Hit]),
    /// Whether anything is hit.
    Any(&'a [bool]),
}

impl<'a> Progress<'a> {
    /// The rays from an index on.
    pub(super) fn of_rays_from(self, first: usize) -> Progress<'a> {
        match self {
            Progress::Nearest(hits) => Progress::Nearest(&hits[first..]),
            Progress::Any(found) => Progress::Any(&found[first..]),
        }
    }

    /// The greatest t of hits that can still change the result of a ray if they lie in its range; negative infinity if its query is complete.
    #[inline(always)]
    pub(super) fn tmax(&self, ray: usize) -> f32 {
        match self {
            Progress::Nearest(hits) => hits[ray].t,
            Progress::Any(found) if found[ray] => f32::NEG_INFINITY,
            Progress::Any(_) => f32::INFINITY,
        }
    }
}
