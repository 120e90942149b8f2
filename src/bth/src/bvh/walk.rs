//! The walk of every query that is not a plain ray: all hits, crossings, points, boxes and balls.
//!
//! A query says which boxes may matter ([`BoxQuery`]) and what happens at the leaves. A tree is the
//! BVH of an object, whose leaves hold triangles ([`TriangleQuery`]), or the top level of a scene,
//! whose leaves are instances (`instances/enumerate.rs`).

use super::nodes::{Leaf, LeafMemory, leaf, prefetch};
use super::single_stack::SingleStack;
use super::stack::BOTTOM;
use crate::intersect::filter::TriangleBlock;
use crate::intersect::point_lanes::CornerLanes;
use crate::query::{AnyHit, NearestHit};
use crate::shortcuts::SpecialLeaf;
use crate::simd::{Isa, Kernel, Part, Simd};
use bth_format::layout::{Child, WIDTH, WideNode};
use bth_format::object::{NodeBase, ObjectView};

/// Which boxes of a tree may matter to a query.
pub(crate) trait BoxQuery {
    /// Constants of the query in lanes, which a walk keeps at hand.
    type Constants<S: Simd>: Copy;
    /// True if nearer boxes are entered first. Otherwise keys and limits are not used.
    const NEAREST_FIRST: bool = true;
    fn lanes<S: Simd>(&self, s: S) -> Self::Constants<S>;
    /// The children of a node whose boxes may matter, one bit each, and their keys: lower bounds of
    /// the distances of the boxes. Empty slots may be among them.
    fn children<S: Simd>(&self, s: S, lanes: &Self::Constants<S>, node: &WideNode, limit: f32)
    -> (u32, S::F);
    /// Upper bound of the distances of boxes that can still change the result.
    #[inline(always)]
    fn limit(&self) -> f32 {
        0.0
    }
    /// The max key of stacked boxes within a limit. Sorting changes the four lowest bits of keys.
    #[inline(always)]
    fn max_key(limit: f32) -> f32 {
        limit
    }
}

/// A query about the triangles of an object.
pub(crate) trait TriangleQuery: BoxQuery {
    /// Visits the triangles of a leaf. The id of triangle i is `ids[block.first() + i]`. Returns
    /// true if the query is complete.
    fn triangles<S: Simd, B: TriangleBlock + CornerLanes>(
        &mut self,
        s: S,
        lanes: &Self::Constants<S>,
        block: &B,
        ids: &[u32],
        limit: f32,
    ) -> bool;

    /// Visits the triangles of a special leaf. Returns true if the query is complete.
    #[inline(always)]
    fn special<S: Simd>(
        &mut self,
        s: S,
        lanes: &Self::Constants<S>,
        object: &ObjectView<'_>,
        leaf: SpecialLeaf,
    ) -> bool
    where
        Self: Sized,
    {
        s.call(VisitSpecial { query: self, lanes, object, leaf })
    }
}

/// A tree that a query walks through.
pub(crate) trait Tree<Q: BoxQuery> {
    /// Child code of the root.
    fn root(&self) -> u32;
    fn node(&self, code: u32) -> &WideNode;
    /// Prefetches what is entered soon.
    #[inline(always)]
    fn prefetch<S: Simd>(&self, _: S, _code: u32) {}
    /// Visits the leaf of a child code; the code may be `NONE`. Returns true if the query is
    /// complete.
    fn leaf<S: Simd>(&self, s: S, lanes: &Q::Constants<S>, code: u32, query: &mut Q, limit: f32) -> bool;
}

/// Walks through a tree. Returns true if the query is complete before the end.
#[inline(always)]
pub(crate) fn walk<S: Simd, Q: BoxQuery>(
    s: S,
    tree: &impl Tree<Q>,
    query: &mut Q,
    stack: &mut SingleStack,
) -> bool {
    let lanes = query.lanes(s);
    let mut code = tree.root();
    let mut stack = stack.start(code);
    let mut limit = query.limit();
    let mut max_key = Q::max_key(limit);
    loop {
        while code & Child::LEAF_BIT == 0 {
            let node = tree.node(code);
            let (bits, keys) = query.children(s, &lanes, node, limit);
            if bits & bits.wrapping_sub(1) == 0 {
                code = match bits {
                    0 if Q::NEAREST_FIRST => stack.pop(max_key, NearestHit),
                    0 => stack.pop(max_key, AnyHit),
                    _ => node.child[bits.trailing_zeros() as usize % WIDTH],
                };
                continue;
            }
            let free = stack.free_entries();
            let children = s.load_u(&node.child);
            if Q::NEAREST_FIRST {
                let (count, nearest) = s.sort_far_to_near(bits, keys, children, free.codes, free.keys);
                code = node.child[nearest % WIDTH];
                free.push(count);
            } else {
                code = node.child[bits.trailing_zeros() as usize % WIDTH];
                let others = s.compress(bits & (bits - 1), children, free.codes);
                free.push(others + 1);
            }
            // The entry below the new top is most often needed next.
            tree.prefetch(s, stack.below());
        }
        if code == BOTTOM {
            return false;
        }
        if tree.leaf(s, &lanes, code, query, limit) {
            return true;
        }
        limit = query.limit();
        max_key = Q::max_key(limit);
        code = if Q::NEAREST_FIRST { stack.pop(max_key, NearestHit) } else { stack.pop(max_key, AnyHit) };
    }
}

/// [`walk`] as a kernel.
struct WalkKernel<'a, T, Q> {
    tree: &'a T,
    query: &'a mut Q,
    stack: &'a mut SingleStack,
}

impl<T: Tree<Q>, Q: BoxQuery> Kernel for WalkKernel<'_, T, Q> {
    type Output = bool;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        walk(s, self.tree, self.query, self.stack)
    }
}

/// Walks through a tree with the chosen instruction set. Returns true if the query is complete
/// before the end.
pub(crate) fn run_walk<Q: BoxQuery>(tree: &impl Tree<Q>, query: &mut Q) -> bool {
    Isa::chosen().run(WalkKernel { tree, query, stack: &mut SingleStack::new() })
}

/// The BVH of an object.
pub(crate) struct ObjectTree<'a> {
    object: &'a ObjectView<'a>,
    node_base: NodeBase<'a>,
}

impl<'a> ObjectTree<'a> {
    #[inline(always)]
    pub(crate) fn new(object: &'a ObjectView<'a>) -> ObjectTree<'a> {
        ObjectTree { object, node_base: object.node_base() }
    }
}

impl<Q: TriangleQuery> Tree<Q> for ObjectTree<'_> {
    #[inline(always)]
    fn root(&self) -> u32 {
        self.object.header.root
    }
    #[inline(always)]
    fn node(&self, code: u32) -> &WideNode {
        self.node_base.node(code)
    }
    #[inline(always)]
    fn prefetch<S: Simd>(&self, s: S, code: u32) {
        prefetch(s, self.node_base, code);
    }
    #[inline(always)]
    fn leaf<S: Simd>(&self, s: S, lanes: &Q::Constants<S>, code: u32, query: &mut Q, limit: f32) -> bool {
        let (object, mut memory) = (self.object, LeafMemory::default());
        match leaf(s, object, self.node_base, code, &mut memory) {
            Leaf::Indexed(block) => query.triangles(s, lanes, block, object.triangle_ids, limit),
            Leaf::Raw(block) => query.triangles(s, lanes, block, object.triangle_ids, limit),
            Leaf::Special(leaf) => query.special(s, lanes, object, leaf),
            Leaf::None => false,
        }
    }
}

/// The triangles of a special leaf, as blocks of sixteen. Kernels call this part, because such
/// leaves are rare.
struct VisitSpecial<'a, S: Simd, Q: BoxQuery> {
    query: &'a mut Q,
    lanes: &'a Q::Constants<S>,
    object: &'a ObjectView<'a>,
    leaf: SpecialLeaf,
}

impl<S: Simd, Q: TriangleQuery> Part<S> for VisitSpecial<'_, S, Q> {
    type Output = bool;
    #[inline(always)]
    fn run(self, s: S) -> bool {
        let VisitSpecial { query, lanes, object, leaf } = self;
        let mut blocks = leaf.blocks(object);
        while let Some((block, ids)) = blocks.next_block() {
            let limit = query.limit();
            if query.triangles(s, lanes, block, ids, limit) {
                return true;
            }
        }
        false
    }
}

/// The triangles of a leaf as bits, at most sixteen even if the count in an unchecked file is
/// larger.
#[inline(always)]
pub(crate) fn all_triangles(block: &impl TriangleBlock) -> u32 {
    1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH)
}

/// Calls `visit` with the index of each triangle in a set, until it returns true. Returns true
/// then.
#[inline(always)]
pub(crate) fn any_in_set(mut triangles: u32, mut visit: impl FnMut(usize) -> bool) -> bool {
    while triangles != 0 {
        let i = triangles.trailing_zeros() as usize;
        triangles &= triangles - 1;
        if visit(i) {
            return true;
        }
    }
    false
}
