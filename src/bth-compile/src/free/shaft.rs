//! Shafts: all points that rays in the directions of a bin reach from a triangle. Planes prove that another triangle is not met.
//!
//! A plane proves it if the triangle from which rays start lies on its upper side, the other one on its lower side, and every
//! direction of the bin points strictly upwards: then no point p + s d of the shaft with s > 0 is a point of the other triangle, also
//! where both share corners on the plane. By the separation theorem such a plane exists whenever the shaft does not meet the other
//! triangle; tried are the triangle's own plane and those that bound the shaft. The margin of bins makes the directions of a bin point
//! strictly upwards from planes that contain an edge of the bin's cone.

use super::bins::Cone;
use bth_format::exact::side;
use std::cmp::Ordering;

/// A triangle with its corners in f32, as traced, and in f64.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) stored: [[f32; 3]; 3],
    pub(super) at: [[f64; 3]; 3],
    /// Lower and upper end of its box.
    pub(super) bounds: [[f64; 3]; 2],
    /// A sphere that holds the triangle, but for rounding.
    pub(super) center: [f64; 3],
    radius: f64,
}

impl Corners {
    pub(super) fn new(stored: [[f32; 3]; 3]) -> Self {
        let at = stored.map(|p| p.map(f64::from));
        let end = |pick: fn(f64, f64) -> f64| {
            std::array::from_fn(|k| pick(pick(at[0][k], at[1][k]), at[2][k]))
        };
        let center = std::array::from_fn(|k| (at[0][k] + at[1][k] + at[2][k]) / 3.0);
        let square = |p: [f64; 3]| dot(minus(p, center), minus(p, center));
        let radius = at.into_iter().map(square).fold(0.0, f64::max).sqrt();
        Corners { stored, at, bounds: [end(f64::min), end(f64::max)], center, radius }
    }

    /// Lower bound of the distance to another triangle, by the spheres around both.
    pub(super) fn gap(&self, other: &Corners) -> f64 {
        let between = minus(self.center, other.center);
        let rounding = SLACK * (size(self.center) + size(other.center));
        (dot(between, between).sqrt() - self.radius - other.radius) * (1.0 - SLACK) - rounding
    }
}

/// Bound of the relative error of sums of products below: more than twice the about 15 roundings of 2^-53.
const ERROR: f64 = 32.0 / (1u64 << 53) as f64;

/// More than the relative error of a quotient or root, by which bounds are widened.
const SLACK: f64 = 1.0 / (1u64 << 40) as f64;

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
    /// Length of the normal, in whose units heights are.
    length: f64,
    /// Upper bound of one over the length.
    per_length: f64,
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
        // The error of the length is that of heights.
        let length = dot(normal, normal).sqrt();
        let certain = length - 2.0 * slope;
        let per_length = if certain > 0.0 { (1.0 + SLACK) / certain } else { f64::INFINITY };
        Start { corners, edges, normal, slope, length: length + 2.0 * slope, per_length }
    }

    /// On which side of the triangle's plane all directions of a cone lie: 1 for the side of the normal, -1 for the other, 0 if
    /// neither is certain.
    pub(super) fn side(&self, cone: &Cone) -> i32 {
        let mut sum = 0;
        for d in cone.corners {
            let height = dot(self.normal, d);
            sum += i32::from(height > 4.0 * self.slope) - i32::from(-height > 4.0 * self.slope);
        }
        i32::from(sum == 4) - i32::from(sum == -4)
    }

    /// Lower bound of the sine of the angle between the plane and the directions of a cone on one side of it. On the arc between two
    /// directions the sine is concave, so that it is least at a corner.
    pub(super) fn elevation(&self, cone: &Cone) -> f64 {
        let sine = |d: [f64; 3]| (dot(self.normal, d).abs() - 4.0 * self.slope) / dot(d, d).sqrt();
        cone.corners.into_iter().map(sine).fold(f64::INFINITY, f64::min) / self.length * (1.0 - SLACK) - SLACK
    }

    /// Upper bounds of the heights of points of a box above the plane, and of the depths below it; not positive if no point lies on
    /// that side. In units of length.
    #[inline]
    pub(super) fn heights_of_box(&self, bounds: &[[f64; 3]; 2]) -> [f64; 2] {
        let (low, high) = (minus(bounds[0], self.corners.at[0]), minus(bounds[1], self.corners.at[0]));
        let (mut least, mut most) = (0.0, 0.0);
        for k in 0..3 {
            let (a, b) = (self.normal[k] * low[k], self.normal[k] * high[k]);
            least += a.min(b);
            most += a.max(b);
        }
        let error = self.slope * (size(low) + size(high));
        [(most + error) * self.per_length, (error - least) * self.per_length]
    }

    /// As [`Self::heights_of_box`], for the corners of a triangle. The signs are exact.
    pub(super) fn heights_of(&self, other: &Corners) -> [f64; 2] {
        let mut heights = [0.0f64; 2];
        for (stored, at) in other.stored.iter().zip(&other.at) {
            let from = minus(*at, self.corners.at[0]);
            let (height, error) = (dot(self.normal, from), self.slope * size(from));
            let order = if height.abs() > error {
                height.total_cmp(&0.0)
            } else {
                let [a, b, c] = self.corners.stored;
                side(a, b, c, *stored)
            };
            let side = match order {
                Ordering::Greater => 0,
                Ordering::Less => 1,
                Ordering::Equal => continue,
            };
            heights[side] = heights[side].max((height.abs() + error) * self.per_length).max(f64::MIN_POSITIVE);
        }
        heights
    }
}

/// The planes that bound the shaft from a triangle in the directions of a bin, without the triangle's own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shaft {
    planes: [Plane; 7],
    count: usize,
}

impl Shaft {
    /// `side` is [`Start::side`] of the cone and not 0.
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

/// The plane through an edge of the start triangle and an edge of the cone, above which all else of both lies.
fn through_edge(start: &Start, cone: &Cone, side: i32, edge: usize) -> Option<Plane> {
    // The third corner lies above the plane of the edge and a direction d of the cone if its normal is the cross product of d and
    // the edge, for directions on the side of the triangle's normal.
    let e = start.edges[edge].map(|x| -x * f64::from(side));
    let mut touched = 0;
    let mut normal = cross(e, cone.corners[0]);
    for corner in 1..4 {
        if dot(normal, cone.corners[corner]) < 0.0 {
            (touched, normal) = (corner, cross(e, cone.corners[corner]));
        }
    }
    let slope = ERROR * greatest(e);
    let is_above = |corner: usize| {
        corner == touched || dot(normal, cone.corners[corner]) > slope * size(cone.corners[corner])
    };
    let from = minus(start.corners.at[(edge + 2) % 3], start.corners.at[edge]);
    if !(0..4).all(is_above) || dot(normal, from) < slope * size(from) {
        return None;
    }
    let lowest = 1 << edge | 1 << ((edge + 1) % 3);
    Some(Plane { normal, anchor: start.corners.at[edge], slope, floor: 0.0, lowest })
}
