//! The arithmetic of [`super::exact`] in vectors of four f64, for one pair of a ray and a triangle:
//! its three vector products are one operation, and so are its four scalar products.

use crate::intersect::exact::{INVERSE_RATIO_ERROR, RoundedIntersection, WEIGHT_ERROR};
use crate::intersect::origin::{Origin, RoundedLine, RoundedOrigin};
use crate::simd::Doubles;

/// A coordinate.
pub(crate) trait QuadNumber: Copy {
    /// Four of them.
    fn load<D: Doubles>(s: D, numbers: [Self; 4]) -> D::V;
    fn wide(self) -> f64;
}

impl QuadNumber for f32 {
    #[inline(always)]
    fn load<D: Doubles>(s: D, numbers: [f32; 4]) -> D::V {
        s.widen(numbers)
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        self.into()
    }
}

impl QuadNumber for f64 {
    #[inline(always)]
    fn load<D: Doubles>(s: D, numbers: [f64; 4]) -> D::V {
        s.load(numbers)
    }
    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

/// The origin of a ray.
pub(crate) trait QuadOrigin<N>: Copy {
    /// Repeats a coordinate of a corner in four lanes, except that the third lane gets the
    /// coordinate of the origin along the same axis.
    fn with_corner<D: Doubles>(self, s: D, corner: N, axis: usize) -> D::V;
    /// Like [`Origin::enlarge`].
    fn enlarge(self, error: [f64; 2], edge: f64, distance: f64) -> [f64; 2];
}

impl QuadOrigin<f32> for [f32; 3] {
    #[inline(always)]
    fn with_corner<D: Doubles>(self, s: D, a: f32, axis: usize) -> D::V {
        s.widen([a, a, self[axis], a])
    }
    #[inline(always)]
    fn enlarge(self, error: [f64; 2], _edge: f64, _distance: f64) -> [f64; 2] {
        error
    }
}

/// Origins in f64.
macro_rules! wide_origin {
    ($($origin:ty)*) => { $(
        impl<N: QuadNumber> QuadOrigin<N> for $origin {
            #[inline(always)]
            fn with_corner<D: Doubles>(self, s: D, a: N, axis: usize) -> D::V {
                s.load([a.wide(), a.wide(), self.point()[axis], a.wide()])
            }
            #[inline(always)]
            fn enlarge(self, error: [f64; 2], edge: f64, distance: f64) -> [f64; 2] {
                Origin::enlarge(self, error, edge, distance)
            }
        }
    )* };
}

wide_origin!(RoundedOrigin RoundedLine);

/// Like [`RoundedIntersection::new`] with the terms of an origin and a triangle, with the same
/// bits.
#[inline(always)]
pub(crate) fn rounded_intersection<D: Doubles, N: QuadNumber>(
    s: D,
    (origin, direction): (impl QuadOrigin<N>, [impl QuadNumber; 3]),
    [a, b, c]: [[N; 3]; 3],
    norm: impl QuadNumber,
) -> RoundedIntersection {
    // By axis, four factors of vector products: the edges to b and c, the offset of a from the
    // origin, and the first edge again.
    // Closures might be compiled without the instruction set of the kernel.
    let mut left = [s.widen([0.0; 4]); 3];
    for k in 0..3 {
        left[k] = s.sub(N::load(s, [b[k], c[k], a[k], b[k]]), origin.with_corner(s, a[k], k));
    }
    // The other factors, so that the products are `normal`, `second`, `third` and `normal` again.
    let right = [s.rotate(left[0]), s.rotate(left[1]), s.rotate(left[2])];
    // Scalar products with the direction, and the last with the offset.
    let mut terms = [left[0]; 3];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let product = s.sub(s.mul(left[i], right[j]), s.mul(left[j], right[i]));
        terms[k] = s.mul(product, s.with_last(QuadNumber::load(s, [direction[k]; 4]), left[k]));
    }
    let [x, y, z] = terms;
    let sum = s.add(s.add(x, y), z);
    let greatest = s.max(s.max(sum, s.add(s.add(y, z), x)), s.add(s.add(z, x), y));
    let ([_, second, third, _], [determinant, _, _, volume]) = (s.array(sum), s.array(greatest));
    let [edge_b, edge_c, distance, _] = s.array(s.max(s.max(s.abs(left[0]), s.abs(left[1])), s.abs(left[2])));
    let edge = if edge_b > edge_c { edge_b } else { edge_c };
    let error = [WEIGHT_ERROR * (edge * (edge + distance)), WEIGHT_ERROR * (distance * (edge * edge))];
    let error = origin.enlarge(error, edge, distance);
    let inverse = 1.0 / determinant;
    RoundedIntersection {
        weight: [second, third, determinant],
        inverse,
        t: volume * inverse,
        is_accurate: (INVERSE_RATIO_ERROR * error[1] < volume.abs())
            & (INVERSE_RATIO_ERROR * error[0] * norm.wide() < determinant.abs()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::OriginTerms;
    use crate::intersect::vector::{max_norm, wide};
    use crate::simd::{Isa, Kernel, Simd};
    use bth_random::Rng;

    /// The numbers of an intersection on an instruction set, as bits.
    struct OnIsa([f32; 3], [f32; 3], [[f32; 3]; 3], f32);

    impl Kernel for OnIsa {
        type Output = [u64; 6];
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let OnIsa(origin, direction, corners, norm) = self;
            let found = bits(&rounded_intersection(s.doubles(), (origin, direction), corners, norm));
            let line = RoundedLine {
                origin: RoundedOrigin(wide(origin), 0.0),
                direction: wide(direction),
                direction_error: 0.0,
            };
            let (direction, norm) = (line.direction, max_norm(line.direction));
            assert_eq!(bits(&rounded_intersection(s.doubles(), (line, direction), corners, norm)), found);
            let corners = corners.map(wide);
            assert_eq!(bits(&rounded_intersection(s.doubles(), (line, direction), corners, norm)), found);
            found
        }
    }

    /// Sign and payload of NaN are unspecified.
    fn bits(found: &RoundedIntersection) -> [u64; 6] {
        let [second, third, determinant] = found.weight;
        let numbers =
            [second, third, determinant, found.inverse, found.t, f64::from(u8::from(found.is_accurate))];
        numbers.map(|x| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() })
    }

    #[test]
    fn all_instruction_sets_give_the_bits_of_plain_code() {
        let mut rng = Rng::new(11);
        let mut accurate = 0;
        let rounds = if cfg!(miri) { 50 } else { 20_000 };
        for round in 0..rounds {
            let scale = [1.0, 1e-30, 3e37, 1e-42, 1e12][round % 5];
            let mut point = |size: f32| {
                [(); 3].map(|()| (rng.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0) * size * scale)
            };
            let (origin, mut direction) = (point(1.0), point(1.0));
            let mut corners = [point(1.0), point(1.0), point(1.0)];
            match round / 5 % 4 {
                // A direction along an axis, a triangle of no area, and an origin at a corner.
                1 => direction[round % 3] = 0.0,
                2 => corners[2] = corners[1],
                3 => corners[round % 3] = origin,
                _ => {}
            }
            let terms = OriginTerms::new(wide(origin), corners.map(wide));
            let norm = max_norm(wide(direction));
            let expected = RoundedIntersection::new(&terms, wide(direction), norm);
            accurate += usize::from(expected.is_accurate);
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let found = isa.run(OnIsa(origin, direction, corners, norm as f32));
                assert_eq!(found, bits(&expected), "{isa} {origin:?} {direction:?} {corners:?}");
            }
        }
        assert!(accurate > rounds / 4, "{accurate} of {rounds}");
    }
}
