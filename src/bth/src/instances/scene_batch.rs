//! A batch of rays through the instances of a scene, its parts, and its answers so far.

use super::World;
use super::top_level::TopLevel;
use crate::objects::Objects;
use crate::query::better;
use crate::query::double::better_wide;
use crate::query::sink::Visit;
use crate::rays::{Hit, Ray, Ray64};
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// A batch of rays in world space.
#[derive(Clone, Copy)]
pub(crate) struct WorldRays<'a> {
    /// The rays, rounded to f32.
    pub(crate) rays: &'a [Ray],
    /// For each ray its start, if rays start on triangles; else empty.
    pub(crate) starts: &'a [InstanceStart],
    /// The rays in f64, if they are; else empty.
    pub(crate) wide: &'a [Ray64],
}

/// A batch of rays in world space, and the scene that they go through.
pub(super) struct SceneBatch<'a> {
    pub(super) world: &'a World,
    pub(super) objects: &'a Objects,
    pub(super) rays: &'a [Ray],
    /// As in [`WorldRays`].
    pub(super) starts: &'a [InstanceStart],
    /// As in [`WorldRays`].
    pub(super) wide: &'a [Ray64],
}

impl<'a> SceneBatch<'a> {
    /// A ray of the batch.
    pub(super) fn world_ray(&self, index: usize) -> WorldRay<'a> {
        let start = self.starts.get(index).filter(|start| start.instance != NONE);
        WorldRay { ray: &self.rays[index], start, wide: self.wide.get(index) }
    }

    /// The new hit of a ray, with its t in world space, if it is better than `best`.
    pub(super) fn better(&self, ray: usize, best: &Hit, hit: &Hit, t_scale: f32) -> Option<Hit> {
        if self.wide.is_empty() {
            return better(&self.rays[ray], best, hit, t_scale);
        }
        let exact_t = |hit: &Hit| self.world.exact_t(self.objects, self.world_ray(ray), hit);
        better_wide(best, hit, t_scale, exact_t)
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
    /// The nearest hits of rays in f64: another may be nearer by less than f32 can tell.
    NearestWide(&'a [Hit]),
    /// True if anything is hit.
    Any(&'a [bool]),
}

impl<'a> BatchProgress<'a> {
    /// The rays from an index on.
    pub(super) fn of_rays_from(self, first: usize) -> BatchProgress<'a> {
        match self {
            BatchProgress::Nearest(hits) => BatchProgress::Nearest(&hits[first..]),
            BatchProgress::NearestWide(hits) => BatchProgress::NearestWide(&hits[first..]),
            BatchProgress::Any(found) => BatchProgress::Any(&found[first..]),
        }
    }

    /// The max t of hits that can still change the result of a ray if they lie in its range;
    /// negative infinity if its query is complete.
    #[inline(always)]
    pub(super) fn tmax(&self, ray: usize) -> f32 {
        match self {
            BatchProgress::Nearest(hits) => hits[ray].t,
            BatchProgress::NearestWide(hits) => hits[ray].t.next_up(),
            BatchProgress::Any(found) if found[ray] => f32::NEG_INFINITY,
            BatchProgress::Any(_) => f32::INFINITY,
        }
    }
}
