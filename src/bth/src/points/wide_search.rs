//! The search of a point for triangles in world space as real numbers: points of f64, and points of
//! f32 among instances.

use super::{Closest, Closest64};
use crate::intersect::point_triangle::Feature;
use crate::intersect::wide_distance::{ExactDistance, Measured, locate, measure};
use crate::intersect::wide_triangle::WideTriangle;
use crate::rays::PrimitiveRef;
use std::cmp::Ordering;

/// A max distance.
#[derive(Clone, Copy, Debug)]
pub(super) enum Radius {
    /// Compared with distances as they are reported in f32.
    Reported(f32),
    /// Compared with exact distances.
    Exact(f64),
}

/// Slack of a radius relative to itself. It covers the rounding of distances to f32.
const RADIUS_SLACK: f64 = 1.0 / (1 << 20) as f64;
/// Bounds the error of a rounded exact distance relative to itself.
const ROUNDED: f64 = 1.0 / (1u64 << 49) as f64;

/// The same for denormal numbers.
const LEAST: f64 = f64::from_bits(16);

impl Radius {
    /// Upper bound of the distances within it. `None` if it is negative or NaN.
    fn limit(self) -> Option<f64> {
        match self {
            Radius::Exact(radius) => (radius >= 0.0).then_some(radius),
            Radius::Reported(radius) => {
                let limit = (f64::from(radius) + f64::from(f32::from_bits(1))) * (1.0 + RADIUS_SLACK);
                (radius >= 0.0).then_some(limit)
            }
        }
    }

    /// Returns true if a triangle lies within it.
    fn contains(
        self,
        point: [f64; 3],
        triangle: &WideTriangle,
        Measured { low, high, .. }: Measured,
    ) -> bool {
        match self {
            Radius::Exact(radius) if high <= radius => true,
            Radius::Exact(radius) => {
                low <= radius && ExactDistance::new(point, triangle).compare_with(radius).is_le()
            }
            Radius::Reported(radius) if (high * (1.0 + ROUNDED)) as f32 <= radius => true,
            Radius::Reported(radius) => {
                (low * (1.0 - ROUNDED)) as f32 <= radius && locate(point, triangle).distance as f32 <= radius
            }
        }
    }
}

/// A search for the closest triangle. Of two triangles the one of the smaller exact distance is
/// closer, or of equal ones the one of the smaller instance and id. So the result does not depend
/// on the order in which they are offered.
#[derive(Clone, Debug)]
pub(super) struct WideSearch {
    pub(super) point: [f64; 3],
    radius: Radius,
    /// Upper bound of the distances of triangles that can still change the result.
    pub(super) limit: f64,
    best: Option<Offered>,
}

#[derive(Clone, Debug)]
struct Offered {
    primitive: PrimitiveRef,
    triangle: WideTriangle,
    measured: Measured,
    exact: Option<Box<ExactDistance>>,
}

impl Offered {
    fn exact(&mut self, point: [f64; 3]) -> &ExactDistance {
        self.exact.get_or_insert_with(|| Box::new(ExactDistance::new(point, &self.triangle)))
    }

    /// Compares its distance with another one.
    fn compare(&mut self, other: &mut Offered, point: [f64; 3]) -> Ordering {
        if self.measured.high < other.measured.low {
            return Ordering::Less;
        }
        if self.measured.low > other.measured.high {
            return Ordering::Greater;
        }
        let is_same_instance = self.primitive.instance == other.primitive.instance;
        if is_same_instance && self.is_same_feature(other) {
            return Ordering::Equal;
        }
        other.exact(point);
        let ordering = self.exact(point).compare(other.exact(point));
        for offered in [self, other] {
            let exact = offered.exact(point);
            let (distance, feature) = (exact.distance(), Some(exact.feature));
            let low = (distance * (1.0 - ROUNDED) - LEAST).max(0.0);
            let high = distance * (1.0 + ROUNDED) + LEAST;
            offered.measured = Measured { low, high, feature };
        }
        ordering
    }

    /// Returns true if the closest points of two triangles of an instance certainly lie on the same
    /// edge or corner.
    fn is_same_feature(&self, other: &Offered) -> bool {
        let corner = |of: &Offered, i: u8| of.triangle.corners[usize::from(i) % 3];
        match (self.measured.feature, other.measured.feature) {
            (Some(Feature::Vertex(i)), Some(Feature::Vertex(j))) => corner(self, i) == corner(other, j),
            (Some(Feature::Edge(i)), Some(Feature::Edge(j))) => {
                let [p, q] = [corner(self, i), corner(self, i + 1)];
                let others = [corner(other, j), corner(other, j + 1)];
                others == [p, q] || others == [q, p]
            }
            _ => false,
        }
    }
}

impl WideSearch {
    /// A search within a radius. `None` if the point is not finite or the radius is negative or
    /// NaN.
    pub(super) fn new(point: [f64; 3], radius: Radius) -> Option<WideSearch> {
        let limit = radius.limit().filter(|_| point.iter().all(|x| x.is_finite()))?;
        Some(WideSearch { point, radius, limit, best: None })
    }

    /// Offers a triangle.
    #[inline(never)]
    pub(super) fn offer(&mut self, triangle: WideTriangle, primitive: PrimitiveRef) {
        let measured = measure(&triangle.relative(self.point));
        if measured.low > self.limit {
            return;
        }
        let mut offered = Offered { primitive, triangle, measured, exact: None };
        if let Some(best) = &mut self.best {
            let order = |p: PrimitiveRef| (p.instance, p.triangle);
            let closer = offered
                .compare(best, self.point)
                .then_with(|| order(offered.primitive).cmp(&order(best.primitive)));
            if closer.is_ge() {
                return;
            }
        }
        self.limit = self.limit.min(offered.measured.high);
        self.best = Some(offered);
    }

    /// Returns true if a triangle lies within the radius.
    #[inline(never)]
    pub(super) fn is_within(&self, triangle: &WideTriangle) -> bool {
        let measured = measure(&triangle.relative(self.point));
        measured.low <= self.limit && self.radius.contains(self.point, triangle, measured)
    }

    /// Returns true if another point is nearer to this search's point than the best triangle is.
    pub(super) fn is_near(&self, point: &[f64; 3]) -> bool {
        let difference = [0, 1, 2].map(|k| point[k] - self.point[k]);
        difference.iter().map(|x| x * x).sum::<f64>() < self.limit * self.limit
    }

    /// Offers the result of another search.
    pub(super) fn offer_result(&mut self, other: &WideSearch) {
        if let Some(best) = &other.best {
            self.offer(best.triangle, best.primitive);
        }
    }

    /// The result, unless its distance exceeds the radius.
    pub(super) fn answer(&self) -> Option<Closest64> {
        let Offered { primitive, triangle, measured, .. } = self.best.as_ref()?;
        if !self.radius.contains(self.point, triangle, *measured) {
            return None;
        }
        let located = locate(self.point, triangle);
        let [u, v] = located.weight;
        let mut point = [0, 1, 2].map(|k| self.point[k] + located.vector[k]);
        if let (Feature::Vertex(i), None) = (located.feature, &triangle.rows) {
            point = triangle.corners[usize::from(i)];
        }
        let (distance, feature, primitive) = (located.distance, located.feature, *primitive);
        Some(Closest64 { distance, point, u, v, primitive, feature })
    }

    /// The result, rounded to f32.
    pub(super) fn narrow_answer(&self) -> Option<Closest> {
        let Closest64 { distance, point, u, v, primitive, feature } = self.answer()?;
        let (distance, point) = (distance as f32, point.map(|x| x as f32));
        Some(Closest { distance, point, u: u as f32, v: v as f32, primitive, feature })
    }
}
