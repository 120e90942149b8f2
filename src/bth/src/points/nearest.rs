//! The walk of a point through the BVH of an object, nearest boxes first: for the closest triangle,
//! or for all triangles that overlap a ball.

use super::search::Search;
use super::wide_search::WideSearch;
use crate::bvh::walk::{BoxQuery, ObjectTree, TriangleQuery, all_triangles, any_in_set, run_walk};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::point_lanes::{CornerLanes, LanePoint, PointLanes, TriangleLanes};
use crate::nodes::placed::{NarrowPoint, PlacedObject};
use crate::rays::PrimitiveRef;
use crate::simd::{Part, Simd};
use bth_format::exact::is_zero_area;
use bth_format::layout::{NONE, WideNode};
use bth_format::object::ObjectView;

/// An instance of an object for a query about triangles in world space.
#[derive(Clone, Copy)]
pub(super) struct PointInstance<'a> {
    pub(super) object: &'a ObjectView<'a>,
    /// Instance that is reported.
    pub(super) instance: u32,
    /// The transform of the instance. `None` for queries in f32 of what lies in world space as f32.
    pub(super) placed: Option<&'a PlacedObject>,
}

impl PointInstance<'_> {
    /// Returns true if a triangle is part of the surface, given its corners in object space: if it
    /// has an area. Only deformable objects hold others.
    #[inline(always)]
    pub(super) fn is_surface(&self, corners: [[f32; 3]; 3]) -> bool {
        !(self.object.is_deformable() && is_zero_area(corners))
    }

    /// The triangle with an id.
    #[inline(always)]
    pub(super) fn primitive(&self, triangle: u32) -> PrimitiveRef {
        PrimitiveRef { instance: self.instance, triangle }
    }
}

/// What is done with a triangle in a region. It returns true to end the query.
pub(super) type Visitor<'a> = dyn FnMut(PrimitiveRef) -> bool + 'a;

/// What is searched.
pub(super) enum PointGoal<'a, 'v> {
    /// The closest triangle.
    Closest(&'a mut Search),
    /// All triangles that overlap the ball of a search that has found nothing yet.
    Ball { search: &'a Search, radius: f32, visit: &'a mut Visitor<'v> },
    /// The closest triangle of a placed instance.
    WideClosest(&'a mut WideSearch),
    /// All triangles of a placed instance in the ball of a search that has found nothing yet.
    WideBall { search: &'a WideSearch, visit: &'a mut Visitor<'v> },
}

/// Searches an instance. Returns true if the query is complete.
#[inline(always)]
pub(super) fn search_instance(at: PointInstance<'_>, goal: PointGoal<'_, '_>) -> bool {
    let PointInstance { object, placed, .. } = at;
    if object.header.root == NONE {
        return false;
    }
    let in_object = |point, placed: Option<&PlacedObject>| {
        let nowhere = NarrowPoint { point: [0.0; 3], off: 0.0 };
        placed.map_or(nowhere, |placed| placed.narrow(&placed.point(point), object))
    };
    let NarrowPoint { point, off } = match &goal {
        PointGoal::Closest(search) => NarrowPoint { point: search.point, off: 0.0 },
        PointGoal::Ball { search, .. } => NarrowPoint { point: search.point, off: 0.0 },
        PointGoal::WideClosest(search) => in_object(search.point, placed),
        PointGoal::WideBall { search, .. } => in_object(search.point, placed),
    };
    let point = LanePoint::new(point, object.bounds.greatest);
    // In object space, the smallest upper bound says nothing about which triangle is closest in
    // world space; nor does the bound of a triangle of zero area, which is not offered.
    let only_closest = matches!(goal, PointGoal::Closest(_)) && !object.is_deformable();
    run_walk(&ObjectTree::new(object), &mut PointTriangles { at, off, point, only_closest, goal })
}

/// The triangles near a point.
struct PointTriangles<'a, 'g, 'v> {
    at: PointInstance<'a>,
    /// How far a coordinate of the point in object space is off.
    off: f64,
    /// The point in object space.
    point: LanePoint,
    /// True if triangles that are certainly not the closest of a leaf are skipped.
    only_closest: bool,
    goal: PointGoal<'g, 'v>,
}

impl PointTriangles<'_, '_, '_> {
    /// Decides a triangle of a placed instance. Returns true if the query is complete.
    #[inline(never)]
    fn decide(&mut self, corners: [[f32; 3]; 3], id: u32) -> bool {
        let at = self.at;
        let Some(placed) = at.placed else { return false };
        let triangle = placed.triangle(at.object, corners, id);
        match &mut self.goal {
            PointGoal::WideClosest(search) => search.offer(triangle, at.primitive(id)),
            PointGoal::WideBall { search, visit } => {
                return search.is_within(&triangle) && visit(at.primitive(id));
            }
            PointGoal::Closest(_) | PointGoal::Ball { .. } => {}
        }
        false
    }
}

impl BoxQuery for PointTriangles<'_, '_, '_> {
    type Constants<S: Simd> = PointLanes<S>;
    #[inline(always)]
    fn lanes<S: Simd>(&self, s: S) -> PointLanes<S> {
        self.point.lanes(s)
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, lanes: &PointLanes<S>, node: &WideNode, limit: f32) -> (u32, S::F) {
        lanes.children(s, node, limit)
    }
    /// Upper bound in scaled object space of squared distances that can change the result.
    #[inline(always)]
    fn limit(&self) -> f32 {
        let in_object =
            |limit| self.at.placed.map_or(0.0, |placed| placed.squared_in_object(limit, self.off));
        self.point.limit(match &self.goal {
            PointGoal::Closest(search) => search.squared,
            PointGoal::Ball { search, .. } => search.squared,
            PointGoal::WideClosest(search) => in_object(search.limit),
            PointGoal::WideBall { search, .. } => in_object(search.limit),
        })
    }
}

impl TriangleQuery for PointTriangles<'_, '_, '_> {
    #[inline(always)]
    fn triangles<S: Simd, B: TriangleBlock + CornerLanes>(
        &mut self,
        s: S,
        lanes: &PointLanes<S>,
        block: &B,
        ids: &[u32],
        limit: f32,
    ) -> bool {
        let valid = all_triangles(block);
        let found = if S::HAS_VECTORS {
            NearTriangles { point: lanes, block, valid, limit, only_closest: self.only_closest }
                .inline_or_call(s)
        } else if is_beyond_called(s, lanes, block, limit) {
            // Without vectors, bounds in lanes take as long as decisions, and much code.
            0
        } else {
            valid
        };
        let at = self.at;
        any_in_set(found, |i| {
            let corners = block.corners(i);
            if !at.is_surface(corners) {
                return false;
            }
            let id = || ids[block.first() as usize + i];
            match &mut self.goal {
                PointGoal::Closest(search) => {
                    search.offer(corners, || at.primitive(id()));
                    false
                }
                PointGoal::Ball { search, radius, visit } => {
                    search.is_in_ball(corners, *radius) && visit(at.primitive(id()))
                }
                _ => self.decide(corners, id()),
            }
        })
    }
}

/// The triangles of `valid` that may be closer than `limit` and, with `only_closest`, than the
/// others.
struct NearTriangles<'a, S: Simd, B> {
    point: &'a PointLanes<S>,
    block: &'a B,
    valid: u32,
    limit: f32,
    only_closest: bool,
}

impl<S: Simd, B: CornerLanes> Part<S> for NearTriangles<'_, S, B> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let NearTriangles { point, block, valid, limit, only_closest } = self;
        if block.is_beyond(s, point, limit) {
            return 0;
        }
        NearCorners { corners: &block.relative(s, point), valid, limit, only_closest }.inline_or_call(s)
    }
}

/// [`NearTriangles`], given the corners of the triangles relative to the point: the same for leaves
/// of both record formats.
struct NearCorners<'a, S: Simd> {
    corners: &'a [[S::F; 3]; 3],
    valid: u32,
    limit: f32,
    only_closest: bool,
}

impl<S: Simd> Part<S> for NearCorners<'_, S> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let NearCorners { corners, valid, limit, only_closest } = self;
        let bounds = TriangleLanes::new(s, corners);
        let least = if only_closest { bounds.least_upper_bound(s, valid) } else { limit };
        bounds.candidates(s, valid, least.min(limit))
    }
}

/// [`CornerLanes::is_beyond`] as a function, because unrolled in all scalar code it would take much
/// code.
#[inline(never)]
fn is_beyond_called<S: Simd>(s: S, point: &PointLanes<S>, block: &impl CornerLanes, limit: f32) -> bool {
    block.is_beyond(s, point, limit)
}
