//! What rays that start on a triangle cannot meet. Specification: "Free directions".

use super::{Child, NONE, assert_layout::assert_layout};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Columns, and rows, of direction bins.
pub const FREE_SIDE: usize = 11;
/// Direction bins of a triangle.
pub const FREE_BINS: usize = FREE_SIDE * FREE_SIDE;
/// Squares of the slopes at which columns meet: tan²(k π / 22) for k = 1, 3, 5, 7, 9, rounded. Columns are equally wide in terms of
/// the angle that a direction is tilted by along an axis.
pub const FREE_BORDERS: [f64; 5] =
    [0.020672197824104982, 0.20856091329926152, 0.750830798121458, 2.4212305216220913, 11.598705569133076];
/// Greatest slope of the directions of bins.
pub const FREE_STEEPEST: f64 = 16.0;
/// How far the promise of a bin reaches beyond its borders: slopes s reach to s ± margin (1 + s²), which is that angle. A reader may
/// therefore compute slopes with rounding errors.
pub const FREE_MARGIN: f64 = 1.0 / 512.0;
/// Lengths of the edges at the first corner of a triangle whose directions are known.
pub const FREE_EDGES: [f64; 2] = [1.0 / (1u64 << 20) as f64, (1u64 << 20) as f64];
/// Least sine of the angle between these edges: rounding errors in f32 stay below the margin.
pub const FREE_LEAST_SINE: f64 = 1.0 / 128.0;
/// The least and greatest reach that is stored: squares of it neither vanish nor overflow.
pub const FREE_REACH_RANGE: [f32; 2] = [1.0 / (1u64 << 50) as f32, (1u64 << 50) as f32];

/// A row of `FREE_DIRECTIONS`, by triangle id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeDirections {
    /// Where the triangle lies ([`FreePlace`]); [`NONE`] if nothing is known.
    pub place: u32,
    /// [`FreeBins`], the lowest bits first.
    pub bins: [u32; 4],
}

/// The row of `FREE_REACH`.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeReach {
    /// Distance in object space within which rays meet nothing in free directions of rows with [`FreeBins::NEARBY`].
    pub reach: f32,
    /// Zeros.
    pub reserved: [u32; 3],
}

assert_layout! {
    FreeDirections 20 { bins 4 }
    FreeReach 16 { reserved 4 }
}

/// Bit i tells whether bin i is free. Bits from 121 to 125 are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FreeBins(pub u128);

impl FreeBins {
    /// The bits of all bins.
    pub const ALL: u128 = (1 << FREE_BINS) - 1;
    /// Set where directions are those on the back of the triangle, from which its corners are seen clockwise.
    pub const BACK: u128 = 1 << 126;
    /// Set where free directions meet nothing within the reach, and nothing is known of what is beyond.
    pub const NEARBY: u128 = 1 << 127;

    /// Whether directions are those on the back.
    pub const fn is_back(self) -> bool {
        self.0 & Self::BACK != 0
    }

    /// Whether only what is within the reach is known.
    pub const fn is_nearby(self) -> bool {
        self.0 & Self::NEARBY != 0
    }

    /// Whether a bin is free.
    pub const fn is_free(self, bin: usize) -> bool {
        bin < FREE_BINS && self.0 >> bin & 1 == 1
    }
}

impl FreeDirections {
    /// A row that knows nothing.
    pub const UNKNOWN: Self = FreeDirections { place: NONE, bins: [0; 4] };

    /// The row of a triangle.
    pub fn new(place: u32, bins: FreeBins) -> Self {
        FreeDirections { place, bins: std::array::from_fn(|k| (bins.0 >> (32 * k)) as u32) }
    }

    /// The bins.
    pub fn bins(&self) -> FreeBins {
        FreeBins(self.bins.iter().rev().fold(0, |bits, word| bits << 32 | u128::from(*word)))
    }
}

/// Axes of the directions of a triangle with corners a, b, c, not normalized: b - a, normal × (b - a), and the normal
/// (b - a) × (c - a). `None` for a triangle whose rounding errors may exceed the margin.
pub fn free_axes(corners: [[f32; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let length = |p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    let (first, second) = (minus(b, a), minus(c, a));
    let normal = cross(first, second);
    let [least, greatest] = FREE_EDGES;
    let is_usable = |edge: f64| least <= edge && edge <= greatest;
    let edges = [length(first), length(second)];
    let is_wide = length(normal) >= FREE_LEAST_SINE * edges[0] * edges[1];
    (is_wide && edges.into_iter().all(is_usable)).then(|| [first, cross(normal, first), normal])
}

/// The bin of a direction that leaves a triangle with these axes on its front, and whether it leaves it on its back; `None` for
/// directions that are too steep.
pub fn free_bin(axes: &[[f64; 3]; 3], direction: [f64; 3]) -> Option<(usize, bool)> {
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let [x, y, z] = axes.map(|axis| dot(direction, axis) / dot(axis, axis).sqrt());
    let column = |tilt: f64| {
        let slope = tilt / z.abs();
        let beyond = FREE_BORDERS.iter().filter(|border| slope * slope > **border).count();
        // False for what is no number.
        let is_flat = slope.abs() <= FREE_STEEPEST;
        let middle = FREE_SIDE / 2;
        is_flat.then_some(if slope < 0.0 { middle - beyond } else { middle + beyond })
    };
    Some((FREE_SIDE * column(y)? + column(x)?, z < 0.0))
}

/// Least and greatest slope of the promise of a column, with the margin.
pub fn free_column(column: usize) -> [f64; 2] {
    // The border between columns i and i + 1 is at the tilt (2 i - 9) π / 22.
    let border = |k: isize| {
        let k = 2 * k - FREE_SIDE as isize;
        match k.unsigned_abs() {
            FREE_SIDE => FREE_STEEPEST.copysign(k as f64),
            odd => FREE_BORDERS[odd / 2].sqrt().copysign(k as f64),
        }
    };
    let [least, greatest] = [border(column as isize), border(column as isize + 1)];
    let margin = |slope: f64| FREE_MARGIN * (1.0 + slope * slope);
    [least - margin(least), greatest + margin(greatest)]
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
    /// Bit of a code that is set for raw leaves.
    pub const RAW: u32 = 1 << 31;

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

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    #[test]
    fn rows_keep_all_bits() {
        let mut random = Rng::new(3);
        for _ in 0..100 {
            let bits = (0..4).fold(0u128, |bits, _| bits << 32 | u128::from(random.below(1 << 32)));
            assert_eq!(FreeDirections::new(7, FreeBins(bits)).bins().0, bits);
        }
    }

    #[test]
    fn places_are_encoded() {
        for leaf in
            [Child::Indexed(0), Child::Raw(0), Child::Indexed(77), Child::Raw(FreePlace::INDEX_LIMIT - 1)]
        {
            let place = FreePlace { leaf, slot: 9 };
            assert_eq!(FreePlace::from_code(place.code()), Some(place));
        }
        for leaf in [Child::Indexed(FreePlace::INDEX_LIMIT), Child::Node(0), Child::Tets(1)] {
            assert_eq!(FreePlace { leaf, slot: 0 }.code(), NONE);
        }
        assert_eq!(FreePlace::from_code(NONE), None);
    }

    #[test]
    fn columns_are_equally_wide_and_hold_their_directions() {
        let axes = free_axes([[0.0; 3], [2.0, 0.0, 0.0], [1.0, 3.0, 0.0]]).unwrap();
        let mut random = Rng::new(4);
        for _ in 0..20_000 {
            let d: [f64; 3] = random.unit_vector();
            let Some((bin, back)) = free_bin(&axes, d) else {
                assert!(d[2].abs() < 0.07, "{d:?}");
                continue;
            };
            assert_eq!(back, d[2] < 0.0);
            for (k, column) in [bin % FREE_SIDE, bin / FREE_SIDE].into_iter().enumerate() {
                let slope = d[k] / d[2].abs();
                assert_eq!((slope.atan() * 11.0 / std::f64::consts::PI + 5.5) as usize, column);
                let [least, greatest] = free_column(column);
                assert!(least < slope && slope < greatest);
            }
        }
    }

    #[test]
    fn slivers_and_extreme_sizes_have_no_axes() {
        assert!(free_axes([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e-3, 0.0]]).is_none());
        assert!(free_axes([[0.0; 3], [1e7, 0.0, 0.0], [0.0, 1e7, 0.0]]).is_none());
        assert!(free_axes([[0.0; 3], [1e-7, 0.0, 0.0], [0.0, 1e-7, 0.0]]).is_none());
        assert!(free_axes([[0.0; 3]; 3]).is_none());
        assert!(free_axes([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.1, 0.0]]).is_some());
    }
}
