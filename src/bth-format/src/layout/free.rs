//! What rays that start on a triangle cannot hit. Specification: "Free directions".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Columns, and rows, of direction bins.
pub const FREE_SIDE: usize = 11;
/// Direction bins of a triangle.
pub const FREE_BINS: usize = FREE_SIDE * FREE_SIDE;
/// Squares of the slopes at which columns touch: tan²(k π / 22) for k = 1, 3, 5, 7, 9, rounded.
/// Columns are equally wide in terms of the angle that a direction is tilted by along an axis.
pub const FREE_BORDERS: [f64; 5] =
    [0.020672197824104982, 0.20856091329926152, 0.750830798121458, 2.4212305216220913, 11.598705569133076];
/// Max slope of the directions of bins.
pub const FREE_STEEPEST: f64 = 16.0;
/// How far the promise of a bin reaches beyond its borders: slopes s reach to s ± margin (1 + s²),
/// which is that angle. A reader may therefore compute slopes with rounding errors.
pub const FREE_MARGIN: f64 = 1.0 / 512.0;
/// Lengths of the edges at the first corner of a triangle whose directions are known.
pub const FREE_EDGES: [f64; 2] = [1.0 / (1u64 << 20) as f64, (1u64 << 20) as f64];
/// Min sine of the angle between these edges: rounding errors in f32 stay below the margin.
pub const FREE_LEAST_SINE: f64 = 1.0 / 128.0;
/// Sectors of directions, into which columns and rows of bins are joined: four by four.
pub const FREE_SECTORS: usize = 16;
/// For each column of bins its column of sectors, and the same for rows. The outermost ones, in
/// which directions are nearly always blocked at once, have none.
pub const FREE_SECTOR_OF: [Option<usize>; FREE_SIDE] =
    [None, Some(0), Some(0), Some(1), Some(1), Some(1), Some(2), Some(2), Some(3), Some(3), None];
/// The min and max distance of a level: squares of them neither vanish nor overflow.
pub const FREE_DISTANCE_RANGE: [f32; 2] = [1.0 / (1u64 << 50) as f32, (1u64 << 50) as f32];

/// A row of `FREE_DIRECTIONS`, by triangle id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeDirections {
    /// [`FreeSectors`] of the side that `bins` are of.
    pub sectors: u32,
    /// [`FreeBins`], the lowest bits first.
    pub bins: [u32; 4],
}

/// A row of `FREE_DISTANCES`, by triangle id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeDistances {
    /// [`FreeSectors`] of the front, and of the back.
    pub sectors: [u32; 2],
}

/// The row of `FREE_LEVELS`.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct FreeLevels {
    /// Distances in object space of the levels 1, 2 and 3 of [`FreeSectors`], ascending.
    pub distance: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

assert_layout! {
    FreeDirections 20 { bins 4 }
    FreeDistances 8 { sectors 0 }
    FreeLevels 16 { reserved 12 }
}

/// Bit i tells whether bin i is free. Bits from 121 to 125, and 127, are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FreeBins(pub u128);

impl FreeBins {
    /// The bits of all bins.
    pub const ALL: u128 = (1 << FREE_BINS) - 1;
    /// Set where directions are those on the back of the triangle, from which its corners are seen
    /// clockwise.
    pub const BACK: u128 = 1 << 126;

    /// Returns true if directions are those on the back.
    #[inline(always)]
    pub const fn is_back(self) -> bool {
        self.0 & Self::BACK != 0
    }

    /// Returns true if a bin is free.
    #[inline(always)]
    pub const fn is_free(self, bin: usize) -> bool {
        bin < FREE_BINS && self.0 >> bin & 1 == 1
    }
}

/// A level for each sector, from 0 to 3: nothing is hit within the distance of the level; for level
/// 0 nothing is known. Bits 0 to 15 are the low bits of the levels, bits 16 to 31 the high ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FreeSectors(pub u32);

impl FreeSectors {
    /// The max level.
    pub const LEVELS: usize = 3;

    /// The sector of a bin, if it has one.
    #[inline(always)]
    pub const fn of_bin(bin: usize) -> Option<usize> {
        match (FREE_SECTOR_OF[bin / FREE_SIDE], FREE_SECTOR_OF[bin % FREE_SIDE]) {
            (Some(row), Some(column)) => Some(4 * row + column),
            _ => None,
        }
    }

    /// Returns the level of a bin's sector, 0 without a sector.
    #[inline(always)]
    pub const fn level_of_bin(self, bin: usize) -> usize {
        match Self::of_bin(bin) {
            Some(sector) => self.level(sector),
            None => 0,
        }
    }

    /// The level of a sector.
    #[inline(always)]
    pub const fn level(self, sector: usize) -> usize {
        (self.0 >> sector & 1 | (self.0 >> (sector + 16) & 1) << 1) as usize
    }

    /// With the level of a sector, which is 0 before.
    pub const fn with(self, sector: usize, level: usize) -> Self {
        let level = level as u32;
        FreeSectors(self.0 | (level & 1) << sector | (level >> 1 & 1) << (sector + 16))
    }
}

impl FreeLevels {
    /// The distance within which nothing is hit in a sector of a level.
    #[inline(always)]
    pub fn within(&self, level: usize) -> f32 {
        level.checked_sub(1).map_or(0.0, |above| self.distance[above])
    }
}

impl FreeDirections {
    /// No free direction is known.
    pub const UNKNOWN: Self = FreeDirections { sectors: 0, bins: [0; 4] };

    /// The row of a triangle.
    pub fn new(sectors: FreeSectors, bins: FreeBins) -> Self {
        let bins = std::array::from_fn(|k| (bins.0 >> (32 * k)) as u32);
        FreeDirections { sectors: sectors.0, bins }
    }

    /// The bins.
    #[inline(always)]
    pub fn bins(&self) -> FreeBins {
        FreeBins(self.bins.iter().rev().fold(0, |bits, word| bits << 32 | u128::from(*word)))
    }
}

impl FreeDistances {
    /// No distance is known.
    pub const UNKNOWN: Self = FreeDistances { sectors: [0; 2] };
}

/// What an object knows of the directions of a triangle, from whichever section it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownFree {
    /// The sectors of the front, and of the back.
    pub sectors: [FreeSectors; 2],
    /// The free bins; none where the section has none.
    pub bins: FreeBins,
}

impl KnownFree {
    /// Returns true if nothing is known.
    pub fn is_nothing(&self) -> bool {
        self.sectors == [FreeSectors(0); 2] && self.bins == FreeBins(0)
    }
}

impl From<&FreeDirections> for KnownFree {
    #[inline(always)]
    fn from(row: &FreeDirections) -> Self {
        let (bins, mut sectors) = (row.bins(), [FreeSectors(0); 2]);
        sectors[usize::from(bins.is_back())] = FreeSectors(row.sectors);
        KnownFree { sectors, bins }
    }
}

impl From<&FreeDistances> for KnownFree {
    #[inline(always)]
    fn from(row: &FreeDistances) -> Self {
        KnownFree { sectors: row.sectors.map(FreeSectors), bins: FreeBins(0) }
    }
}

/// Axes of the directions of a triangle with corners a, b, c, not normalized: b - a, normal × (b -
/// a), and the normal (b - a) × (c - a). `None` for a triangle whose rounding errors may exceed the
/// margin.
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

/// The bin of a direction that leaves a triangle with these axes on its front, and whether it
/// leaves it on its back; `None` for directions that are too steep.
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

/// Min and max slope of the promise of a column, with the margin.
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

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    #[test]
    fn rows_keep_all_bits() {
        let mut random = Rng::new(3);
        for _ in 0..100 {
            let bits = (0..4).fold(0u128, |bits, _| bits << 32 | u128::from(random.below(1 << 32)));
            let sectors = (0..FREE_SECTORS)
                .fold(FreeSectors(0), |all, sector| all.with(sector, (bits >> (2 * sector) & 3) as usize));
            let row = FreeDirections::new(sectors, FreeBins(bits));
            assert_eq!(row.bins().0, bits);
            for sector in 0..FREE_SECTORS {
                assert_eq!(FreeSectors(row.sectors).level(sector), (bits >> (2 * sector) & 3) as usize);
            }
        }
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
