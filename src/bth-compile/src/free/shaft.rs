//! Shafts: all points that rays in the directions of a bin reach from a triangle. Planes prove that another triangle is not met.
//!
//! A plane proves it if the triangle from which rays start lies on its upper side, the other one on its lower side, and every
//! direction of the bin points strictly upwards: then no point p + s d of the shaft with s > 0 is a point of the other triangle, also
//! where both share corners on the plane. By the separation theorem such a plane exists whenever the shaft does not meet the other
//! triangle; tried are the triangle's own plane and those that bound the shaft. The margin of bins makes the directions of a bin point
//! strictly upwards from planes that contain an edge of the bin's cone.

use super::frame::Cone;
use bth_format::exact::side as exact_side;
use std::cmp::Ordering;

/// A triangle with its corners in f32, as traced, and in f64.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) stored: [[f32; 3]; 3],
    pub(super) at: [[f64; 3]; 3],
}

impl Corners {
    pub(super) fn new(stored: [[f32; 3]; 3]) -> Self {
        let at = stored.map(|p| p.map(f64::from));
        Corners { stored, at }
    }
}

/// Bound of the relative error of sums of products below: more than twice the about 15 roundings of 2^-53.
const ERROR: f64 = 32.0 / (1u64 << 53) as f64;

#[inline]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
fn size(a: [f64; 3]) -> f64 {
    a[0].abs() + a[1].abs() + a[2].abs()
}

#[inline]
fn greatest(a: [f64; 3]) -> f64 {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// The triangle from which rays start, with its own plane.
pub(super) struct Start {
    pub(super) corners: Corners,
    /// Edges k from corner k to the next.
    edges: [[f64; 3]; 3],
    normal: [f64; 3],
    /// Error of the height of a point for each unit of its distance from corner 0, as the sum of components.
    slope: f64,
}

/// A plane that holds a start triangle on its upper side, and whose upper side all directions of a bin point to.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: [f64; 3],
    /// A corner of the start triangle. Heights are those above the plane through it.
    anchor: [f64; 3],
    /// Error of the height of a point for each unit of its distance from the anchor, as the sum of components.
    slope: f64,
    /// Lower bound of the heights of the start triangle, at most 0.
    floor: f64,
    /// Corners of the start triangle, by bits, that are certainly the lowest: points equal to one are not above the triangle.
    lowest: u8,
}

impl Start {
    pub(super) fn new(stored: [[f32; 3]; 3]) -> Self {
        let corners = Corners::new(stored);
        let [a, b, c] = corners.at;
        let edges = [minus(b, a), minus(c, b), minus(a, c)];
        let normal = cross(edges[0], minus(c, a));
        let slope = ERROR * greatest(edges[0]) * greatest(minus(c, a));
        Start { corners, edges, normal, slope }
    }

    /// The normal of another triangle's plane, towards the side on which this triangle lies, with a bound of its error; `None` if it
    /// lies on both. A ray that leaves this triangle away from that plane does not meet the other one beyond its start.
    pub(super) fn plane_of(&self, other: &Corners) -> Option<([f64; 3], f64)> {
        let [a, b, c] = other.stored;
        let mut sides = [false; 2];
        for corner in self.corners.stored {
            match exact_side(a, b, c, corner) {
                Ordering::Greater => sides[0] = true,
                Ordering::Less => sides[1] = true,
                Ordering::Equal => {}
            }
        }
        let (first, second) = (minus(other.at[1], other.at[0]), minus(other.at[2], other.at[0]));
        let (normal, error) = (cross(first, second), ERROR * size(first) * size(second));
        match sides {
            [true, false] => Some((normal, error)),
            [false, true] => Some((normal.map(|x| -x), error)),
            _ => None,
        }
    }

    /// Whether the plane has a point of another triangle on a side: 1 for that of the normal, -1 for the other. Exact.
    pub(super) fn is_below(&self, other: &Corners, side: i32) -> bool {
        let wanted = if side > 0 { Ordering::Greater } else { Ordering::Less };
        other.stored.iter().zip(&other.at).any(|(stored, at)| {
            let from = minus(*at, self.corners.at[0]);
            let (height, error) = (dot(self.normal, from), self.slope * size(from));
            if height.abs() > error {
                return height.total_cmp(&0.0) == wanted;
            }
            let [a, b, c] = self.corners.stored;
            exact_side(a, b, c, *stored) == wanted
        })
    }
}

/// The planes that bound the shaft from a triangle in the directions of a bin, without the triangle's own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shaft {
    planes: [Plane; 7],
    count: usize,
}

impl Shaft {
    /// `side` is 1 for a cone on the side of the normal, -1 on the other.
    pub(super) fn new(start: &Start, cone: &Cone, side: i32) -> Self {
        let none = Plane { normal: [0.0; 3], anchor: [0.0; 3], slope: 0.0, floor: 0.0, lowest: 0 };
        let mut shaft = Shaft { planes: [none; 7], count: 0 };
        for normal in cone.inward {
            shaft.push(along_face(start, normal));
        }
        for edge in 0..3 {
            if let Some(plane) = through_edge(start, cone, side, edge) {
                shaft.push(plane);
            }
        }
        shaft
    }

    fn push(&mut self, plane: Plane) {
        self.planes[self.count] = plane;
        self.count += 1;
    }

    /// Whether one of the planes proves that the shaft does not meet a triangle.
    pub(super) fn certainly_misses(&self, start: &Start, other: &Corners) -> bool {
        // Corners of the other triangle that are corners of the start triangle, by bits.
        let mut shared = [0u8; 3];
        for (q, shared) in shared.iter_mut().enumerate() {
            for k in 0..3 {
                *shared |= u8::from(other.stored[q] == start.corners.stored[k]) << k;
            }
        }
        self.planes[..self.count].iter().any(|plane| {
            (0..3).all(|q| {
                if shared[q] != 0 {
                    return shared[q] & plane.lowest != 0;
                }
                let from = minus(other.at[q], plane.anchor);
                dot(plane.normal, from) + plane.slope * size(from) <= plane.floor
            })
        })
    }
}

/// The plane along a face of the cone, through the lowest corner of the start triangle. The normal is exact.
fn along_face(start: &Start, normal: [f64; 3]) -> Plane {
    let slope = ERROR * greatest(normal);
    let mut anchor = 0;
    for k in 1..3 {
        if dot(normal, minus(start.corners.at[k], start.corners.at[anchor])) < 0.0 {
            anchor = k;
        }
    }
    let at = start.corners.at[anchor];
    let mut floor = 0.0f64;
    for k in (0..3).filter(|k| *k != anchor) {
        let from = minus(start.corners.at[k], at);
        floor = floor.min(dot(normal, from) - slope * size(from));
    }
    let lowest = if floor < 0.0 { 0 } else { 1 << anchor };
    Plane { normal, anchor: at, slope, floor, lowest }
}

/// The plane through an edge of the start triangle and an edge of the cone, above which all else of both lies. Edges of the cone may
/// lie in the plane, and below it by rounding: directions of the bin are farther inside the cone than that.
fn through_edge(start: &Start, cone: &Cone, side: i32, edge: usize) -> Option<Plane> {
    // The third corner lies above the plane of the edge and a direction d of the cone if its normal is the cross product of d and
    // the edge, for directions on the side of the triangle's normal.
    let e = start.edges[edge].map(|x| -x * f64::from(side));
    let mut normal = cross(e, cone.corners[0]);
    for corner in &cone.corners[1..] {
        if dot(normal, *corner) < 0.0 {
            normal = cross(e, *corner);
        }
    }
    let slope = ERROR * greatest(e);
    let is_above = |corner: &[f64; 3]| dot(normal, *corner) >= -slope * size(*corner);
    let from = minus(start.corners.at[(edge + 2) % 3], start.corners.at[edge]);
    if !cone.corners.iter().all(is_above) || dot(normal, from) < slope * size(from) {
        return None;
    }
    let lowest = 1 << edge | 1 << ((edge + 1) % 3);
    Some(Plane { normal, anchor: start.corners.at[edge], slope, floor: 0.0, lowest })
}
