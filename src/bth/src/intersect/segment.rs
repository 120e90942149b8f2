//! Exact test of triangles that cross the open segment between two points. The points may be starts
//! on triangles.

use super::origin::RoundedOrigin;
use super::start::{ExactStart, START_VOLUME_PARTS};
use super::vector::minus;
use crate::rays::Ray;
use bth_format::exact::{Expansion, VOLUME_PARTS};

/// Parts of a volume of two starts and two points.
const TWO_STARTS_PARTS: usize = 9 * START_VOLUME_PARTS;
/// 2^-46: bounds the error of volumes in f64 relative to the product of the sizes of their edges,
/// with room: 3 roundings of 2^-53 for each of six products of three differences, and their sums.
const ROUNDING: f64 = 1.0 / (1u64 << 46) as f64;

/// An end of a segment.
pub(crate) enum ExactEnd {
    /// A start on a triangle.
    Start(ExactStart),
    /// A point of f32 coordinates.
    Point([f64; 3]),
}

impl ExactEnd {
    /// det[p-E, q-E, r-E] for this end E, exactly, times a positive number.
    fn volume(&self, [p, q, r]: [[f64; 3]; 3]) -> Expansion<START_VOLUME_PARTS> {
        match self {
            ExactEnd::Start(start) => start.volume([p, q, r]),
            ExactEnd::Point(point) => {
                let mut sum = Expansion::<VOLUME_PARTS>::new();
                sum.add_volume(*point, p, q, r);
                let mut same = Expansion::new();
                same.add_sum(&sum);
                same
            }
        }
    }
}

/// The segment between two points, in the space of an object.
pub(crate) struct Segment {
    pub(crate) from: ExactEnd,
    pub(crate) to: ExactEnd,
    /// Both ends in f64.
    pub(crate) rounded: [RoundedOrigin; 2],
}

/// det[p-o, q-o, r-o] in f64, and a bound of its error where each point is off by at most `off`
/// along an axis.
fn volume(o: [f64; 3], [p, q, r]: [[f64; 3]; 3], off: f64) -> (f64, f64) {
    let [p, q, r] = [p, q, r].map(|point| minus(point, o));
    let size = |v: [f64; 3]| v.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let value = p[0] * (q[1] * r[2] - q[2] * r[1])
        + p[1] * (q[2] * r[0] - q[0] * r[2])
        + p[2] * (q[0] * r[1] - q[1] * r[0]);
    let [p, q, r] = [p, q, r].map(size);
    // Six products of three differences. The errors of two points change each difference by at most
    // 2·off.
    let moved = 2.0 * off;
    let change = 6.0 * ((p + moved) * (q + moved) * (r + moved) - p * q * r);
    (value, ROUNDING * p * q * r + change * (1.0 + ROUNDING))
}

impl Segment {
    /// A ray that the segment does not leave by more than `error`, the `origin_error` of
    /// [`for_segments`](bth_format::object::ObjectBounds::for_segments), for t from 0 to 1.
    pub(crate) fn ray(&self, error: f32) -> Ray {
        let [RoundedOrigin(from, _), RoundedOrigin(to, _)] = self.rounded;
        let origin = from.map(|x| x as f32);
        let mut direction = [0, 1, 2].map(|k| (to[k] - f64::from(origin[k])) as f32);
        if direction == [0.0; 3] {
            // A ray needs a direction; one shorter than the error changes nothing.
            direction[0] = error / 4.0;
        }
        Ray { origin, tmin: 0.0, direction, tmax: 1.0 }
    }

    /// u and v where a triangle crosses the open segment, if it does.
    pub(crate) fn crossed(&self, corners: [[f64; 3]; 3]) -> Option<[f32; 2]> {
        let [a, b, c] = corners;
        let [RoundedOrigin(from, from_off), RoundedOrigin(to, to_off)] = self.rounded;
        let off = from_off.max(to_off);
        // On different sides of the plane.
        let sides = [(&self.from, from), (&self.to, to)].map(|(exact, point)| {
            let (value, error) = volume(point, corners, off);
            if value.abs() > error { value } else { exact.volume(corners).value() }
        });
        if !(sides[0] > 0.0 && sides[1] < 0.0 || sides[0] < 0.0 && sides[1] > 0.0) {
            return None;
        }
        // On the same side of all edges.
        let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| {
            let (value, error) = volume(from, [to, p, q], off);
            if value.abs() > error { value } else { self.edge(p, q) }
        });
        let positive = weights.iter().any(|w| *w > 0.0);
        let negative = weights.iter().any(|w| *w < 0.0);
        if positive == negative {
            return None;
        }
        let sum: f64 = weights.iter().sum();
        Some([weights[1] / sum, weights[2] / sum].map(|x| x.clamp(0.0, 1.0) as f32))
    }

    /// det[to-from, p-from, q-from], with the exact sign.
    #[cold]
    #[inline(never)]
    fn edge(&self, p: [f64; 3], q: [f64; 3]) -> f64 {
        match &self.to {
            ExactEnd::Point(to) => self.from.volume([*to, p, q]).value(),
            ExactEnd::Start(to) => {
                let sum: Expansion<TWO_STARTS_PARTS> = to.combined(|to| self.from.volume([to, p, q]));
                sum.value()
            }
        }
    }
}
