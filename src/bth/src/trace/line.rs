//! The line of a ray, and everything that is decided about triangles relative to it.
//!
//! One place decides whether a triangle is hit and at which t, u, v, whatever structure led
//! there, so that every structure, record and instruction set gives the same bits.
//!
//! Points are projected along the ray by the axis shear of Woop, Benthin and Wald
//! ("Watertight Ray/Triangle Intersection", JCGT 2013), in f64: the line becomes the origin of a
//! plane. A sign that rounding might have got wrong is decided again in exact arithmetic, so
//! hits and misses are exact: a closed triangle is hit if and only if the real line of the
//! ray meets it (rays that lie in its plane miss it).

use crate::expansion::Expansion;
use crate::layout::WIDTH;
use crate::rays::Ray;

/// 8 units of f64 rounding (2^-53 each): bounds the error of a projected coordinate relative
/// to the greatest coordinate of the point seen from the ray's origin; see [`Line::project`].
const PROJECTION_ERROR: f64 = 1.0 / (1u64 << 50) as f64;
/// t, u and v are computed exactly unless f64 gives them to 2^-28, an eighth of the rounding of f32.
const RATIO_ERROR: f64 = 1.0 / (1u64 << 28) as f64;

/// The line of a ray, prepared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) origin: [f64; 3],
    pub(crate) direction: [f64; 3],
    /// The axes of the projection: two in the plane, and the one along which the direction is greatest.
    axis: [usize; 3],
    shear: [f64; 2],
    /// 1 / direction[axis[2]]: turns depths into t.
    inverse_depth: f64,
}

/// A point as seen along the line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Along the greatest axis, from the ray's origin.
    pub(crate) depth: f64,
}

impl Projected {
    fn size(&self) -> f64 {
        self.x.abs() + self.y.abs()
    }
}

/// All vertices of a leaf as seen along the line.
pub(crate) struct ProjectedRows {
    x: [f64; WIDTH],
    y: [f64; WIDTH],
    depth: [f64; WIDTH],
    /// At least the bound within which [`Line::crossing`] takes a weight for uncertain, for any of the triangles.
    bound: f64,
}

impl ProjectedRows {
    #[inline(always)]
    fn point(&self, i: usize) -> Projected {
        Projected { x: self.x[i], y: self.y[i], depth: self.depth[i] }
    }

    /// The corners of a triangle, unless the line certainly passes it by.
    #[inline(always)]
    pub(crate) fn near(&self, corner: [usize; 3]) -> Option<[Projected; 3]> {
        let points = corner.map(|i| self.point(i));
        let [a, b, c] = points.each_ref();
        let weight = [cross(b, c), cross(c, a), cross(a, b)];
        let least = weight[0].min(weight[1]).min(weight[2]);
        let greatest = weight[0].max(weight[1]).max(weight[2]);
        (greatest <= self.bound || least >= -self.bound).then_some(points)
    }
}

/// Where a triangle is hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// In units of the direction. Order hits by this; report it rounded to f32.
    pub(crate) t: f64,
    pub(crate) u: f32,
    pub(crate) v: f32,
}

/// A sign that is known, or that rounding hides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    Negative,
    Uncertain,
    Positive,
}

fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

/// Twice the signed area of the triangle (origin, p, q) in the plane of projection. Antisymmetric
/// in its arguments bit for bit, so two triangles never disagree about their shared edge.
fn cross(p: &Projected, q: &Projected) -> f64 {
    p.x * q.y - p.y * q.x
}

impl Line {
    /// None if the ray has no line: a component that is not finite, or a zero direction.
    pub(crate) fn new(ray: &Ray) -> Option<Line> {
        let (origin, direction) = (wide(ray.origin), wide(ray.direction));
        let finite = origin.iter().chain(&direction).all(|x| x.is_finite());
        let size = direction.map(f64::abs);
        let z = if size[0] > size[1] && size[0] > size[2] {
            0
        } else if size[1] > size[2] {
            1
        } else {
            2
        };
        if !finite || size[z] == 0.0 {
            return None;
        }
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            // Keeps the handedness: faces whose normal points along the ray are counterclockwise.
            std::mem::swap(&mut x, &mut y);
        }
        let depth = direction[z];
        Some(Line {
            origin,
            direction,
            axis: [x, y, z],
            shear: [direction[x] / depth, direction[y] / depth],
            inverse_depth: 1.0 / depth,
        })
    }

    /// Projects a point. With u = 2^-53 and R the greatest |coordinate| of point - origin, the
    /// differences are off by uR, the shear by a factor of 1+u, and |shear| <= 1: x and y are off by
    /// less than 2uR + 4uR + uR < 8uR.
    #[inline(always)]
    pub(crate) fn project(&self, point: [f32; 3]) -> Projected {
        let [x, y, z] = self.axis.map(|k| f64::from(point[k]) - self.origin[k]);
        Projected { x: x - self.shear[0] * z, y: y - self.shear[1] * z, depth: z }
    }

    /// Projects the vertices of a leaf, given as rows of x, y and z: to the same bits as [`Self::project`].
    #[inline(always)]
    pub(crate) fn project_rows(&self, rows: &[[f32; WIDTH]; 3]) -> ProjectedRows {
        let [rx, ry, rz] = self.axis.map(|k| &rows[k]);
        let [ox, oy, oz] = self.axis.map(|k| self.origin[k]);
        let mut out = ProjectedRows { x: [0.0; WIDTH], y: [0.0; WIDTH], depth: [0.0; WIDTH], bound: 0.0 };
        for i in 0..WIDTH {
            let z = f64::from(rz[i]) - oz;
            out.x[i] = (f64::from(rx[i]) - ox) - self.shear[0] * z;
            out.y[i] = (f64::from(ry[i]) - oy) - self.shear[1] * z;
            out.depth[i] = z;
        }
        let (mut size, mut depth) = (0.0, 0.0);
        for i in 0..WIDTH {
            let s = out.x[i].abs() + out.y[i].abs();
            size = if s > size { s } else { size };
            depth = if out.depth[i].abs() > depth { out.depth[i].abs() } else { depth };
        }
        let error = Self::projection_error(size + depth);
        out.bound = 4.0 * error * (3.0 * size + error);
        out
    }

    /// Bound on the error of x and y of [`Self::project`], for points no farther (in the maximum
    /// norm) from the origin than `reach`.
    #[inline(always)]
    pub(crate) fn projection_error(reach: f64) -> f64 {
        PROJECTION_ERROR * reach
    }

    /// Greatest coordinate of any point of a box, seen from the origin.
    pub(crate) fn reach_of_box(&self, lower: [f32; 3], upper: [f32; 3]) -> f64 {
        (0..3).fold(0.0, |reach: f64, k| {
            let (lo, hi) = (f64::from(lower[k]) - self.origin[k], f64::from(upper[k]) - self.origin[k]);
            reach.max(lo.abs()).max(hi.abs())
        })
    }

    /// Side of the line on which the edge p→q passes, given the error of the coordinates.
    /// The products are off by error·(sizes + error) plus their own rounding, below one more of these.
    #[inline(always)]
    pub(crate) fn side(p: &Projected, q: &Projected, error: f64) -> Sign {
        let value = cross(p, q);
        let bound = 2.0 * error * (p.size() + q.size() + error);
        if value > bound {
            Sign::Positive
        } else if value < -bound {
            Sign::Negative
        } else {
            Sign::Uncertain
        }
    }

    /// Greatest and least t at which the line can cross a triangle with these corners.
    #[inline(always)]
    pub(crate) fn t_range(&self, corners: [&Projected; 3]) -> (f64, f64) {
        let t = corners.map(|p| p.depth * self.inverse_depth);
        (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]))
    }

    /// Whether the corners of a triangle that the line crosses for certain go around it clockwise.
    pub(crate) fn turns_clockwise([a, b, c]: [&Projected; 3]) -> bool {
        cross(b, c) + cross(c, a) + cross(a, b) < 0.0
    }

    /// A t before which the line does not cross a triangle that it certainly crosses, with coordinates of this error.
    pub(crate) fn t_before(&self, [a, b, c]: [&Projected; 3], error: f64) -> f64 {
        let weight = [cross(b, c), cross(c, a), cross(a, b)];
        let bound = 4.0 * error * (a.size() + b.size() + c.size() + error);
        let sum = weight[0] + weight[1] + weight[2];
        let depth = (weight[0] * a.depth + weight[1] * b.depth + weight[2] * c.depth) / sum;
        let farthest = a.depth.abs().max(b.depth.abs()).max(c.depth.abs());
        // Errors of the weights shift the depth within the range of depths, those of this sum by less than 2^-48.
        let shift =
            2.0 * farthest * (4.0 * bound / (sum.abs() - 4.0 * bound).max(0.0)) + farthest * RATIO_ERROR;
        depth * self.inverse_depth - shift * self.inverse_depth.abs()
    }

    /// Whether, where and how the line crosses the closed triangle with these corners: the one
    /// decision that every structure uses. `projected` are the projections of `corners`.
    #[inline(always)]
    pub(crate) fn crossing(
        &self,
        corners: impl Fn() -> [[f32; 3]; 3],
        projected: [&Projected; 3],
    ) -> Option<Crossing> {
        let [a, b, c] = projected;
        let weight = [cross(b, c), cross(c, a), cross(a, b)];
        // A coordinate of a point is at most its sheared one plus its depth.
        let reach = [a, b, c].iter().fold(0.0, |r: f64, p| r.max(p.size() + p.depth.abs()));
        let error = Self::projection_error(reach);
        let bound = 4.0 * error * (a.size() + b.size() + c.size() + error);
        if weight.iter().any(|&w| w > bound) && weight.iter().any(|&w| w < -bound) {
            return None;
        }
        self.crossing_near(corners(), projected, weight, bound)
    }

    #[inline(never)]
    fn crossing_near(
        &self,
        corners: [[f32; 3]; 3],
        projected: [&Projected; 3],
        mut weight: [f64; 3],
        bound: f64,
    ) -> Option<Crossing> {
        let corners = corners.map(wide);
        for i in 0..3 {
            if weight[i].abs() <= bound {
                weight[i] = self.exact_weight(corners[(i + 1) % 3], corners[(i + 2) % 3]);
            }
        }
        let positive = weight.iter().any(|&w| w > 0.0);
        let negative = weight.iter().any(|&w| w < 0.0);
        if positive == negative {
            return None; // passes outside, or lies in the plane
        }
        let sum = weight[0] + weight[1] + weight[2];
        let [a, b, c] = projected;
        let depth = (weight[0] * a.depth + weight[1] * b.depth + weight[2] * c.depth) / sum;
        // Errors of the weights shift the depth within the triangle's range of depths.
        let range = a.depth.max(b.depth).max(c.depth) - a.depth.min(b.depth).min(c.depth);
        let tolerance = RATIO_ERROR * sum.abs();
        if bound > tolerance || bound * range > tolerance * depth.abs() {
            return Some(self.exact_crossing(corners));
        }
        Some(Crossing {
            t: depth * self.inverse_depth,
            u: (weight[1] / sum) as f32,
            v: (weight[2] / sum) as f32,
        })
    }

    /// The value of `cross` for the edge p→q, with an exact sign: det[d, p-o, q-o] brought to the
    /// same unit and handedness.
    fn exact_weight(&self, p: [f64; 3], q: [f64; 3]) -> f64 {
        let mut sum = Expansion::new();
        sum.add_edge(self.origin, self.direction, p, q);
        sum.value() * self.inverse_depth.abs()
    }

    /// t, u and v from exact sums.
    fn exact_crossing(&self, corners: [[f64; 3]; 3]) -> Crossing {
        let [a, b, c] = corners;
        let edge = |p, q| {
            let mut sum = Expansion::new();
            sum.add_edge(self.origin, self.direction, p, q);
            sum
        };
        let mut whole = Expansion::new();
        for (p, q) in [(a, b), (b, c), (c, a)] {
            whole.add_edge(self.origin, self.direction, p, q);
        }
        let mut volume = Expansion::new();
        volume.add_volume(self.origin, a, b, c);
        let whole = whole.value();
        Crossing {
            t: volume.value() / whole,
            u: (edge(c, a).value() / whole) as f32,
            v: (edge(a, b).value() / whole) as f32,
        }
    }
}
