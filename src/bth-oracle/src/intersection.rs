//! The exact intersection of a line and a triangle.

use crate::number::{Coordinate, Number, Point, determinant, dot, exact, sub};
use num_rational::BigRational;
use num_traits::ToPrimitive;

/// Rows of a matrix from object to world space.
pub type Rows = [[f64; 4]; 3];

/// The matrix of objects that nothing moves.
pub(crate) const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Bounds the error of a determinant in f64 relative to the size of its products.
const ROUNDING: f64 = 1e-13;
/// Bounds what underflow adds to the error of a determinant, relative to the direction: three units
/// of 2^-1074 in each product.
const UNDERFLOW: f64 = 1e-320;
/// A magnitude for the underflow of coordinates: 2^52 times three units of 2^-1074, or more.
const SMALL: f64 = 1e-300;

/// The point at which a line hits a triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Intersection {
    /// Parameter of the point along the ray: origin + t * direction.
    pub t: BigRational,
    /// Barycentric weight of the second corner.
    pub u: BigRational,
    /// Barycentric weight of the third corner.
    pub v: BigRational,
}

/// Where a line hits a closed triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineHit {
    /// Nowhere.
    Missed,
    /// The line lies in the plane of the triangle, or the triangle has no area.
    InPlane,
    /// At one point.
    At(Intersection),
}

impl LineHit {
    /// The point, if there is one.
    pub fn at(self) -> Option<Intersection> {
        match self {
            LineHit::At(at) => Some(at),
            LineHit::Missed | LineHit::InPlane => None,
        }
    }
}

/// A quotient rounded to the nearest f64.
pub fn to_f64(t: &BigRational) -> f64 {
    t.to_f64().expect("every quotient is rounded to a number or an infinity")
}

/// A triangle in world space: the images of its corners under a matrix, as real numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed<'a> {
    corners: [[f64; 3]; 3],
    to_world: &'a Rows,
}

impl<'a> Placed<'a> {
    pub(crate) fn new<T: Coordinate>(corners: [[T; 3]; 3], to_world: &'a Rows) -> Placed<'a> {
        Placed { corners: corners.map(|p| p.map(Into::into)), to_world }
    }

    /// The corners.
    pub(crate) fn exact(&self) -> [Point; 3] {
        let rows = self.to_world.map(|row| row.map(Number::from));
        self.corners.map(exact).map(|p| {
            [0, 1, 2].map(|k| {
                let [a, b, c, moved] = &rows[k];
                &dot(&[a.clone(), b.clone(), c.clone()], &p) + moved
            })
        })
    }

    /// The corners relative to a point, rounded, and a `magnitude` for [`certainly_missed`].
    fn rounded(&self, point: [f64; 3]) -> ([[f64; 3]; 3], f64) {
        let mut magnitude: f64 = 0.0;
        let corners = self.corners.map(|p| {
            [0, 1, 2].map(|k| {
                let [a, b, c, moved] = self.to_world[k];
                let terms = [a * p[0], b * p[1], c * p[2], moved, -point[k]];
                // Five terms with one rounding each and four sums: below 8 roundings of the sum of
                // their magnitudes.
                magnitude = magnitude.max(8.0 * terms.iter().map(|x| x.abs()).sum::<f64>() + SMALL);
                terms.iter().sum()
            })
        });
        (corners, magnitude)
    }
}

/// The line through `point / scale` along `direction`.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) point: Point,
    pub(crate) scale: Number,
    pub(crate) direction: Point,
    /// The point, rounded, and the direction.
    rounded: [[f64; 3]; 2],
}

impl Line {
    /// The line through a point of floating-point numbers.
    pub(crate) fn through(point: [f64; 3], direction: [f64; 3]) -> Line {
        let rounded = [point, direction];
        Line { point: exact(point), scale: Number::from(1.0), direction: exact(direction), rounded }
    }

    pub(crate) fn new((point, scale): (Point, Number), direction: [f64; 3]) -> Line {
        let near = [0, 1, 2].map(|k| to_f64(&point[k].over(&scale)));
        Line { point, scale, direction: exact(direction), rounded: [near, direction] }
    }

    /// Corners relative to the point, all times `scale`.
    pub(crate) fn relative(&self, corners: &[Point; 3]) -> [Point; 3] {
        [0, 1, 2].map(|i| sub(&corners[i].each_ref().map(|x| x * &self.scale), &self.point))
    }

    pub(crate) fn certainly_misses(&self, triangle: &Placed<'_>) -> bool {
        let [point, direction] = self.rounded;
        let (corners, magnitude) = triangle.rounded(point);
        certainly_missed(direction, corners, magnitude)
    }

    /// Where the line hits a triangle.
    pub(crate) fn hit(&self, triangle: &Placed<'_>) -> LineHit {
        match self.certainly_misses(triangle) {
            true => LineHit::Missed,
            false => hit(&self.relative(&triangle.exact()), &self.direction, &self.scale),
        }
    }
}

/// Where the line through 0 along `d` hits the triangle of `corners / scale`.
pub(crate) fn hit([a, b, c]: &[Point; 3], d: &Point, scale: &Number) -> LineHit {
    let sides = [determinant(d, b, c), determinant(d, c, a), determinant(d, a, b)];
    match (sides.iter().any(Number::is_positive), sides.iter().any(Number::is_negative)) {
        (true, true) => return LineHit::Missed,
        (false, false) => return LineHit::InPlane,
        _ => {}
    }
    let [w, u, v] = sides;
    let whole = &(&w + &u) + &v;
    LineHit::At(Intersection {
        t: determinant(a, b, c).over(&(&whole * scale)),
        u: u.over(&whole),
        v: v.over(&whole),
    })
}

/// Returns true if a line certainly misses a triangle. The corners are relative to the origin of
/// the line; each coordinate has an error of at most 2^-52 times the sum of `magnitude` and itself.
fn certainly_missed(direction: [f64; 3], corners: [[f64; 3]; 3], magnitude: f64) -> bool {
    let (mut positive, mut negative) = (false, false);
    let underflow = UNDERFLOW * (1.0 + direction.iter().map(|x| x.abs()).sum::<f64>());
    for (p, q) in [(0, 1), (1, 2), (2, 0)] {
        let (mut value, mut size) = (0.0, 0.0);
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            let (x, y) = (corners[p][j] * corners[q][k], corners[p][k] * corners[q][j]);
            let reach = |c: usize, axis: usize| corners[c][axis].abs() + magnitude;
            value += direction[i] * (x - y);
            size += direction[i].abs() * (reach(p, j) * reach(q, k) + reach(p, k) * reach(q, j));
        }
        let bound = ROUNDING * size + underflow;
        positive |= value > bound;
        negative |= value < -bound;
    }
    positive && negative
}

/// Returns where the whole line through `origin` along `direction`, which is not zero, hits a
/// triangle. All coordinates must be finite.
pub fn line_hit<T: Coordinate>(origin: [T; 3], direction: [T; 3], corners: [[T; 3]; 3]) -> LineHit {
    Line::through(origin.map(Into::into), direction.map(Into::into)).hit(&Placed::new(corners, &IDENTITY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::BigInt;
    use proptest::prelude::*;

    /// Numbers of every size that an f64 times 2^`down` has.
    fn number() -> impl Strategy<Value = f64> {
        let finite = |x: &f64| x.is_finite();
        prop_oneof![
            (-3i32..4).prop_map(f64::from),
            -1.0f64..1.0,
            any::<u32>().prop_map(|x| f64::from(f32::from_bits(x))).prop_filter("finite", finite),
            any::<u64>().prop_map(f64::from_bits).prop_filter("finite", finite),
            Just(f64::MAX),
            Just(f64::from_bits(1)),
            Just(-0.0),
        ]
    }

    fn points() -> impl Strategy<Value = [[f64; 3]; 3]> {
        prop::array::uniform3(prop::array::uniform3(number()))
    }

    #[test]
    fn a_step_of_f64_decides_at_large_coordinates() {
        let far = [5.5e6, 4.2e5, 300.0];
        let at = |x: f64, y: f64, z: f64| [far[0] + x, far[1] + y, far[2] + z];
        let corners = [at(0.0, 0.0, 0.0), at(4.0, 0.0, 0.0), at(0.0, 4.0, 0.0)];
        let (step, down) = (2f64.powi(-30), [0.0, 0.0, -1.0]);
        let found =
            line_hit(at(0.0, 1.0, 8.0), down, corners).at().expect("the edge belongs to the triangle");
        assert_eq!((to_f64(&found.t), to_f64(&found.v)), (8.0, 0.25));
        assert_eq!(line_hit(at(-step, 1.0, 8.0), down, corners), LineHit::Missed);
        assert_eq!(line_hit(at(0.0, 1.0, 0.0), [1.0, 0.0, 0.0], corners), LineHit::InPlane);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]
        /// The filter never skips a triangle that the line hits.
        #[test]
        fn the_filter_changes_no_intersection(
            [origin, direction, moved] in points(),
            corners in points(),
            linear in points(),
            is_placed in any::<bool>(),
        ) {
            let rows = [0, 1, 2].map(|k| [linear[k][0], linear[k][1], linear[k][2], moved[k]]);
            let placed = Placed::new(corners, if is_placed { &rows } else { &IDENTITY });
            prop_assume!(direction != [0.0; 3]);
            let line = Line::through(origin, direction);
            prop_assert_eq!(line.hit(&placed).at(), hit(&line.relative(&placed.exact()), &line.direction, &line.scale).at());
        }

        /// A ray aimed at a point of a triangle from outside its plane hits it with the t, u and v
        /// of that point.
        #[test]
        fn a_point_of_a_triangle_is_hit_there(
            corners in prop::array::uniform3(prop::array::uniform3(-50i32..50)),
            weights in (0i32..9).prop_flat_map(|a| (Just(a), 0..9 - a)),
            origin in prop::array::uniform3(-50i32..50),
        ) {
            let (a, b) = weights;
            let c = 8 - a - b;
            let f = |p: [i32; 3]| p.map(|x| 8.0 * x as f32);
            let target = [0, 1, 2].map(|k| (a * corners[0][k] + b * corners[1][k] + c * corners[2][k]) as f32);
            let (origin, scaled) = (f(origin), corners.map(f));
            let direction = [0, 1, 2].map(|k| (target[k] - origin[k]) / 4.0);
            prop_assume!(direction != [0.0; 3]);
            if let Some(found) = line_hit(origin, direction, scaled).at() {
                let eighth = |n: i32| BigRational::new(n.into(), BigInt::from(8));
                prop_assert_eq!(found, Intersection { t: eighth(32), u: eighth(b), v: eighth(c) });
            } else {
                // There is no intersection only when the line lies in the plane or the triangle has
                // no area.
                let [x, y, z] = scaled.map(|q| sub(&exact(q), &exact(origin)));
                prop_assert!(determinant(&x, &y, &z).is_zero());
            }
        }
    }
}
