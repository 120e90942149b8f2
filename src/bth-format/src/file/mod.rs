//! A BTH file in memory: read or mapped, its header and section table checked. Specification:
//! "Container" and "Opening".
//!
//! Opening costs O(sections) beyond reading the bytes, and does not read what is in the sections.
//! [`File::check`] checks the indices of an object, [`File::check_scene`] the indices of the scene,
//! [`crate::verify`] everything.

mod buffer;
mod deformable;
mod sections;
mod table;

pub use crate::layout::kind::stride as kind_stride;
pub use deformable::{DeformableObject, Normals, RefitParts};
pub use table::{content_id, hash128};

use crate::Identity;
use crate::check;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::{ExactPositions, MAX_LINES, ObjectBounds, ObjectView};
use crate::view;
use buffer::Buffer;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use zerocopy::{FromBytes, Immutable, KnownLayout};

/// An open file whose header and section table have been checked: `BTH-F001` to `BTH-F019` and
/// `BTH-F022` hold. Clones share the memory or the mapping, which lasts as long as the last of
/// them.
#[derive(Clone, Debug)]
pub struct File {
    buffer: Arc<Buffer>,
    /// Per object the first row of the section table, and at the end the number of rows of objects.
    rows: Arc<[u32]>,
    /// Per object its view, once it has been made. Views borrow from `buffer`; `'static` replaces a
    /// lifetime that cannot be named: see [`File::first_view`].
    views: Arc<[OnceLock<Box<ObjectView<'static>>>]>,
}

/// A section: its table entry and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct SectionView<'a> {
    /// The table entry.
    pub entry: &'a SectionEntry,
    /// The bytes, starting at a multiple of 64.
    pub bytes: &'a [u8],
}

/// Reads the section table of a file and nothing behind it, and checks it and the header.
///
/// # Errors
/// As [`File::read`].
pub fn read_table(path: &Path) -> Result<Vec<SectionEntry>> {
    let read = || {
        let (buffer, length) = Buffer::read_first(path, table::end)?;
        table::check(buffer.bytes(), length)?;
        let (header, _) = Header::ref_from_prefix(buffer.bytes()).ok().expect("checked above");
        Ok(table::entries(buffer.bytes(), header).to_vec())
    };
    read().map_err(|e: Error| e.in_file(path))
}

/// Memory for the bytes of a file that a caller writes there, so that they need not be copied once
/// more ([`File::from_memory`]).
#[derive(Debug)]
pub struct FileMemory(buffer::Owned);

impl FileMemory {
    /// Zero bytes.
    ///
    /// # Errors
    /// `BTH-O001` when there is not enough memory.
    pub fn zeroed(length: usize) -> Result<Self> {
        buffer::Owned::zeroed(length).map(Self).ok_or_else(|| Error::memory(length as u64))
    }

    /// The bytes.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        self.0.bytes_mut()
    }
}

impl File {
    /// Reads a file into memory and checks the header and the section table.
    ///
    /// # Errors
    /// `BTH-O001` when the file cannot be read, `BTH-O002` on big-endian machines, `BTH-F001` to
    /// `BTH-F019` or `BTH-F022` for the first invariant that the file violates.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Buffer::read(path).and_then(Self::new).map_err(|e| e.in_file(path))
    }

    /// Copies the bytes of a file, which need no alignment, and checks the header and the section
    /// table.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Self::new(Buffer::copy(bytes)?)
    }

    /// As [`Self::from_bytes`], without copying them.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_memory(memory: FileMemory) -> Result<Self> {
        Self::new(Buffer::Owned(memory.0))
    }

    /// As [`Self::from_bytes`], of a mapped file, without copying the bytes.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn from_map(map: memmap2::Mmap) -> Result<Self> {
        Self::new(Buffer::Mapped(map, false))
    }

    /// Maps a file and checks the header and the section table. Pages are read when they are used.
    ///
    /// # Safety
    /// Until the `File` and its clones are dropped nobody, in this process or another, may write to
    /// the file, truncate it or punch holes into it. Renaming another file over it or removing its
    /// name is allowed: the mapping keeps the old content.
    ///
    /// # Errors
    /// As [`Self::read`].
    #[allow(unsafe_code)]
    pub unsafe fn map(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        // SAFETY: the caller promises what `Buffer::map` requires, in the same words.
        let buffer = unsafe { Buffer::map(path) };
        buffer.and_then(Self::new).map_err(|e| e.in_file(path))
    }

    /// Returns true if the file is mapped and was larger than the [memory](crate::memory) that was
    /// available then. Each page is read when it is needed, so threads wait for the disk, and more
    /// threads than processors are faster.
    pub fn is_paged(&self) -> bool {
        self.buffer.is_paged()
    }

    /// Asks the system to read rows of this file before they are needed, and returns at once. Does
    /// nothing unless the file [is paged](Self::is_paged).
    pub fn will_need<T>(&self, rows: &[T]) {
        self.buffer.will_need(rows.as_ptr().addr(), size_of_val(rows));
    }

    fn new(buffer: Buffer) -> Result<Self> {
        if cfg!(target_endian = "big") {
            return Err(Error::at(Code::Host, 0, "a little-endian machine", "a big-endian one"));
        }
        let objects = table::check(buffer.bytes(), buffer.bytes().len() as u64)?;
        let views = (0..objects).map(|_| OnceLock::new()).collect();
        let (header, _) = Header::ref_from_prefix(buffer.bytes()).ok().expect("checked above");
        let of_objects =
            table::entries(buffer.bytes(), header).iter().take_while(|entry| entry.object != NONE);
        let (mut rows, mut end) = (Vec::with_capacity(objects as usize + 1), 0);
        for entry in of_objects {
            if entry.kind == kind::OBJECT {
                rows.push(end);
            }
            end += 1;
        }
        rows.push(end);
        Ok(Self { buffer: Arc::new(buffer), rows: rows.into(), views })
    }

    /// All bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        self.buffer.bytes()
    }

    /// The header.
    pub fn header(&self) -> &Header {
        let (header, _) = Header::ref_from_prefix(self.bytes()).ok().expect("checked when opened");
        header
    }

    /// The section table, sorted by object and kind.
    pub fn table(&self) -> &[SectionEntry] {
        table::entries(self.bytes(), self.header())
    }

    /// The sections, in the order of the table.
    pub fn sections(&self) -> impl ExactSizeIterator<Item = SectionView<'_>> {
        self.table().iter().map(|entry| self.section_of(entry))
    }

    /// The section of a kind; `object` is [`NONE`] for sections of the whole file. `None` when the
    /// file lacks it.
    pub fn section(&self, object: u32, kind: u32) -> Option<SectionView<'_>> {
        let table = self.table();
        let rows = match self.rows.get(object as usize..).and_then(|rows| rows.first_chunk()) {
            Some(&[first, end]) => &table[first as usize..end as usize],
            None => &table[*self.rows.last()? as usize..],
        };
        let row = rows.binary_search_by_key(&(object, kind), |entry| (entry.object, entry.kind)).ok()?;
        Some(self.section_of(&rows[row]))
    }

    /// The section of an entry of this file's table, which lies within the file (BTH-F012).
    fn section_of<'a>(&'a self, entry: &'a SectionEntry) -> SectionView<'a> {
        let bytes = &self.bytes()[entry.offset as usize..(entry.offset + entry.length) as usize];
        SectionView { entry, bytes }
    }

    /// Number of objects in the file.
    #[inline]
    pub fn object_count(&self) -> u32 {
        self.views.len() as u32
    }

    /// BLAKE3 of what the sections hold, without provenance: equal for files that answer all rays
    /// equally. Specification: "Content id".
    pub fn content_id(&self) -> [u8; 32] {
        self.header().content_id
    }

    /// The PROVENANCE section, JSON by the specification; `None` when the file lacks it or it is
    /// not UTF-8.
    pub fn provenance(&self) -> Option<&str> {
        std::str::from_utf8(self.section(NONE, kind::PROVENANCE)?.bytes).ok()
    }

    /// Bytes of the sections that tracing reads: no attributes, positions in f32 or provenance.
    pub fn resident_bytes(&self) -> u64 {
        self.table().iter().filter(|entry| self.is_traced(entry)).map(|entry| entry.length).sum()
    }

    /// Returns true if tracing reads the section of an entry of this file's table.
    pub fn is_traced(&self, entry: &SectionEntry) -> bool {
        let is_of_exact =
            || entry.kind == kind::TRIANGLES && self.section(entry.object, kind::EXACT_POSITIONS).is_some();
        entry.object != NONE && (kind::is_traced(entry.kind) || is_of_exact())
    }

    /// The sections of an object, whose **indices are not checked**: use [`Self::check`] before
    /// tracing.
    ///
    /// # Errors
    /// `BTH-O003` when there is no such object, `BTH-F101` when the kind of its tetrahedron records
    /// differs from the kind of TETS, `BTH-F104` when its grid is invalid or is not announced in
    /// the header.
    pub fn object(&self, object: u32) -> Result<ObjectView<'_>> {
        self.view(object).copied()
    }

    /// Returns true if the file is mapped, so that reading bytes may wait for the disk.
    pub fn is_mapped(&self) -> bool {
        matches!(*self.buffer, Buffer::Mapped(..))
    }

    /// As [`Self::object`], made once and kept.
    ///
    /// # Errors
    /// As [`Self::object`].
    #[inline]
    pub fn view(&self, object: u32) -> Result<&ObjectView<'_>> {
        // Every query comes here: the first view of an object is made out of line.
        match self.views.get(object as usize).and_then(OnceLock::get) {
            Some(view) => Ok(&**view),
            None => self.first_view(object),
        }
    }

    /// The view of the only object, if the file has only one and [`Self::view`] has made its view
    /// before.
    #[inline(always)]
    pub fn sole_view(&self) -> Option<&ObjectView<'_>> {
        match &*self.views {
            [view] => view.get().map(|view| &**view),
            _ => None,
        }
    }

    #[cold]
    #[inline(never)]
    #[allow(unsafe_code)]
    fn first_view(&self, object: u32) -> Result<&ObjectView<'_>> {
        let view = self.make_view(object)?;
        // SAFETY: only the lifetime changes. The view borrows from the bytes of `buffer`, which are
        // on the heap or mapped: they do not move when `self` does, are never written to or
        // replaced, and live until `self` and all its clones are dropped. `views` is private and
        // shared only with clones, which share `buffer`, too; what leaves this type is shortened to
        // a borrow of `self`, so no view is used after `buffer` is gone. A view has no destructor,
        // so the order in which the fields of `self` are dropped does not matter.
        let view = unsafe { std::mem::transmute::<ObjectView<'_>, ObjectView<'static>>(view) };
        Ok(self.views[object as usize].get_or_init(|| Box::new(view)))
    }

    fn make_view(&self, object: u32) -> Result<ObjectView<'_>> {
        if object >= self.object_count() {
            let expected = format!("an object below {}", self.object_count());
            return Err(Error::at(Code::NoSuchObject, 0, expected, format!("{object}")));
        }
        let header: &[Object] = self.slice(object, kind::OBJECT);
        let header = &header[0];
        let records: &[Link32] = self.slice(object, kind::TETS);
        let has_records = self.section(object, kind::TETS).is_some();
        if !(header.record == LINK32 && has_records || header.record == 0 && records.is_empty()) {
            let found = format!("record kind {} and {} rows of TETS", header.record, records.len());
            let (code, found) = match OLD_RECORDS.contains(&header.record) {
                true => (Code::Features, found + ", which are no longer read; compile the model again"),
                false => (Code::Record, found),
            };
            let offset = std::mem::offset_of!(Object, record) as u64;
            let error = Error::within(code, kind::OBJECT, offset, "a record kind that fits TETS", found);
            return Err(self.locate(error, object));
        }
        let grid = self.grid(header).map_err(|e| self.locate(e, object))?;
        let lines: &[CacheLine] = self.slice(object, kind::LINES);
        let mut bounds = ObjectBounds::new(header);
        let triangles = self.slice(object, kind::TRIANGLES);
        let exact = ExactPositions::new(self.slice(object, kind::EXACT_POSITIONS), triangles);
        if !exact.is_empty() {
            bounds = bounds.with_rounded_corners();
        }
        Ok(ObjectView {
            identity: Identity::new(),
            header,
            bounds,
            start_bounds: bounds.for_starts(),
            near_bounds: bounds.for_near_lines(),
            grid,
            lines: lines.get(..MAX_LINES).unwrap_or(lines),
            triangle_ids: self.slice(object, kind::TRIANGLE_IDS),
            tet_leaves: self.slice(object, kind::TET_LEAVES),
            records,
            tet_vertices: self.slice(object, kind::TET_VERTICES),
            tet_faces: self.slice(object, kind::TET_FACES),
            hull_faces: self.slice(object, kind::HULL_FACES),
            triangle_faces: self.slice(object, kind::TRIANGLE_FACES),
            leaf_vertices: self.slice(object, kind::LEAF_VERTICES),
            places: self.slice(object, kind::TRIANGLE_PLACES),
            free: self.slice(object, kind::FREE_DIRECTIONS),
            free_distances: self.slice(object, kind::FREE_DISTANCES),
            free_levels: self.slice(object, kind::FREE_LEVELS),
            positions: self.slice(object, kind::POSITIONS),
            triangles,
            anchor: self.anchor(object),
            exact,
            corners: self.slice(object, kind::CORNERS),
            normals: self.slice(object, kind::NORMALS),
            uvs: self.slice(object, kind::UVS),
            groups: self.slice(object, kind::GROUPS),
            group_runs: self.slice(object, kind::GROUP_RUNS),
            materials: self.slice(object, kind::MATERIALS),
            labels: self.slice(object, kind::LABELS),
            opacity: self.slice(object, kind::OPACITY),
            opacity_micro: self.slice(object, kind::OPACITY_MICRO),
        })
    }

    /// BTH-F104: the grid of an object, and that the header announces grids and widened boxes.
    fn grid(&self, object: &Object) -> Result<Option<Grid>> {
        let at = std::mem::offset_of!(Object, coordinates) as u64;
        let wrong = |expected: &'static str, found: String| {
            Error::within(Code::Coordinates, kind::OBJECT, at, expected, found)
        };
        let expected = "coordinates that are f32, with zeros, or a grid of points that are f32";
        let grid = Grid::from_object(object).map_err(|what| wrong(expected, String::from(what)))?;
        let features = self.header().required_features;
        if grid.is_some() && features & FEATURE_GRID == 0 {
            return Err(wrong("f32, as the header announces no grid", format!("{:#x}", object.coordinates)));
        }
        if object.coordinates & WIDENED_BOXES != 0 && features & FEATURE_WIDENED_BOXES == 0 {
            let found = format!("{:#x}", object.coordinates);
            return Err(wrong("boxes that are not widened, as the header announces none", found));
        }
        Ok(grid)
    }

    /// The sections of an object, after checking every index in them: traversing it neither reads
    /// out of bounds nor loops. Costs O(bytes of the object).
    ///
    /// # Errors
    /// As [`Self::object`], `BTH-F101` to `BTH-F147`, `BTH-F149`, `BTH-F160`, `BTH-F161`,
    /// `BTH-F163` to `BTH-F171`, `BTH-F173` to `BTH-F179` and `BTH-F190` to `BTH-F194`.
    pub fn check(&self, object: u32) -> Result<ObjectView<'_>> {
        let view = self.object(object)?;
        check::object(&view).map_err(|e| self.locate(e, object))?;
        check::exact(&view, self.slice(object, kind::ANCHOR)).map_err(|e| self.locate(e, object))?;
        let materials = self.materials(object);
        check::materials(&materials, view.materials.len(), view.header.triangles)
            .map_err(|e| self.locate(e, object))?;
        check::sequence(&view, &self.sequence(object)).map_err(|e| self.locate(e, object))?;
        check::deformation(&self.deformation(object), &view).map_err(|e| self.locate(e, object))?;
        Ok(view)
    }

    /// The OBJECT row of an object. Panics when there is no such object.
    pub fn object_header(&self, object: u32) -> &Object {
        let rows: &[Object] = self.slice(object, kind::OBJECT);
        &rows[0]
    }

    /// The origin of an object's space in the space of its source: zero but next to exact
    /// positions.
    pub fn anchor(&self, object: u32) -> [f64; 3] {
        let anchors: &[[f64; 3]] = self.slice(object, kind::ANCHOR);
        anchors.first().copied().unwrap_or_default()
    }

    /// The instances of the scene, whose indices are not checked; empty when the file has no scene.
    pub fn instances(&self) -> &[Instance] {
        self.slice(NONE, kind::INSTANCES)
    }

    /// The same error with its offset counted from the start of the file instead of the start of
    /// its section, which belongs to `object`.
    pub fn locate(&self, error: Error, object: u32) -> Error {
        let start = error.section().and_then(|s| self.section(object, s.kind)).map_or(0, |s| s.entry.offset);
        error.in_object(object).move_by(start)
    }

    /// A section as a slice of its elements; empty when the file lacks it.
    pub(crate) fn slice<T: FromBytes + KnownLayout + Immutable>(&self, object: u32, kind: u32) -> &[T] {
        view::rows(self.section_bytes(object, kind))
    }

    /// The bytes of a section; `None` if the file lacks it.
    fn section_bytes(&self, object: u32, kind: u32) -> Option<&[u8]> {
        self.section(object, kind).map(|section| section.bytes)
    }
}
