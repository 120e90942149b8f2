//! Affine transforms in f64, and their inverses for rays.

use crate::intersect::long::{LONG_ERROR, Long, LongVector, long_dot, long_vector};
use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::vector::max_norm;
use crate::rays::Ray;
use crate::simd::LANES;

/// Max condition number, in the maximum norm, of transforms that are not treated as singular.
/// Beyond it f32 would exclude nothing in object space.
const GREATEST_CONDITION: f64 = (1u64 << 24) as f64;
/// 2^-50: the largest residual I - LA that is computed for the inverse L of A, relative to the
/// condition number.
const RESIDUAL: f64 = 1.0 / (1u64 << 50) as f64;
/// Six roundings of half an epsilon; the transform of a vector has four.
const ROUNDINGS: f64 = 3.0 * f64::EPSILON;
/// Bounds the rounding of the computed residual relative to the condition number: each of its
/// products has at most three roundings of half an epsilon.
const RESIDUAL_ROUNDING: f64 = 2.0 * f64::EPSILON;

/// An affine transform: a point p is mapped to `linear * p + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine {
    /// Rows of the linear part.
    pub(crate) linear: [[f64; 3]; 3],
    pub(crate) translation: [f64; 3],
}

#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Maximum norm of a matrix: the max sum of the absolute values of a row.
#[inline(always)]
fn norm(rows: &[[f64; 3]; 3]) -> f64 {
    let mut greatest = 0.0;
    for row in rows {
        let sum = row[0].abs() + row[1].abs() + row[2].abs();
        greatest = if sum > greatest { sum } else { greatest };
    }
    greatest
}

/// Returns true if all elements are finite, without branches.
#[inline(always)]
fn all_finite(rows: &[[f64; 3]; 3]) -> bool {
    let mut finite = true;
    for row in rows {
        finite &= row[0].is_finite() & row[1].is_finite() & row[2].is_finite();
    }
    finite
}

/// The rows, each element multiplied by a factor.
#[inline(always)]
fn scaled(rows: &[[f64; 3]; 3], factor: f64) -> [[f64; 3]; 3] {
    let mut product = *rows;
    for row in &mut product {
        for x in row {
            *x *= factor;
        }
    }
    product
}

/// I - LA.
#[inline(always)]
fn residual(l: &[[f64; 3]; 3], a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut rest = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let unit = if i == j { 1.0 } else { 0.0 };
            rest[i][j] = unit - (l[i][0] * a[0][j] + l[i][1] * a[1][j] + l[i][2] * a[2][j]);
        }
    }
    rest
}

/// The inverse L of A after a step of Newton's method, L + (I - LA)L, for ill-conditioned A.
#[cold]
#[inline(never)]
fn refined(l: [[f64; 3]; 3], a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let rest = residual(&l, a);
    let column = |j: usize| [0, 1, 2].map(|k: usize| l[k][j]);
    [0, 1, 2].map(|i: usize| [0, 1, 2].map(|j: usize| l[i][j] + dot(rest[i], column(j))))
}

impl Affine {
    pub(crate) const IDENTITY: Affine =
        Affine { linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// The transform that scales, then rotates by a quaternion, which is normalized here, then
    /// translates. It is not finite if the quaternion is zero. `parts` are translation, quaternion
    /// (x, y, z, w) and scale.
    pub(crate) fn from_parts(parts: &[f64; 10]) -> Affine {
        let [t0, t1, t2, x, y, z, w, sx, sy, sz] = *parts;
        // The division by the max component keeps squares from overflow and underflow.
        let greatest = [x, y, z, w].iter().fold(0.0f64, |m, c| m.max(c.abs()));
        let [x, y, z, w] = [x, y, z, w].map(|c| c / greatest);
        let length = (x * x + y * y + z * z + w * w).sqrt();
        let [x, y, z, w] = [x, y, z, w].map(|c| c / length);
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Affine { linear: rotation.map(|r| [r[0] * sx, r[1] * sy, r[2] * sz]), translation: [t0, t1, t2] }
    }

    /// The transform with the rows of four of `m`, one after the other.
    #[inline(always)]
    pub(crate) fn from_rows(m: &[f64; 12]) -> Affine {
        let row = |i: usize| [m[4 * i], m[4 * i + 1], m[4 * i + 2]];
        Affine { linear: [row(0), row(1), row(2)], translation: [m[3], m[7], m[11]] }
    }

    /// The product: `inner` is applied first, then `self`.
    pub(crate) fn times(&self, inner: &Affine) -> Affine {
        let column = |k: usize| [0, 1, 2].map(|row| inner.linear[row][k]);
        Affine {
            linear: self.linear.map(|row| [0, 1, 2].map(|k| dot(row, column(k)))),
            translation: self.apply(inner.translation),
        }
    }

    pub(crate) fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| dot(self.linear[k], p) + self.translation[k])
    }

    #[inline(always)]
    pub(crate) fn is_finite(&self) -> bool {
        let [x, y, z] = self.translation;
        all_finite(&self.linear) & x.is_finite() & y.is_finite() & z.is_finite()
    }

    /// Returns true if the linear part is zero.
    pub(crate) fn is_zero(&self) -> bool {
        self.linear.iter().flatten().all(|x| *x == 0.0)
    }

    /// Rows of the matrix that is applied to columns (x, y, z, 1).
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        [0, 1, 2].map(|k| {
            let [a, b, c] = self.linear[k];
            [a, b, c, self.translation[k]]
        })
    }

    /// The inverse, and its accuracy. `None` if the transform is not
    /// finite or treated as singular.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> Option<(Inverse, Accuracy)> {
        if !self.is_finite() {
            return None;
        }
        // Scaling by a power of two brings the max element near 1, so that no product
        // overflows or underflows.
        let mut greatest = 0.0f64;
        for row in &self.linear {
            for x in row {
                greatest = if x.abs() > greatest { x.abs() } else { greatest };
            }
        }
        let exponent = f64::from_bits(greatest.to_bits() & (0x7ff << 52));
        let scale = 1.0 / exponent;
        if !(exponent > 0.0 && scale.is_finite() && scale > 0.0) {
            return None;
        }
        let [a, b, c] = scaled(&self.linear, scale);
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant = dot(a, cofactors[0]);
        let mut linear = [[0.0; 3]; 3];
        for k in 0..3 {
            for j in 0..3 {
                linear[k][j] = cofactors[j][k] / determinant;
            }
        }
        if !all_finite(&linear) {
            return None;
        }
        let condition = norm(&[a, b, c]) * norm(&linear);
        let mut rest = norm(&residual(&linear, &[a, b, c]));
        if rest > RESIDUAL * condition {
            linear = refined(linear, &[a, b, c]);
            rest = norm(&residual(&linear, &[a, b, c]));
            if rest.is_nan() || rest > RESIDUAL * condition {
                return None;
            }
        }
        let line_error = 1.01 * (rest + RESIDUAL_ROUNDING * condition) + ROUNDINGS;
        let linear = scaled(&linear, scale);
        let inverse = Inverse { linear, origin: self.translation };
        let line_error = if inverse.is_identity() { 0.0 } else { line_error };
        let accuracy = Accuracy::new(condition, line_error);
        (condition <= GREATEST_CONDITION && norm(&linear).is_finite()).then_some((inverse, accuracy))
    }

    /// Maximum norm of the linear part.
    #[inline(always)]
    pub(crate) fn norm(&self) -> f64 {
        norm(&self.linear)
    }
}

/// How accurate an inverse is, in four bytes: upper bounds, each the upper half of an f32.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Accuracy {
    condition: u16,
    error: u16,
}

impl Accuracy {
    /// With the bound of the error of a product of the inverse L with a vector, relative to |L| and
    /// the vector.
    fn new(condition: f64, line_error: f64) -> Accuracy {
        /// Beyond this error nothing is known: bounds of the first order would not hold.
        const LARGEST: f64 = 1.0 / 128.0;
        let half = |x: f64| ((x as f32).next_up().to_bits() >> 16) as u16 + 1;
        let error = match condition * line_error {
            0.0 => 0,
            error if error < LARGEST => half(1.02 * error),
            _ => (f32::INFINITY.to_bits() >> 16) as u16,
        };
        Accuracy { condition: half(condition), error }
    }

    /// The condition number κ of the transform A.
    pub(crate) fn condition(self) -> f64 {
        f64::from(f32::from_bits(u32::from(self.condition) << 16))
    }

    /// Bound of the error of a product x of L with a vector, relative to |x|: κ times the error
    /// relative to |L| and the vector, which is Ax. It includes the error of L, and is 0 for the
    /// identity.
    #[inline(always)]
    pub(crate) fn error(self) -> f64 {
        f64::from(f32::from_bits(u32::from(self.error) << 16))
    }
}

/// The inverse transform of an instance: a point p in world space is mapped to `linear * (p -
/// origin)` in object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inverse {
    /// Rows of the linear part.
    pub(crate) linear: [[f64; 3]; 3],
    /// The origin of object space, in world space.
    pub(crate) origin: [f64; 3],
}

/// Max |binary exponent| of a direction's max component in object space with which it is
/// used without scaling.
const MAX_EXPONENT: i32 = 64;

/// The min number with such an exponent.
const LEAST_UNSCALED: f64 = 1.0 / (1u128 << MAX_EXPONENT) as f64;
/// The min number with a greater exponent.
const LEAST_SCALED: f64 = (1u128 << (MAX_EXPONENT + 1)) as f64;
/// Max components of directions with which they are used without scaling.
pub(crate) const UNSCALED: std::ops::Range<f64> = LEAST_UNSCALED..LEAST_SCALED;

/// Sixteen rays, one in each lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayLanes {
    pub(crate) origin: [[f32; LANES]; 3],
    pub(crate) direction: [[f32; LANES]; 3],
    /// Not 0 for rays whose direction is not scaled: their t in object space is t in world space.
    pub(crate) unscaled: [u32; LANES],
}

impl RayLanes {
    pub(crate) const NONE: RayLanes =
        RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], unscaled: [0; LANES] };
}

/// A ray in the space of an object's source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectRay {
    /// Each number rounded to f32.
    pub(crate) ray: Ray,
    pub(crate) line: RoundedLine,
    /// Factor from t in object space to t in world space, a power of two: 1 unless the direction
    /// would leave the range of f32.
    pub(crate) t_scale: f32,
}

impl ObjectRay {
    /// A ray on a line of the object's space; `tmin` and `tmax` are in world space.
    #[inline(always)]
    pub(crate) fn of(line: RoundedLine, tmin: f32, tmax: f32) -> ObjectRay {
        let origin = line.origin.0.map(|x| x as f32);
        let exponent = (max_norm(line.direction).to_bits() >> 52) as i32 - 1023;
        if exponent.abs() <= MAX_EXPONENT {
            let direction = line.direction.map(|x| x as f32);
            return ObjectRay { ray: Ray { origin, direction, tmin, tmax }, line, t_scale: 1.0 };
        }
        ObjectRay::scaled(line, origin, exponent, [tmin, tmax])
    }

    /// Makes the origin in f32 relative to an object's anchor.
    pub(crate) fn set_anchor(&mut self, anchor: [f64; 3]) {
        self.ray.origin = self.line.relative_to(anchor).map(|x| x as f32);
    }

    /// The ray where its direction must be scaled.
    #[cold]
    fn scaled(line: RoundedLine, origin: [f32; 3], exponent: i32, [tmin, tmax]: [f32; 2]) -> ObjectRay {
        // The clamp keeps the scale itself in the range of f32.
        let exponent = exponent.clamp(-100, 100);
        let scale = f64::from_bits(((1023 + exponent) as u64) << 52);
        let line = line.with_direction_times(1.0 / scale);
        let direction = line.direction.map(|x| x as f32);
        let t_scale = (1.0 / scale) as f32;
        let (tmin, tmax) = (-greatest_below(-tmin, scale, t_scale), greatest_below(tmax, scale, t_scale));
        ObjectRay { ray: Ray { origin, direction, tmin, tmax }, line, t_scale }
    }
}

/// The max t in object space that is at most `t` in world space, where it is the product with
/// `t_scale` = 1 / `scale`, a power of two, rounded to f32. Infinity gives the farthest t that is
/// finite in world space. NaN stays NaN.
pub(crate) fn greatest_below(t: f32, scale: f64, t_scale: f32) -> f32 {
    // Products that are denormal are rounded to multiples of twice this; it is lost in the sum with
    // numbers so great that products are exact.
    const HALF_STEP: f64 = 0.5 * f32::from_bits(1) as f64;
    let t = t.clamp(f32::MIN, f32::MAX);
    let exact = (f64::from(t) + HALF_STEP) * scale;
    let below = if exact < f64::from(exact as f32) { (exact as f32).next_down() } else { exact as f32 };
    // Ties are rounded to even numbers.
    if below * t_scale > t { below.next_down() } else { below }
}

impl Inverse {
    /// Returns true if object space is world space.
    pub(crate) fn is_identity(&self) -> bool {
        self.linear == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] && self.origin == [0.0; 3]
    }

    /// Maximum norm of the linear part.
    pub(crate) fn norm(&self) -> f64 {
        norm(&self.linear)
    }

    /// Transforms a line of world space to object space, with the same points at the same t.
    ///
    /// Errors are bounded in the maximum norm ([`Accuracy::error`]).
    #[inline(always)]
    pub(crate) fn line(&self, accuracy: Accuracy, line: &RoundedLine) -> RoundedLine {
        // The direction of a line in world space is exact.
        let RoundedLine { origin: RoundedOrigin(point, off), direction, direction_error } = *line;
        let (mut relative, mut origin, mut of_object) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for k in 0..3 {
            relative[k] = point[k] - self.origin[k];
        }
        for k in 0..3 {
            origin[k] = dot(self.linear[k], relative);
            of_object[k] = dot(self.linear[k], direction);
        }
        let mut origin_error = max_norm(origin) * accuracy.error();
        if off != 0.0 {
            origin_error += 1.01 * norm(&self.linear) * off;
        }
        RoundedLine {
            origin: RoundedOrigin(origin, origin_error),
            direction: of_object,
            direction_error: accuracy.error() + direction_error,
        }
        .or_unknown()
    }

    /// Bound of the error that rounding to f32 has, in object space, for points with coordinates of
    /// at most `in_world` in world space.
    pub(crate) fn rounding_error(&self, in_world: f64) -> f64 {
        /// Half a unit in the last place of f32, relative.
        const ROUNDED: f64 = 1.0 / (1u64 << 24) as f64;
        1.01 * norm(&self.linear) * ROUNDED * in_world
    }

    /// The vector x of object space with Ax = `of`, for the transform A from object space with
    /// these rows, and a bound of its error; `off` bounds the error of `of`.
    ///
    /// A step of refinement: with the residual r of x = L`of`, L r is added. Its error is at most
    /// the error of L times r.
    pub(crate) fn solve(
        &self,
        accuracy: Accuracy,
        rows: &[[f64; 4]; 3],
        (of, off): (LongVector, f64),
    ) -> (LongVector, f64) {
        let linear = rows.map(|[x, y, z, _]| [x, y, z]);
        let rounded = of.map(Long::rounded);
        let x = self.linear.map(|row| dot(row, rounded));
        let rest = [0, 1, 2].map(|k| of[k] - long_dot(long_vector(linear[k]), long_vector(x)));
        let rest = rest.map(Long::rounded);
        let solution = [0, 1, 2].map(|k| Long::from(x[k]) + Long::from(dot(self.linear[k], rest)));
        let of_rest = LONG_ERROR * (norm(&linear) * max_norm(x) + max_norm(rounded)) + off;
        // The low part of the residual, which is not used, is a rounding of f64.
        let relative_error = accuracy.error() + ROUNDINGS;
        (solution, 1.01 * norm(&self.linear) * (relative_error * max_norm(rest) + of_rest))
    }

    /// A point of object space in world space: the solution of the three equations by Cramer's
    /// rule.
    ///
    /// The residual of the solution x bounds its error: |A| (|p - Lx| + 8u|L||x|), and |E| adds
    /// a relative error of [`Accuracy::error`], where |A| ≤ κ / |L|.
    pub(crate) fn point_in_world(&self, accuracy: Accuracy, point: RoundedOrigin) -> RoundedOrigin {
        let condition = accuracy.condition();
        let RoundedOrigin(point, off) = point;
        let [a, b, c] = self.linear;
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant = dot(a, cofactors[0]);
        let x = [0, 1, 2].map(|k| {
            let sum = point[0] * cofactors[0][k] + point[1] * cofactors[1][k] + point[2] * cofactors[2][k];
            sum / determinant
        });
        let rest = max_norm([0, 1, 2].map(|k| point[k] - dot(self.linear[k], x)));
        let error = condition / norm(&self.linear) * (rest + off)
            + 2.0 * (accuracy.error() + ROUNDINGS * condition) * max_norm(x);
        let world = [0, 1, 2].map(|k| self.origin[k] + x[k]);
        RoundedOrigin(world, 1.01 * error + max_norm(world) * ROUNDINGS)
    }

    /// Like [`Self::line`] and [`ObjectRay::of`] for sixteen rays of f32, rounded to f32, with
    /// origins relative to an object's anchor. The results of lanes that are not `unscaled` are not
    /// valid.
    #[inline(always)]
    pub(crate) fn transform(&self, lanes: &mut RayLanes, anchor: [f64; 3]) {
        let RayLanes { origin, direction, unscaled } = lanes;
        let Inverse { linear, origin: object_origin, .. } = *self;
        // There are no branches, so that the loop is vectorized.
        for i in 0..LANES {
            let (mut relative, mut world_direction) = ([0.0; 3], [0.0; 3]);
            for k in 0..3 {
                relative[k] = f64::from(origin[k][i]) - object_origin[k];
                world_direction[k] = f64::from(direction[k][i]);
            }
            let mut greatest = 0.0;
            for k in 0..3 {
                let component = dot(linear[k], world_direction);
                origin[k][i] = (dot(linear[k], relative) - anchor[k]) as f32;
                direction[k][i] = component as f32;
                greatest = if component.abs() > greatest { component.abs() } else { greatest };
            }
            unscaled[i] = u32::from(greatest >= LEAST_UNSCALED) & u32::from(greatest < LEAST_SCALED);
        }
    }

    /// Transforms a normal of the object to world space, by the transpose of this transform. Its
    /// length has no meaning.
    pub(crate) fn normal(&self, n: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.linear[0][k] * n[0] + self.linear[1][k] * n[1] + self.linear[2][k] * n[2])
    }
}
