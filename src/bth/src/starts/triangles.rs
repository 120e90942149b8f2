//! The triangles on which sixteen rays start: what must be read of them, without waiting for it.

use super::locate::prefetch_leaf;
use crate::intersect::start::{place, start_corners};
use crate::shortcuts::free::{FreeColumns, FreeRow};
use crate::simd::{LANES, Simd};
use bth_format::exact::is_zero_area;
use bth_format::layout::{Child, NONE, TrianglePlace};
use bth_format::object::{NodeBase, ObjectView};

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

/// The ids of the triangles on which sixteen rays start; an id may be anything.
#[derive(Clone, Copy)]
pub(super) struct TriangleIds {
    ids: [u32; LANES],
    /// Bits of the rays that start on another triangle than the one before. Neighbouring rays often
    /// start on the same one.
    new: u32,
}

impl TriangleIds {
    pub(super) const NONE: TriangleIds = TriangleIds { ids: [NONE; LANES], new: 0 };

    #[inline(always)]
    pub(super) fn new<S: Simd>(s: S, of: S::U) -> Self {
        let same = s.mask_bits(s.eq_u(of, s.lookup_u(of, s.load_u(&BEFORE[0]))));
        let mut ids = [NONE; LANES];
        s.store_u(of, &mut ids);
        TriangleIds { ids, new: !same & 0xffff | 1 }
    }

    /// Prefetches the rows and the places of the triangles.
    #[inline(always)]
    pub(super) fn prefetch_rows<S: Simd, R: FreeRow>(&self, s: S, object: &ObjectView<'_>, rows: &[R]) {
        let mut new = self.new;
        while new != 0 {
            let id = self.ids[new.trailing_zeros() as usize % LANES] as usize;
            new &= new - 1;
            if R::TELLS {
                s.prefetch(rows.as_ptr().wrapping_add(id));
            }
            s.prefetch(object.places.as_ptr().wrapping_add(id));
        }
    }

    /// Prefetches the leaves in which the triangles lie, whose places are there. Those on a grid,
    /// and what is beyond the lines of an indexed leaf, are not.
    #[inline(always)]
    pub(super) fn prefetch_leaves<S: Simd>(&self, s: S, object: &ObjectView<'_>) {
        let mut new = self.new;
        while new != 0 {
            let id = self.ids[new.trailing_zeros() as usize % LANES];
            new &= new - 1;
            prefetch_leaf(s, object, id);
        }
    }
}

/// The triangles on which sixteen rays start, and what the file knows of them. Each vector is a
/// cache line, so what is shorter comes last.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct StartTriangles {
    /// For each ray the column of its triangle: the first ray that starts there.
    column: [u32; LANES],
    /// Corners of the triangles, by corner and axis.
    pub(super) corners: [[[f32; LANES]; 3]; 3],
    /// Child codes of their leaves; `NONE` where there is no such triangle, or it has no area.
    pub(super) leaf: [u32; LANES],
    /// Their slots in the leaves.
    pub(super) slot: [u32; LANES],
    /// What the file knows of them.
    pub(super) known: FreeColumns,
    /// True if each ray has a separate column, even where rays start on the same triangle.
    is_expanded: bool,
}

impl StartTriangles {
    pub(super) const NONE: StartTriangles = StartTriangles {
        column: [0; LANES],
        corners: [[[0.0; LANES]; 3]; 3],
        leaf: [NONE; LANES],
        slot: [0; LANES],
        known: FreeColumns::NONE,
        is_expanded: false,
    };

    /// Reads the triangles.
    #[inline(always)]
    pub(super) fn fetch<S: Simd, R: FreeRow>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rows: &[R],
        triangles: &TriangleIds,
    ) {
        let (mut new, base) = (triangles.new, object.node_base());
        self.is_expanded = new == 0xffff;
        self.set_columns(s, new);
        while new != 0 {
            let lane = new.trailing_zeros() as usize % LANES;
            new &= new - 1;
            let id = triangles.ids[lane];
            if R::TELLS
                && let Some(row) = rows.get(id as usize)
            {
                row.copy(&mut self.known, lane);
            }
            self.set((object, base), id, lane);
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
    fn set(&mut self, (object, base): (&ObjectView<'_>, NodeBase<'_>), id: u32, column: usize) {
        let place = object.places.get(id as usize).copied().unwrap_or(NONE);
        // Most triangles lie in indexed leaves of f32.
        let code = Child::LEAF_BIT | place >> 4;
        let leaf = if place & TrianglePlace::RAW == 0 { base.indexed_leaf(code) } else { None };
        let Some(leaf) = leaf.filter(|_| !object.is_deformable()) else {
            return self.set_other(object, id, column);
        };
        let slot = place as usize % LANES;
        (self.leaf[column], self.slot[column]) = (code, slot as u32);
        for corner in 0..3 {
            let vertex = usize::from(leaf.corner[corner][slot]) % LANES;
            for axis in 0..3 {
                self.corners[corner][axis][column] = leaf.vertex[axis][vertex];
            }
        }
    }

    /// Like [`Self::set`], for any triangle.
    #[inline(never)]
    fn set_other(&mut self, object: &ObjectView<'_>, id: u32, column: usize) {
        self.leaf[column] = NONE;
        let Some((leaf, slot)) = place(object, id) else { return };
        let Some(corners) = start_corners(object, leaf, slot) else { return };
        if object.is_deformable() && is_zero_area(corners) {
            return;
        }
        (self.leaf[column], self.slot[column]) = (leaf, slot);
        for corner in 0..3 {
            for axis in 0..3 {
                self.corners[corner][axis][column] = corners[corner][axis];
            }
        }
    }

    /// Copies each triangle to the lanes of its rays.
    #[inline(always)]
    pub(super) fn expand<S: Simd, R: FreeRow>(&mut self, s: S) {
        if self.is_expanded {
            return;
        }
        let column = s.load_u(&self.column);
        for corner in &mut self.corners {
            for row in corner {
                s.store(s.lookup(s.load(row), column), row);
            }
        }
        for row in [&mut self.leaf, &mut self.slot] {
            s.store_u(s.lookup_u(s.load_u(row), column), row);
        }
        self.known.expand::<S, R>(s, column);
    }
}
