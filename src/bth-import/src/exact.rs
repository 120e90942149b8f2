//! Positions in f64, and the anchor relative to which they are rounded to f32.

use bth_format::object::{EXACT_RANGE, relative_to_anchor};
use rayon::prelude::*;

/// Positions with all digits of the source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exact {
    /// What is subtracted before positions are rounded: 0 along axes along which the mesh is not
    /// farther from the origin than it is large.
    pub anchor: [f64; 3],
    /// Row by row for [`Mesh::positions`](crate::Mesh::positions), in the source's space.
    /// Coordinates are 0 or in [`EXACT_RANGE`].
    pub positions: Vec<[f64; 3]>,
}

impl Exact {
    /// Positions with their anchor.
    pub(crate) fn new(positions: Vec<[f64; 3]>) -> Self {
        let (lower, upper) = bounds(&positions);
        let size = (0..3).fold(0.0, |size: f64, k| size.max(upper[k] - lower[k]));
        // The largest power of two that is at most the size, over 8. It keeps the anchor short, so
        // that most differences from it are as short as the coordinates.
        let step = f64::from_bits(size.to_bits() & f64::INFINITY.to_bits()) / 8.0;
        let anchor = [0, 1, 2].map(|k| {
            let middle = 0.5 * lower[k] + 0.5 * upper[k];
            match (middle.abs() > size, size > 0.0) {
                (false, _) => 0.0,
                (true, false) => middle,
                (true, true) => (middle / step).round() * step,
            }
        });
        Self { anchor, positions }
    }

    /// The positions relative to the anchor, each rounded once.
    pub(crate) fn rounded(&self) -> Vec<[f32; 3]> {
        let rounded = |p: &[f64; 3]| [0, 1, 2].map(|k| relative_to_anchor(p[k], self.anchor[k]));
        self.positions.par_iter().map(rounded).collect()
    }
}

/// Ends of the box of positions, at least one.
fn bounds(positions: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let first = positions.first().copied().unwrap_or_default();
    positions.iter().fold((first, first), |(lower, upper), p| {
        ([0, 1, 2].map(|k| lower[k].min(p[k])), [0, 1, 2].map(|k| upper[k].max(p[k])))
    })
}

/// The position with 0 for -0 and for what f32 rounds to 0; `None` if a coordinate is beyond f32.
pub(crate) fn in_range(position: [f64; 3]) -> Option<[f64; 3]> {
    let kept = position.map(|x| if x.abs() < *EXACT_RANGE.start() { 0.0 } else { x });
    kept.iter().all(|x| x.abs() <= *EXACT_RANGE.end()).then_some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of_box(lower: [f64; 3], size: f64) -> Exact {
        Exact::new(vec![lower, lower.map(|x| x + size), [lower[0], lower[1] + size, lower[2]]])
    }

    #[test]
    fn anchors_are_short_numbers_in_the_middle() {
        let exact = of_box([5_500_000.13, 419_990.7, 3.0], 20.0);
        assert_eq!(exact.anchor, [5_500_010.0, 420_000.0, 0.0]);
        assert_eq!(of_box([-0.5; 3], 1.5).anchor, [0.0; 3]);
        assert_eq!(of_box([1e9 + 0.1; 3], 0.0).anchor, [1e9 + 0.1; 3]);
        assert_eq!(Exact::new(Vec::new()).anchor, [0.0; 3]);
        // Differences from the anchor stay finite.
        let widest = Exact::new(vec![[-f64::from(f32::MAX); 3], [f64::from(f32::MAX); 3]]);
        assert_eq!(widest.rounded(), [[-f32::MAX; 3], [f32::MAX; 3]]);
        let tiny = f64::from(f32::from_bits(1));
        assert_eq!(of_box([tiny; 3], 0.0).anchor, [tiny; 3]);
    }

    #[test]
    fn numbers_beyond_f32_are_not_kept() {
        assert_eq!(
            in_range([-0.0, 1e-60, 1.0]).map(|p| p.map(f64::to_bits)),
            Some([0.0, 0.0, 1.0].map(f64::to_bits))
        );
        assert_eq!(in_range([0.0, f64::from(f32::MAX).next_up(), 0.0]), None);
        assert_eq!(in_range([0.0, 0.0, f64::NAN]), None);
    }

    proptest! {
        /// Rounded positions are off by at most 2^-24 of one and a half times the size.
        #[test]
        fn rounding_is_relative_to_the_size(
            away in prop::array::uniform3(-1e7f64..1e7), size in 1e-3f64..1e3,
            corners in prop::collection::vec(prop::array::uniform3(0f64..1.0), 2..20),
        ) {
            let positions = corners.iter().map(|p| [0, 1, 2].map(|k| away[k] + p[k] * size)).collect();
            let exact = Exact::new(positions);
            let (lower, upper) = bounds(&exact.positions);
            let size = (0..3).fold(0.0, |size: f64, k| size.max(upper[k] - lower[k]));
            for (p, rounded) in exact.positions.iter().zip(exact.rounded()) {
                for k in 0..3 {
                    prop_assert!(f64::from(rounded[k].abs()) <= 1.5 * size * (1.0 + 1e-6));
                    let off = (p[k] - exact.anchor[k] - f64::from(rounded[k])).abs();
                    prop_assert!(off <= 1.5 * size / (1u64 << 24) as f64);
                }
            }
        }
    }
}
