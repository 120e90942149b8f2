//! An instance in the world: its inverse transform and a conservative world box.

use super::affine::{Affine, Inverse};
use bth_format::layout::{NONE, Object, WIDTH};
use bth_format::object::ObjectView;
use std::num::NonZeroU32;

/// Bound of the distance by which rounding may move a ray relative to the instance, in units of the magnitudes given at
/// [`Placed::new`]: 2^-24 for each component of origin and direction, and the error of the inverse, below 2^-53 times ten times the
/// greatest condition number of 2^24. The constant is more than four times their sum.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// A visible instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub(crate) inverse: Inverse,
    /// Lower end of the world box, which includes the part of the rounding that does not depend on the ray.
    pub(crate) lower: [f32; 3],
    /// Upper end of the box.
    pub(crate) upper: [f32; 3],
    /// One more than the index of the object, so that `Option<Placed>` needs no further memory.
    object: NonZeroU32,
    /// The part of the rounding that depends on the ray: this times the greatest |coordinate| of the ray's origin must be added to the
    /// box.
    pub(crate) looseness: f32,
}

/// Boxes that contain all triangles of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    count: usize,
    /// For each axis the lower and the upper ends of the boxes. Elements beyond the count are not used.
    ends: [[[f32; WIDTH]; 2]; 3],
}

impl Parts {
    /// The box of the whole object.
    pub(crate) fn whole(object: &Object) -> Parts {
        let ends = [0, 1, 2].map(|k| [[object.lower[k]; WIDTH], [object.upper[k]; WIDTH]]);
        Parts { count: 1, ends }
    }

    /// The boxes of the root's children if the object has a root node, else its box.
    pub(crate) fn of(object: &ObjectView<'_>) -> Parts {
        let mut parts = Parts::whole(object.header);
        let Some(node) = object.root() else { return parts };
        let used = node.child.iter().take_while(|code| **code != NONE).count();
        if used > 0 {
            parts.count = used;
            parts.ends = node.bounds;
        }
        parts
    }

    /// The least and the greatest scalar product of `row` with a point of the boxes.
    fn reach(&self, row: [f64; 3]) -> [f64; 2] {
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        // The signs of the row decide which corner of a box is the lowest along it.
        let ends = [0, 1, 2].map(|k| {
            let [low, high] = &self.ends[k];
            if row[k] < 0.0 { [high, low] } else { [low, high] }
        });
        let at = |end: usize, i: usize| -> f64 { (0..3).map(|k| row[k] * f64::from(ends[k][end][i])).sum() };
        for i in 0..self.count {
            let (least, most) = (at(0, i), at(1, i));
            reach[0] = if least < reach[0] { least } else { reach[0] };
            reach[1] = if most > reach[1] { most } else { reach[1] };
        }
        reach
    }
}

/// Why an instance cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Misplaced {
    /// Its transform has no inverse that is accurate enough for rays.
    Singular,
    /// Its transform or its box is not finite.
    NotFinite,
}

impl Placed {
    /// Places an object that has a root, given its index, by a transform from its space to the world.
    ///
    /// A hit at t of the traced ray lies in the object's box. Let o be the ray's origin in the world, T that of the
    /// object, M the transform and A its inverse, b the greatest coordinate of the object's box. Rounding moves
    /// origin and direction such that the point at t moves in object space by at most 2^-24 (2 |A (o - T)| + b), in the
    /// world by at most |M| times that, with norms: 2^-24 (2 κ (|o| + |T|) + |M| b) where κ = |M| |A|.
    ///
    /// `parts` are boxes that contain all triangles of the object: the tighter they are, the tighter is the world box.
    pub(crate) fn new(
        world: &Affine,
        index: u32,
        object: &Object,
        parts: &Parts,
    ) -> Result<Placed, Misplaced> {
        if !world.is_finite() {
            return Err(Misplaced::NotFinite);
        }
        let (inverse, condition) = world.inverse().ok_or(Misplaced::Singular)?;
        let coordinate = |v: &[f64; 3]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let greatest = coordinate(&object.lower.map(f64::from)).max(coordinate(&object.upper.map(f64::from)));
        let pad = ROUNDING * (condition * coordinate(&world.translation) + world.norm() * greatest);
        let mut placed = Placed {
            inverse,
            lower: [0.0; 3],
            upper: [0.0; 3],
            object: NonZeroU32::MIN.saturating_add(index),
            looseness: ((ROUNDING * condition) as f32).next_up(),
        };
        for k in 0..3 {
            let [least, most] = parts.reach(world.linear[k]);
            placed.lower[k] = ((world.translation[k] + least - pad) as f32).next_down();
            placed.upper[k] = ((world.translation[k] + most + pad) as f32).next_up();
        }
        let finite = placed.lower.iter().chain(&placed.upper).all(|x| x.is_finite());
        if finite { Ok(placed) } else { Err(Misplaced::NotFinite) }
    }

    /// Index of the object.
    pub(crate) fn object(&self) -> u32 {
        self.object.get() - 1
    }
}

const _: () = assert!(size_of::<Option<Placed>>() == 128);

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;
    use zerocopy::FromZeros;

    #[test]
    fn world_boxes_contain_all_parts_and_are_no_larger_than_that_of_the_whole() {
        let mut rng = Rng::new(7);
        let mut tighter = 0;
        for round in 0..500 {
            let mut unit = || rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0;
            let mut object = Object::new_zeroed();
            (object.lower, object.upper) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            let mut parts = Parts { count: 1 + round % WIDTH, ends: [[[f32::NAN; WIDTH]; 2]; 3] };
            for i in 0..parts.count {
                for k in 0..3 {
                    let (a, b) = (unit() as f32, unit() as f32 * 0.2);
                    parts.ends[k][0][i] = a.min(a + b);
                    parts.ends[k][1][i] = a.max(a + b);
                    object.lower[k] = object.lower[k].min(parts.ends[k][0][i]);
                    object.upper[k] = object.upper[k].max(parts.ends[k][1][i]);
                }
            }
            let mut numbers = [0.0; 10];
            numbers.iter_mut().for_each(|x| *x = unit());
            let world = Affine::from_parts(&numbers);
            let Ok(placed) = Placed::new(&world, 0, &object, &parts) else { continue };
            for (i, corner) in (0..parts.count).flat_map(|i| (0..8).map(move |corner| (i, corner))) {
                let end = |k: usize| f64::from(parts.ends[k][corner >> k & 1][i]);
                let point = world.apply([end(0), end(1), end(2)]);
                let holds = |k: usize| {
                    f64::from(placed.lower[k]) <= point[k] && point[k] <= f64::from(placed.upper[k])
                };
                assert!((0..3).all(holds), "round {round}, part {i}: {point:?}, {placed:?}");
            }
            let whole = Placed::new(&world, 0, &object, &Parts::whole(&object)).unwrap();
            for k in 0..3 {
                assert!(whole.lower[k] <= placed.lower[k] && placed.upper[k] <= whole.upper[k]);
                tighter += u32::from(whole.lower[k] < placed.lower[k]);
            }
        }
        assert!(tighter > 200, "{tighter}");
    }
}
