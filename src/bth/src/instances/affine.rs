//! Affine transforms in f64, and their inverses for rays.

use crate::rays::Ray;
use crate::simd::LANES;
use bth_format::layout::Node;

/// Transforms whose condition number (in the maximum norm) exceeds this count as singular: the rounding of
/// rays to f32 in object space, 2^-24, would then be as large as the object.
const GREATEST_CONDITION: f64 = (1u64 << 24) as f64;

/// `linear * p + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine {
    /// Rows.
    pub(crate) linear: [[f64; 3]; 3],
    pub(crate) translation: [f64; 3],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Greatest sum of absolute values of a row.
fn norm(rows: &[[f64; 3]; 3]) -> f64 {
    rows.iter().map(|r| r[0].abs() + r[1].abs() + r[2].abs()).fold(0.0, f64::max)
}

impl Affine {
    pub(crate) const IDENTITY: Affine =
        Affine { linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// Scales, then rotates by a quaternion (normalized here), then moves. Not finite when the quaternion has
    /// no length.
    pub(crate) fn from_parts(parts: &[f64; 10]) -> Affine {
        let [t0, t1, t2, x, y, z, w, sx, sy, sz] = *parts;
        // Scaled first, so that squares neither overflow nor underflow.
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

    /// `inner` first, then `self`.
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

    pub(crate) fn is_finite(&self) -> bool {
        self.linear.iter().flatten().chain(&self.translation).all(|x| x.is_finite())
    }

    /// Whether it shrinks everything to a point.
    pub(crate) fn is_zero(&self) -> bool {
        self.linear.iter().flatten().all(|x| *x == 0.0)
    }

    /// Rows of four, applied to columns (x, y, z, 1).
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        [0, 1, 2].map(|k| {
            let [a, b, c] = self.linear[k];
            [a, b, c, self.translation[k]]
        })
    }

    /// The inverse with the condition number of the linear part; `None` for what is not finite or counts as
    /// singular.
    pub(crate) fn inverse(&self) -> Option<(Inverse, f64)> {
        if !self.is_finite() {
            return None;
        }
        // By a power of two near 1, so that no product overflows or underflows.
        let greatest = self.linear.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        let exponent = f64::from_bits(greatest.to_bits() & (0x7ff << 52));
        let scale = 1.0 / exponent;
        if !(exponent > 0.0 && scale.is_finite() && scale > 0.0) {
            return None;
        }
        let [a, b, c] = self.linear.map(|row| row.map(|x| x * scale));
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant = dot(a, cofactors[0]);
        let linear = [0, 1, 2].map(|k| [0, 1, 2].map(|j| cofactors[j][k] / determinant));
        if !linear.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let condition = norm(&[a, b, c]) * norm(&linear);
        let linear = linear.map(|row| row.map(|x| x * scale));
        let inverse = Inverse { linear, origin: self.translation };
        (condition <= GREATEST_CONDITION && norm(&linear).is_finite()).then_some((inverse, condition))
    }

    /// Greatest sum of absolute values of a row of the linear part.
    pub(crate) fn norm(&self) -> f64 {
        norm(&self.linear)
    }
}

/// `linear * (p - origin)`: from the world to an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inverse {
    /// Rows.
    pub(crate) linear: [[f64; 3]; 3],
    /// Where the object's origin stands in the world.
    pub(crate) origin: [f64; 3],
}

/// Directions in object space whose greatest component has an exponent within this of 0 are taken as they are.
const PLAIN_EXPONENTS: i32 = 64;

/// The least number with such an exponent, and the least with a greater one.
const LEAST_PLAIN: f64 = 1.0 / (1u128 << PLAIN_EXPONENTS) as f64;
const MOST_PLAIN: f64 = (1u128 << (PLAIN_EXPONENTS + 1)) as f64;

/// Sixteen rays, a lane each.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayLanes {
    pub(super) origin: [[f32; LANES]; 3],
    pub(super) direction: [[f32; LANES]; 3],
    /// Not 0 for rays whose t in the object is that in the world.
    pub(super) plain: [u32; LANES],
}

impl RayLanes {
    pub(super) const NONE: RayLanes =
        RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], plain: [0; LANES] };
}

/// A ray in an object's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectRay {
    pub(crate) ray: Ray,
    /// t of the world's ray is t here times this, a power of two: 1 unless the direction would leave the
    /// range of f32.
    pub(crate) t_scale: f32,
}

impl Inverse {
    /// Whether an object's space is the world's.
    pub(crate) fn is_identity(&self) -> bool {
        self.linear == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] && self.origin == [0.0; 3]
    }

    /// The ray in object space: the same points at the same t, but for one rounding to f32 of each
    /// component of origin and direction (relative 2^-24). All triangles of the object see the same rounded ray, so
    /// nothing leaks within an object; where objects meet, answers may differ from those of one
    /// object by that rounding.
    pub(crate) fn ray(&self, ray: &Ray) -> ObjectRay {
        let from = [0, 1, 2].map(|k| f64::from(ray.origin[k]) - self.origin[k]);
        let direction = ray.direction.map(f64::from);
        let origin = self.linear.map(|row| dot(row, from) as f32);
        let direction = self.linear.map(|row| dot(row, direction));
        let greatest = direction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let exponent = (greatest.to_bits() >> 52) as i32 - 1023;
        if exponent.abs() <= PLAIN_EXPONENTS {
            let direction = direction.map(|x| x as f32);
            return ObjectRay { ray: Ray { origin, direction, ..*ray }, t_scale: 1.0 };
        }
        // Beyond 100 the scale itself could leave f32; such directions are at the end of what t can tell.
        let exponent = exponent.clamp(-100, 100);
        let up = f64::from_bits(((1023 + exponent) as u64) << 52);
        let direction = direction.map(|x| (x / up) as f32);
        let t = |t: f32| (f64::from(t) * up) as f32;
        let ray = Ray { origin, direction, tmin: t(ray.tmin), tmax: t(ray.tmax) };
        ObjectRay { ray, t_scale: (1.0 / up) as f32 }
    }

    /// As [`Self::ray`], sixteen rays, to the same bits; but lanes that are not `plain` are not what that makes of them.
    #[inline(always)]
    pub(super) fn transform(&self, lanes: &mut RayLanes) {
        let RayLanes { origin, direction, plain } = lanes;
        let Inverse { linear, origin: place } = *self;
        // Without branches, so that it is compiled to vectors.
        for i in 0..LANES {
            let (mut from, mut along) = ([0.0; 3], [0.0; 3]);
            for k in 0..3 {
                from[k] = f64::from(origin[k][i]) - place[k];
                along[k] = f64::from(direction[k][i]);
            }
            let mut greatest = 0.0;
            for k in 0..3 {
                let turned = dot(linear[k], along);
                origin[k][i] = dot(linear[k], from) as f32;
                direction[k][i] = turned as f32;
                greatest = if turned.abs() > greatest { turned.abs() } else { greatest };
            }
            plain[i] = u32::from(greatest >= LEAST_PLAIN) & u32::from(greatest < MOST_PLAIN);
        }
    }

    /// A normal of the object in the world: by the transpose of this; its length has no meaning.
    pub(crate) fn normal(&self, n: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.linear[0][k] * n[0] + self.linear[1][k] * n[1] + self.linear[2][k] * n[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    fn unit(rng: &mut Rng) -> f64 {
        rng.below(1 << 40) as f64 / (1u64 << 39) as f64 - 1.0
    }

    fn random(rng: &mut Rng, scale: f64) -> Affine {
        let mut parts = [0.0; 10];
        parts.iter_mut().for_each(|x| *x = unit(rng));
        let shear = Affine::from_parts(&parts);
        parts.iter_mut().for_each(|x| *x = unit(rng));
        let mut product = shear.times(&Affine::from_parts(&parts));
        product.linear = product.linear.map(|row| row.map(|x| x * scale));
        product
    }

    #[test]
    fn inverses_undo_sheared_and_mirrored_transforms_at_any_scale() {
        let mut rng = Rng::new(1);
        let mut checked = 0;
        for round in 0..2000 {
            let scale = [1.0, 1e-30, 1e30, 1e-5, 1e4][round % 5];
            let affine = random(&mut rng, scale);
            let Some((inverse, condition)) = affine.inverse() else { continue };
            let p = [(); 3].map(|()| unit(&mut rng));
            let world = affine.apply(p);
            let back = inverse.linear.map(|row| dot(row, [0, 1, 2].map(|k| world[k] - inverse.origin[k])));
            // The subtraction loses what the translation took from tiny objects.
            let lost = (1.0 + 2.0 / scale) * condition * f64::EPSILON * 16.0;
            for k in 0..3 {
                assert!((back[k] - p[k]).abs() <= lost, "{p:?} came back as {back:?}, condition {condition}");
            }
            checked += 1;
        }
        assert!(checked > 1900, "{checked}");
    }

    #[test]
    fn singular_and_infinite_transforms_have_no_inverse() {
        let mut flat = Affine::IDENTITY;
        flat.linear[2] = [0.0; 3];
        assert!(flat.inverse().is_none());
        flat.linear[2] = [0.0, 0.0, 2f64.powi(-23)];
        assert!(flat.inverse().is_some());
        flat.linear[2] = [0.0, 0.0, 2f64.powi(-25)];
        assert!(flat.inverse().is_none(), "beyond the greatest condition");
        let mut dependent = Affine::IDENTITY;
        dependent.linear = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
        assert!(dependent.inverse().is_none());
        let mut endless = Affine::IDENTITY;
        endless.translation[1] = f64::INFINITY;
        assert!(endless.inverse().is_none());
        assert!(Affine { linear: [[0.0; 3]; 3], ..Affine::IDENTITY }.inverse().is_none());
    }

    #[test]
    fn rays_keep_their_t_whatever_the_scale() {
        let mut rng = Rng::new(5);
        for round in 0..2000 {
            let scale = [1.0, 1e-25, 1e25, 3.0, 1e-3][round % 5];
            let mut affine = random(&mut rng, scale);
            affine.translation = affine.translation.map(|x| x * scale);
            let Some((inverse, condition)) = affine.inverse() else { continue };
            let point = |rng: &mut Rng| [(); 3].map(|()| (unit(rng) * scale) as f32);
            let ray = Ray { origin: point(&mut rng), tmin: 0.0, direction: point(&mut rng), tmax: 2.0 };
            let found = inverse.ray(&ray);
            assert_eq!(f64::from(found.ray.tmax) * f64::from(found.t_scale), 2.0);
            // The point at t = 2 of both rays, compared in the world.
            let t = 2.0 / f64::from(found.t_scale);
            let object =
                [0, 1, 2].map(|k| f64::from(found.ray.origin[k]) + t * f64::from(found.ray.direction[k]));
            let back = affine.apply(object);
            for k in 0..3 {
                let expected = f64::from(ray.origin[k]) + 2.0 * f64::from(ray.direction[k]);
                // Condition number times the rounding of origin (|p - o| <= 3) and direction (2 |d|).
                let bound = condition * scale * 5.0 * 2f64.powi(-23);
                assert!((back[k] - expected).abs() <= bound, "round {round}: {back:?}, {expected}");
            }
        }
    }

    #[test]
    fn sixteen_rays_at_once_are_the_same_to_the_bit() {
        let mut rng = Rng::new(9);
        let mut plain = 0;
        for round in 0..500 {
            let scale = [1.0, 1e-12, 1e12, 1e25, 1e-25, 3.0][rng.below(6) as usize];
            let Some((inverse, _)) = random(&mut rng, scale).inverse() else { continue };
            let mut lanes = RayLanes::NONE;
            let mut expected = vec![];
            for lane in 0..LANES {
                let mut point = |size: f64| [(); 3].map(|()| (unit(&mut rng) * size) as f32);
                let mut ray = Ray { origin: point(3.0), tmin: 0.5, direction: point(1.0), tmax: 2.0 };
                ray.direction[lane % 3] *= [1.0, 0.0, -0.0, f32::INFINITY, f32::NAN][(round + lane) % 5];
                for k in 0..3 {
                    (lanes.origin[k][lane], lanes.direction[k][lane]) = (ray.origin[k], ray.direction[k]);
                }
                expected.push(inverse.ray(&ray));
            }
            inverse.transform(&mut lanes);
            for (lane, ObjectRay { ray, t_scale }) in expected.into_iter().enumerate() {
                let finite = ray.direction.iter().all(|x| x.is_finite());
                assert!(lanes.plain[lane] == 0 || t_scale == 1.0 && finite, "{ray:?}");
                if lanes.plain[lane] == 0 {
                    continue;
                }
                plain += 1;
                for k in 0..3 {
                    assert_eq!(lanes.origin[k][lane].to_bits(), ray.origin[k].to_bits());
                    assert_eq!(lanes.direction[k][lane].to_bits(), ray.direction[k].to_bits());
                }
            }
        }
        assert!(plain > 2000, "{plain}");
    }

    #[test]
    fn identity_changes_no_ray() {
        let (inverse, condition) = Affine::IDENTITY.inverse().unwrap();
        assert_eq!(condition, 1.0);
        let ray = Ray { origin: [1.5, -2.25, 1e-30], tmin: 0.5, direction: [0.1, -0.0, 3.0], tmax: 7.0 };
        let found = inverse.ray(&ray);
        assert_eq!((found.ray, found.t_scale), (ray, 1.0));
    }
}
