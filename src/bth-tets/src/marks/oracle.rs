//! The slow, obvious oracle of the pair test: the intersection of two triangles, by clipping one
//! against the other in rational arithmetic on small integer coordinates.

use super::triangle_contact::Triangle;

type IntegerVector = [i128; 3];

/// A rational point: `n / w`, `w > 0`, in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct RationalPoint {
    n: IntegerVector,
    w: i128,
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a.abs() } else { gcd(b, a % b) }
}

impl RationalPoint {
    fn new(n: IntegerVector, w: i128) -> Self {
        let d = n.iter().fold(w, |d, &x| gcd(d, x)) * w.signum();
        Self { n: n.map(|x| x / d), w: w / d }
    }
}

fn minus(a: IntegerVector, b: IntegerVector) -> IntegerVector {
    [0, 1, 2].map(|k| a[k] - b[k])
}
fn cross(a: IntegerVector, b: IntegerVector) -> IntegerVector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn dot(a: IntegerVector, b: IntegerVector) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Keeps the part of a convex polygon (or segment, or point) where `normal . (x - origin) >= 0`.
fn clip(polygon: &[RationalPoint], normal: IntegerVector, origin: IntegerVector) -> Vec<RationalPoint> {
    let height = |p: &RationalPoint| dot(normal, p.n) - dot(normal, origin) * p.w;
    let mut kept: Vec<RationalPoint> = Vec::new();
    let mut keep = |p: RationalPoint| {
        if !kept.contains(&p) {
            kept.push(p);
        }
    };
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (hp, hq) = (height(p), height(q));
        if hp >= 0 {
            keep(*p);
        }
        if (hp > 0 && hq < 0) || (hp < 0 && hq > 0) {
            // The heights are scaled by w: the crossing is p/w_p + hp/w_p / (hp/w_p - hq/w_q) (q -
            // p).
            let n = [0, 1, 2].map(|k| hp * q.n[k] - hq * p.n[k]);
            keep(RationalPoint::new(n, hp * q.w - hq * p.w));
        }
    }
    kept
}

/// Corners of the convex hull of the points that two triangles have in common.
fn common_part(a: [IntegerVector; 3], b: [IntegerVector; 3]) -> Vec<RationalPoint> {
    let normal = cross(minus(b[1], b[0]), minus(b[2], b[0]));
    let mut polygon: Vec<RationalPoint> = a.iter().map(|&n| RationalPoint::new(n, 1)).collect();
    polygon = clip(&polygon, normal, b[0]);
    polygon = clip(&polygon, normal.map(|x| -x), b[0]);
    for k in 0..3 {
        polygon = clip(&polygon, cross(normal, minus(b[(k + 1) % 3], b[k])), b[k]);
    }
    polygon
}

/// Returns true if two triangles with small integer coordinates touch beyond the vertices they
/// share.
pub(crate) fn oracle(a: &Triangle, b: &Triangle) -> bool {
    let integer = |t: &Triangle| t.corners.map(|p| p.map(|x| x as i128));
    let shared: Vec<IntegerVector> = (0..3)
        .filter(|&i| b.vertices.contains(&a.vertices[i]))
        .map(|i| a.corners[i].map(|x| x as i128))
        .collect();
    let common = common_part(integer(a), integer(b));
    let allowed = |p: &RationalPoint| match shared[..] {
        [s] => *p == RationalPoint::new(s, 1),
        // The points lie within triangle a, so those that are collinear with the edge lie on it.
        [s, t] => cross(minus(t, s), [0, 1, 2].map(|k| p.n[k] - s[k] * p.w)) == [0; 3],
        _ => false,
    };
    !common.iter().all(allowed)
}
