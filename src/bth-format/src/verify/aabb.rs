//! Axis-aligned boxes that grow.

/// An axis-aligned box, object space.
#[derive(Clone, Copy)]
pub(super) struct Aabb {
    pub(super) lower: [f32; 3],
    pub(super) upper: [f32; 3],
}

impl Aabb {
    /// The box of no point; every box contains it.
    pub(super) const EMPTY: Aabb = Aabb { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// Grows to contain a point.
    pub(super) fn add(&mut self, point: [f32; 3]) {
        for (axis, x) in point.into_iter().enumerate() {
            self.lower[axis] = self.lower[axis].min(x);
            self.upper[axis] = self.upper[axis].max(x);
        }
    }

    /// Grows to contain another box.
    pub(super) fn merge(&mut self, other: &Aabb) {
        for axis in 0..3 {
            self.lower[axis] = self.lower[axis].min(other.lower[axis]);
            self.upper[axis] = self.upper[axis].max(other.upper[axis]);
        }
    }

    /// Whether the other box lies within this one, boundaries included.
    pub(super) fn contains(&self, other: &Aabb) -> bool {
        (0..3).all(|a| self.lower[a] <= other.lower[a] && other.upper[a] <= self.upper[a])
    }
}
