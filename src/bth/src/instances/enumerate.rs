//! The instances that a query may reach, by the same walk as through objects: those whose boxes a
//! ray may enter, lie near a point, or overlap a box.

use super::World;
use super::box_tests::{entered, limit, widened_slabs};
use super::instance_list::{InstanceList, InstanceReceiver};
use super::top_level::TopLevel;
use super::top_nodes::{INSTANCE, TopNodes};
use crate::bvh::ray_state::key_limit;
use crate::bvh::single_stack::SingleStack;
use crate::bvh::stack::BOTTOM;
use crate::bvh::walk::{BoxQuery, Tree, run_walk, walk};
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::intersect::line::Line;
use crate::intersect::point_lanes::{LanePoint, PointLanes};
use crate::intersect::prepare::PreparedRay;
use crate::intersect::region_box::{RegionBox, RegionLanes};
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Simd};
use bth_format::layout::WideNode;
use bth_format::object::ObjectBounds;
use std::hint::black_box;

impl World {
    /// Calls `visit` with each visible instance whose box a ray in world space may enter within its
    /// range of t, nearer boxes first. Instances beyond what `visit` returns may be skipped.
    /// Returns true if `visit` has ended the enumeration.
    pub(crate) fn enumerate(&self, ray: &Ray, visit: InstanceReceiver<'_>) -> bool {
        let top = &self.top;
        // False for NaN, too.
        let has_range = ray.tmin <= ray.tmax;
        has_range && !top.is_empty() && Isa::chosen().run(RayKernel { top, ray, visit })
    }

    /// Calls `visit` with each visible instance whose box may have a point within a squared
    /// distance of a finite point, nearer boxes first. `visit` returns the squared distance from
    /// then on, or `None` to end. Returns true if it has ended the enumeration.
    pub(crate) fn enumerate_near(
        &self,
        point: [f32; 3],
        squared: f64,
        visit: &mut dyn FnMut(u32) -> Option<f64>,
    ) -> bool {
        let point = LanePoint::new(point, self.top.greatest_coordinate());
        !self.top.is_empty() && run_walk(&self.top.nodes(), &mut PointInstances { point, squared, visit })
    }

    /// Calls `visit` with each visible instance whose box may overlap a region, until it returns
    /// true. Returns true then.
    pub(super) fn rows_in_box(&self, region: [[f64; 3]; 2], visit: &mut dyn FnMut(u32) -> bool) -> bool {
        let region = RegionBox::in_world(region, self.top.greatest_coordinate());
        !self.top.is_empty() && run_walk(&self.top.nodes(), &mut BoxInstances { region, visit })
    }
}

/// A query about the instances of a scene.
trait InstanceQuery: BoxQuery {
    /// Visits an instance. Returns true if the query is complete.
    fn instance(&mut self, instance: u32) -> bool;
}

impl<Q: InstanceQuery> Tree<Q> for TopNodes<'_> {
    #[inline(always)]
    fn root(&self) -> u32 {
        0
    }
    #[inline(always)]
    fn node(&self, code: u32) -> &WideNode {
        TopNodes::node(self, code)
    }
    #[inline(always)]
    fn leaf<S: Simd>(&self, _: S, _: &Q::Constants<S>, code: u32, query: &mut Q, _limit: f32) -> bool {
        // Boxes of empty slots may pass the test.
        code < BOTTOM && query.instance(code & !INSTANCE)
    }
}

/// The constants of a ray for tests of the boxes in the top level; `None` for rays that cannot hit
/// anything.
#[inline(always)]
fn slabs<S: Simd>(s: S, ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    if ray.origin.iter().all(|x| x.abs() <= top.reach)
        && let Some(prepared) = PreparedRay::of(s, &top.cube, ray)
    {
        return Some(prepared.slabs);
    }
    widened_slabs(ray, top)
}

/// The kernel of [`World::enumerate`]. The receiver is called through a table, so that there is one
/// kernel per instruction set.
struct RayKernel<'a> {
    top: &'a TopLevel,
    ray: &'a Ray,
    visit: InstanceReceiver<'a>,
}

impl Kernel for RayKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let RayKernel { top, ray, visit } = self;
        let Some(slabs) = slabs(s, ray, top) else { return false };
        walk_ray(s, (top, ray), &slabs, visit)
    }
}

/// Like [`RayKernel`], in the space of a group. The ray is prepared for `bounds`.
pub(super) struct GroupKernel<'a> {
    pub(super) top: &'a TopLevel,
    pub(super) bounds: &'a ObjectBounds,
    pub(super) ray: &'a Ray,
    pub(super) visit: InstanceReceiver<'a>,
}

impl Kernel for GroupKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let GroupKernel { top, bounds, ray, visit } = self;
        let slabs = match PreparedRay::of(s, bounds, ray) {
            Some(prepared) => prepared.slabs,
            // Where numbers leave the range of f32, every box is entered.
            None => Line::new(ray).map_or(RaySlabs::NONE, |line| RaySlabs::new(ray, &line, bounds)),
        };
        walk_ray(s, (top, ray), &slabs, visit)
    }
}

/// Visits what a ray with these constants may enter. Returns true if `visit` has ended the walk.
#[inline(always)]
fn walk_ray<S: Simd>(
    s: S,
    (top, ray): (&TopLevel, &Ray),
    slabs: &RaySlabs,
    visit: InstanceReceiver<'_>,
) -> bool {
    // Kept in memory: vectors of its numbers would be stored before each visit and loaded after
    // it.
    let slabs = black_box(slabs);
    let last = limit(slabs.scale, ray.tmax);
    // Lists save visits, but elsewhere they take longer than that.
    if S::HAS_FAST_COMPRESS
        && ray.tmin >= 0.0
        && let Some(list) = InstanceList::of(s, top, slabs, last)
    {
        return list.visit(slabs.scale, ray.tmax, visit);
    }
    let mut query = RayInstances { slabs, tmax: ray.tmax, last, visit };
    walk(s, &top.nodes(), &mut query, &mut SingleStack::new())
}

/// The instances that a ray may enter.
struct RayInstances<'a> {
    slabs: &'a RaySlabs,
    /// Max t of hits that can still change the result, and their max depth.
    tmax: f32,
    last: f32,
    visit: InstanceReceiver<'a>,
}

impl<'a> BoxQuery for RayInstances<'a> {
    /// Numbers, not vectors: instructions broadcast them from memory, and no leaf stores and loads
    /// them.
    type Constants<S: Simd> = &'a RaySlabs;
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: S) -> &'a RaySlabs {
        self.slabs
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, slabs: &&'a RaySlabs, node: &WideNode, limit: f32) -> (u32, S::F) {
        entered(s, &RaySlabLanes::new(s, slabs), node, limit)
    }
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.last
    }
    #[inline(always)]
    fn max_key(limit: f32) -> f32 {
        key_limit(limit)
    }
}

impl InstanceQuery for RayInstances<'_> {
    #[inline(always)]
    fn instance(&mut self, instance: u32) -> bool {
        match (self.visit)(instance) {
            None => return true,
            Some(t) if t < self.tmax => (self.tmax, self.last) = (t, limit(self.slabs.scale, t)),
            Some(_) => {}
        }
        false
    }
}

/// The instances near a point.
pub(super) struct PointInstances<'a> {
    pub(super) point: LanePoint,
    pub(super) squared: f64,
    pub(super) visit: &'a mut dyn FnMut(u32) -> Option<f64>,
}

impl BoxQuery for PointInstances<'_> {
    type Constants<S: Simd> = PointLanes<S>;
    #[inline(always)]
    fn lanes<S: Simd>(&self, s: S) -> PointLanes<S> {
        self.point.lanes(s)
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, lanes: &PointLanes<S>, node: &WideNode, limit: f32) -> (u32, S::F) {
        lanes.children(s, node, limit)
    }
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.point.limit(self.squared)
    }
}

impl InstanceQuery for PointInstances<'_> {
    #[inline(always)]
    fn instance(&mut self, instance: u32) -> bool {
        let Some(squared) = (self.visit)(instance) else { return true };
        self.squared = squared;
        false
    }
}

/// The instances that overlap a region.
pub(super) struct BoxInstances<'a> {
    pub(super) region: RegionBox,
    pub(super) visit: &'a mut dyn FnMut(u32) -> bool,
}

impl BoxQuery for BoxInstances<'_> {
    type Constants<S: Simd> = RegionLanes<S>;
    const NEAREST_FIRST: bool = false;
    #[inline(always)]
    fn lanes<S: Simd>(&self, s: S) -> RegionLanes<S> {
        self.region.lanes(s)
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, lanes: &RegionLanes<S>, node: &WideNode, _limit: f32) -> (u32, S::F) {
        (lanes.children(s, node), s.splat(0.0))
    }
}

impl InstanceQuery for BoxInstances<'_> {
    #[inline(always)]
    fn instance(&mut self, instance: u32) -> bool {
        (self.visit)(instance)
    }
}

#[cfg(test)]
#[path = "enumerate_tests.rs"]
mod tests;
