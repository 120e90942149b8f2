//! Binned SAH: "On fast Construction of SAH-based Bounding Volume Hierarchies" (Wald 2007).

use super::bounds::Bounds;
use super::split::{Reference, Split};
use rayon::prelude::*;

/// Greatest number of bins.
pub(super) const MAX_BINS: usize = 32;
/// Nodes of more triangles are binned in parallel, in chunks.
const PARALLEL_COUNT: usize = 1 << 15;
const CHUNK: usize = 1 << 13;

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

type Bins = [[Bin; MAX_BINS]; 3];

const EMPTY: Bins = [[Bin { bounds: Bounds::EMPTY, count: 0 }; MAX_BINS]; 3];

/// Maps centres to bins. The partition uses the same arithmetic, so its counts agree with those of the bins.
#[derive(Clone, Copy)]
struct Grid {
    origin: [f32; 3],
    scale: [f32; 3],
    last: usize,
}

impl Grid {
    fn new(centers: &Bounds, bins: usize) -> Grid {
        let scale = std::array::from_fn(|k| bins as f32 / (centers.upper[k] - centers.lower[k]));
        Grid { origin: centers.lower, scale, last: bins - 1 }
    }

    /// The cast saturates and turns the NaN of 0 * infinity (extent 0 or nearly so) to 0.
    #[inline(always)]
    fn bin(&self, center: f32, axis: usize) -> usize {
        (((center - self.origin[axis]) * self.scale[axis]) as usize).min(self.last)
    }

    #[inline(never)]
    fn fill(&self, references: &[Reference]) -> Bins {
        let mut bins = EMPTY;
        for reference in references {
            let center = reference.bounds.half_center();
            for k in 0..3 {
                let bin = &mut bins[k][self.bin(center[k], k)];
                bin.bounds.grow(&reference.bounds);
                bin.count += 1;
            }
        }
        bins
    }
}

fn merge(mut a: Bins, b: Bins) -> Bins {
    for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
        a.bounds.grow(&b.bounds);
        a.count += b.count;
    }
    a
}

/// Bounds of the triangles and of their half centres (see [`Bounds::half_center`]).
pub(super) fn measure(references: &[Reference]) -> (Bounds, Bounds) {
    fn serial(references: &[Reference]) -> (Bounds, Bounds) {
        let (mut all, mut centers) = (Bounds::EMPTY, Bounds::EMPTY);
        for reference in references {
            all.grow(&reference.bounds);
            let center = reference.bounds.half_center();
            centers.grow(&Bounds { lower: center, upper: center });
        }
        (all, centers)
    }
    if references.len() <= PARALLEL_COUNT {
        return serial(references);
    }
    references
        .par_chunks(CHUNK)
        .map(serial)
        .reduce(|| (Bounds::EMPTY, Bounds::EMPTY), |a, b| (a.0.union(&b.0), a.1.union(&b.1)))
}

/// Partitions the references at the best of the boundaries between `bins` equal slabs per axis and
/// returns the size of the left side; `None`, with nothing changed, when no boundary separates them.
pub(super) fn split(references: &mut [Reference], centers: &Bounds, bins: usize) -> Option<usize> {
    let grid = Grid::new(centers, bins);
    let filled = if references.len() <= PARALLEL_COUNT {
        grid.fill(references)
    } else {
        references.par_chunks(CHUNK).map(|chunk| grid.fill(chunk)).reduce(|| EMPTY, merge)
    };
    let total = references.len();
    let mut best = Split::NONE;
    for (axis, row) in filled.iter().enumerate() {
        if centers.lower[axis] >= centers.upper[axis] {
            continue;
        }
        // Costs of all triangles from each bin on; the sweep from the left then adds the costs of those before.
        let mut right_cost = [f64::INFINITY; MAX_BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0u32);
        for (bin, cost) in row[..bins].iter().zip(&mut right_cost).rev() {
            bounds.grow(&bin.bounds);
            count += bin.count;
            if count > 0 {
                *cost = bounds.half_area() * f64::from(count);
            }
        }
        let (mut bounds, mut count) = (Bounds::EMPTY, 0u32);
        for at in 1..bins {
            bounds.grow(&row[at - 1].bounds);
            count += row[at - 1].count;
            if count > 0 && (count as usize) < total {
                let cost = bounds.half_area() * f64::from(count) + right_cost[at];
                best.improve(cost, axis, at, count as usize, total);
            }
        }
    }
    let found = best.is_some().then_some(best)?;
    let is_left = |r: &Reference| grid.bin(r.bounds.half_center()[found.axis], found.axis) < found.position;
    partition(references, is_left);
    Some(found.left)
}

/// Moves the references that are `is_left` to the front, in place. The order depends on the input order alone.
fn partition(references: &mut [Reference], is_left: impl Fn(&Reference) -> bool) {
    let (mut i, mut j) = (0, references.len());
    loop {
        while i < j && is_left(&references[i]) {
            i += 1;
        }
        while i < j && !is_left(&references[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return;
        }
        references.swap(i, j - 1);
        i += 1;
        j -= 1;
    }
}
