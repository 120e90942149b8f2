//! Which nodes may be tetrahedralized: the paper's MARKSUITABLENODES (§3.1) with exact predicates.

/// Result of the marking stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Per node of the binary BVH: whether no two of its triangles are in bad contact.
    pub suitable: Vec<bool>,
}
