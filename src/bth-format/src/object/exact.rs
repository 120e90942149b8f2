//! Positions in f64, of objects whose source has more digits than f32 keeps. Specification: "Exact
//! positions".

use crate::exact::two_sum;

/// Absolute values of exact coordinates other than 0. Sums of products of four of them neither
/// overflow nor lose bits in f64.
pub const EXACT_RANGE: std::ops::RangeInclusive<f64> = f32::from_bits(1) as f64..=f32::MAX as f64;

/// The corners of triangles as the source has them.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExactPositions<'a> {
    positions: &'a [[f64; 3]],
    triangles: &'a [[u32; 3]],
}

impl<'a> ExactPositions<'a> {
    /// Positions, and their rows for each triangle.
    pub fn new(positions: &'a [[f64; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self { positions, triangles }
    }

    /// Returns true if corners in f32 are all there is. Object space is then the source's space.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The positions, in the source's space; row by row for
    /// [`super::ObjectView::positions`].
    pub fn positions(&self) -> &'a [[f64; 3]] {
        self.positions
    }

    /// The corners of a triangle in the source's space, in the source's order. `None` if there are
    /// no exact positions or there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> Option<[[f64; 3]; 3]> {
        let [a, b, c] = *self.triangles.get(triangle as usize)?;
        let corner = |row: u32| self.positions.get(row as usize).copied();
        Some([corner(a)?, corner(b)?, corner(c)?])
    }
}

/// The f32 nearest to `x - anchor`, of two equally near ones the even one, and 0 for -0. Both are 0
/// or in [`EXACT_RANGE`].
pub fn relative_to_anchor(x: f64, anchor: f64) -> f32 {
    let (difference, error) = two_sum(x, -anchor);
    // The next rounding goes wrong only where the first one ends halfway between two f32. Such a
    // number is even, so the odd one of the two f64 around the exact difference is as good as it
    // (Boldo and Melquiond, "Emulation of FMA and correctly rounded sums: proved algorithms using
    // rounding to odd", 2008).
    let bits = difference.to_bits();
    let odd = if error == 0.0 || bits & 1 == 1 {
        difference
    } else if (error > 0.0) == (difference > 0.0) {
        f64::from_bits(bits + 1)
    } else {
        f64::from_bits(bits - 1)
    };
    odd as f32 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A multiple of 2^-40 that f64 holds.
    fn number() -> impl Strategy<Value = i64> {
        let near_ties = (-8i64..8, 24u32..53).prop_map(|(low, bit)| (1 << bit) + low);
        prop_oneof![-(1i64 << 53)..1 << 53, near_ties, -9i64..9]
    }

    fn to_f64(x: i64) -> f64 {
        x as f64 / (1u64 << 40) as f64
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        /// Integers convert to f32 with one rounding.
        #[test]
        fn differences_are_rounded_once(x in number(), anchor in number()) {
            let expected = (x - anchor) as f32 / (1u64 << 40) as f32;
            prop_assert_eq!(relative_to_anchor(to_f64(x), to_f64(anchor)).to_bits(), expected.to_bits());
        }
    }

    #[test]
    fn a_difference_that_f64_rounds_to_halfway_between_two_f32_is_rounded_once() {
        let (halfway, less) = (1.0 + 1.0 / f64::from(1u32 << 24), 1e-30);
        assert_eq!((halfway - less) as f32, 1.0);
        assert_eq!(relative_to_anchor(halfway, less), 1.0);
        assert_eq!(relative_to_anchor(halfway, -less), 1.0f32.next_up());
        assert_eq!(relative_to_anchor(-halfway, less), -1.0f32.next_up());
        assert_eq!(relative_to_anchor(3.0, 3.0).to_bits(), 0);
        assert_eq!(relative_to_anchor(-1e-60, 0.0).to_bits(), 0);
    }
}
