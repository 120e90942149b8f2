//! Triangles that overlap a box or a ball.

use super::nearest::{PointGoal, PointInstance, Visitor, search_instance};
use super::search::Search;
use super::searcher::Instances;
use super::wide_search::{Radius, WideSearch};
use crate::bvh::walk::{BoxQuery, ObjectTree, TriangleQuery, all_triangles, any_in_set, run_walk};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::region_box::{RegionBox, RegionLanes};
use crate::intersect::vector::wide;
use crate::intersect::{triangle_box, wide_box};
use crate::rays::PrimitiveRef;
use crate::scene::Scene;
use crate::simd::Simd;
use bth_format::layout::{NONE, WideNode};

/// A box: lower and upper end.
pub(super) type Region = [[f64; 3]; 2];

/// The part of a box with coordinates of at most `max`. `None` if it contains no such point or a
/// coordinate is NaN.
fn finite_box([lower, upper]: Region, max: f64) -> Option<Region> {
    let is_number = lower.iter().chain(&upper).all(|x| !x.is_nan());
    let (lower, upper) = (lower.map(|x| x.max(-max)), upper.map(|x| x.min(max)));
    (is_number && (0..3).all(|k| lower[k] <= upper[k])).then_some([lower, upper])
}

/// Visits the triangles of an instance that overlap a box in world space. Returns true if the
/// visitor has ended the query.
fn visit_in_box(at: PointInstance<'_>, region: Region, visit: &mut Visitor<'_>) -> bool {
    let object = at.object;
    let boxes = match at.placed {
        None => RegionBox::in_world(region, object.bounds.greatest),
        Some(placed) => placed.region(region, object),
    };
    object.header.root != NONE
        && run_walk(&ObjectTree::new(object), &mut BoxTriangles { at, region, boxes, visit })
}

/// The triangles that overlap a box.
struct BoxTriangles<'a, 'v> {
    at: PointInstance<'a>,
    region: Region,
    /// The region for tests of boxes.
    boxes: RegionBox,
    visit: &'a mut Visitor<'v>,
}

impl BoxQuery for BoxTriangles<'_, '_> {
    type Constants<S: Simd> = RegionLanes<S>;
    const NEAREST_FIRST: bool = false;
    #[inline(always)]
    fn lanes<S: Simd>(&self, s: S) -> RegionLanes<S> {
        self.boxes.lanes(s)
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, lanes: &RegionLanes<S>, node: &WideNode, _limit: f32) -> (u32, S::F) {
        (lanes.children(s, node), s.splat(0.0))
    }
}

impl TriangleQuery for BoxTriangles<'_, '_> {
    #[inline(always)]
    fn triangles<S: Simd, B: TriangleBlock>(
        &mut self,
        _: S,
        _: &RegionLanes<S>,
        block: &B,
        ids: &[u32],
        _limit: f32,
    ) -> bool {
        self.visit_block(block, ids)
    }
}

impl BoxTriangles<'_, '_> {
    /// Decides the triangles of a leaf without lanes: most leaves whose boxes overlap a region hold
    /// triangles that do.
    #[inline(never)]
    fn visit_block(&mut self, block: &impl TriangleBlock, ids: &[u32]) -> bool {
        let [lower, upper] = self.region;
        let narrow = self.region.map(|end| end.map(|x| x as f32));
        any_in_set(all_triangles(block), |i| {
            let corners = block.corners(i);
            let id = || ids[block.first() as usize + i];
            let overlaps = || match self.at.placed {
                None => triangle_box::overlaps(narrow[0], narrow[1], corners),
                Some(placed) => {
                    wide_box::overlaps(lower, upper, &placed.triangle(self.at.object, corners, id()))
                }
            };
            self.at.is_surface(corners) && overlaps() && (self.visit)(self.at.primitive(id()))
        })
    }
}

/// Collects triangles by ascending instance and triangle.
pub(super) fn collect_sorted(triangles: &mut Vec<PrimitiveRef>, find: impl FnOnce(&mut Visitor<'_>) -> bool) {
    triangles.clear();
    find(&mut |primitive| {
        triangles.push(primitive);
        false
    });
    triangles.sort_unstable_by_key(|p| (p.instance, p.triangle));
}

/// Visits the triangles of a scene that overlap a box, until the visitor returns true. Returns true
/// then. With `narrow` the numbers of the box are f32.
pub(super) fn visit_box(scene: &Scene, region: Region, narrow: bool, visit: &mut Visitor<'_>) -> bool {
    let max = if narrow { f64::from(f32::MAX) } else { f64::MAX };
    let Some(region) = finite_box(region, max) else { return false };
    let mut instances = Instances::new(scene);
    let narrow = narrow && instances.is_narrow();
    instances.any(narrow, |world, visit| world.enumerate_in_box(region, visit), &mut |at| {
        visit_in_box(at, region, visit)
    })
}

/// Visits the triangles of a scene that overlap a ball of f32 numbers, until the visitor returns
/// true. Returns true then.
pub(super) fn visit_ball(scene: &Scene, center: [f32; 3], radius: f32, visit: &mut Visitor<'_>) -> bool {
    let mut instances = Instances::new(scene);
    if !instances.is_narrow() {
        return visit_wide_ball(scene, wide(center), Radius::Reported(radius), visit);
    }
    let Some(search) = &Search::new(center, radius) else { return false };
    let visit = &mut |at: PointInstance<'_>| search_instance(at, PointGoal::Ball { search, radius, visit });
    instances.any(true, |_, _| false, visit)
}

/// Like [`visit_ball`], about triangles as real numbers.
pub(super) fn visit_wide_ball(
    scene: &Scene,
    center: [f64; 3],
    radius: Radius,
    visit: &mut Visitor<'_>,
) -> bool {
    let Some(mut search) = WideSearch::new(center, radius) else { return false };
    Instances::new(scene)
        .any_near(&mut search, |at, search| search_instance(at, PointGoal::WideBall { search, visit }))
}
