//! Binned SAH: "On fast Construction of SAH-based Bounding Volume Hierarchies" (Wald 2007).

use super::extent::Extent;
use super::split::{Reference, Split};
use rayon::prelude::*;

/// Largest number of bins.
pub(super) const MAX_BINS: usize = 32;
/// Nodes of more triangles are binned in parallel, in chunks.
const PARALLEL_COUNT: usize = 1 << 15;
const CHUNK: usize = 1 << 13;

#[derive(Clone, Copy)]
struct Bin<E> {
    bounds: E,
    count: u32,
}

/// The bins of each axis, or of each order of several poses. They are on the heap: 16 poses take
/// 150 KiB, and a thread that waits for others splits further nodes on top of its stack.
type Bins<E> = Vec<[Bin<E>; MAX_BINS]>;

fn empty<E: Extent>() -> Bins<E> {
    let orders = E::orders(|_| ()).as_ref().len();
    vec![[Bin { bounds: E::EMPTY, count: 0 }; MAX_BINS]; orders]
}

/// The range of the centres of triangles, halved (see [`Extent::half_center`]), per axis or order.
pub(super) struct Centers<E: Extent> {
    lower: E::Orders<f32>,
    upper: E::Orders<f32>,
}

impl<E: Extent> Centers<E> {
    fn empty() -> Self {
        Centers { lower: E::orders(|_| f32::INFINITY), upper: E::orders(|_| f32::NEG_INFINITY) }
    }

    #[inline(always)]
    fn add(&mut self, center: &E::Orders<f32>) {
        self.grow_to(center, center);
    }

    #[inline(always)]
    fn grow_to(&mut self, lower: &E::Orders<f32>, upper: &E::Orders<f32>) {
        for (a, b) in self.lower.as_mut().iter_mut().zip(lower.as_ref()) {
            *a = if *b < *a { *b } else { *a };
        }
        for (a, b) in self.upper.as_mut().iter_mut().zip(upper.as_ref()) {
            *a = if *b > *a { *b } else { *a };
        }
    }

    /// Returns true if all centres are equal.
    pub(super) fn coincide(&self) -> bool {
        self.lower.as_ref() == self.upper.as_ref()
    }

    /// The order of the widest range, the first of several.
    pub(super) fn widest(&self) -> usize {
        let extent = |k: usize| self.upper.as_ref()[k] - self.lower.as_ref()[k];
        (1..self.lower.as_ref().len()).fold(0, |best, k| if extent(k) > extent(best) { k } else { best })
    }
}

/// Maps centres to bins. The partition uses the same arithmetic, so both count alike.
struct Grid<E: Extent> {
    origin: E::Orders<f32>,
    scale: E::Orders<f32>,
    last: usize,
}

impl<E: Extent> Grid<E> {
    fn new(centers: &Centers<E>, bins: usize) -> Grid<E> {
        let scale = E::orders(|k| bins as f32 / (centers.upper.as_ref()[k] - centers.lower.as_ref()[k]));
        Grid { origin: centers.lower.clone(), scale, last: bins - 1 }
    }

    /// The cast saturates and turns the NaN of 0 * infinity (extent 0 or nearly so) to 0.
    #[inline(always)]
    fn bin(&self, center: f32, axis: usize) -> usize {
        (((center - self.origin.as_ref()[axis]) * self.scale.as_ref()[axis]) as u32 as usize).min(self.last)
    }

    #[inline(never)]
    fn fill(&self, references: &[Reference<E>]) -> Bins<E> {
        let mut bins = empty::<E>();
        for reference in references {
            let center = reference.bounds.half_center();
            for (k, (bins, center)) in bins.iter_mut().zip(center.as_ref()).enumerate() {
                let bin = &mut bins[self.bin(*center, k)];
                bin.bounds.grow(&reference.bounds);
                bin.count += 1;
            }
        }
        bins
    }
}

fn merge<E: Extent>(mut a: Bins<E>, b: Bins<E>) -> Bins<E> {
    for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
        a.bounds.grow(&b.bounds);
        a.count += b.count;
    }
    a
}

/// Bounds of the triangles and the range of their centres.
pub(super) struct Measured<E: Extent> {
    pub(super) bounds: E,
    pub(super) centers: Centers<E>,
}

/// Measures triangles.
pub(super) fn measure<E: Extent>(references: &[Reference<E>]) -> Measured<E> {
    let empty = || Measured { bounds: E::EMPTY, centers: Centers::empty() };
    let serial = |references: &[Reference<E>]| {
        let mut all = empty();
        for reference in references {
            all.bounds.grow(&reference.bounds);
            all.centers.add(&reference.bounds.half_center());
        }
        all
    };
    if references.len() <= PARALLEL_COUNT {
        return serial(references);
    }
    let join = |mut a: Measured<E>, b: Measured<E>| {
        a.bounds.grow(&b.bounds);
        a.centers.grow_to(&b.centers.lower, &b.centers.upper);
        a
    };
    references.par_chunks(CHUNK).map(serial).reduce(empty, join)
}

/// Two parts of triangles.
pub(super) struct Sides<E: Extent> {
    /// Triangles of the left one.
    pub(super) left: usize,
    /// Both, where they are measured already.
    pub(super) measured: [Option<Measured<E>>; 2],
}

impl<E: Extent> From<usize> for Sides<E> {
    fn from(left: usize) -> Self {
        Sides { left, measured: [None, None] }
    }
}

/// Partitions the references at the best of the boundaries between `bins` equal slabs per axis;
/// `None`, with nothing changed, when no boundary separates them.
// Keeps its frame out of the frame of the recursion.
#[inline(never)]
pub(super) fn split<E: Extent>(
    references: &mut [Reference<E>],
    centers: &Centers<E>,
    bins: usize,
) -> Option<Sides<E>> {
    let grid = Grid::new(centers, bins);
    let filled = if references.len() <= PARALLEL_COUNT {
        grid.fill(references)
    } else {
        references.par_chunks(CHUNK).map(|chunk| grid.fill(chunk)).reduce(empty::<E>, merge::<E>)
    };
    let total = references.len();
    let mut best = Split::NONE;
    for (axis, row) in filled.iter().enumerate() {
        if centers.lower.as_ref()[axis] >= centers.upper.as_ref()[axis] {
            continue;
        }
        // Costs of all triangles from each bin on; the sweep from the left then adds the costs of
        // those before.
        let mut right_cost = [f64::INFINITY; MAX_BINS];
        let (mut bounds, mut count) = (E::EMPTY, 0u32);
        let mut cost = f64::INFINITY;
        for (bin, right_cost) in row[..bins].iter().zip(&mut right_cost).rev() {
            if bin.count > 0 {
                bounds.grow(&bin.bounds);
                count += bin.count;
                cost = bounds.half_area() * f64::from(count);
            }
            *right_cost = cost;
        }
        let (mut bounds, mut count) = (E::EMPTY, 0u32);
        for at in 1..bins {
            // Behind an empty bin the boundary parts the same as before it.
            if row[at - 1].count == 0 {
                continue;
            }
            bounds.grow(&row[at - 1].bounds);
            count += row[at - 1].count;
            if (count as usize) < total {
                let cost = bounds.half_area() * f64::from(count) + right_cost[at];
                best.improve(cost, axis, at, count as usize, total);
            }
        }
    }
    let found = best.is_some().then_some(best)?;
    let is_left =
        |center: &E::Orders<f32>| grid.bin(center.as_ref()[found.axis], found.axis) < found.position;
    if total > PARALLEL_COUNT {
        partition(references, |r| is_left(&r.bounds.half_center()));
        return Some(found.left.into());
    }
    let mut centers = [Centers::empty(), Centers::empty()];
    partition(references, |r| {
        let center = r.bounds.half_center();
        let is_left = is_left(&center);
        centers[usize::from(!is_left)].add(&center);
        is_left
    });
    let all = |bins: &[Bin<E>]| bins.iter().fold(E::EMPTY, |all, bin| all.union(&bin.bounds));
    let (left, right) = filled[found.axis][..bins].split_at(found.position);
    let [a, b] = centers;
    let measured =
        [(left, a), (right, b)].map(|(part, centers)| Some(Measured { bounds: all(part), centers }));
    Some(Sides { left: found.left, measured })
}

/// Moves the references that are `is_left` to the front, in place. The order depends on the input
/// order alone.
fn partition<E>(references: &mut [Reference<E>], mut is_left: impl FnMut(&Reference<E>) -> bool) {
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
