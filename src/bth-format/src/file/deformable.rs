//! An object of a file with separate positions.

use super::File;
use super::buffer::Owned;
use crate::Identity;
use crate::error::{Code, Error, Result};
use crate::layout::{CacheLine, Object, WIDTH};
use crate::object::{ObjectBounds, ObjectView};
use std::sync::Arc;
use zerocopy::{FromBytes, IntoBytes};

/// A deformable object of a file whose positions have been replaced. It has its own nodes, leaves,
/// positions and bounds; everything else stays in the file.
#[derive(Debug)]
pub struct DeformableObject {
    // The view comes first so that it is dropped before what it borrows from. It has no destructor.
    view: ObjectView<'static>,
    lines: Owned,
    positions: Vec<[f32; 3]>,
    normals: Normals,
    header: Arc<Object>,
    file: File,
    object: u32,
}

/// Normals of a deformed object, in the rows of NORMALS.
pub type Normals = Option<Vec<[f32; 3]>>;

/// What a refit reads and writes.
#[derive(Debug)]
pub struct RefitParts<'a> {
    /// Nodes and leaves of the object, from the file or from the refit before.
    pub lines: &'a mut [CacheLine],
    /// As [`ObjectView::leaf_vertices`].
    pub leaf_vertices: &'a [[u32; WIDTH]],
    /// The new positions.
    pub positions: &'a [[f32; 3]],
}

impl DeformableObject {
    /// A copy of what a refit replaces.
    ///
    /// # Errors
    /// As [`File::object`]; `BTH-S006` if the object is not deformable; `BTH-O001` if there is not
    /// enough memory.
    #[allow(unsafe_code)]
    pub fn new(file: &File, object: u32) -> Result<Self> {
        let view = file.object(object)?;
        if !view.is_deformable() {
            return Err(Error::of_call(
                Code::NotDeformable,
                "a deformable object",
                format!("object {object}"),
            ));
        }
        let bytes = view.lines.as_bytes();
        let mut lines = Owned::zeroed(bytes.len()).ok_or_else(|| Error::memory(bytes.len() as u64))?;
        lines.bytes_mut().copy_from_slice(bytes);
        let positions = copy_of(view.positions)?;
        let header = Arc::new(*view.header);
        // SAFETY: `file`, which the view borrows from, is held next to it; see `extended`.
        let view = unsafe { extended(ObjectView { identity: Identity::new(), ..view }) };
        let mut deformed = Self { view, lines, positions, normals: None, header, file: file.clone(), object };
        deformed.set_view(true)?;
        Ok(deformed)
    }

    /// The object with its own positions.
    #[inline(always)]
    pub fn view(&self) -> &ObjectView<'_> {
        &self.view
    }

    /// Bytes on the heap.
    pub fn heap_bytes(&self) -> usize {
        self.lines.bytes().len() + size_of_val(self.positions.as_slice()) + size_of::<Object>()
    }

    /// Replaces the positions by the same number of others, and the normals: by others, by none at
    /// all (an empty vector), or by the file's (`None`). Returns the former ones. `refit` computes
    /// the boxes of nodes and the vertices of leaves from them, changes nothing else of the lines,
    /// and returns the bounds of all triangles: lower and upper end.
    ///
    /// # Errors
    /// None for an object that [`Self::new`] has made.
    pub fn refit<T>(
        &mut self,
        positions: &mut Vec<[f32; 3]>,
        normals: &mut Normals,
        refit: impl FnOnce(RefitParts<'_>) -> ([[f32; 3]; 2], T),
    ) -> Result<T> {
        // While memory is written to, nothing borrows from it; should `refit` panic, the file's
        // view remains.
        self.set_view(false)?;
        let view = self.view;
        std::mem::swap(&mut self.positions, positions);
        std::mem::swap(&mut self.normals, normals);
        let lines =
            <[CacheLine]>::mut_from_bytes(self.lines.bytes_mut()).ok().expect("a whole number of lines");
        let leaf_vertices = view.leaf_vertices;
        let ([lower, upper], result) = refit(RefitParts { lines, leaf_vertices, positions: &self.positions });
        if let Some(header) = Arc::get_mut(&mut self.header) {
            (header.lower, header.upper) = (lower, upper);
        }
        self.set_view(true)?;
        Ok(result)
    }

    /// Makes the view again: with the object's own memory, or as the file has it.
    #[allow(unsafe_code)]
    fn set_view(&mut self, own: bool) -> Result<()> {
        let mut view = ObjectView { identity: self.view.identity, ..self.file.object(self.object)? };
        if own {
            let lines =
                <[CacheLine]>::ref_from_bytes(self.lines.bytes()).ok().expect("a whole number of lines");
            let header: &Object = &self.header;
            let (bounds, positions) = (ObjectBounds::new(header), self.positions.as_slice());
            let normals = self.normals.as_deref().unwrap_or(view.normals);
            view = ObjectView {
                header,
                bounds,
                start_bounds: bounds.for_starts(),
                near_bounds: bounds.for_near_lines(),
                lines,
                positions,
                normals,
                ..view
            };
        }
        // SAFETY: the view borrows from `file` and, if `own`, from `lines`, `positions`, `normals`
        // and `header`, which are held next to it. They lie on the heap or in mapped pages, so they
        // do not move when `self` does, and are written to and replaced only in `refit`, which
        // first replaces the view by one that does not borrow from them. See `extended`.
        self.view = unsafe { extended(view) };
        Ok(())
    }
}

/// A copy of rows.
fn copy_of<T: Copy>(rows: &[T]) -> Result<Vec<T>> {
    let mut copy = Vec::new();
    copy.try_reserve_exact(rows.len()).map_err(|_| Error::memory(size_of_val(rows) as u64))?;
    copy.extend_from_slice(rows);
    Ok(copy)
}

/// The same view with a lifetime that cannot be named.
///
/// # Safety
/// The view is stored next to what it borrows from, is not used after that is moved, written to or
/// dropped, and is lent only for a borrow of the structure that holds both.
#[allow(unsafe_code)]
unsafe fn extended(view: ObjectView<'_>) -> ObjectView<'static> {
    // SAFETY: only the lifetime changes, and the caller promises that the view is not used beyond
    // the former one.
    unsafe { std::mem::transmute::<ObjectView<'_>, ObjectView<'static>>(view) }
}
