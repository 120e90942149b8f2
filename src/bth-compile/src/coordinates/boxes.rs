//! Boxes of a node's children in bytes, rounded outwards: no box becomes smaller, and no side moves by more than a step.

use bth_format::layout::{NONE, PackedNode, WIDTH, WideNode};

/// Greatest number of steps along an axis.
const MOST: f64 = 255.0;

/// The node with packed boxes; `None` where coordinates are too great.
pub(super) fn packed_node(node: &WideNode) -> Option<PackedNode> {
    let mut packed = PackedNode {
        bounds: [[[255; WIDTH], [0; WIDTH]]; 3],
        child: node.child,
        origin: [0.0; 3],
        step: [1.0; 3],
        reserved: [0; 2],
    };
    let used = node.child.iter().take_while(|code| **code != NONE).count();
    for axis in 0..3 {
        let [lower, upper] = node.bounds[axis].map(|row| row.map(f64::from));
        let least = lower[..used].iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = upper[..used].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (origin, step) = steps(least, greatest)?;
        (packed.origin[axis], packed.step[axis]) = (origin as f32, step as f32);
        for slot in 0..used {
            // The difference of an end and an origin of much greater magnitude is rounded; moving by one more step corrects
            // this.
            let mut first = ((lower[slot] - origin) / step).floor();
            let mut last = ((upper[slot] - origin) / step).ceil();
            first -= f64::from(u8::from(origin + first * step > lower[slot]));
            last += f64::from(u8::from(origin + last * step < upper[slot]));
            if !(0.0..=MOST).contains(&first) || !(0.0..=MOST).contains(&last) {
                return None;
            }
            packed.bounds[axis][0][slot] = first as u8;
            packed.bounds[axis][1][slot] = last as u8;
        }
    }
    let holds = |slot: usize| {
        (0..3).all(|axis| {
            let [lower, upper] = node.bounds[axis].map(|row| row[slot]);
            packed.end(axis, 0, slot) <= lower && upper <= packed.end(axis, 1, slot)
        })
    };
    (packed.is_exact() && (0..used).all(holds)).then_some(packed)
}

/// Origin and step of an axis: the least power of two by which bytes reach from end to end and ends are `f32`.
fn steps(least: f64, greatest: f64) -> Option<(f64, f64)> {
    let size = least.abs().max(greatest.abs());
    // No finer than the resolution of f32 at this magnitude, and no finer than the least normal f32.
    let finest = (size / f64::from(1 << 23)).max((greatest - least) / MOST).max(f64::from(f32::MIN_POSITIVE));
    // The power of two at or below it, by its exponent bits, so that it is the same on every machine.
    let mut step = f64::from_bits(finest.to_bits() & 0x7ff << 52);
    while step <= f64::from(f32::MAX) {
        let origin = (least / step).floor() * step;
        // Both terms are multiples of the step, so the sum is exact; the difference of the ends would be rounded.
        if greatest <= origin + MOST * step && size / step <= f64::from(1 << 23) {
            return Some((origin, step));
        }
        step *= 2.0;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn node(boxes: &[[[f32; 2]; 3]]) -> WideNode {
        let mut node =
            WideNode { bounds: [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3], child: [NONE; WIDTH] };
        for (slot, ends) in boxes.iter().enumerate() {
            node.child[slot] = slot as u32;
            for (rows, [a, b]) in node.bounds.iter_mut().zip(ends) {
                rows[0][slot] = a.min(*b);
                rows[1][slot] = a.max(*b);
            }
        }
        node
    }

    fn check(node: &WideNode) -> Option<WideNode> {
        let unpacked = packed_node(node)?.unpacked();
        assert_eq!(unpacked.child, node.child);
        for slot in 0..WIDTH {
            for axis in 0..3 {
                let [[a, b], [c, d]] = [&unpacked, node].map(|n| n.bounds[axis].map(|row| row[slot]));
                assert!(a <= c && d <= b, "{axis} {slot}: {a} {b} around {c} {d}");
                if node.child[slot] == NONE {
                    assert_eq!((a, b), (f32::MAX, -f32::MAX));
                }
            }
        }
        Some(unpacked)
    }

    fn end() -> impl Strategy<Value = f32> {
        prop_oneof![
            -1.0f32..1.0,
            (-1.0f32..1.0).prop_map(|x| 1e7 + x),
            Just(0.0),
            Just(-0.0),
            any::<u32>().prop_map(|bits| f32::from_bits(bits & 0x807f_ffff | 0x1000_0000)),
            any::<f32>().prop_filter("finite", |x| x.abs() < 1e30),
        ]
    }

    proptest! {
        #[test]
        fn boxes_only_grow(boxes in prop::collection::vec([[end(), end()], [end(), end()], [end(), end()]], 1..=16)) {
            prop_assert!(check(&node(&boxes)).is_some());
        }
    }

    #[test]
    fn ends_far_apart_in_size_are_packed() {
        // Their difference rounds to 255 steps of 2^78 and is a little more.
        let far = -255.0 * 2.0f32.powi(78);
        assert!(check(&node(&[[[far, 1e7], [0.0, 0.0], [0.0, 0.0]]])).is_some());
    }

    #[test]
    fn boxes_grow_by_less_than_two_steps_of_a_power_of_two() {
        let boxes: Vec<_> = (0..16).map(|i| [[i as f32 * 0.1, i as f32 * 0.1 + 0.07]; 3]).collect();
        let (plain, packed) = (node(&boxes), check(&node(&boxes)).unwrap());
        for axis in 0..3 {
            for slot in 0..WIDTH {
                // The width is 1.57: steps of 2^-7 reach over 255 of them.
                assert!(plain.bounds[axis][0][slot] - packed.bounds[axis][0][slot] <= 0.0079);
                assert!(packed.bounds[axis][1][slot] - plain.bounds[axis][1][slot] <= 0.0079);
            }
        }
    }

    #[test]
    fn coordinates_of_any_size_are_packed_or_refused() {
        for size in [0.0, f32::from_bits(1), 1e-40, f32::MIN_POSITIVE, 1e-30, 1.0, 1e30, 1e37] {
            assert!(check(&node(&[[[-size, size]; 3], [[size, size]; 3]])).is_some(), "{size}");
        }
        assert!(check(&node(&[[[-f32::MAX, f32::MAX]; 3]])).is_none());
    }
}
