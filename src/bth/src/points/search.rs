//! The search of a point: the best triangle so far, and the decision between triangles.

use super::Closest;
use crate::intersect::point_triangle::{Feature, locate, squared_distance};
use crate::rays::PrimitiveRef;

/// Slack of the squared radius relative to itself. It covers the rounding of the distance to f32,
/// by which the radius is decided, and the error of squared distances.
const RADIUS_SLACK: f64 = 1.0 / (1 << 20) as f64;

/// The search of the closest triangle to a point.
///
/// Triangles are ordered by their squared distances, which [`squared_distance`] computes from the
/// point and the corners alone, then by their ids. So the result does not depend on the order in
/// which they are offered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    pub(super) point: [f32; 3],
    /// Squared distance of the best triangle; before one is found, an upper bound of squared
    /// distances within the radius.
    pub(super) squared: f64,
    primitive: PrimitiveRef,
    /// The corners in world space.
    corners: [[f32; 3]; 3],
    feature: Feature,
}

impl Search {
    /// A search within a radius. `None` if the point is not finite or the radius is negative or
    /// NaN.
    #[inline(always)]
    pub(super) fn new(point: [f32; 3], radius: f32) -> Option<Search> {
        let finite = point[0].is_finite() && point[1].is_finite() && point[2].is_finite();
        if !(finite && radius >= 0.0) {
            return None;
        }
        let radius = f64::from(radius) + f64::from(f32::from_bits(1));
        Some(Search {
            point,
            squared: radius * radius * (1.0 + RADIUS_SLACK),
            primitive: PrimitiveRef::NONE,
            corners: [[0.0; 3]; 3],
            feature: Feature::Face,
        })
    }

    /// Offers a triangle, given its corners in world space and a function that returns what it is.
    #[inline(always)]
    pub(super) fn offer(&mut self, corners: [[f32; 3]; 3], primitive: impl FnOnce() -> PrimitiveRef) {
        let (squared, feature) = squared_distance(self.point, corners);
        if squared > self.squared {
            return;
        }
        let primitive = primitive();
        let order = |p: PrimitiveRef| (p.instance, p.triangle);
        if squared < self.squared || order(primitive) < order(self.primitive) {
            *self = Search { point: self.point, squared, primitive, corners, feature };
        }
    }

    /// Returns true if the distance of a triangle, rounded to f32 as it is reported, does not
    /// exceed a radius.
    pub(super) fn is_in_ball(&self, corners: [[f32; 3]; 3], radius: f32) -> bool {
        squared_distance(self.point, corners).0.sqrt() as f32 <= radius
    }

    /// Returns true if another point is nearer to this search's point than the best triangle is.
    pub(super) fn is_near(&self, point: &[f32; 3]) -> bool {
        let difference = [0, 1, 2].map(|k| f64::from(point[k]) - f64::from(self.point[k]));
        difference.iter().map(|x| x * x).sum::<f64>() < self.squared
    }

    /// Offers the result of another search.
    pub(super) fn offer_result(&mut self, other: &Search) {
        if other.primitive != PrimitiveRef::NONE {
            self.offer(other.corners, || other.primitive);
        }
    }

    /// The result, unless its distance, rounded to f32 as it is reported, exceeds the radius.
    pub(super) fn answer(&self, radius: f32) -> Option<Closest> {
        let distance = self.squared.sqrt() as f32;
        if self.primitive == PrimitiveRef::NONE || distance > radius {
            return None;
        }
        let closest = locate(self.point, self.corners, self.feature);
        Some(Closest {
            distance,
            point: closest.point,
            u: closest.weight[0],
            v: closest.weight[1],
            primitive: self.primitive,
            feature: closest.feature,
        })
    }
}
