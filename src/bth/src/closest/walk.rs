//! The walk of a point through the BVH of an object, nearest boxes first.

use super::placed::PlacedObject;
use super::search::Search;
use crate::bvh::nodes::{indexed_leaf, prefetch, raw as raw_leaf};
use crate::bvh::single_stack::SingleStack;
use crate::intersect::filter::TriangleBlock;
use crate::intersect::point_lanes::{CornerLanes, LanePoint, PointLanes, TriangleLanes};
use crate::query::NearestHit;
use crate::rays::PrimitiveRef;
use crate::simd::{Isa, Kernel, LANES, Part, Simd};
use bth_format::exact::is_zero_area;
use bth_format::layout::{Child, NONE, RawLeaf, TetLeaf, WIDTH};
use bth_format::object::ObjectView;

/// An object in which closest triangles are searched.
pub(super) struct ObjectWalk<'a> {
    object: &'a ObjectView<'a>,
    /// Instance that is reported.
    instance: u32,
    /// The transform of the instance and its slack for the point; `None` where object space is world space.
    placed: Option<(&'a PlacedObject, f64)>,
    /// The point in object space.
    point: LanePoint,
}

/// Searches an object whose space is world space.
#[inline(always)]
pub(super) fn search_object(object: &ObjectView<'_>, instance: u32, search: &mut Search) {
    let point = LanePoint::new(search.point, object.bounds.greatest);
    walk(&ObjectWalk { object, instance, placed: None, point }, search);
}

/// Searches the object of an instance.
pub(super) fn search_placed(
    object: &ObjectView<'_>,
    placed: &PlacedObject,
    instance: u32,
    search: &mut Search,
) {
    let point = LanePoint::new(placed.point(search.point), object.bounds.greatest);
    let placed = Some((placed, placed.slack(search.point)));
    walk(&ObjectWalk { object, instance, placed, point }, search);
}

#[inline(always)]
fn walk(walk: &ObjectWalk<'_>, search: &mut Search) {
    if walk.object.header.root != NONE {
        Isa::chosen().run(WalkKernel { walk, search });
    }
}

struct WalkKernel<'a> {
    walk: &'a ObjectWalk<'a>,
    search: &'a mut Search,
}

impl Kernel for WalkKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let WalkKernel { walk, search } = self;
        let object = walk.object;
        let node_base = object.node_base();
        let point = walk.point.lanes(s);
        let mut stack = SingleStack::new();
        let mut code = object.header.root;
        let mut stack = stack.start(code);
        let mut limit = walk.limit(search);
        loop {
            while code & Child::LEAF_BIT == 0 {
                let node = node_base.node(code);
                let (child, (bits, squared)) = (&node.child, point.children(s, node, limit));
                if bits & bits.wrapping_sub(1) == 0 {
                    code = match bits {
                        0 => stack.pop(limit, NearestHit),
                        _ => child[bits.trailing_zeros() as usize % WIDTH],
                    };
                    continue;
                }
                let free = stack.free_entries();
                let children = s.load_u(child);
                let (count, nearest) = s.sort_far_to_near(bits, squared, children, free.codes, free.keys);
                code = child[nearest % WIDTH];
                free.push(count);
                // The entry below the new top is most often needed next.
                prefetch(s, node_base, stack.below());
            }
            let (mut indexed, mut raw) = (None, None);
            if let Some(leaf) = indexed_leaf(s, object, node_base, code, &mut indexed) {
                walk.leaf(s, &point, leaf, limit, search);
            } else {
                match Child::from_code(code) {
                    Some(Child::Raw(at)) => {
                        walk.leaf(s, &point, raw_leaf(s, object, at, &mut raw), limit, search)
                    }
                    Some(Child::Tets(row)) => {
                        let leaf = &object.tet_leaves[row as usize];
                        if leaf.subtree != NONE {
                            code = leaf.subtree;
                            continue;
                        }
                        s.call(Faces { walk, point: &point, leaf, search });
                    }
                    // An empty slot, or the bottom of the stack.
                    _ if stack.is_empty() => break,
                    _ => {}
                }
            }
            limit = walk.limit(search);
            code = stack.pop(limit, NearestHit);
        }
    }
}

/// The triangles of `valid` that may be closer than `limit` and, if all that may be closest `is_offered`, than the others.
struct Candidates<'a, S: Simd, B> {
    point: &'a PointLanes<S>,
    block: &'a B,
    valid: u32,
    limit: f32,
    is_offered: bool,
}

impl<S: Simd, B: CornerLanes> Part<S> for Candidates<'_, S, B> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let Candidates { point, block, valid, limit, is_offered } = self;
        if block.is_beyond(s, point, limit) {
            return 0;
        }
        CandidatesOf { corners: &block.relative(s, point), valid, limit, is_offered }.inline_or_call(s)
    }
}

/// [`Candidates`], given the corners of the triangles relative to the point: the same for leaves of both record formats.
struct CandidatesOf<'a, S: Simd> {
    corners: &'a [[S::F; 3]; 3],
    valid: u32,
    limit: f32,
    is_offered: bool,
}

impl<S: Simd> Part<S> for CandidatesOf<'_, S> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let CandidatesOf { corners, valid, limit, is_offered } = self;
        let bounds = TriangleLanes::new(s, corners);
        let least = if is_offered { bounds.least_upper_bound(s, valid) } else { limit };
        bounds.candidates(s, valid, least.min(limit))
    }
}

/// The constrained faces of a tet leaf without a subtree, as a part that kernels call: such leaves are rare.
struct Faces<'a, 'w, S: Simd> {
    walk: &'a ObjectWalk<'w>,
    point: &'a PointLanes<S>,
    leaf: &'a TetLeaf,
    search: &'a mut Search,
}

impl<S: Simd> Part<S> for Faces<'_, '_, S> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        self.walk.faces(s, self.point, self.leaf, self.search);
    }
}

impl ObjectWalk<'_> {
    /// Upper bound in scaled object space of squared distances that can change the result.
    #[inline(always)]
    fn limit(&self, search: &Search) -> f32 {
        self.point.limit(match self.placed {
            None => search.squared,
            Some((placed, slack)) => placed.squared_in_object(search.squared, slack),
        })
    }

    /// The triangles of `valid` that may be closer than `limit`, and than the others.
    #[inline(always)]
    fn candidates<S: Simd>(
        &self,
        s: S,
        point: &PointLanes<S>,
        block: &impl CornerLanes,
        valid: u32,
        limit: f32,
    ) -> u32 {
        // Without vectors, bounds in lanes take as long as decisions, and much code.
        if !S::HAS_VECTORS {
            return if is_beyond_called(s, point, block, limit) { 0 } else { valid };
        }
        // In object space, the least upper bound says nothing about which triangle is closest in world space; nor does that of a
        // triangle of zero area, which is not offered.
        let is_offered = self.placed.is_none() && !self.object.is_deformable();
        Candidates { point, block, valid, limit, is_offered }.inline_or_call(s)
    }

    /// Offers the triangles of a leaf.
    #[inline(always)]
    fn leaf<S: Simd, B: TriangleBlock + CornerLanes>(
        &self,
        s: S,
        point: &PointLanes<S>,
        block: &B,
        limit: f32,
        search: &mut Search,
    ) {
        let valid = 1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH);
        let mut bits = self.candidates(s, point, block, valid, limit);
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let index = block.first() as usize + i;
            self.offer(block.corners(i), || self.object.triangle_ids[index], search);
        }
    }

    /// Offers the constrained faces of a tet leaf.
    #[inline(always)]
    fn faces<S: Simd>(&self, s: S, point: &PointLanes<S>, leaf: &TetLeaf, search: &mut Search) {
        let faces = &self.object.tet_faces[leaf.first_face as usize..][..leaf.faces as usize];
        let mut block = RawLeaf { corner: [[[0.0; WIDTH]; 3]; 3], first: 0, triangles: 0, reserved: [0; 14] };
        for faces in faces.chunks(LANES) {
            for i in 0..faces.len() {
                for c in 0..3 {
                    let position = &self.object.tet_vertices[faces[i].vertex[c] as usize].position;
                    for k in 0..3 {
                        block.corner[c][k][i] = position[k];
                    }
                }
            }
            let valid = ((1u64 << faces.len()) - 1) as u32;
            let mut bits = self.candidates(s, point, &block, valid, self.limit(search));
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                self.offer(block.corners(i), || faces[i].triangle, search);
            }
        }
    }

    /// Offers a triangle, given its corners in object space and a function that returns its id.
    #[inline(always)]
    fn offer(&self, corners: [[f32; 3]; 3], id: impl FnOnce() -> u32, search: &mut Search) {
        // Triangles of zero area are no part of the surface; only the leaves of deformable objects hold some.
        if self.object.is_deformable() && is_zero_area(corners) {
            return;
        }
        let corners = match self.placed {
            None => corners,
            Some((placed, _)) => placed.corners_in_world(corners),
        };
        search.offer(corners, || PrimitiveRef { instance: self.instance, triangle: id() });
    }
}

/// [`CornerLanes::is_beyond`] as a function of its own, because unrolled wherever scalar code needs it it would take much code.
#[inline(never)]
fn is_beyond_called<S: Simd>(s: S, point: &PointLanes<S>, block: &impl CornerLanes, limit: f32) -> bool {
    block.is_beyond(s, point, limit)
}
