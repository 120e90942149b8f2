//! The frame of a start triangle, in which its direction bins are cones around its normal.

use bth_format::layout::{FREE_BINS, FREE_SIDE, free_axes, free_column};
use std::sync::LazyLock;

/// A set of bins: bit i stands for bin i.
pub(super) type BinSet = u128;

/// The cone of a bin with its margin, from the origin, in object space. The promise of the bin lies strictly within it, also if these
/// rounded numbers are taken as exact.
pub(super) struct Cone {
    /// Directions of its edges, counter-clockwise or clockwise.
    pub(super) corners: [[f64; 3]; 4],
    /// Normals of its faces, inwards.
    pub(super) inward: [[f64; 3]; 4],
}

/// Least and greatest slopes of columns: those of the promise, and a little more than all rounding errors.
static COLUMNS: LazyLock<[[f64; 2]; FREE_SIDE]> = LazyLock::new(|| {
    std::array::from_fn(|column| {
        let [least, greatest] = free_column(column);
        let more = |slope: f64| 1e-9 * (1.0 + slope * slope);
        [least - more(least), greatest + more(greatest)]
    })
});

/// Share of the cosine-weighted directions of a side that lie in each bin.
pub(super) static SHARES: LazyLock<[f64; FREE_BINS]> = LazyLock::new(|| {
    // Form factor of the rectangle from (0, 0) to (x, y) in the plane at distance 1, seen from the origin.
    let factor = |x: f64, y: f64| {
        let part = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
        (part(x, y) + part(y, x)) / std::f64::consts::TAU
    };
    std::array::from_fn(|bin| {
        let [x, y] = [bin % FREE_SIDE, bin / FREE_SIDE].map(free_column);
        factor(x[1], y[1]) - factor(x[0], y[1]) - factor(x[1], y[0]) + factor(x[0], y[0])
    })
});

/// Unit axes at the first corner of a triangle: along its first edge, across, and along the normal of the side from which rays start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) axes: [[f64; 3]; 3],
    pub(super) origin: [f64; 3],
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

    /// Coordinates of a point.
    #[inline]
    pub(super) fn local(&self, p: [f64; 3]) -> [f64; 3] {
        let from = [0, 1, 2].map(|k| p[k] - self.origin[k]);
        self.axes.map(|axis| axis[0] * from[0] + axis[1] * from[1] + axis[2] * from[2])
    }

    /// The bins all of whose directions certainly have a positive product with a vector that has this error.
    pub(super) fn bins_along(&self, vector: [f64; 3], error: f64) -> BinSet {
        let [x, y, z] = self.axes.map(|axis| axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]);
        // Least products over columns and rows. Rounding errors are far below the slack.
        let slack = 1e-9 * (x.abs() + y.abs() + z.abs()) + 64.0 * error;
        let least = |factor: f64| COLUMNS.map(|[a, b]| (factor * a).min(factor * b));
        let (columns, rows) = (least(x), least(y));
        let mut bins = 0;
        for (row, in_row) in rows.into_iter().enumerate() {
            let above = slack - z - in_row;
            let of_row = columns
                .iter()
                .enumerate()
                .fold(0, |bits, (i, in_column)| bits | u32::from(*in_column > above) << i);
            bins |= BinSet::from(of_row) << (FREE_SIDE * row);
        }
        bins
    }

    pub(super) fn cone(&self, bin: usize) -> Cone {
        let [[x0, x1], [y0, y1]] = [COLUMNS[bin % FREE_SIDE], COLUMNS[bin / FREE_SIDE]];
        let vector = |[x, y, z]: [f64; 3]| {
            [0, 1, 2].map(|k| x * self.axes[0][k] + y * self.axes[1][k] + z * self.axes[2][k])
        };
        Cone {
            corners: [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| vector([x, y, 1.0])),
            inward: [[1.0, 0.0, -x0], [-1.0, 0.0, x1], [0.0, 1.0, -y0], [0.0, -1.0, y1]].map(vector),
        }
    }
}

/// Borders between columns as f32, reached by a column from either side with twice the margin: more than rounding errors of slopes.
pub(super) struct Borders {
    /// Slopes above entry i are certainly beyond column i.
    pub(super) above: [f32; FREE_SIDE],
    /// Slopes below entry i are certainly before column i.
    pub(super) below: [f32; FREE_SIDE],
}

pub(super) static BORDERS: LazyLock<Borders> = LazyLock::new(|| {
    let margin = |slope: f64| bth_format::layout::FREE_MARGIN * (1.0 + slope * slope);
    Borders {
        above: std::array::from_fn(|i| (COLUMNS[i][1] + margin(COLUMNS[i][1])) as f32),
        below: std::array::from_fn(|i| (COLUMNS[i][0] - margin(COLUMNS[i][0])) as f32),
    }
});

/// The bins of columns and rows from the first to the last.
#[inline]
pub(super) fn bins(columns: [u32; 2], rows: [u32; 2]) -> BinSet {
    /// Bit 0 of each row.
    const FIRST: BinSet = {
        let (mut bits, mut row) = (0, 0);
        while row < FREE_SIDE {
            bits |= 1 << (FREE_SIDE * row);
            row += 1;
        }
        bits
    };
    const SIDE: u32 = FREE_SIDE as u32;
    let of_row = (2u32 << columns[1]) - (1 << columns[0]);
    let before = |row: u32| (1 << (SIDE * row)) - 1;
    let in_rows = FIRST & before(rows[1] + 1) & !before(rows[0]);
    in_rows * BinSet::from(of_row)
}

/// The bins of slopes between the least and the greatest along both axes.
#[inline]
pub(super) fn bins_of_slopes(x: [f32; 2], y: [f32; 2]) -> BinSet {
    let borders = &*BORDERS;
    let range = |[least, greatest]: [f32; 2]| {
        let first = borders.above.iter().map(|border| u32::from(least > *border)).sum();
        let last = borders.below[1..].iter().map(|border| u32::from(greatest >= *border)).sum();
        (first <= last && greatest >= borders.below[0]).then_some([first, last])
    };
    let (Some(columns), Some(rows)) = (range(x), range(y)) else { return 0 };
    bins(columns, rows)
}
