//! Whether, where and how lines cross closed triangles: the one decision that every structure uses.
//!
//! Points are projected along the ray ([`super::line`]) and the origin's weights in the projected triangle are its
//! barycentric coordinates. f64 decides; where its error bound leaves a sign, or a digit, open, exact sums
//! decide ([`crate::expansion`]).

use super::line::{Line, PROJECTION_ERROR};
use super::query::reported;
use crate::expansion::{EDGE, Expansion, VOLUME};

/// t, u and v are computed exactly unless f64 gives them to 2^-28, an eighth of the rounding of f32.
pub(crate) const RATIO_ERROR: f64 = 1.0 / (1u64 << 28) as f64;

/// Where a triangle is hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// In units of the direction. Order hits by this; report it rounded to f32.
    pub(crate) t: f64,
    /// u, v and 1 as multiples of the same.
    pub(crate) weight: [f64; 3],
}

impl Crossing {
    /// Barycentric weights of the triangle's second and third vertex, as they are reported.
    pub(crate) fn uv(&self) -> [f32; 2] {
        let [u, v, whole] = self.weight;
        let share = 1.0 / whole;
        [reported(u * share), reported(v * share)]
    }
}

/// What f64 makes of a line and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Estimate {
    /// The line passes the triangle.
    Missed,
    /// It crosses, at t, u and v good to [`RATIO_ERROR`].
    Crossed(Crossing),
    /// Rounding hides the answer: weights, the bound of their error, and between which t the line crosses, if it does.
    Open([f64; 3], f64, [f64; 2]),
}

/// The least and the greatest. Compared in the way that vector instructions do; nothing is NaN here.
#[inline(always)]
fn ends([a, b, c]: [f64; 3]) -> (f64, f64) {
    let least = if a < b { a } else { b };
    let greatest = if a > b { a } else { b };
    (if c < least { c } else { least }, if c > greatest { c } else { greatest })
}

/// What f64 makes of a line and a triangle, before anything is decided from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighed {
    pub(crate) weight: [f64; 3],
    /// Of the error of each weight.
    pub(crate) bound: f64,
    /// The greatest difference of the corners' depths.
    pub(crate) range: f64,
    pub(crate) depth: f64,
    pub(crate) inverse_depth: f64,
    /// 1 / the sum of the weights.
    pub(crate) share: f64,
    pub(crate) t: f64,
}

/// Weighs a triangle. Coordinates are along the axes of the line's projection: two in its plane, and the
/// one along the line. No operation is fused and none is conditional, so the bits are the same on every machine,
/// one triangle at a time or many.
#[inline(always)]
pub(crate) fn weigh(origin: [f64; 3], direction: [f64; 3], corner: [[f64; 3]; 3]) -> Weighed {
    let inverse_depth = 1.0 / direction[2];
    let shear = [direction[0] * inverse_depth, direction[1] * inverse_depth];
    let (mut x, mut y, mut z) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for c in 0..3 {
        z[c] = corner[c][2] - origin[2];
        x[c] = (corner[c][0] - origin[0]) - shear[0] * z[c];
        y[c] = (corner[c][1] - origin[1]) - shear[1] * z[c];
    }
    // Antisymmetric bit for bit, so two triangles never disagree about their shared edge.
    let weight = [x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]];
    let size = [x[0].abs() + y[0].abs(), x[1].abs() + y[1].abs(), x[2].abs() + y[2].abs()];
    // A coordinate of a point is at most its sheared one plus its depth.
    let (_, reach) = ends([size[0] + z[0].abs(), size[1] + z[1].abs(), size[2] + z[2].abs()]);
    let error = PROJECTION_ERROR * reach;
    let bound = 4.0 * error * (size[0] + size[1] + size[2] + error);
    let sum = weight[0] + weight[1] + weight[2];
    let share = 1.0 / sum;
    let depth = (weight[0] * z[0] + weight[1] * z[1] + weight[2] * z[2]) * share;
    let (shallow, deep) = ends(z);
    Weighed { weight, bound, range: deep - shallow, depth, inverse_depth, share, t: depth * inverse_depth }
}

/// What is certain of a line and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    /// Of the weights.
    pub(crate) sum: f64,
    /// The line passes within.
    inside: bool,
    /// It does, and t, u and v are good to [`RATIO_ERROR`].
    pub(crate) crossed: bool,
    pub(crate) missed: bool,
}

impl Weighed {
    /// What is certain. Without branches.
    #[inline(always)]
    pub(crate) fn verdict(&self) -> Verdict {
        let (weight, bound) = (self.weight, self.bound);
        let (least, greatest) = ends(weight);
        let sum = weight[0] + weight[1] + weight[2];
        // Errors of the weights shift the depth within the triangle's range of depths.
        let tolerance = RATIO_ERROR * sum.abs();
        let inside = (least > bound) | (greatest < -bound);
        let good = (bound <= tolerance) & (bound * self.range <= tolerance * self.depth.abs());
        Verdict { sum, inside, crossed: inside & good, missed: (least < -bound) & (greatest > bound) }
    }

    /// Decides, or leaves it open.
    #[inline(always)]
    pub(crate) fn judge(&self) -> Estimate {
        let Verdict { sum, inside, crossed, missed } = self.verdict();
        let weight = self.weight;
        if missed {
            return Estimate::Missed;
        }
        if crossed {
            return Estimate::Crossed(Crossing { t: self.t, weight: [weight[1], weight[2], sum] });
        }
        let t = if inside { self.t_range(sum.abs()) } else { [f64::NEG_INFINITY, f64::INFINITY] };
        Estimate::Open(weight, self.bound, t)
    }

    /// Between which t the line crosses a triangle whose weights have certain signs. Three weights that are off by e move
    /// the depth by at most 3e·range/(|sum| - 3e); roundings move it by less than 2^-48 of the greatest depth.
    #[inline(never)]
    fn t_range(&self, sum: f64) -> [f64; 2] {
        const ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;
        if sum <= 12.0 * self.bound {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let shift = 4.0 * self.bound * self.range / sum + (self.depth.abs() + self.range) * ROUNDING;
        let (t, u) = ((self.depth - shift) * self.inverse_depth, (self.depth + shift) * self.inverse_depth);
        [t.min(u), t.max(u)]
    }
}

/// Decides in f64, or leaves it open; coordinates as for [`weigh`].
#[inline(always)]
pub(crate) fn estimate(origin: [f64; 3], direction: [f64; 3], corner: [[f64; 3]; 3]) -> Estimate {
    weigh(origin, direction, corner).judge()
}

fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

impl Line {
    /// Whether, where and how the line crosses the closed triangle with these corners.
    pub(crate) fn crossing(&self, corners: [[f32; 3]; 3]) -> Option<Crossing> {
        let along = |p: [f64; 3]| self.axis.map(|k| p[k]);
        let corner = corners.map(|p| along(wide(p)));
        match estimate(along(self.origin), along(self.direction), corner) {
            Estimate::Missed => None,
            Estimate::Crossed(crossing) => Some(crossing),
            Estimate::Open(weight, bound, _) => self.close_crossing(corners, weight, bound),
        }
    }

    /// A crossing that f64 leaves open.
    #[cold]
    #[inline(never)]
    fn close_crossing(&self, corners: [[f32; 3]; 3], mut weight: [f64; 3], bound: f64) -> Option<Crossing> {
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
        Some(self.exact_crossing(corners))
    }

    /// The weight of the edge p→q, with an exact sign: det[d, p-o, q-o] brought to the same unit and
    /// handedness.
    fn exact_weight(&self, p: [f64; 3], q: [f64; 3]) -> f64 {
        let mut sum = Expansion::<EDGE>::new();
        sum.add_edge(self.origin, self.direction, p, q);
        sum.value() * self.inverse_depth.abs()
    }

    /// t, u and v from exact sums.
    fn exact_crossing(&self, corners: [[f64; 3]; 3]) -> Crossing {
        let [a, b, c] = corners;
        let edge = |p, q| {
            let mut sum = Expansion::<EDGE>::new();
            sum.add_edge(self.origin, self.direction, p, q);
            sum
        };
        let (second, third) = (edge(c, a), edge(a, b));
        let mut whole = Expansion::<{ 3 * EDGE }>::new();
        whole.add_edge(self.origin, self.direction, b, c);
        whole.add_sum(&second);
        whole.add_sum(&third);
        let mut volume = Expansion::<VOLUME>::new();
        volume.add_volume(self.origin, a, b, c);
        let whole = whole.value();
        Crossing { t: volume.value() / whole, weight: [second.value(), third.value(), whole] }
    }
}
