//! Contact of coplanar triangles, decided exactly in a projection onto a coordinate plane.

use super::Point;
use robust::{Coord, orient2d};

/// A coordinate plane onto which the plane of a triangle projects one to one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    axes: [usize; 2],
}

impl Projection {
    /// The first coordinate plane in which the triangle keeps an area, with the sign of that area;
    /// `None` for a triangle of zero area.
    pub(super) fn of(triangle: [Point; 3]) -> Option<(Projection, f64)> {
        [[0, 1], [1, 2], [2, 0]].into_iter().find_map(|axes| {
            let projection = Projection { axes };
            let area = projection.orient(triangle[0], triangle[1], triangle[2]);
            (area != 0.0).then_some((projection, area))
        })
    }

    /// Positive, zero or negative as the projected points turn left, are collinear or turn right.
    #[inline]
    pub(super) fn orient(&self, a: Point, b: Point, c: Point) -> f64 {
        let coord = |p: Point| Coord { x: p[self.axes[0]], y: p[self.axes[1]] };
        orient2d(coord(a), coord(b), coord(c))
    }

    /// Returns true if `p`, collinear with `a` and `b`, lies on the closed segment between them.
    fn between(&self, a: Point, b: Point, p: Point) -> bool {
        self.axes.iter().all(|&k| a[k].min(b[k]) <= p[k] && p[k] <= a[k].max(b[k]))
    }

    /// Returns true if two closed segments have a point in common.
    fn segments_meet(&self, a: Point, b: Point, c: Point, d: Point) -> bool {
        let (oc, od) = (self.orient(a, b, c), self.orient(a, b, d));
        let (oa, ob) = (self.orient(c, d, a), self.orient(c, d, b));
        let straddles = |x: f64, y: f64| (x > 0.0 && y < 0.0) || (x < 0.0 && y > 0.0);
        straddles(oc, od) && straddles(oa, ob)
            || oc == 0.0 && self.between(a, b, c)
            || od == 0.0 && self.between(a, b, d)
            || oa == 0.0 && self.between(c, d, a)
            || ob == 0.0 && self.between(c, d, b)
    }
}

/// Returns true if a closed segment touches a closed triangle of non-zero area that lies in the
/// same plane.
pub(super) fn segment_meets_coplanar_triangle(p: Point, q: Point, triangle: [Point; 3]) -> bool {
    let Some((projection, area)) = Projection::of(triangle) else { return false };
    let edges = [(0, 1), (1, 2), (2, 0)];
    // A segment that crosses no edge has both ends inside or both outside.
    edges.iter().all(|&(i, j)| projection.orient(triangle[i], triangle[j], p) * area.signum() >= 0.0)
        || edges.iter().any(|&(i, j)| projection.segments_meet(p, q, triangle[i], triangle[j]))
}

/// Returns true if two coplanar triangles of non-zero area that share the edge `s`, `t` lie on the
/// same side of it; `a` and `b` are their other corners.
pub(super) fn on_same_side(s: Point, t: Point, a: Point, b: Point) -> bool {
    let Some((projection, area)) = Projection::of([s, t, a]) else { return false };
    let other = projection.orient(s, t, b);
    (area > 0.0 && other > 0.0) || (area < 0.0 && other < 0.0)
}
