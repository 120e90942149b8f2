//! Full-sweep SAH: every split between neighbours in the order of the centres, on each axis.

use super::extent::Extent;
use super::split::{Reference, Split};

/// Buffers of [`split`], kept between nodes.
pub(super) struct Scratch<E: Extent> {
    /// Per axis: order-preserving bits of the centre in the high half, index in the low.
    keys: E::Orders<Vec<u64>>,
    right_cost: Vec<f64>,
    sorted: Vec<Reference<E>>,
}

impl<E: Extent> Default for Scratch<E> {
    fn default() -> Self {
        Scratch { keys: E::orders(|_| Vec::new()), right_cost: Vec::new(), sorted: Vec::new() }
    }
}

/// Bits that compare as unsigned integers like the finite floats do.
fn ordered_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Sorts the references along the best axis and returns the size of the best left side. At least
/// two references.
pub(super) fn split<E: Extent>(references: &mut [Reference<E>], scratch: &mut Scratch<E>) -> usize {
    let total = references.len();
    let Scratch { keys, right_cost, sorted } = scratch;
    right_cost.clear();
    right_cost.resize(total, 0.0);
    let mut best = Split::NONE;
    for (axis, keys) in keys.as_mut().iter_mut().enumerate() {
        keys.clear();
        keys.extend(
            references.iter().enumerate().map(|(i, r)| {
                u64::from(ordered_bits(r.bounds.half_center().as_ref()[axis])) << 32 | i as u64
            }),
        );
        keys.sort_unstable();
        let at = |i: usize| &references[keys[i] as u32 as usize].bounds;
        let mut bounds = E::EMPTY;
        for i in (1..total).rev() {
            bounds.grow(at(i));
            right_cost[i] = bounds.half_area() * (total - i) as f64;
        }
        let mut bounds = E::EMPTY;
        for (left, right_cost) in right_cost.iter().enumerate().skip(1) {
            bounds.grow(at(left - 1));
            best.improve(bounds.half_area() * left as f64 + right_cost, axis, left, left, total);
        }
    }
    sorted.clear();
    sorted.extend(keys.as_ref()[best.axis].iter().map(|&key| references[key as u32 as usize]));
    references.copy_from_slice(sorted);
    best.left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordered_bits_sort_like_floats() {
        let values = [-f32::MAX, -1.5, -f32::MIN_POSITIVE, 0.0, f32::from_bits(1), 1.0, f32::MAX];
        assert!(values.windows(2).all(|w| ordered_bits(w[0]) < ordered_bits(w[1])));
    }
}
