//! What rays that start on a triangle cannot meet. Specification: "Free directions".

use super::{Child, NONE, assert_layout::assert_layout};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Direction bins of a face of the cube in a row.
pub const FREE_SIDE: usize = 4;
/// Direction bins: [`FREE_SIDE`]² on each of the six faces of a cube.
pub const FREE_BINS: usize = 6 * FREE_SIDE * FREE_SIDE;
/// Bytes that hold the classes of all bins, five in a byte.
pub const FREE_BYTES: usize = FREE_BINS.div_ceil(FREE_BINS_PER_BYTE);
/// Bins whose classes share a byte: 3⁵ is below 256.
pub const FREE_BINS_PER_BYTE: usize = 5;

/// Where bins of a face meet, besides 0 and the edges: tan(π/8), rounded.
pub const FREE_BORDER: f32 = f32::from_bits(0x3ed4_13cd);
/// How far the promise of a bin reaches beyond its borders, in the coordinates of the cube's face. A reader may therefore compute
/// the bin of a direction with rounding errors, and take either bin where the greatest components are equal.
pub const FREE_MARGIN: f32 = 1.0 / 1024.0;

/// Classes of a byte: entry `b` holds in two bits each the five digits of `b` to base 3, the lowest first. Bytes from 243 on,
/// which are not assigned, hold zeros.
pub const FREE_DIGITS: [u16; 256] = digits();

const fn digits() -> [u16; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 243 {
        let (mut rest, mut k) = (byte, 0);
        while k < FREE_BINS_PER_BYTE {
            table[byte] |= ((rest % 3) as u16) << (2 * k);
            rest /= 3;
            k += 1;
        }
        byte += 1;
    }
    table
}

/// What rays that start on a triangle in the directions of a bin can meet beyond it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum FreeClass {
    /// Nothing is known.
    #[default]
    Unknown = 0,
    /// Nothing within the object's reach.
    Near = 1,
    /// Nothing at all.
    All = 2,
}

impl FreeClass {
    /// The class of a digit.
    pub const fn from_digit(digit: u32) -> Self {
        match digit {
            1 => FreeClass::Near,
            2 => FreeClass::All,
            _ => FreeClass::Unknown,
        }
    }
}

/// A row of `FREE_DIRECTIONS`, by triangle id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeDirections {
    /// Where the triangle lies ([`FreePlace`]); [`NONE`] if nothing is known.
    pub place: u32,
    /// Classes of the bins: byte k holds bins 5k to 5k + 4 as digits to base 3, the lowest first.
    pub classes: [u8; FREE_BYTES],
}

/// The row of `FREE_REACH`.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeReach {
    /// Distance in object space within which directions of class [`FreeClass::Near`] meet nothing.
    pub reach: f32,
    /// Zeros.
    pub reserved: [u32; 3],
}

/// The least and greatest reach that is stored: squares of it neither vanish nor overflow.
pub const FREE_REACH_RANGE: [f32; 2] = [1.0 / (1u64 << 50) as f32, (1u64 << 50) as f32];

assert_layout! {
    FreeDirections 24 { classes 4 }
    FreeReach 16 { reserved 4 }
}

/// Place of a triangle in the leaves of an object: bit 31 is set for raw leaves, bits 4 to 30 are the index of the leaf's child
/// code, bits 0 to 3 the slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreePlace {
    /// The leaf, [`Child::Indexed`] or [`Child::Raw`].
    pub leaf: Child,
    /// Slot of the triangle in the leaf.
    pub slot: u32,
}

impl FreePlace {
    /// Leaf indices are below this.
    pub const INDEX_LIMIT: u32 = (1 << 27) - 1;
    const RAW: u32 = 1 << 31;

    /// The number that encodes it; [`NONE`] for leaves whose index does not fit and what is no triangle leaf.
    pub fn code(self) -> u32 {
        match self.leaf {
            Child::Indexed(index) if index < Self::INDEX_LIMIT => index << 4 | self.slot,
            Child::Raw(index) if index < Self::INDEX_LIMIT => Self::RAW | index << 4 | self.slot,
            _ => NONE,
        }
    }

    /// The place that a number encodes; `None` for [`NONE`] and other numbers beyond the limit.
    #[inline(always)]
    pub const fn from_code(code: u32) -> Option<Self> {
        let (index, slot) = (code >> 4 & Self::INDEX_LIMIT, code & 15);
        if index == Self::INDEX_LIMIT {
            return None;
        }
        let leaf = if code & Self::RAW == 0 { Child::Indexed(index) } else { Child::Raw(index) };
        Some(FreePlace { leaf, slot })
    }
}

impl FreeDirections {
    /// A row that knows nothing.
    pub const UNKNOWN: Self = FreeDirections { place: NONE, classes: [0; FREE_BYTES] };

    /// The class of a bin.
    ///
    /// # Panics
    /// If there is no such bin.
    #[inline(always)]
    pub fn class(&self, bin: usize) -> FreeClass {
        FreeClass::from_digit(self.digit(bin))
    }

    /// The number of the class of a bin.
    ///
    /// # Panics
    /// If there is no such bin.
    #[inline(always)]
    pub fn digit(&self, bin: usize) -> u32 {
        let digits = FREE_DIGITS[usize::from(self.classes[bin / FREE_BINS_PER_BYTE])];
        u32::from(digits) >> (2 * (bin % FREE_BINS_PER_BYTE)) & 3
    }

    /// The row of a triangle with these classes.
    pub fn new(place: u32, classes: &[FreeClass; FREE_BINS]) -> Self {
        let byte = |k: usize| {
            let bins = &classes[FREE_BINS_PER_BYTE * k..FREE_BINS.min(FREE_BINS_PER_BYTE * (k + 1))];
            bins.iter().rev().fold(0, |byte, class| 3 * byte + *class as u8)
        };
        FreeDirections { place, classes: std::array::from_fn(byte) }
    }
}

/// The bin of a direction that is not zero and finite. Face 2k + s of the cube is where component k is the greatest in absolute
/// value, with s = 1 if it is negative; the columns of a face ascend with component k + 1, its rows with component k + 2, both
/// divided by the absolute value of component k.
#[inline]
pub fn free_bin(direction: [f32; 3]) -> usize {
    let size = direction.map(f32::abs);
    // Directions are not predictable: there are no branches.
    let is_x = usize::from((size[0] >= size[1]) & (size[0] >= size[2]));
    let is_y = usize::from(size[1] >= size[2]) & (1 - is_x);
    let axis = 2 - 2 * is_x - is_y;
    let column = |k: usize| {
        let (negative, outer) =
            (usize::from(direction[k] < 0.0), usize::from(size[k] > FREE_BORDER * size[axis]));
        2 * (1 - negative) + (outer ^ negative)
    };
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let next = [1, 2, 0];
    (face * FREE_SIDE + column(next[next[axis]])) * FREE_SIDE + column(next[axis])
}

/// Ends of a column of bins on a face of the cube, with the margin: a and b of the promise a ≤ component / depth ≤ b.
pub const fn free_column(column: usize) -> [f64; 2] {
    let border = FREE_BORDER as f64;
    let ends = [-1.0, -border, 0.0, border, 1.0];
    let margin = FREE_MARGIN as f64;
    [ends[column] - margin, ends[column + 1] + margin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_the_classes_of_all_bins() {
        let mut random = bth_random::Rng::new(3);
        for _ in 0..200 {
            let classes = std::array::from_fn(|_| FreeClass::from_digit(random.below(3) as u32));
            let row = FreeDirections::new(7, &classes);
            assert!((0..FREE_BINS).all(|bin| row.class(bin) == classes[bin]));
            assert!(row.classes.iter().all(|byte| *byte < 243));
        }
    }

    #[test]
    fn places_come_back_from_their_numbers() {
        for leaf in [Child::Indexed(0), Child::Raw(0), Child::Indexed(FreePlace::INDEX_LIMIT - 1), Child::Raw(77)] {
            for slot in [0, 15] {
                let place = FreePlace { leaf, slot };
                assert_eq!(FreePlace::from_code(place.code()), Some(place));
            }
        }
        assert_eq!(FreePlace::from_code(NONE), None);
        for leaf in [Child::Node(1), Child::Tets(1), Child::Raw(FreePlace::INDEX_LIMIT)] {
            assert_eq!(FreePlace { leaf, slot: 0 }.code(), NONE);
        }
    }

    #[test]
    fn directions_lie_between_the_ends_of_their_bin() {
        let mut random = bth_random::Rng::new(4);
        for _ in 0..20_000 {
            let d: [f32; 3] = std::array::from_fn(|_| random.between(-1.0, 1.0) as f32);
            let bin = free_bin(d);
            let (face, row, column) = (bin / 16, bin / 4 % 4, bin % 4);
            let (axis, negative) = (face / 2, face % 2 == 1);
            let depth = f64::from(d[axis]).abs();
            assert_eq!(d[axis] < 0.0, negative);
            for (k, at) in [(axis + 1, column), (axis + 2, row)] {
                let [a, b] = free_column(at);
                let x = f64::from(d[k % 3]) / depth;
                assert!(a < x && x < b, "{d:?}: {x} in {a}..{b}");
            }
        }
    }
}
