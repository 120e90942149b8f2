//! Affine transforms in f64, and their inverses for rays.

use crate::intersect::start_point::StartPoint;
use crate::rays::Ray;
use crate::simd::LANES;
use bth_format::layout::Node;

/// Max condition number, in the maximum norm, of transforms that are not treated as singular.
/// Beyond it the rounding of rays to f32 in object space, 2^-24, would be as large as the object.
const GREATEST_CONDITION: f64 = (1u64 << 24) as f64;

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

    /// The transform of a node with a matrix.
    pub(crate) fn of_matrix(node: &Node) -> Affine {
        let t = &node.transform;
        let row = |i: usize| [t[4 * i], t[4 * i + 1], t[4 * i + 2]];
        Affine { linear: [row(0), row(1), row(2)], translation: [t[3], t[7], t[11]] }
    }

    /// The transform with the rows of four of `m`, one after the other.
    #[inline(always)]
    pub(crate) fn from_f32(m: &[f32; 12]) -> Affine {
        let mut affine = Affine::IDENTITY;
        for i in 0..3 {
            for j in 0..3 {
                affine.linear[i][j] = f64::from(m[4 * i + j]);
            }
            affine.translation[i] = f64::from(m[4 * i + 3]);
        }
        affine
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

    /// The inverse, and the condition number of the linear part. `None` if the transform is not
    /// finite or treated as singular.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> Option<(Inverse, f64)> {
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
        let linear = scaled(&linear, scale);
        let inverse = Inverse { linear, origin: self.translation };
        (condition <= GREATEST_CONDITION && norm(&linear).is_finite()).then_some((inverse, condition))
    }

    /// Maximum norm of the linear part.
    #[inline(always)]
    pub(crate) fn norm(&self) -> f64 {
        norm(&self.linear)
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

/// A ray in an object's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectRay {
    pub(crate) ray: Ray,
    /// Factor from t in object space to t in world space, a power of two: 1 unless the direction
    /// would leave the range of f32.
    pub(crate) t_scale: f32,
}

impl ObjectRay {
    /// The ray with the ends of the range of `world`, the same ray in world space, as they are: for
    /// t that are compared with them exactly. The range of [`Self::ray`] reaches to all t that are
    /// rounded to its ends in world space.
    pub(crate) fn with_exact_range(&self, world: &Ray) -> Ray {
        let end = |t: f32| (f64::from(t) / f64::from(self.t_scale)) as f32;
        Ray { tmin: end(world.tmin), tmax: end(world.tmax), ..self.ray }
    }
}

/// The max t in object space that is at most `t` in world space, where it is the product with
/// `t_scale` = 1 / `scale`, a power of two, rounded to f32. Infinity gives the farthest t that is
/// finite in world space. NaN stays NaN.
pub(super) fn greatest_below(t: f32, scale: f64, t_scale: f32) -> f32 {
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

    /// Transforms a ray to object space, with the same points at the same t except for one rounding
    /// to f32 of each component of origin and direction (relative 2^-24). All triangles of an
    /// object are tested with the same rounded ray, so there are no leaks within an object. Where
    /// two objects touch, answers may differ by that rounding from those for one joined object.
    pub(crate) fn ray(&self, ray: &Ray) -> ObjectRay {
        let relative = [0, 1, 2].map(|k| f64::from(ray.origin[k]) - self.origin[k]);
        let direction = ray.direction.map(f64::from);
        let origin = self.linear.map(|row| dot(row, relative) as f32);
        let direction = self.linear.map(|row| dot(row, direction));
        let greatest = direction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let exponent = (greatest.to_bits() >> 52) as i32 - 1023;
        if exponent.abs() <= MAX_EXPONENT {
            let direction = direction.map(|x| x as f32);
            return ObjectRay { ray: Ray { origin, direction, ..*ray }, t_scale: 1.0 };
        }
        // The clamp keeps the scale itself in the range of f32.
        let exponent = exponent.clamp(-100, 100);
        let scale = f64::from_bits(((1023 + exponent) as u64) << 52);
        let direction = direction.map(|x| (x / scale) as f32);
        let t_scale = (1.0 / scale) as f32;
        let (tmin, tmax) =
            (-greatest_below(-ray.tmin, scale, t_scale), greatest_below(ray.tmax, scale, t_scale));
        ObjectRay { ray: Ray { origin, direction, tmin, tmax }, t_scale }
    }

    /// A point of object space in world space, with rounding errors of f64: the solution of the
    /// three equations by Cramer's rule.
    pub(crate) fn point_in_world(&self, point: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.linear;
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant = dot(a, cofactors[0]);
        [0, 1, 2].map(|k| {
            let sum = point[0] * cofactors[0][k] + point[1] * cofactors[1][k] + point[2] * cofactors[2][k];
            self.origin[k] + sum / determinant
        })
    }

    /// Like [`Self::ray`], for a ray that may start on a triangle of the object: then its origin is
    /// that start, rounded.
    #[inline(always)]
    pub(crate) fn ray_from(&self, ray: &Ray, start: Option<&StartPoint>) -> ObjectRay {
        let mut of_object = self.ray(ray);
        if let Some(start) = start {
            of_object.ray.origin = start.rounded();
        }
        of_object
    }

    /// Like [`Self::ray`] for sixteen rays, with the same bits. The results of lanes that are not
    /// `unscaled` are not valid.
    #[inline(always)]
    pub(crate) fn transform(&self, lanes: &mut RayLanes) {
        let RayLanes { origin, direction, unscaled } = lanes;
        let Inverse { linear, origin: object_origin } = *self;
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
                origin[k][i] = dot(linear[k], relative) as f32;
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
