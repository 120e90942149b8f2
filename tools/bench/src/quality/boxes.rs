//! Axis-aligned boxes of `f32`, and the boxes of the parts of a triangle on either side of a plane.
//!
//! A triangle in several leaves is found through any of them, so every point of it must lie in the box of
//! at least one leaf. Hence boxes are rounded outwards, and points in the plane belong to both sides.

/// A box; empty where a lower end is above the upper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Box3 {
    pub(super) lower: [f32; 3],
    pub(super) upper: [f32; 3],
}

impl Box3 {
    pub(super) const EMPTY: Box3 = Box3 { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    pub(super) fn of_points(points: &[[f32; 3]]) -> Box3 {
        let mut all = Box3::EMPTY;
        points.iter().for_each(|&p| all.grow(&Box3 { lower: p, upper: p }));
        all
    }

    pub(super) fn grow(&mut self, other: &Box3) {
        for k in 0..3 {
            self.lower[k] = self.lower[k].min(other.lower[k]);
            self.upper[k] = self.upper[k].max(other.upper[k]);
        }
    }

    pub(super) fn intersection(&self, other: &Box3) -> Box3 {
        Box3 {
            lower: std::array::from_fn(|k| self.lower[k].max(other.lower[k])),
            upper: std::array::from_fn(|k| self.upper[k].min(other.upper[k])),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        (0..3).any(|k| self.lower[k] > self.upper[k])
    }

    /// Half the surface; 0 if empty.
    pub(super) fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let [x, y, z]: [f64; 3] =
            std::array::from_fn(|k| f64::from(self.upper[k]) - f64::from(self.lower[k]));
        x * y + y * z + z * x
    }

    pub(super) fn center(&self, axis: usize) -> f32 {
        0.5 * self.lower[axis] + 0.5 * self.upper[axis]
    }
}

/// A triangle, or the part of a triangle that lies in a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// Around the triangle or its part.
    pub(super) bounds: Box3,
    /// Id of the triangle.
    pub(super) id: u32,
}

/// The box around all references.
pub(super) fn bounds(references: &[Reference]) -> Box3 {
    let mut all = Box3::EMPTY;
    references.iter().for_each(|r| all.grow(&r.bounds));
    all
}

/// Boxes around the two parts of a triangle within a box: at or below a plane across an axis, and at or above it. A box is
/// empty where there is no such part.
pub(super) fn parts(corners: &[[f32; 3]; 3], within: &Box3, axis: usize, plane: f32) -> [Box3; 2] {
    let [mut left, mut right] = [Box3::EMPTY; 2];
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        let (a, b) = (&corners[a], &corners[b]);
        let point = Box3 { lower: *a, upper: *a };
        if a[axis] <= plane {
            left.grow(&point);
        }
        if a[axis] >= plane {
            right.grow(&point);
        }
        if (a[axis] < plane && plane < b[axis]) || (b[axis] < plane && plane < a[axis]) {
            let crossing = crossing(a, b, axis, plane);
            left.grow(&crossing);
            right.grow(&crossing);
        }
    }
    [left.intersection(within), right.intersection(within)]
}

/// A box around the point in which an edge crosses a plane strictly between its ends.
fn crossing(a: &[f32; 3], b: &[f32; 3], axis: usize, plane: f32) -> Box3 {
    let [from, to, at] = [a[axis], b[axis], plane].map(f64::from);
    let share = (at - from) / (to - from);
    let mut found = Box3 { lower: [plane; 3], upper: [plane; 3] };
    for k in (0..3).filter(|&k| k != axis) {
        let (p, q) = (f64::from(a[k]), f64::from(b[k]));
        let x = p + share * (q - p);
        // Six roundings, each at most half an epsilon of a term: three differences, a quotient, a product and a sum.
        // None underflows: differences of f32 are at least 2^-149, quotients of them at least 2^-278.
        let error = 8.0 * f64::EPSILON * (p.abs() + q.abs());
        found.lower[k] = round_down(x - error).max(a[k].min(b[k]));
        found.upper[k] = round_up(x + error).min(a[k].max(b[k]));
    }
    found
}

/// The greatest `f32` that is at most this.
fn round_down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

/// The least `f32` that is at least this.
fn round_up(x: f64) -> f32 {
    -round_down(-x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    #[test]
    fn crossings_are_rounded_outwards() {
        let mut rng = Rng::new(4);
        let mut inexact = 0;
        for _ in 0..20_000 {
            let mut whole = || rng.below(8192) as f32 - 4096.0;
            let (a, b) = ([whole(), whole(), 0.0], [whole(), whole(), 0.0]);
            let plane = whole();
            if !(a[0] < plane && plane < b[0]) {
                continue;
            }
            let found = crossing(&a, &b, 0, plane);
            let [a, b] = [a, b].map(|p| p.map(f64::from));
            // y - a.y = rise / run; no product or difference below takes more than 53 bits.
            let (rise, run) = ((f64::from(plane) - a[0]) * (b[1] - a[1]), b[0] - a[0]);
            let above_a = |y: f32| (f64::from(y) - a[1]) * run;
            assert!(
                above_a(found.lower[1]) <= rise && rise <= above_a(found.upper[1]),
                "{a:?} {b:?} {plane}"
            );
            assert!(found.upper[1] <= found.lower[1].next_up().next_up(), "tight: {found:?}");
            inexact += usize::from(found.lower[1] < found.upper[1]);
        }
        assert!(inexact > 1000, "{inexact}");
    }

    #[test]
    fn every_point_of_a_triangle_lies_in_one_of_its_parts() {
        let mut rng = Rng::new(5);
        for case in 0..3000 {
            let scale = [1.0f32, 1e-30, 1e30, 7.3][case % 4];
            let corners: [[f32; 3]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| scale * (rng.unit_f32() - 0.5)));
            let mut boxes = vec![Box3::of_points(&corners)];
            for _ in 0..6 {
                let at = rng.below(boxes.len() as u64) as usize;
                let axis = rng.below(3) as usize;
                let within = boxes.swap_remove(at);
                let share = rng.unit_f32();
                let plane = within.lower[axis] + share * (within.upper[axis] - within.lower[axis]);
                boxes.extend(parts(&corners, &within, axis, plane).into_iter().filter(|b| !b.is_empty()));
            }
            // Points with dyadic weights: in f64 (24 bits of coordinate, 8 of weight) they are exact but for the sums,
            // whose rounding is far below half a place of f32.
            for _ in 0..40 {
                let (i, j) = (rng.below(257), rng.below(257));
                let (i, j) = if i + j > 256 { (256 - i, 256 - j) } else { (i, j) };
                let weights = [256 - i - j, i, j].map(|w| w as f64 / 256.0);
                let point: [f64; 3] =
                    std::array::from_fn(|k| (0..3).map(|c| weights[c] * f64::from(corners[c][k])).sum());
                let slack = 1e-14 * f64::from(scale);
                let holds = |b: &Box3| {
                    (0..3).all(|k| {
                        f64::from(b.lower[k]) - slack <= point[k] && point[k] <= f64::from(b.upper[k]) + slack
                    })
                };
                assert!(boxes.iter().any(holds), "{corners:?}: {point:?} in none of {boxes:?}");
            }
        }
    }
}
