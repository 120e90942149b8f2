//! The frame of a start triangle, in which its direction bins are cones around its normal.

use bth::simd::LANES;
use bth_format::layout::{FREE_BINS, FREE_SECTORS, FREE_SIDE, FreeSectors, free_axes, free_column};
use std::sync::LazyLock;

/// A set of bins: bit i is bin i.
pub(super) type BinSet = u128;

/// All columns, or rows, as bits.
pub(super) const ALL_COLUMNS: u32 = (1 << FREE_SIDE) - 1;

/// The bins that have a sector.
pub(super) const IN_SECTORS: BinSet = {
    let (mut all, mut sector) = (0, 0);
    while sector < FREE_SECTORS {
        all |= SECTORS[sector];
        sector += 1;
    }
    all
};

/// The bins of each sector.
pub(super) const SECTORS: [BinSet; FREE_SECTORS] = {
    let mut sectors = [0; FREE_SECTORS];
    let mut bin = 0;
    while bin < FREE_BINS {
        if let Some(sector) = FreeSectors::of_bin(bin) {
            sectors[sector] |= 1 << bin;
        }
        bin += 1;
    }
    sectors
};

/// Smallest and largest slopes of columns, in f32: the slopes of the promise, and a 2^-19 (1 + s²)
/// beyond, which is more than the rounding errors of sums of two products with them. Lanes from the
/// eleventh on are empty.
#[repr(align(64))]
pub(super) struct Columns {
    pub(super) least: [f32; LANES],
    pub(super) greatest: [f32; LANES],
}

pub(super) static COLUMNS: LazyLock<Columns> = LazyLock::new(|| {
    let mut columns = Columns { least: [f32::INFINITY; LANES], greatest: [f32::NEG_INFINITY; LANES] };
    for column in 0..FREE_SIDE {
        let [least, greatest] = free_column(column);
        let more = |slope: f64| (1.0 + slope * slope) / f64::from(1 << 19);
        columns.least[column] = (least - more(least)) as f32;
        columns.greatest[column] = (greatest + more(greatest)) as f32;
    }
    columns
});

/// Share of the cosine-weighted directions of a side that lie in each bin.
static SHARES: LazyLock<[f64; FREE_BINS]> = LazyLock::new(|| {
    // Form factor of the rectangle from (0, 0) to (x, y) in the plane at distance 1, seen from the
    // origin.
    let factor = |x: f64, y: f64| {
        let part = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
        (part(x, y) + part(y, x)) / std::f64::consts::TAU
    };
    std::array::from_fn(|bin| {
        let [x, y] = [bin % FREE_SIDE, bin / FREE_SIDE].map(free_column);
        factor(x[1], y[1]) - factor(x[0], y[1]) - factor(x[1], y[0]) + factor(x[0], y[0])
    })
});

/// Share of the cosine-weighted directions of a side that lie in each sector.
static SECTOR_SHARES: LazyLock<[f64; FREE_SECTORS]> = LazyLock::new(|| SECTORS.map(share));

/// Share of the cosine-weighted directions of a side that some bins hold.
pub(super) fn share(mut bins: BinSet) -> f64 {
    let shares = &*SHARES;
    let mut sum = 0.0;
    while bins != 0 {
        sum += shares[bins.trailing_zeros() as usize];
        bins &= bins - 1;
    }
    sum
}

/// Share of the cosine-weighted directions of a side that lie in sectors of a level or a greater
/// one.
pub(super) fn beyond(sectors: FreeSectors, level: usize) -> f64 {
    (0..FREE_SECTORS)
        .filter(|sector| sectors.level(*sector) >= level)
        .map(|sector| SECTOR_SHARES[sector])
        .sum()
}

/// Unit axes at the first corner of a triangle: along its first edge, across, and along the normal
/// of the side from which rays start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) axes: [[f64; 3]; 3],
    origin: [f64; 3],
}

impl Frame {
    /// `None` for triangles whose directions have no bins.
    pub(super) fn new(corners: [[f32; 3]; 3], is_back: bool) -> Option<Self> {
        let mut axes = free_axes(corners)?.map(|axis| {
            let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            axis.map(|x| x / length)
        });
        if is_back {
            axes[2] = axes[2].map(|x| -x);
        }
        Some(Frame { axes, origin: corners[0].map(f64::from) })
    }

    /// Coordinates of a point along the first two axes.
    pub(super) fn local(&self, p: [f32; 3]) -> [f64; 2] {
        let from = [0, 1, 2].map(|k| f64::from(p[k]) - self.origin[k]);
        [0, 1].map(|k| {
            let axis = self.axes[k];
            axis[0] * from[0] + axis[1] * from[1] + axis[2] * from[2]
        })
    }
}

/// The bins of columns, and of rows, before each.
const BEFORE: [[BinSet; FREE_SIDE + 1]; 2] = {
    let mut before = [[0; FREE_SIDE + 1]; 2];
    let mut end = 0;
    while end <= FREE_SIDE {
        let mut bin = 0;
        while bin < FREE_BINS {
            before[0][end] |= ((bin % FREE_SIDE < end) as BinSet) << bin;
            before[1][end] |= ((bin / FREE_SIDE < end) as BinSet) << bin;
            bin += 1;
        }
        end += 1;
    }
    before
};

/// The bins of columns and rows from the first to that before the end.
#[inline(always)]
pub(super) fn bins(columns: [usize; 2], rows: [usize; 2]) -> BinSet {
    static TABLE: [[BinSet; FREE_SIDE + 1]; 2] = BEFORE;
    let of = |k: usize, [first, end]: [usize; 2]| TABLE[k][end] & !TABLE[k][first];
    of(0, columns) & of(1, rows)
}
