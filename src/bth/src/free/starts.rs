//! The triangles on which sixteen rays start: what must be read of them, without waiting for it.

use super::corners_at;
use crate::simd::{LANES, Simd};
use bth_format::layout::{Child, FreeBins, FreeDirections, FreeDistances, TrianglePlace};
use bth_format::object::{NodeBase, ObjectView};

/// Bit of the last word of bins.
const BACK: u32 = (FreeBins::BACK >> 96) as u32;

/// A row of one of the sections.
pub(super) trait Row {
    /// Whether it tells free bins.
    const HAS_BINS: bool;
    /// Copies what the row tells to a column.
    fn copy(&self, starts: &mut Starts, column: usize);
}

impl Row for FreeDirections {
    const HAS_BINS: bool = true;

    #[inline(always)]
    fn copy(&self, starts: &mut Starts, column: usize) {
        for word in 0..4 {
            starts.bins[word][column] = self.bins[word];
        }
        let back = if self.bins[3] & BACK != 0 { u32::MAX } else { 0 };
        starts.sectors[0][column] = self.sectors & !back;
        starts.sectors[1][column] = self.sectors & back;
    }
}

impl Row for FreeDistances {
    const HAS_BINS: bool = false;

    #[inline(always)]
    fn copy(&self, starts: &mut Starts, column: usize) {
        starts.sectors[0][column] = self.sectors[0];
        starts.sectors[1][column] = self.sectors[1];
    }
}

/// The lanes.
static LANE: [u32; LANES] = before(0);
/// For each lane the one that is 1, 2, 4 and 8 lanes before it, or the first.
static BEFORE: [[u32; LANES]; 4] = [before(1), before(2), before(4), before(8)];

const fn before(distance: usize) -> [u32; LANES] {
    let mut lanes = [0; LANES];
    let mut lane = distance;
    while lane < LANES {
        lanes[lane] = (lane - distance) as u32;
        lane += 1;
    }
    lanes
}

/// The triangles on which sixteen rays start.
#[derive(Clone, Copy)]
pub(super) struct Hints<'a> {
    triangle: &'a [u32; LANES],
    /// Bits of the rays that start on another triangle than the one before. Neighbouring rays often start on the same one.
    new: u32,
}

impl<'a> Hints<'a> {
    #[inline(always)]
    pub(super) fn new<S: Simd>(s: S, triangle: &'a [u32; LANES]) -> Self {
        let of = s.load_u(triangle);
        let same = s.mask_bits(s.eq_u(of, s.lookup_u(of, s.load_u(&BEFORE[0]))));
        Hints { triangle, new: !same & 0xffff | 1 }
    }

    /// Prefetches the rows and the places of the triangles.
    #[inline(always)]
    pub(super) fn prefetch_rows<S: Simd, R: Row>(&self, s: S, object: &ObjectView<'_>, rows: &[R]) {
        for &triangle in self.triangle {
            s.prefetch(rows.as_ptr().wrapping_add(triangle as usize));
            s.prefetch(object.places.as_ptr().wrapping_add(triangle as usize));
        }
    }

    /// Prefetches the leaves in which the triangles lie, whose places are there. Those on a grid, and what is beyond the lines of an
    /// indexed leaf, are not.
    #[inline(always)]
    pub(super) fn prefetch_leaves<S: Simd>(&self, s: S, object: &ObjectView<'_>) {
        let mut new = self.new;
        while new != 0 {
            let lane = new.trailing_zeros() as usize % LANES;
            new &= new - 1;
            let Some(place) = object.places.get(self.triangle[lane] as usize) else { continue };
            let leaf = object.lines.as_ptr().wrapping_add((place >> 4 & TrianglePlace::INDEX_LIMIT) as usize);
            for k in 0..4 {
                s.prefetch(leaf.wrapping_add(k));
            }
        }
    }
}

/// What the file knows of the triangles on which sixteen rays start. Each vector is a cache line, so what is shorter comes last.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Starts {
    /// For each ray the column of its triangle: the first ray that starts there.
    column: [u32; LANES],
    /// Corners of the triangles, by corner and axis. Triangles of which nothing is known have no area.
    pub(super) corners: [[[f32; LANES]; 3]; 3],
    /// The words of their bins.
    pub(super) bins: [[u32; LANES]; 4],
    /// The sectors of their fronts and backs.
    pub(super) sectors: [[u32; LANES]; 2],
    /// Whether all rays have columns of their own.
    is_expanded: bool,
}

impl Starts {
    pub(super) const NONE: Starts = Starts {
        column: [0; LANES],
        corners: [[[0.0; LANES]; 3]; 3],
        bins: [[0; LANES]; 4],
        sectors: [[0; LANES]; 2],
        is_expanded: false,
    };

    /// Reads the triangles.
    #[inline(always)]
    pub(super) fn fetch<S: Simd, R: Row>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rows: &[R],
        hints: &Hints<'_>,
    ) {
        let (mut new, base) = (hints.new, object.node_base());
        self.is_expanded = new == 0xffff;
        self.set_columns(s, new);
        while new != 0 {
            let lane = new.trailing_zeros() as usize % LANES;
            new &= new - 1;
            let triangle = hints.triangle[lane] as usize;
            let row = rows.get(triangle).zip(object.places.get(triangle));
            self.set((object, base), row, lane);
        }
    }

    /// Sets the columns: the last lane up to each whose bit is set.
    #[inline(always)]
    fn set_columns<S: Simd>(&mut self, s: S, new: u32) {
        let mut column = s.select_u(s.mask(new), s.load_u(&LANE), s.splat_u(0));
        for before in &BEFORE {
            let other = s.lookup_u(column, s.load_u(before));
            column = s.select_u(s.lt_u(column, other), other, column);
        }
        s.store_u(column, &mut self.column);
    }

    #[inline(always)]
    fn set<R: Row>(&mut self, of: (&ObjectView<'_>, NodeBase<'_>), row: Option<(&R, &u32)>, column: usize) {
        let (object, base) = of;
        // A triangle that does not exist has no row, nor has NONE.
        let Some((row, &place)) = row else {
            return self.set_corners([[0.0; 3]; 3], column);
        };
        row.copy(self, column);
        // Most triangles lie in indexed leaves of f32.
        let leaf = if place & TrianglePlace::RAW == 0 {
            base.indexed_leaf(Child::LEAF_BIT | place >> 4)
        } else {
            None
        };
        let Some(leaf) = leaf else {
            return self.set_corners(corners_at(object, place).unwrap_or_default(), column);
        };
        let slot = place as usize % LANES;
        for corner in 0..3 {
            let vertex = usize::from(leaf.corner[corner][slot]) % LANES;
            for axis in 0..3 {
                self.corners[corner][axis][column] = leaf.vertex[axis][vertex];
            }
        }
    }

    /// Sets the corners of a triangle. Nothing is known of one that has no area.
    #[inline(never)]
    fn set_corners(&mut self, corners: [[f32; 3]; 3], column: usize) {
        for corner in 0..3 {
            for axis in 0..3 {
                self.corners[corner][axis][column] = corners[corner][axis];
            }
        }
    }

    /// Copies each triangle to the lanes of its rays.
    #[inline(always)]
    pub(super) fn expand<S: Simd, R: Row>(&mut self, s: S) {
        if self.is_expanded {
            return;
        }
        let column = s.load_u(&self.column);
        for corner in &mut self.corners {
            for row in corner {
                s.store(s.lookup(s.load(row), column), row);
            }
        }
        for row in if R::HAS_BINS { &mut self.bins[..] } else { &mut [] } {
            s.store_u(s.lookup_u(s.load_u(row), column), row);
        }
        for row in &mut self.sectors {
            s.store_u(s.lookup_u(s.load_u(row), column), row);
        }
    }
}
