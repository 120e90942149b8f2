//! An instance in the world: its inverse transform and a conservative world box.

use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::vector::dot;
use crate::nodes::affine::{Accuracy, Affine, Inverse};
use bth_format::error::{Code, Error};
use bth_format::layout::{NONE, Object, WIDTH};
use bth_format::object::ObjectView;
use std::num::NonZeroU32;

/// Bound of the distance by which rounding may move a ray relative to the instance, in units of the
/// magnitudes given at [`Placement::new`]: 2^-24 for each component of origin and direction, and
/// the error of the inverse, below 2^-53 times ten times the max condition number of 2^24. The
/// constant is more than four times their sum.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// The placement of a visible instance in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// The transform from world space to the space of the object's source.
    pub(crate) inverse: Inverse,
    /// Lower end of the world box, which includes the part of the rounding that does not depend on
    /// the ray.
    pub(crate) lower: [f32; 3],
    /// Upper end of the box.
    pub(crate) upper: [f32; 3],
    /// One more than the index of the object, so that `Option<Placement>` needs no further memory.
    object: NonZeroU32,
    pub(crate) accuracy: Accuracy,
}

/// The world box of a visible row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowBox {
    pub(crate) lower: [f32; 3],
    pub(crate) upper: [f32; 3],
    /// The part of the rounding that depends on the ray: the box must be enlarged on all sides by
    /// this factor times the max |coordinate| of the ray's origin.
    pub(crate) origin_slack: f32,
}

/// Number of boxes that are computed together.
const BLOCK: usize = 4;

/// Boxes that contain all triangles of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartBoxes {
    /// The origin of the object's space in the space of its source.
    anchor: [f64; 3],
    /// Number of blocks in use.
    blocks: usize,
    /// For each axis the lower and the upper ends of the boxes, in blocks. Blocks are filled up
    /// with copies of the first box.
    bounds: [[[[f64; BLOCK]; WIDTH / BLOCK]; 2]; 3],
}

impl PartBoxes {
    /// The first `count` boxes, at least one, of boxes in the layout of a node.
    pub(super) fn new(count: usize, boxes: &[[[f32; WIDTH]; 2]; 3], anchor: [f64; 3]) -> PartBoxes {
        let mut bounds = [[[[0.0; BLOCK]; WIDTH / BLOCK]; 2]; 3];
        for (bounds, boxes) in bounds.as_flattened_mut().iter_mut().zip(boxes.as_flattened()) {
            for (i, value) in bounds.as_flattened_mut().iter_mut().enumerate() {
                *value = f64::from(boxes[if i < count { i } else { 0 }]);
            }
        }
        PartBoxes { anchor, blocks: count.div_ceil(BLOCK), bounds }
    }

    /// The box of the whole object.
    pub(crate) fn whole(object: &Object, anchor: [f64; 3]) -> PartBoxes {
        let boxes = [0, 1, 2].map(|k| [[object.lower[k]; WIDTH], [object.upper[k]; WIDTH]]);
        PartBoxes::new(1, &boxes, anchor)
    }

    /// The boxes of the root's children if the object has a root node, else its box.
    pub(crate) fn of_root_children(object: &ObjectView<'_>) -> PartBoxes {
        let whole = || PartBoxes::whole(object.header, object.anchor);
        let Some(node) = object.root() else { return whole() };
        match node.child.iter().take_while(|code| **code != NONE).count() {
            0 => whole(),
            used => PartBoxes::new(used, &node.bounds, object.anchor),
        }
    }

    /// The min and the max scalar product of `row` with any point of the boxes.
    #[inline(always)]
    fn extent_along(&self, row: [f64; 3]) -> [f64; 2] {
        // The signs of the row's elements determine at which corners of a box the product is
        // smallest and largest.
        let mut ends = [[&self.bounds[0][0]; 2]; 3];
        for k in 0..3 {
            let [low, high] = &self.bounds[k];
            ends[k] = if row[k] < 0.0 { [high, low] } else { [low, high] };
        }
        let (mut least, mut greatest) = ([f64::INFINITY; BLOCK], [f64::NEG_INFINITY; BLOCK]);
        for block in 0..self.blocks {
            let product = |end: usize, i: usize| {
                let [x, y, z] = ends.map(|ends| ends[end][block][i]);
                row[0] * x + row[1] * y + row[2] * z
            };
            for i in 0..BLOCK {
                let (low, high) = (product(0, i), product(1, i));
                least[i] = if low < least[i] { low } else { least[i] };
                greatest[i] = if high > greatest[i] { high } else { greatest[i] };
            }
        }
        [
            least.into_iter().fold(f64::INFINITY, f64::min),
            greatest.into_iter().fold(f64::NEG_INFINITY, f64::max),
        ]
    }
}

/// The sum of the |products| of components.
fn size(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] * b[0]).abs() + (a[1] * b[1]).abs() + (a[2] * b[2]).abs()
}

/// Reason why an instance cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlacementError {
    /// Its transform has no inverse that is accurate enough for rays.
    Singular,
    /// Its transform or its box is not finite.
    NotFinite,
    /// Groups, written out, are too many instances, or nested too deeply.
    TooMany,
}

impl PlacementError {
    /// The code of an error about an instance, what is expected, and what was found.
    pub(crate) fn words(self) -> (Code, &'static str, &'static str) {
        match self {
            PlacementError::Singular => {
                (Code::Singular, "a transform that can be inverted", "one that cannot")
            }
            PlacementError::NotFinite => {
                (Code::NotFinite, "a finite transform and world box", "one that is not")
            }
            PlacementError::TooMany => {
                let expected = "fewer than 2^32 - 1 instances, at most 16 on the way to each, once groups are \
                    written out";
                (Code::TooManyInstances, expected, "more")
            }
        }
    }
}

/// An instance that cannot be placed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unplaceable {
    pub(crate) instance: u32,
    pub(crate) error: PlacementError,
}

impl Unplaceable {
    /// The error of a call; `instance` describes the instance.
    pub(crate) fn error(self, instance: &str) -> Error {
        let (code, expected, found) = self.error.words();
        Error::of_call(code, expected, format!("{found}: {instance}"))
    }
}

impl Placement {
    /// Places an object that has a root. `world` is the transform from object space to world space,
    /// `index` the index of the object.
    ///
    /// A hit at t of the ray in object space lies in the object's box. In world space, let o be the
    /// origin of the ray and T the origin of the object. Let M be the linear part of the transform,
    /// A its inverse, and b the max |coordinate| of the object's box. The rounding of origin and
    /// direction moves the point at t in object space by at most 2^-24 (2 |A (o - T)| + b), hence
    /// in world space by at most |M| times that: 2^-24 (2 κ (|o| + |T|) + |M| b) where κ = |M| |A|,
    /// in the maximum norm.
    ///
    /// `parts` are boxes that contain all triangles of the object. Tighter boxes give a tighter
    /// world box. Where they have an anchor, T is its image; |T| is then a bound that includes the
    /// anchor. What rounding has moved vertices by, at most 2^-24 b, is in the constant, too.
    #[inline(never)]
    pub(crate) fn new(
        world: &Affine,
        index: u32,
        object: &Object,
        parts: &PartBoxes,
    ) -> Result<Placement, PlacementError> {
        Placement::inlined(world, index, object, parts)
    }

    /// An instance of an object that is not in a tree: it only has a transform.
    #[inline(always)]
    pub(super) fn without_box(inverse: Inverse, accuracy: Accuracy, object: u32) -> Placement {
        let object = NonZeroU32::MIN.saturating_add(object);
        Placement { inverse, lower: [0.0; 3], upper: [0.0; 3], object, accuracy }
    }

    /// Like [`Self::new`], compiled inside of a kernel.
    #[inline(always)]
    pub(crate) fn inlined(
        world: &Affine,
        index: u32,
        object: &Object,
        parts: &PartBoxes,
    ) -> Result<Placement, PlacementError> {
        if !world.is_finite() {
            return Err(PlacementError::NotFinite);
        }
        let (inverse, accuracy) = world.inverse().ok_or(PlacementError::Singular)?;
        let condition = accuracy.condition();
        let (mut greatest, mut far) = (0.0, 0.0);
        for k in 0..3 {
            let ends = f64::from(object.lower[k].abs().max(object.upper[k].abs()));
            greatest = if ends > greatest { ends } else { greatest };
            let translation = world.translation[k].abs() + size(world.linear[k], parts.anchor);
            far = if translation > far { translation } else { far };
        }
        let pad = ROUNDING * (condition * far + world.norm() * greatest);
        let mut placement = Placement {
            inverse,
            lower: [0.0; 3],
            upper: [0.0; 3],
            object: NonZeroU32::MIN.saturating_add(index),
            accuracy,
        };
        for k in 0..3 {
            let [lower, upper] = parts.extent_along(world.linear[k]);
            let origin = world.translation[k] + dot(world.linear[k], parts.anchor);
            placement.lower[k] = ((origin + lower - pad) as f32).next_down();
            placement.upper[k] = ((origin + upper + pad) as f32).next_up();
        }
        let mut finite = true;
        for k in 0..3 {
            finite &= placement.lower[k].is_finite() & placement.upper[k].is_finite();
        }
        if finite { Ok(placement) } else { Err(PlacementError::NotFinite) }
    }

    /// The box of the instance.
    pub(crate) fn row_box(&self) -> RowBox {
        let Placement { lower, upper, .. } = *self;
        RowBox { lower, upper, origin_slack: ((ROUNDING * self.accuracy.condition()) as f32).next_up() }
    }

    /// The line in the space of the object, as [`Inverse::line`].
    #[inline(always)]
    pub(crate) fn line(&self, line: &RoundedLine) -> RoundedLine {
        self.inverse.line(self.accuracy, line)
    }

    /// A point of the object in world space, as [`Inverse::point_in_world`].
    pub(crate) fn point_in_world(&self, point: RoundedOrigin) -> RoundedOrigin {
        self.inverse.point_in_world(self.accuracy, point)
    }

    /// Index of the object.
    pub(crate) fn object(&self) -> u32 {
        self.object.get() - 1
    }
}

const _: () = assert!(size_of::<Option<Placement>>() == 128);

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;
    use zerocopy::FromZeros;

    #[test]
    fn world_boxes_contain_all_parts_and_lie_in_the_world_box_of_the_whole() {
        let mut rng = Rng::new(7);
        let mut tighter = 0;
        for case in 0..500 {
            let mut unit = || rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0;
            let mut object = Object::new_zeroed();
            (object.lower, object.upper) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            let (count, mut boxes) = (1 + case % WIDTH, [[[f32::NAN; WIDTH]; 2]; 3]);
            for i in 0..count {
                for k in 0..3 {
                    let (a, b) = (unit() as f32, unit() as f32 * 0.2);
                    boxes[k][0][i] = a.min(a + b);
                    boxes[k][1][i] = a.max(a + b);
                    object.lower[k] = object.lower[k].min(boxes[k][0][i]);
                    object.upper[k] = object.upper[k].max(boxes[k][1][i]);
                }
            }
            let parts = PartBoxes::new(count, &boxes, [0.0; 3]);
            let mut numbers = [0.0; 10];
            numbers.iter_mut().for_each(|x| *x = unit());
            let world = Affine::from_parts(&numbers);
            let Ok(placement) = Placement::new(&world, 0, &object, &parts) else { continue };
            for (i, corner) in (0..count).flat_map(|i| (0..8).map(move |corner| (i, corner))) {
                let end = |k: usize| f64::from(boxes[k][corner >> k & 1][i]);
                let point = world.apply([end(0), end(1), end(2)]);
                let holds = |k: usize| {
                    f64::from(placement.lower[k]) <= point[k] && point[k] <= f64::from(placement.upper[k])
                };
                assert!((0..3).all(holds), "case {case}, part {i}: {point:?}, {placement:?}");
            }
            let whole = Placement::new(&world, 0, &object, &PartBoxes::whole(&object, [0.0; 3])).unwrap();
            for k in 0..3 {
                assert!(whole.lower[k] <= placement.lower[k] && placement.upper[k] <= whole.upper[k]);
                tighter += u32::from(whole.lower[k] < placement.lower[k]);
            }
        }
        assert!(tighter > 200, "{tighter}");
    }
}
