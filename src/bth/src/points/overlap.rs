//! Triangles that overlap a box or a ball.

use super::nearest::{PointGoal, PointInstance, Visitor, search_instance};
use super::search::Search;
use super::searcher::{objects, placed, sole_instance};
use crate::bvh::walk::{BoxQuery, ObjectTree, TriangleQuery, all_triangles, any_in_set, run_walk};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::region_box::{RegionBox, RegionLanes};
use crate::intersect::triangle_box;
use crate::rays::PrimitiveRef;
use crate::scene::Scene;
use crate::simd::Simd;
use bth_format::layout::{NONE, WideNode};

/// The finite part of a box: lower and upper ends. `None` if it contains no finite point or a
/// coordinate is NaN.
fn finite_box(lower: [f32; 3], upper: [f32; 3]) -> Option<[[f32; 3]; 2]> {
    let is_number = lower.iter().chain(&upper).all(|x| !x.is_nan());
    let (lower, upper) = (lower.map(|x| x.max(f32::MIN)), upper.map(|x| x.min(f32::MAX)));
    (is_number && (0..3).all(|k| lower[k] <= upper[k])).then_some([lower, upper])
}

/// Visits the triangles of an instance that overlap a box in world space. Returns true if the
/// visitor has ended the query.
fn visit_in_box(at: PointInstance<'_>, region: [[f32; 3]; 2], visit: &mut Visitor<'_>) -> bool {
    let object = at.object;
    let greatest = object.bounds.greatest;
    let boxes = match at.placed {
        None => RegionBox::in_world(region, greatest),
        Some(placed) => RegionBox::new(region, placed.world_rows(), greatest, placed.extent()),
    };
    object.header.root != NONE
        && run_walk(&ObjectTree::new(object), &mut BoxTriangles { at, region, boxes, visit })
}

/// The triangles that overlap a box.
struct BoxTriangles<'a, 'v> {
    at: PointInstance<'a>,
    region: [[f32; 3]; 2],
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
        any_in_set(all_triangles(block), |i| {
            let Some(corners) = self.at.corners_in_world(block.corners(i)) else { return false };
            triangle_box::overlaps(lower, upper, corners)
                && (self.visit)(self.at.primitive(ids[block.first() as usize + i]))
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
/// then.
pub(super) fn visit_box(scene: &Scene, lower: [f32; 3], upper: [f32; 3], visit: &mut Visitor<'_>) -> bool {
    let Some(region) = finite_box(lower, upper) else { return false };
    match (sole_instance(scene), scene.world()) {
        (Some(sole), _) => visit_in_box(sole, region, visit),
        (None, None) => objects(scene).any(|object| visit_in_box(object, region, visit)),
        (None, Some(world)) => {
            let boxes = RegionBox::in_world(region, world.max_coordinate());
            world.enumerate_in_box(boxes, &mut |instance| {
                let Some(placed) = placed(scene, world, instance) else { return false };
                let object = scene.view(placed.object());
                visit_in_box(PointInstance { object, instance, placed: Some(&placed) }, region, visit)
            })
        }
    }
}

/// Like [`visit_box`], for a ball.
pub(super) fn visit_ball(scene: &Scene, center: [f32; 3], radius: f32, visit: &mut Visitor<'_>) -> bool {
    let Some(search) = &Search::new(center, radius) else { return false };
    let mut in_instance =
        |at: PointInstance<'_>| search_instance(at, PointGoal::Ball { search, radius, visit });
    match (sole_instance(scene), scene.world()) {
        (Some(sole), _) => in_instance(sole),
        (None, None) => objects(scene).any(in_instance),
        (None, Some(world)) => world.enumerate_near(center, search.squared, &mut |instance| {
            let Some(placed) = placed(scene, world, instance) else { return Some(search.squared) };
            let object = scene.view(placed.object());
            let ended = in_instance(PointInstance { object, instance, placed: Some(&placed) });
            (!ended).then_some(search.squared)
        }),
    }
}
