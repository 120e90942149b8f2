//! Triangles during the build, and the best way found to split them.

/// A triangle during the build, with its bounds in one pose or several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference<E> {
    pub(super) bounds: E,
    pub(super) id: u32,
}

/// The best split found so far.
#[derive(Clone, Copy)]
pub(super) struct Split {
    cost: f64,
    imbalance: usize,
    /// Axis, or order in which triangles of several poses are sorted.
    pub(super) axis: usize,
    /// First position (bin or rank) of the right side.
    pub(super) position: usize,
    /// Triangles of the left side.
    pub(super) left: usize,
}

impl Split {
    pub(super) const NONE: Split =
        Split { cost: f64::INFINITY, imbalance: usize::MAX, axis: 0, position: 0, left: 0 };

    pub(super) fn is_some(&self) -> bool {
        self.left > 0
    }

    /// Replaces the split by another one that is cheaper, or equally cheap and better balanced, so
    /// that stacks of equal triangles do not become long chains.
    #[inline(always)]
    pub(super) fn improve(&mut self, cost: f64, axis: usize, position: usize, left: usize, total: usize) {
        if cost <= self.cost {
            let imbalance = left.abs_diff(total - left);
            if cost < self.cost || imbalance < self.imbalance {
                *self = Split { cost, imbalance, axis, position, left };
            }
        }
    }
}
