//! Distance of a point to a closed triangle, and the feature of the triangle on which the closest
//! point lies.
//!
//! The closest point lies in the interior of the triangle if and only if the projection of the
//! point to the triangle's plane does; else it lies on an edge, in its interior or at its ends (the
//! Voronoi regions of Ericson, "Real-Time Collision Detection", 5.1.5). The squared distance is
//! computed in f64. Where cancellation could cost more than [`ACCURACY`] of it, as for points that
//! nearly touch the triangle and for needles, and where the side of an edge is uncertain, the terms
//! that cancel are computed as exact sums ([`super::point_exact`]).
//!
//! The distance to an edge is a function of the point and the edge alone, so triangles that share
//! an edge or a vertex have distances of the same bits where the closest point lies on it.
//!
//! **Errors.** Let u = 2^-53. Differences of two coordinates have a relative error of u. For
//! vectors q and e of such differences with largest |components| |q| and |e|, each component of q ×
//! e has an error below 8.1 u |q||e| (two products, each with three relative errors of u, and one
//! subtraction of at most 2|q||e|). With one more product by a vector r the error of (q × e)·r is
//! below 50 u |q||e||r|, and the error of (q × e)·(r × s) is below 150 u |q||e||r||s|.
//!
//! The range of f64 holds all these products of f32 coordinates, whose exponents lie between -149
//! and 128.

use super::point_exact::{ExactTriangle, exact_edge_cross};
use super::vector::{cross, dot, max_norm};
use std::cmp::Ordering;

/// Bound of the relative error of computed squared distances.
pub(crate) const ACCURACY: f64 = 1.0 / (1 << 27) as f64;
/// Factor by which a rounded term must exceed the bound of its error, so that the relative error of
/// a squared distance that is computed from two of them stays below [`ACCURACY`]: 2 · (√3 + 1) /
/// 2^30.
const CERTAIN: f64 = (1 << 30) as f64;
/// 16 u: bounds the error of a component of q × e relative to |q||e|.
const CROSS_ERROR: f64 = 1.0 / (1u64 << 49) as f64;
/// 64 u: bounds the error of (q × e)·r relative to |q||e||r|.
const VOLUME_ERROR: f64 = 1.0 / (1u64 << 47) as f64;
/// 512 u: bounds the error of (q × e)·(r × s) relative to |q||e||r||s|.
const WEIGHT_ERROR: f64 = 1.0 / (1u64 << 44) as f64;

/// A part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// The interior.
    Face,
    /// The interior of the edge from this corner, 0 to 2, to the next.
    Edge(u8),
    /// A corner, 0 to 2.
    Vertex(u8),
}

impl Feature {
    /// A number for each feature: 0 for the face, 1 to 3 for the edges, 4 to 6 for the corners.
    pub fn code(self) -> u32 {
        match self {
            Feature::Face => 0,
            Feature::Edge(i) => 1 + u32::from(i),
            Feature::Vertex(i) => 4 + u32::from(i),
        }
    }
}

/// The closest point of a triangle, in the space of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClosestPoint {
    pub(crate) point: [f32; 3],
    /// Barycentric weights of the second and of the third corner.
    pub(crate) weight: [f32; 2],
    pub(crate) feature: Feature,
}

/// A triangle relative to a point, in f64.
struct Relative {
    /// The corners minus the point.
    corner: [[f64; 3]; 3],
    /// The edge from each corner to the next.
    edge: [[f64; 3]; 3],
}

fn difference(a: [f32; 3], b: [f32; 3]) -> [f64; 3] {
    let mut out = [0.0; 3];
    for k in 0..3 {
        out[k] = f64::from(a[k]) - f64::from(b[k]);
    }
    out
}

/// The squared distance of a point to a closed triangle, with a relative error of at most
/// [`ACCURACY`], and the feature on which the closest point lies. All coordinates are finite. A
/// triangle without area is the edge or the point that its corners span.
#[inline(never)]
pub(crate) fn squared_distance(point: [f32; 3], corners: [[f32; 3]; 3]) -> (f64, Feature) {
    let [a, b, c] = corners;
    let relative = Relative {
        corner: [difference(a, point), difference(b, point), difference(c, point)],
        edge: [difference(b, a), difference(c, b), difference(a, c)],
    };
    let normal = cross(relative.edge[2], relative.edge[0]);
    let size = max_norm(relative.edge[0]) * max_norm(relative.edge[2]);
    let [outside, inside] = relative.sides(normal, size);
    if inside {
        return (relative.plane(normal, size, point, corners), Feature::Face);
    }
    let boundary = relative.boundary(point, corners);
    if outside || boundary.0 == 0.0 {
        return boundary;
    }
    // The projection lies close to the boundary or the triangle is a needle. If the plane is not
    // nearer than the boundary, the boundary is close enough in any case.
    let plane = relative.plane(normal, size, point, corners);
    if boundary.0 <= plane * (1.0 + ACCURACY / 8.0) || !ExactTriangle::new(corners).projects_inside(point) {
        return boundary;
    }
    (plane, Feature::Face)
}

impl Relative {
    /// Returns true if the projection of the point to the triangle's plane certainly lies outside
    /// of the triangle or on its boundary, and whether it certainly lies inside. `size` is the
    /// product of the largest |components| of the edges that span the normal.
    #[inline(always)]
    fn sides(&self, normal: [f64; 3], size: f64) -> [bool; 2] {
        let [a, b, c] = self.corner;
        let far = [max_norm(a), max_norm(b), max_norm(c)];
        let (mut outside, mut inside) = (false, true);
        for (p, q, i, j) in [(b, c, 1, 2), (c, a, 2, 0), (a, b, 0, 1)] {
            let weight = dot(normal, cross(p, q));
            let bound = WEIGHT_ERROR * size * far[i] * far[j];
            outside |= weight <= -bound;
            inside &= weight > bound;
        }
        [outside, inside]
    }

    /// Squared distance of the point to the plane; 0 for a triangle without area.
    #[inline(always)]
    fn plane(&self, mut normal: [f64; 3], size: f64, point: [f32; 3], corners: [[f32; 3]; 3]) -> f64 {
        if max_norm(normal) < CERTAIN * CROSS_ERROR * size {
            normal = ExactTriangle::new(corners).normal();
        }
        let [a, b, c] = self.corner;
        let far = [max_norm(a), max_norm(b), max_norm(c)];
        let nearest = if far[0] <= far[1] && far[0] <= far[2] {
            0
        } else if far[1] <= far[2] {
            1
        } else {
            2
        };
        let mut volume = dot(normal, self.corner[nearest]);
        if volume.abs() < CERTAIN * VOLUME_ERROR * size * far[nearest] {
            volume = super::point_exact::volume(point, corners);
        }
        if volume == 0.0 {
            return 0.0;
        }
        let squared_length = dot(normal, normal);
        volume * volume / squared_length
    }

    /// Squared distance of the point to the nearest of the edges, and the feature.
    #[inline(always)]
    fn boundary(&self, point: [f32; 3], corners: [[f32; 3]; 3]) -> (f64, Feature) {
        let [a, b, c] = self.corner;
        let squared = [dot(a, a), dot(b, b), dot(c, c)];
        let mut best = (squared[0], Feature::Vertex(0));
        for i in 1..3 {
            if squared[i] < best.0 {
                best = (squared[i], Feature::Vertex(i as u8));
            }
        }
        for i in 0..3 {
            let j = (i + 1) % 3;
            let (p, q, edge) = (self.corner[i], self.corner[j], self.edge[i]);
            // Both are positive where the foot of the perpendicular from the point lies within the
            // edge. Their errors matter only where the foot is so close to a corner that the
            // distance to that corner is as good.
            let (from_p, from_q) = (-dot(edge, p), dot(edge, q));
            if from_p > 0.0 && from_q > 0.0 {
                let distance = line(p, q, edge, from_p.partial_cmp(&from_q))
                    .unwrap_or_else(|| exact_edge_cross(point, corners[i], corners[j]) / dot(edge, edge));
                if distance < best.0 {
                    best = (distance, Feature::Edge(i as u8));
                }
            }
        }
        best
    }
}

/// Squared distance of the origin to the line through p and q. `nearer` compares their distances.
/// `None` where cancellation costs more than [`ACCURACY`]. The same bits for both directions of the
/// edge.
#[inline(always)]
fn line(p: [f64; 3], q: [f64; 3], edge: [f64; 3], nearer: Option<Ordering>) -> Option<f64> {
    let area = match nearer {
        Some(Ordering::Less) => squared_area(p, edge)?,
        Some(Ordering::Greater) => squared_area(q, edge)?,
        _ => squared_area(p, edge)?.min(squared_area(q, edge)?),
    };
    Some(area / dot(edge, edge))
}

/// The squared length of p × edge. `None` where cancellation costs more than [`ACCURACY`].
#[inline(always)]
fn squared_area(p: [f64; 3], edge: [f64; 3]) -> Option<f64> {
    let area = cross(p, edge);
    (max_norm(area) >= CERTAIN * CROSS_ERROR * max_norm(p) * max_norm(edge)).then_some(dot(area, area))
}

/// The closest point of a triangle, given the feature on which it lies.
pub(crate) fn locate(point: [f32; 3], corners: [[f32; 3]; 3], feature: Feature) -> ClosestPoint {
    let weights = match feature {
        Feature::Vertex(i) => {
            let i = usize::from(i);
            let weight = [0, 1, 2].map(|k| if k == i { 1.0 } else { 0.0 });
            return ClosestPoint { point: corners[i], weight: [weight[1], weight[2]], feature };
        }
        Feature::Edge(i) => {
            let i = usize::from(i);
            let j = (i + 1) % 3;
            let edge = difference(corners[j], corners[i]);
            let (from, to) =
                (dot(edge, difference(point, corners[i])), dot(edge, difference(corners[j], point)));
            let t = (from / (from + to)).clamp(0.0, 1.0);
            let mut weight = [0.0; 3];
            (weight[i], weight[j]) = (1.0 - t, t);
            weight
        }
        Feature::Face => face_weights(point, corners),
    };
    let mut closest = [0.0; 3];
    for k in 0..3 {
        let [a, b, c] = corners.map(|p| f64::from(p[k]));
        let x = a + (weights[1] * (b - a) + weights[2] * (c - a));
        closest[k] = x.clamp(a.min(b).min(c), a.max(b).max(c)) as f32;
    }
    ClosestPoint { point: closest, weight: [weights[1] as f32, weights[2] as f32], feature }
}

/// Barycentric weights of the projection of a point to the plane of a triangle, limited to the
/// triangle.
fn face_weights(point: [f32; 3], corners: [[f32; 3]; 3]) -> [f64; 3] {
    let [ab, ac] = [difference(corners[1], corners[0]), difference(corners[2], corners[0])];
    let mut normal = cross(ab, ac);
    if max_norm(normal) < CERTAIN * CROSS_ERROR * max_norm(ab) * max_norm(ac) {
        normal = ExactTriangle::new(corners).normal();
    }
    let squared = dot(normal, normal);
    let relative = corners.map(|p| difference(p, point));
    let height = dot(normal, relative[0]) / squared;
    // The corners relative to the projection: their components along the normal would only add
    // rounding errors.
    let flat = relative.map(|p| [0, 1, 2].map(|k| p[k] - normal[k] * height));
    let weight = |i: usize| (dot(normal, cross(flat[(i + 1) % 3], flat[(i + 2) % 3])) / squared).max(0.0);
    let weights = [weight(0), weight(1), weight(2)];
    let sum = weights[0] + weights[1] + weights[2];
    if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0, 0.0, 0.0] }
}
