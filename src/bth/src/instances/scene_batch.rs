//! A batch of rays through the instances of a scene, its parts, and its answers so far.

use super::World;
use super::top_level::TopLevel;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{Hit, Ray};
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// A batch of rays in world space, and the scene that they go through.
pub(super) struct SceneBatch<'a> {
    pub(super) world: &'a World,
    pub(super) objects: &'a Objects,
    pub(super) rays: &'a [Ray],
    /// For each ray its start, if rays start on triangles; else empty.
    pub(super) starts: &'a [InstanceStart],
}

impl<'a> SceneBatch<'a> {
    /// A ray of the batch.
    pub(super) fn world_ray(&self, index: usize) -> WorldRay<'a> {
        let start = self.starts.get(index).filter(|start| start.instance != NONE);
        WorldRay { ray: &self.rays[index], start, wide: None }
    }

    /// Where the ray of a visit starts, if that is on a triangle of the instance.
    #[inline(always)]
    pub(super) fn start(&self, visit: Visit) -> Option<&InstanceStart> {
        self.starts.get(visit.ray as usize).filter(|start| start.instance == visit.instance)
    }
}

/// Rays of a batch that advance together.
pub(super) struct Chunk<'a> {
    pub(super) top: &'a TopLevel,
    pub(super) rays: &'a [Ray],
    /// Index in the batch of the first of them.
    pub(super) first: u32,
}

/// Visits of the instances of an object by rays of a batch.
#[derive(Clone, Copy)]
pub(super) struct ObjectVisits<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) object: &'a ObjectView<'a>,
    pub(super) visits: &'a [Visit],
}

/// The answers so far, by ray.
#[derive(Clone, Copy)]
pub(super) enum BatchProgress<'a> {
    /// The nearest hits.
    Nearest(&'a [Hit]),
    /// True if anything is hit.
    Any(&'a [bool]),
}

impl<'a> BatchProgress<'a> {
    /// The rays from an index on.
    pub(super) fn of_rays_from(self, first: usize) -> BatchProgress<'a> {
        match self {
            BatchProgress::Nearest(hits) => BatchProgress::Nearest(&hits[first..]),
            BatchProgress::Any(found) => BatchProgress::Any(&found[first..]),
        }
    }

    /// The max t of hits that can still change the result of a ray if they lie in its range;
    /// negative infinity if its query is complete.
    #[inline(always)]
    pub(super) fn tmax(&self, ray: usize) -> f32 {
        match self {
            BatchProgress::Nearest(hits) => hits[ray].t,
            BatchProgress::Any(found) if found[ray] => f32::NEG_INFINITY,
            BatchProgress::Any(_) => f32::INFINITY,
        }
    }
}
