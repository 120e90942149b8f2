//! Walks the tree: front to back, far children on a stack, done at a hit within the current cell.

use super::{KdNode, KdTree};
use crate::triangle_tests::{Intersection, moller_trumbore};
use bth::rays::{Hit, PrimitiveRef, Ray};

/// A child that is visited later, and the interval of the ray in it.
pub(super) type Postponed = (u32, f32, f32);

impl KdTree {
    /// Nearest hit, or with `ANY` whichever is found first.
    pub(super) fn walk<const ANY: bool>(&self, ray: &Ray, stack: &mut Vec<Postponed>) -> Hit {
        let mut best = Hit { t: ray.tmax, ..Hit::MISS };
        let reciprocal = ray.direction.map(|d| 1.0 / d);
        let Some((mut near, mut far)) = self.clip(ray, &reciprocal) else { return Hit::MISS };
        stack.clear();
        let mut at = 0u32;
        loop {
            match self.nodes[at as usize] {
                KdNode::Inner { axis, split, upper } => {
                    let axis = axis as usize;
                    let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
                    let t = (split - origin) * reciprocal[axis];
                    let lower_first = origin < split || origin == split && direction <= 0.0;
                    let (first, second) = if lower_first { (at + 1, upper) } else { (upper, at + 1) };
                    if t.is_nan() {
                        // The ray lies in the plane.
                        stack.push((second, near, far));
                        at = first;
                    } else if t > far || t <= 0.0 {
                        at = first;
                    } else if t < near {
                        at = second;
                    } else {
                        stack.push((second, t, far));
                        (at, far) = (first, t);
                    }
                    continue;
                }
                KdNode::Leaf { first, count } => {
                    for &triangle in &self.lists[first as usize..(first + count) as usize] {
                        if self.test(ray, triangle, &mut best) && ANY {
                            return best;
                        }
                    }
                }
            }
            match stack.pop() {
                Some((node, start, end)) if start <= best.t => (at, near, far) = (node, start, end),
                // Those below on the stack begin at no smaller t.
                _ => break,
            }
        }
        if best.primitive == PrimitiveRef::NONE { Hit::MISS } else { best }
    }

    /// The part of the ray in the bounds, a little widened (as pbrt does).
    fn clip(&self, ray: &Ray, reciprocal: &[f32; 3]) -> Option<(f32, f32)> {
        let (mut near, mut far) = (ray.tmin, ray.tmax);
        for (k, inverse) in reciprocal.iter().enumerate() {
            if ray.direction[k] == 0.0 {
                if ray.origin[k] < self.lower[k] || ray.origin[k] > self.upper[k] {
                    return None;
                }
                continue;
            }
            let a = (self.lower[k] - ray.origin[k]) * inverse;
            let b = (self.upper[k] - ray.origin[k]) * inverse;
            near = near.max(a.min(b));
            far = far.min(a.max(b) * (1.0 + 4.0 * f32::EPSILON));
        }
        (near <= far).then_some((near, far))
    }

    /// Tests a triangle, and keeps the hit if it is nearer.
    fn test(&self, ray: &Ray, triangle: u32, best: &mut Hit) -> bool {
        let hit = moller_trumbore(ray, self.corners[triangle as usize], best.t);
        if let Some(Intersection { t, u, v }) = hit {
            *best = Hit { t, u, v, primitive: PrimitiveRef { instance: 0, triangle } };
        }
        hit.is_some()
    }

    /// Nearest hit among these triangles.
    #[cfg(test)]
    pub(super) fn nearest_of(&self, ray: &Ray, triangles: &[u32]) -> Hit {
        let mut best = Hit { t: ray.tmax, ..Hit::MISS };
        for &triangle in triangles {
            self.test(ray, triangle, &mut best);
        }
        if best.primitive == PrimitiveRef::NONE { Hit::MISS } else { best }
    }
}
