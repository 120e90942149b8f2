//! The line of a ray in world space in exact arithmetic, for the few decisions that f64 leaves
//! open where f32 and [`bth_format::exact::Expansion`] do not hold the numbers: through instances,
//! whose triangles are the images of the object's triangles as real numbers.
//!
//! With the origin o = O/w and the corners p, the weight of a corner is det[d, q-o, r-o] and the
//! volume det[a-o, b-o, c-o], as in [`super::exact`]. All are computed for w·(p-o) = w·p - O, so
//! nothing is divided.

use super::exact::Intersection;
use bth_format::exact::{Dyadic, DyadicVector, dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
use std::cmp::Ordering;

/// Rows of an affine transform that is applied to columns (x, y, z, 1).
pub(crate) type Rows = [[f64; 4]; 3];

/// A line with an exact origin and direction, through an instance.
pub(crate) struct ExactLine {
    /// The origin in world space, times `weight`.
    pub(crate) origin: DyadicVector,
    /// A positive number.
    pub(crate) weight: Dyadic,
    /// In world space.
    pub(crate) direction: DyadicVector,
    /// The transform from the space of the object to world space.
    pub(crate) to_world: Option<Rows>,
}

/// The exact image of a point.
pub(crate) fn image(to_world: Option<&Rows>, point: [f64; 3]) -> DyadicVector {
    let point = dyadic_vector(point);
    let Some(rows) = to_world else { return point };
    rows.map(|[x, y, z, offset]| &dyadic_dot(&dyadic_vector([x, y, z]), &point) + &Dyadic::from(offset))
}

/// The image of the point with weights u and v of a triangle, times the returned weight, which is
/// positive: a + u(b-a) + v(c-a), or (ub + vc)/(u + v) where u + v exceeds 1.
pub(crate) fn image_of_start(
    to_world: Option<&Rows>,
    corners: [[f64; 3]; 3],
    [u, v]: [f64; 2],
) -> (DyadicVector, Dyadic) {
    let [a, b, c] = corners.map(|corner| image(to_world, corner));
    let (u, v, one) = (Dyadic::from(u), Dyadic::from(v), Dyadic::from(1.0));
    let sum = &u + &v;
    let (first, weight) = match (&sum - &one).sign() {
        Ordering::Greater => (Dyadic::from(0.0), sum),
        _ => (&one - &sum, one),
    };
    let point = [0, 1, 2].map(|k| &(&(&first * &a[k]) + &(&u * &b[k])) + &(&v * &c[k]));
    (point, weight)
}

impl ExactLine {
    /// Corners of a triangle of the object in world space, relative to the origin, times `weight`.
    fn relative(&self, corners: [[f64; 3]; 3]) -> [DyadicVector; 3] {
        corners.map(|corner| {
            let at = image(self.to_world.as_ref(), corner).map(|x| &x * &self.weight);
            dyadic_difference(&at, &self.origin)
        })
    }

    /// 1, or -1 where the transform mirrors.
    fn orientation(&self) -> f64 {
        let Some(rows) = &self.to_world else { return 1.0 };
        let [a, b, c] = rows.map(|[x, y, z, _]| dyadic_vector([x, y, z]));
        if dyadic_dot(&dyadic_cross(&a, &b), &c).sign() == Ordering::Less { -1.0 } else { 1.0 }
    }

    /// The intersection with the closed triangle of these corners in the space of the object, with
    /// t, u and v rounded to the nearest f64.
    #[cold]
    #[inline(never)]
    pub(crate) fn intersection(&self, corners: [[f64; 3]; 3]) -> Option<Intersection> {
        let [a, b, c] = self.relative(corners);
        let normals = [dyadic_cross(&b, &c), dyadic_cross(&c, &a), dyadic_cross(&a, &b)];
        let weights = normals.each_ref().map(|normal| dyadic_dot(&self.direction, normal));
        let has = |sign| weights.iter().any(|weight| weight.sign() == sign);
        if has(Ordering::Greater) == has(Ordering::Less) {
            return None; // The line passes outside of the triangle or lies in its plane.
        }
        let [first, second, third] = &weights;
        let determinant = &(first + second) + third;
        let t = dyadic_dot(&a, &normals[0]).ratio(&(&determinant * &self.weight));
        let sign = if determinant.sign() == Ordering::Less { -1.0 } else { 1.0 } * self.orientation();
        let [u, v] = [second, third].map(|weight| weight.ratio(&determinant) * sign);
        Some(Intersection { t, weight: [u, v, sign] })
    }

    /// The exact t at which the line crosses the plane of a triangle; `None` where it is parallel.
    #[cold]
    pub(crate) fn exact_t(&self, corners: [[f64; 3]; 3]) -> Option<ExactT> {
        let [a, b, c] = &self.relative(corners);
        let normal = dyadic_cross(&dyadic_difference(b, a), &dyadic_difference(c, a));
        let determinant = &dyadic_dot(&self.direction, &normal) * &self.weight;
        let volume = dyadic_dot(a, &normal);
        match determinant.sign() {
            Ordering::Equal => None,
            Ordering::Less => Some(ExactT { volume: -&volume, determinant: -&determinant }),
            Ordering::Greater => Some(ExactT { volume, determinant }),
        }
    }

    /// The crossing rule of [`super::crossing`] with the origin moved in world space, for t after
    /// `tmin` and before `tmax`; with `from_start` for t > 0 of the line itself.
    #[cold]
    #[inline(never)]
    pub(crate) fn crossing(&self, corners: [[f64; 3]; 3], [tmin, tmax]: [f64; 2], from_start: bool) -> i32 {
        let [a, b, c] = &self.relative(corners);
        let side = |p: &DyadicVector, q: &DyadicVector| {
            let weight = dyadic_dot(&self.direction, &dyadic_cross(p, q));
            first_sign(&weight, || dyadic_cross(&self.direction, &dyadic_difference(q, p)))
        };
        let passed = side(b, c);
        if passed == 0 || side(c, a) != passed || side(a, b) != passed {
            return 0;
        }
        // Each product of the three relative corners has a factor w³.
        let reversed = dyadic_cross(&dyadic_difference(c, a), &dyadic_difference(b, a));
        let volume = -&dyadic_dot(a, &reversed);
        let determinant = &-&dyadic_dot(&self.direction, &reversed) * &self.weight;
        let position = |s: f64| match s.is_finite() {
            true => {
                let beyond = &volume - &(&Dyadic::from(s) * &determinant);
                passed * first_sign(&beyond, || reversed.clone())
            }
            false => -sign(s),
        };
        let is_after = if from_start { passed * sign_of(&volume) > 0 } else { position(tmin) > 0 };
        if is_after && position(tmax) < 0 { passed * self.orientation() as i32 } else { 0 }
    }
}

/// A t as a quotient; the determinant is positive.
pub(crate) struct ExactT {
    volume: Dyadic,
    determinant: Dyadic,
}

impl ExactT {
    /// This t times a number.
    pub(crate) fn times(self, factor: f64) -> ExactT {
        ExactT { volume: &self.volume * &Dyadic::from(factor), ..self }
    }

    pub(crate) fn cmp(&self, other: &ExactT) -> Ordering {
        (&(&self.volume * &other.determinant) - &(&other.volume * &self.determinant)).sign()
    }
}

/// The line of the segment between two points: its direction is their difference times a positive
/// number.
pub(crate) struct SegmentLine {
    pub(crate) line: ExactLine,
    /// What the end of the segment is multiplied by.
    end_weight: Dyadic,
}

impl SegmentLine {
    /// The line between two points, each times a positive number.
    pub(crate) fn between(
        (from, from_weight): (DyadicVector, Dyadic),
        (to, to_weight): (DyadicVector, Dyadic),
        to_world: Option<Rows>,
    ) -> SegmentLine {
        let direction = [0, 1, 2].map(|k| &(&to[k] * &from_weight) - &(&from[k] * &to_weight));
        let line = ExactLine { origin: from, weight: from_weight, direction, to_world };
        SegmentLine { line, end_weight: to_weight }
    }

    /// u and v where the open segment crosses a closed triangle, if it does.
    #[cold]
    #[inline(never)]
    pub(crate) fn crossed(&self, corners: [[f64; 3]; 3]) -> Option<[f32; 2]> {
        let found = self.line.intersection(corners)?;
        let [a, b, c] = &self.line.relative(corners);
        let normal = dyadic_cross(&dyadic_difference(b, a), &dyadic_difference(c, a));
        // For weights w and z of the ends, the volume has a factor w³ and this determinant w³z: t
        // is the volume times z over the determinant.
        let volume = &dyadic_dot(a, &normal) * &self.end_weight;
        let determinant = dyadic_dot(&self.line.direction, &normal);
        let sign = sign_of(&determinant);
        let inside = sign * sign_of(&volume) > 0 && sign * sign_of(&(&determinant - &volume)) > 0;
        inside.then(|| found.uv())
    }
}

/// The sign of a number; 0 for NaN.
fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

fn sign_of(x: &Dyadic) -> i32 {
    x.sign() as i32
}

/// The sign of a number, or if it is 0 of the first component of its gradient that is not 0.
fn first_sign(x: &Dyadic, gradient: impl Fn() -> DyadicVector) -> i32 {
    match sign_of(x) {
        0 => gradient().iter().map(sign_of).find(|sign| *sign != 0).unwrap_or(0),
        sign => sign,
    }
}
