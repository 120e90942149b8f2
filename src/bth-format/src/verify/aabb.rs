//! Axis-aligned boxes that grow.

use crate::layout::BOX_MARGIN;

/// The max `f32` that is not above the exact value of `x - margin`.
fn below(x: f64, margin: f64) -> f32 {
    // The difference and what its rounding lost (Knuth's sum of two numbers).
    let difference = x - margin;
    let taken = difference - x;
    let rest = (x - (difference - taken)) - (margin + taken);
    let number = difference as f32;
    let is_above = f64::from(number) > difference || f64::from(number) == difference && rest < 0.0;
    if is_above { number.next_down() } else { number }
}

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

    /// Grows to contain a point with the room that widened boxes have around it.
    pub(super) fn add_widened(&mut self, point: [f32; 3]) {
        let greatest = point.into_iter().fold(0.0, |m: f64, x| m.max(f64::from(x).abs()));
        let margin = greatest * BOX_MARGIN;
        self.add(point.map(|x| below(x.into(), margin)));
        self.add(point.map(|x| -below(-f64::from(x), margin)));
    }

    /// Grows to contain another box.
    pub(super) fn merge(&mut self, other: &Aabb) {
        for axis in 0..3 {
            self.lower[axis] = self.lower[axis].min(other.lower[axis]);
            self.upper[axis] = self.upper[axis].max(other.upper[axis]);
        }
    }

    /// The box around both.
    pub(super) fn with(mut self, other: &Aabb) -> Aabb {
        self.merge(other);
        self
    }

    /// Returns true if the other box lies within this one, boundaries included.
    pub(super) fn contains(&self, other: &Aabb) -> bool {
        (0..3).all(|a| self.lower[a] <= other.lower[a] && other.upper[a] <= self.upper[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_rounded_down_from_their_exact_values() {
        assert_eq!(below(1.0, 0.25), 0.75);
        assert_eq!(below(1.0, f64::from(f32::EPSILON) / 8.0), 1f32.next_down());
        // The difference is 1 in f64, too, and a little less without rounding.
        assert_eq!(below(1.0, 1e-30), 1f32.next_down());
        assert_eq!(below(-1.0, 1e-30), (-1f32).next_down());
        assert_eq!(below(0.0, f64::from(f32::from_bits(1)) / 2.0), -f32::from_bits(1));
        assert_eq!(below(3.0, 0.0), 3.0);
    }
}
