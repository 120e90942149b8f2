//! The cones of the direction bins, and the bins whose cone may meet a box.

use bth_format::layout::{FREE_BINS, FREE_SIDE, free_column};
use std::sync::LazyLock;

/// A set of bins: bit i stands for bin i.
pub(super) type BinSet = u128;

/// All bins.
pub(super) const ALL_BINS: BinSet = (1 << FREE_BINS) - 1;

/// The cone of a bin with its margin, from the origin. Numbers are exact.
pub(super) struct Cone {
    /// Directions of its edges, counter-clockwise or clockwise.
    pub(super) corners: [[f64; 3]; 4],
    /// Normals of its faces, inwards.
    pub(super) inward: [[f64; 3]; 4],
}

/// The cones of all bins.
pub(super) static CONES: LazyLock<[Cone; FREE_BINS]> = LazyLock::new(|| std::array::from_fn(cone));

fn cone(bin: usize) -> Cone {
    let (face, row, column) = (bin / 16, bin / FREE_SIDE % FREE_SIDE, bin % FREE_SIDE);
    let (axis, depth) = (face / 2, if face % 2 == 1 { -1.0 } else { 1.0 });
    let ([a0, a1], [b0, b1]) = (free_column(column), free_column(row));
    // A vector by its components along the axes k + 1, k + 2 and k, where k is the axis of the face.
    let vector = |x: f64, y: f64, z: f64| {
        let mut v = [0.0; 3];
        (v[(axis + 1) % 3], v[(axis + 2) % 3], v[axis]) = (x, y, z);
        v
    };
    Cone {
        corners: [[a0, b0], [a1, b0], [a1, b1], [a0, b1]].map(|[a, b]| vector(a, b, depth)),
        inward: [
            vector(1.0, 0.0, -a0 * depth),
            vector(-1.0, 0.0, a1 * depth),
            vector(0.0, 1.0, -b0 * depth),
            vector(0.0, -1.0, b1 * depth),
        ],
    }
}

/// A box of differences of points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Differences {
    pub(super) lower: [f64; 3],
    pub(super) upper: [f64; 3],
}

/// Differences of f32 in f64, and products of these with borders, have relative errors of a few 2^-53.
const OUTWARDS: f64 = 1.0 / (1u64 << 48) as f64;

impl Differences {
    /// The differences from points of the box `from` to points of the box `to`, rounded outwards.
    #[inline]
    pub(super) fn new(from: &[[f64; 3]; 2], to: &[[f64; 3]; 2]) -> Self {
        let (mut lower, mut upper) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let (a, b) = (to[0][k] - from[1][k], to[1][k] - from[0][k]);
            (lower[k], upper[k]) = (a - a.abs() * OUTWARDS, b + b.abs() * OUTWARDS);
        }
        Differences { lower, upper }
    }

    /// Lower bound of the squared length of the differences.
    #[inline]
    pub(super) fn squared_gap(&self) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let gap = self.lower[k].max(-self.upper[k]).max(0.0);
            sum += gap * gap;
        }
        sum * (1.0 - OUTWARDS)
    }

    /// The bins of `of` whose cones, without their tips, may hold one of the differences.
    #[inline]
    pub(super) fn bins(&self, of: BinSet) -> BinSet {
        let mut bins = 0;
        for axis in 0..3 {
            for negative in 0..2 {
                let first = 16 * (2 * axis + negative);
                let wanted = of >> first & 0xffff;
                if wanted == 0 {
                    continue;
                }
                let [near, far] = if negative == 0 {
                    [self.lower[axis].max(0.0), self.upper[axis]]
                } else {
                    [(-self.upper[axis]).max(0.0), -self.lower[axis]]
                };
                if far > 0.0 {
                    bins |= u128::from(self.face(axis, [near, far]) & wanted as u16) << first;
                }
            }
        }
        bins
    }

    /// The bins of a face that may be met at depths between `near` and `far` along its axis.
    #[inline]
    fn face(&self, axis: usize, [near, far]: [f64; 2]) -> u16 {
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        let columns = depths(self.lower[x], self.upper[x]);
        let rows = depths(self.lower[y], self.upper[y]);
        let mut bins = 0;
        for (j, [y_near, y_far]) in rows.into_iter().enumerate() {
            let (least, most) = (near.max(y_near), far.min(y_far));
            if least > most {
                continue;
            }
            for (i, [x_near, x_far]) in columns.into_iter().enumerate() {
                bins |= u16::from(least.max(x_near) <= most.min(x_far)) << (FREE_SIDE * j + i);
            }
        }
        bins
    }
}

/// Reciprocals of the least and greatest end of each column of bins, of which none is zero.
const RECIPROCALS: [[f64; 2]; FREE_SIDE] = {
    let ends = [free_column(0), free_column(1), free_column(2), free_column(3)];
    let mut reciprocals = [[0.0; 2]; FREE_SIDE];
    let mut column = 0;
    while column < FREE_SIDE {
        reciprocals[column] = [1.0 / ends[column][0], 1.0 / ends[column][1]];
        column += 1;
    }
    reciprocals
};

/// For each column of bins the depths z at which a component from `lower` to `upper` lies within the column, from a z to b z, rounded
/// outwards: a z is at most `upper`, and b z at least `lower`. The sign of an end says which of these bounds z from which side.
#[inline]
fn depths(lower: f64, upper: f64) -> [[f64; 2]; FREE_SIDE] {
    let down = |x: f64| x - x.abs() * OUTWARDS;
    let up = |x: f64| x + x.abs() * OUTWARDS;
    let [[a0, b0], [a1, b1], [a2, b2], [a3, b3]] = RECIPROCALS;
    [
        [down(upper * a0), up(lower * b0)],
        [down((upper * a1).max(lower * b1)), f64::INFINITY],
        [down((upper * a2).max(lower * b2)), f64::INFINITY],
        [down(lower * b3), up(upper * a3)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_format::layout::free_bin;
    use bth_random::Rng;

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|k| a[k] * b[k]).sum()
    }

    #[test]
    fn cones_hold_the_directions_of_their_bins() {
        let mut random = Rng::new(1);
        for _ in 0..20_000 {
            let d = random.unit_vector();
            let cone = &CONES[free_bin(d.map(|x| x as f32))];
            assert!(cone.inward.iter().all(|n| dot(*n, d) > 1e-4), "{d:?}");
        }
    }

    #[test]
    fn corners_lie_on_the_faces() {
        for cone in CONES.iter() {
            for n in cone.inward {
                let at: Vec<f64> = cone.corners.iter().map(|d| dot(n, *d)).collect();
                assert_eq!(at.iter().filter(|x| **x == 0.0).count(), 2, "{at:?}");
                assert_eq!(at.iter().filter(|x| **x > 0.1).count(), 2, "{at:?}");
            }
        }
    }

    #[test]
    fn bins_of_a_box_are_those_of_its_points_and_few_more() {
        let mut random = Rng::new(2);
        let (mut found, mut sampled) = (0, 0);
        for _ in 0..300 {
            let at: [f64; 3] = random.unit_vector();
            let size = random.between(0.01, 0.6);
            let lower = at.map(|x| x - size * random.unit_f64());
            let upper = at.map(|x| x + size * random.unit_f64());
            let bins = Differences { lower, upper }.bins(ALL_BINS);
            let mut seen: BinSet = 0;
            for _ in 0..3000 {
                let p: [f64; 3] = std::array::from_fn(|k| random.between(lower[k], upper[k]));
                seen |= 1 << free_bin(p.map(|x| x as f32));
            }
            assert_eq!(seen & !bins, 0, "{lower:?} {upper:?}");
            found += bins.count_ones();
            sampled += seen.count_ones();
        }
        assert!(f64::from(found) < 1.3 * f64::from(sampled), "{found} for {sampled}");
        assert_eq!(Differences { lower: [-1.0; 3], upper: [1.0; 3] }.bins(ALL_BINS), ALL_BINS);
    }

    #[test]
    fn gaps_are_lower_bounds() {
        let boxes = Differences::new(&[[0.0; 3], [1.0; 3]], &[[4.0, 0.5, -3.0], [5.0, 0.7, -2.0]]);
        assert!((boxes.squared_gap() - 13.0).abs() < 1e-9 && boxes.squared_gap() <= 13.0);
        assert_eq!(Differences::new(&[[0.0; 3], [1.0; 3]], &[[1.0; 3], [2.0; 3]]).squared_gap(), 0.0);
    }
}
