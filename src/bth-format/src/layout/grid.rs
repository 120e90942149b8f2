//! The grid of an object: the points that 16 or 21 bits per coordinate can express, each an `f32`
//! without rounding. Specification: "Grids".

use super::bvh::WIDTH;
use super::grid_leaves::{HALF_LINE, IndexedLeaf16, IndexedLeaf21, RawLeaf16, RawLeaf21};
use super::object::{Object, WIDENED_BOXES};

/// Bits of a coordinate of a triangle leaf on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum GridBits {
    /// 16 bits.
    B16 = 16,
    /// 21 bits.
    B21 = 21,
}

impl GridBits {
    /// All of them, the fewest bits first.
    pub const ALL: [GridBits; 2] = [GridBits::B16, GridBits::B21];

    /// Half lines of an indexed leaf, and of a raw leaf.
    pub const fn half_lines(self) -> [usize; 2] {
        match self {
            GridBits::B16 => [size_of::<IndexedLeaf16>() / HALF_LINE, size_of::<RawLeaf16>() / HALF_LINE],
            GridBits::B21 => [size_of::<IndexedLeaf21>() / HALF_LINE, size_of::<RawLeaf21>() / HALF_LINE],
        }
    }

    /// The max number of steps from the origin.
    pub const fn max_steps(self) -> u32 {
        (1 << self as u32) - 1
    }
}

/// The points that a vertex can be: per axis `origin + k * step`, with k from 0 to
/// [`GridBits::max_steps`]. Steps are powers of two, the origin is a multiple of the step, and no
/// point is more than 2^24 steps from 0: so every coordinate is an `f32`, and computing it takes no
/// rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Bits of a coordinate of a triangle leaf on a grid.
    pub bits: GridBits,
    /// The min point, object space.
    pub origin: [f32; 3],
    /// Distance of neighbouring points, per axis, object space.
    pub step: [f32; 3],
}

/// Every integer up to this is an `f32`, and so is its product with a power of two within range.
const EXACT: f64 = (1 << 24) as f64;

impl Grid {
    /// The grid of an object; `None` where coordinates are `f32`.
    ///
    /// # Errors
    /// What violates BTH-F104, in words.
    pub(crate) fn from_object(object: &Object) -> Result<Option<Grid>, &'static str> {
        let coordinates = object.coordinates & !WIDENED_BOXES;
        if coordinates == 0 {
            let numbers = object.grid_origin.iter().chain([&object.displacement]);
            let zero = numbers.into_iter().all(|x| x.to_bits() == 0);
            return if zero { Ok(None) } else { Err("a grid of coordinates that are f32") };
        }
        let [bits, exponents @ ..] = coordinates.to_le_bytes();
        let bits = GridBits::ALL.into_iter().find(|b| *b as u32 == u32::from(bits));
        let bits = bits.ok_or("coordinates that are neither f32 nor of 16 or 21 bits")?;
        if !exponents.iter().all(|e| (1..=254).contains(e)) {
            return Err("a step that is no normal number");
        }
        let step = exponents.map(|e| f32::from_bits(u32::from(e) << 23));
        let grid = Grid { bits, origin: object.grid_origin, step };
        if !(0..3).all(|axis| grid.is_exact(axis)) {
            return Err("a grid with points that are no f32");
        }
        if !(object.displacement >= 0.0 && object.displacement.is_finite()) {
            return Err("a displacement that is no finite distance");
        }
        Ok(Some(grid))
    }

    /// Returns true if every coordinate of an axis is an `f32`.
    pub fn is_exact(&self, axis: usize) -> bool {
        is_exact(self.origin[axis], self.step[axis], self.bits.max_steps())
    }

    /// The fields of an [`Object`] that define the grid: `coordinates` and `grid_origin`.
    pub fn fields(&self) -> (u32, [f32; 3]) {
        let exponent = |axis: usize| (self.step[axis].to_bits() >> 23) as u8;
        (u32::from_le_bytes([self.bits as u32 as u8, exponent(0), exponent(1), exponent(2)]), self.origin)
    }

    /// Steps from the origin to the multiple of the step nearest to a coordinate, ties to the even
    /// multiple. Below 0 or above [`GridBits::max_steps`] where the coordinate lies outside the
    /// grid.
    pub fn steps(&self, axis: usize, x: f32) -> i64 {
        let step = f64::from(self.step[axis]);
        // Quotients of f32 by powers of two that are f32 are exact in f64.
        let multiple = (f64::from(x) / step).round_ties_even();
        (multiple - f64::from(self.origin[axis]) / step) as i64
    }

    /// The point of the grid nearest to a point, per axis; ties as in [`Self::steps`].
    pub fn nearest(&self, point: [f32; 3]) -> [f32; 3] {
        let coordinate = |axis: usize| {
            let steps = self.steps(axis, point[axis]).clamp(0, i64::from(self.bits.max_steps()));
            self.coordinate(axis, steps as u32)
        };
        [coordinate(0), coordinate(1), coordinate(2)]
    }

    /// The coordinate at a number of steps from the origin, object space; exact.
    #[inline(always)]
    pub fn coordinate(&self, axis: usize, steps: u32) -> f32 {
        self.origin[axis] + steps as f32 * self.step[axis]
    }

    /// Sixteen coordinates of an axis from 16 bits each.
    #[inline(always)]
    pub(crate) fn row_16(&self, axis: usize, low: &[u16; WIDTH]) -> [f32; WIDTH] {
        let mut out = [0.0; WIDTH];
        for i in 0..WIDTH {
            out[i] = self.coordinate(axis, u32::from(low[i]));
        }
        out
    }

    /// Sixteen coordinates of an axis from their low bits and the high bits of all axes.
    #[inline(always)]
    pub(crate) fn row_21(&self, axis: usize, low: &[u16; WIDTH], high: &[u16; WIDTH]) -> [f32; WIDTH] {
        let mut out = [0.0; WIDTH];
        for i in 0..WIDTH {
            out[i] = self.coordinate(axis, steps_21(axis, low[i], high[i]));
        }
        out
    }
}

/// Returns true if `origin + k * step` is an `f32` for all k from 0 to `max_steps`. The step has to
/// be a power of two.
pub fn is_exact(origin: f32, step: f32, max_steps: u32) -> bool {
    let step = f64::from(step);
    let first = f64::from(origin) / step;
    let last = first + f64::from(max_steps);
    let multiples = first == first.trunc() && first.abs() <= EXACT && last <= EXACT;
    multiples && last * step <= f64::from(f32::MAX)
}

/// Steps from the low bits of an axis and the high bits of all axes, as [`IndexedLeaf21::high`] has
/// them.
#[inline(always)]
fn steps_21(axis: usize, low: u16, high: u16) -> u32 {
    u32::from(low) | (u32::from(high) >> (5 * axis) & 31) << 16
}
