//! Nodes, and leaves of `f32`, by child code.

use super::view::ObjectView;
use crate::layout::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// An object has at most as many lines as child codes can address, so that [`NodeBase::wide_node`]
/// need not test the kind of a child. Opening a file skips further lines, which nothing can lead
/// to.
pub(crate) const MAX_LINES: usize = Child::INDEX_LIMIT as usize + NODE_LINES - 1;

/// The lines of an object and how child codes index them: what a traversal loop keeps at hand.
///
/// Methods that return a node or leaf panic when the lines end before it does; after
/// [`crate::File::check`] they never do.
#[derive(Clone, Copy, Debug)]
pub struct NodeBase<'a> {
    lines: &'a [CacheLine],
    /// [`Child::LEAF_BIT`] where leaves are on a grid, so that their indices count half lines; else
    /// 0.
    halved: u32,
}

impl<'a> NodeBase<'a> {
    #[inline(always)]
    fn block<T: FromBytes + KnownLayout + Immutable>(self, line: u32, lines: usize) -> &'a T {
        let at = line as usize;
        let bytes = self.lines[at..at + lines].as_bytes();
        T::ref_from_bytes(bytes).ok().expect("a block is a whole number of aligned lines")
    }
    /// As [`ObjectView::node`].
    #[inline(always)]
    pub fn node(self, line: u32) -> &'a WideNode {
        self.block(line, NODE_LINES)
    }
    /// The node that a child code leads to, if it is a node within the lines: the codes of all
    /// others are greater than the number of lines. So a traversal that asks for it need not test
    /// the kind of the child.
    #[inline(always)]
    pub fn wide_node(self, code: u32) -> Option<&'a WideNode> {
        let at = code as usize;
        let bytes = self.lines.get(at..at + NODE_LINES)?.as_bytes();
        Some(WideNode::ref_from_bytes(bytes).ok().expect("a node is a whole number of aligned lines"))
    }
    /// The leaf that a child code leads to, if it is an indexed leaf of `f32`.
    #[inline(always)]
    pub fn indexed_leaf(self, code: u32) -> Option<&'a IndexedLeaf> {
        let line = code ^ Child::LEAF_BIT;
        // Only codes of indexed leaves, and those only without a grid, stay below the limit.
        (line | self.halved < Child::INDEX_LIMIT).then(|| self.block(line, INDEXED_LINES))
    }
    /// Address of the block of a child code, to prefetch. It is not valid for every code: do not
    /// dereference it.
    #[inline(always)]
    pub fn block_address(self, code: u32) -> *const CacheLine {
        let index = code & (Child::INDEX_LIMIT - 1);
        self.lines.as_ptr().wrapping_add((index >> ((code & self.halved) >> 31)) as usize)
    }
}

impl<'a> ObjectView<'a> {
    /// The object's lines, for a traversal loop.
    #[inline(always)]
    pub fn node_base(&self) -> NodeBase<'a> {
        debug_assert!(self.lines.len() <= MAX_LINES, "see `MAX_LINES`");
        NodeBase { lines: self.lines, halved: if self.grid.is_some() { Child::LEAF_BIT } else { 0 } }
    }
    /// The node at a line. Panics when the lines end before the node does; after
    /// [`crate::File::check`] they never do.
    #[inline(always)]
    pub fn node(&self, line: u32) -> &'a WideNode {
        self.node_base().node(line)
    }
    /// The indexed leaf of `f32` at a line; panics as [`Self::node`] does.
    #[inline(always)]
    pub fn indexed_leaf(&self, line: u32) -> &'a IndexedLeaf {
        self.node_base().block(line, INDEXED_LINES)
    }
    /// The raw leaf of `f32` at a line; panics as [`Self::node`] does.
    #[inline(always)]
    pub fn raw_leaf(&self, line: u32) -> &'a RawLeaf {
        NodeBase { lines: self.lines, halved: 0 }.block(line, RAW_LINES)
    }
    /// The node that a child leads to; `None` for leaves. Panics as [`Self::node`] does.
    pub fn node_at(&self, child: Child) -> Option<&'a WideNode> {
        match child {
            Child::Node(line) => Some(self.node(line)),
            Child::Indexed(_) | Child::Raw(_) | Child::Tets(_) => None,
        }
    }
    /// The root. `None` if it is not a node or does not lie within the lines, as may be in an
    /// object that was not checked.
    pub fn root(&self) -> Option<&'a WideNode> {
        self.node_base().wide_node(self.header.root)
    }
}
