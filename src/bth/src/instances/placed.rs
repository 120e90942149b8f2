//! An instance in the world: its inverse and a conservative box.

use super::affine::{Affine, Inverse};
use crate::layout::Object;
use std::num::NonZeroU32;

/// How far rounding may move a ray against the instance that it is traced in, relative to what is in play:
/// 2^-24 for each component of origin and direction, and the error of the inverse, below
/// 2^-53 times ten times the greatest condition number of 2^24; four times their sum and more.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// An instance that can be seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub(crate) inverse: Inverse,
    /// World box, with the part of the rounding that does not depend on the ray.
    pub(crate) lower: [f32; 3],
    /// Upper end of the box.
    pub(crate) upper: [f32; 3],
    /// One more than the number of the object, so that an absent place needs no memory of its own.
    object: NonZeroU32,
    /// The rest of the rounding: by this times the greatest coordinate of the ray's origin a ray may
    /// pass by the box and still hit.
    pub(crate) looseness: f32,
}

/// Why an instance has no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Misplaced {
    /// It has no inverse that is good enough for rays.
    Singular,
    /// Its transform or its box is beyond the range of numbers.
    NotFinite,
}

impl Placed {
    /// Places an object with a root; objects number less than 2^32 - 1.
    ///
    /// A hit at t of the traced ray lies in the object's box. Let o be the ray's origin in the world, T that of the
    /// object, M the transform and A its inverse, b the greatest coordinate of the object's box. Rounding moves
    /// origin and direction such that the point at t moves in object space by at most 2^-24 (2 |A (o - T)| + b), in the
    /// world by at most |M| times that, with norms: 2^-24 (2 κ (|o| + |T|) + |M| b) where κ = |M| |A|.
    pub(crate) fn new(world: &Affine, number: u32, object: &Object) -> Result<Placed, Misplaced> {
        if !world.is_finite() {
            return Err(Misplaced::NotFinite);
        }
        let (inverse, condition) = world.inverse().ok_or(Misplaced::Singular)?;
        let (low, high) = (object.lower.map(f64::from), object.upper.map(f64::from));
        let coordinate = |v: &[f64; 3]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let greatest = coordinate(&low).max(coordinate(&high));
        let pad = ROUNDING * (condition * coordinate(&world.translation) + world.norm() * greatest);
        let mut placed = Placed {
            inverse,
            lower: [0.0; 3],
            upper: [0.0; 3],
            object: NonZeroU32::MIN.saturating_add(number),
            looseness: ((ROUNDING * condition) as f32).next_up(),
        };
        for k in 0..3 {
            let (mut least, mut most) = (world.translation[k], world.translation[k]);
            for j in 0..3 {
                let (a, b) = (world.linear[k][j] * low[j], world.linear[k][j] * high[j]);
                least += a.min(b);
                most += a.max(b);
            }
            placed.lower[k] = ((least - pad) as f32).next_down();
            placed.upper[k] = ((most + pad) as f32).next_up();
        }
        let finite = placed.lower.iter().chain(&placed.upper).all(|x| x.is_finite());
        if finite { Ok(placed) } else { Err(Misplaced::NotFinite) }
    }

    /// The object that stands here.
    pub(crate) fn object(&self) -> u32 {
        self.object.get() - 1
    }
}

const _: () = assert!(size_of::<Option<Placed>>() == 128);
