//! Reads ahead in files that do not fit in memory.
//!
//! Such files are mapped without reading ahead, since most rays need pages here and there. Rays
//! that hit neighbouring triangles are the exception: their leaves follow each other in the file,
//! and reading 64 KiB takes little longer than reading one page.

use crate::Scene;
use crate::intersect::start::place;
use crate::rays::PrimitiveRef;
use crate::surface::object_at;
use bth_format::layout::{CacheLine, Child};
use bth_format::object::ObjectView;

/// Bytes of nodes and leaves that are read at a time. With half as much pictures took longer.
const BLOCK: usize = 64 << 10;
/// Rows of triangles that are read at a time: the leaves of a block have about 3,000.
const ROWS: usize = 4096;

impl Scene {
    /// Asks the system to read what lies around a triangle, which rays that hit its neighbours will
    /// need, and returns at once. Does nothing unless the file of the triangle
    /// [is paged](bth_format::File::is_paged), and where there is no such triangle.
    ///
    /// A renderer calls this for the hits of a few rays before it traces the many rays that are
    /// close to them.
    pub fn fetch_around(&self, primitive: PrimitiveRef) {
        let Some(object) = object_at(self, primitive) else { return };
        let (file, _) = self.file_of(object);
        if !file.is_paged() {
            return;
        }
        let view = self.view(object);
        let id = primitive.triangle;
        let Some((line, first)) = place(view, id).and_then(|(leaf, _)| line_of(view, leaf)) else { return };
        file.will_need(block(view.lines, line, BLOCK / size_of::<CacheLine>()));
        file.will_need(block(view.triangle_ids, first, ROWS));
        file.will_need(block(view.places, id as usize, ROWS));
    }
}

/// The line of a triangle leaf, and its first row of TRIANGLE_IDS.
fn line_of(view: &ObjectView<'_>, leaf: u32) -> Option<(usize, usize)> {
    let (mut indexed, mut raw) = (None, None);
    let (index, first) = match Child::from_code(leaf)? {
        Child::Indexed(index) => (index, view.indexed(index, &mut indexed).first),
        Child::Raw(index) => (index, view.raw(index, &mut raw).first),
        Child::Node(_) | Child::Tets(_) => return None,
    };
    let lines = index as usize / if view.grid.is_some() { 2 } else { 1 };
    Some((lines, first as usize))
}

/// The block of rows around one of them.
fn block<T>(rows: &[T], row: usize, length: usize) -> &[T] {
    let first = row / length * length;
    &rows[first.min(rows.len())..(first + length).min(rows.len())]
}

#[cfg(test)]
mod tests {
    use super::block;

    #[test]
    fn blocks_end_with_the_rows() {
        let rows: Vec<usize> = (0..10).collect();
        assert_eq!([block(&rows, 3, 4), block(&rows, 4, 4)], [&[0, 1, 2, 3], &[4, 5, 6, 7]]);
        assert_eq!([block(&rows, 9, 4), block(&rows, 12, 4)], [&[8, 9][..], &[]]);
    }
}
