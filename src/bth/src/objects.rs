//! The objects of a scene: all objects of one file, or of several files. Some may have new
//! positions.

use crate::clock;
use crate::refit::{OwnPositions, Refitted};
use bth_format::layout::{Object, kind};
use bth_format::object::ObjectView;
use bth_format::{Code, Error, File};
use std::time::{Duration, Instant};

/// The objects of a scene, by their index.
#[derive(Debug)]
pub(crate) struct Objects {
    files: Files,
    /// For each object its own positions, boxes and leaves, if it was given new positions; shorter
    /// than the number of objects, or empty, where the others have none.
    own_positions: Vec<Option<Box<OwnPositions>>>,
    /// True if some object has positions in f64.
    any_exact: bool,
}

/// Where objects come from.
#[derive(Debug)]
enum Files {
    /// All objects of a file, with the same indices.
    One(File),
    /// The objects of any number of files, in the order in which they were added.
    Several(ObjectTable),
}

/// The objects of several files.
#[derive(Debug, Default)]
struct ObjectTable {
    files: Vec<File>,
    /// For each object its file, as an index of `files`, and its index there.
    rows: Vec<(u32, u32)>,
}

impl ObjectTable {
    /// Adds the objects of another scene. Their files are shared.
    fn add(&mut self, objects: &Files) {
        match objects {
            Files::One(file) => {
                let row = self.file_row(file);
                self.rows.extend((0..file.object_count()).map(|object| (row, object)));
            }
            Files::Several(table) => {
                let rows: Vec<u32> = table.files.iter().map(|file| self.file_row(file)).collect();
                self.rows.extend(table.rows.iter().map(|(file, object)| (rows[*file as usize], *object)));
            }
        }
    }

    /// The index of a file, which is added unless one that shares its memory is there.
    fn file_row(&mut self, file: &File) -> u32 {
        let same = |other: &File| std::ptr::eq(other.bytes(), file.bytes());
        self.files.iter().position(same).unwrap_or_else(|| {
            self.files.push(file.clone());
            self.files.len() - 1
        }) as u32
    }

    fn locate(&self, object: u32) -> Option<(&File, u32)> {
        let (file, object) = *self.rows.get(object as usize)?;
        Some((&self.files[file as usize], object))
    }
}

impl Objects {
    /// All objects of a file.
    pub(crate) fn of_file(file: File) -> Objects {
        let any_exact =
            file.table().iter().any(|entry| entry.kind == kind::EXACT_POSITIONS && entry.count != 0);
        Objects { files: Files::One(file), own_positions: Vec::new(), any_exact }
    }

    /// An empty table, to which the objects of several files can be added.
    pub(crate) fn of_several_files() -> Objects {
        let files = Files::Several(ObjectTable::default());
        Objects { files, own_positions: Vec::new(), any_exact: false }
    }

    /// Adds the objects of another scene, with the positions in their files, to a table of several
    /// files.
    pub(crate) fn add(&mut self, other: &Objects) {
        if let Files::Several(table) = &mut self.files {
            table.add(&other.files);
            self.any_exact |= other.any_exact;
        }
    }

    /// Number of objects.
    #[inline]
    pub(crate) fn count(&self) -> u32 {
        match &self.files {
            Files::One(file) => file.object_count(),
            Files::Several(table) => table.rows.len() as u32,
        }
    }

    /// The file of an object and the object's index there; `None` if there is no such object.
    pub(crate) fn locate(&self, object: u32) -> Option<(&File, u32)> {
        match &self.files {
            Files::One(file) => (object < file.object_count()).then_some((file, object)),
            Files::Several(table) => table.locate(object),
        }
    }

    /// The sections of an object, those that new positions have replaced among them.
    #[inline]
    pub(crate) fn view(&self, object: u32) -> &ObjectView<'_> {
        const CHECKED: &str = "an object below object_count, checked when opened";
        if let Some(Some(own)) = self.own_positions.get(object as usize) {
            return own.view();
        }
        match &self.files {
            Files::One(file) => file.view(object).ok().expect(CHECKED),
            Files::Several(table) => {
                let (file, object) = table.locate(object).expect(CHECKED);
                file.view(object).ok().expect(CHECKED)
            }
        }
    }

    /// The sections of the only object of a file that was given no new positions; `None` elsewhere,
    /// and before the first [`Self::view`].
    #[inline(always)]
    pub(crate) fn sole_view(&self) -> Option<&ObjectView<'_>> {
        match &self.files {
            Files::One(file) if self.own_positions.is_empty() => file.sole_view(),
            _ => None,
        }
    }

    /// Like [`Self::view`], of an object that may not have been checked; `None` if its sections do
    /// not fit each other.
    pub(crate) fn unchecked_view(&self, object: u32) -> Option<&ObjectView<'_>> {
        if self.has_own_positions(object) {
            return Some(self.view(object));
        }
        let (file, object) = self.locate(object)?;
        file.view(object).ok()
    }

    /// Returns true if the object has been given positions that differ from its file.
    fn has_own_positions(&self, object: u32) -> bool {
        self.own_positions.get(object as usize).is_some_and(Option::is_some)
    }

    /// The `OBJECT` row of an object. Other sections of the object are not read.
    pub(crate) fn header(&self, object: u32) -> &Object {
        if let Some(Some(own)) = self.own_positions.get(object as usize) {
            return own.view().header;
        }
        let (file, object) = self.locate(object).expect("an object below object_count");
        file.object_header(object)
    }

    /// The origin of an object's space in the space of its source.
    pub(crate) fn anchor(&self, object: u32) -> [f64; 3] {
        self.locate(object).filter(|_| self.any_exact).map_or([0.0; 3], |(file, row)| file.anchor(row))
    }

    /// Returns true if some object has positions in f64.
    pub(crate) fn any_exact(&self) -> bool {
        self.any_exact
    }

    /// Returns true if reading the nodes of an object may wait for the disk: they are in a mapped
    /// file.
    pub(crate) fn is_mapped(&self, object: u32) -> bool {
        !self.has_own_positions(object) && self.locate(object).is_some_and(|(file, _)| file.is_mapped())
    }

    /// The file, if the scene is one.
    pub(crate) fn sole_file(&self) -> Option<&File> {
        match &self.files {
            Files::One(file) => Some(file),
            Files::Several(_) => None,
        }
    }

    /// Size in bytes of the sections that traversal reads.
    pub(crate) fn resident_bytes(&self) -> u64 {
        match &self.files {
            Files::One(file) => file.resident_bytes(),
            Files::Several(table) => {
                table.files.iter().map(File::resident_bytes).fold(0, u64::saturating_add)
            }
        }
    }

    /// The own positions, boxes and leaves of an object, which are made if it has none yet.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S006` if it is not deformable, `BTH-O001` if
    /// there is not enough memory.
    pub(crate) fn own_positions(&mut self, object: u32) -> Result<&mut OwnPositions, Error> {
        let count = self.count();
        let Some((file, row)) = self.locate(object) else {
            let expected = format!("an object below {count}");
            return Err(Error::of_call(Code::NoSuchObject, expected, format!("{object}")));
        };
        let index = object as usize;
        if !self.has_own_positions(object) {
            let new = Box::new(OwnPositions::new(file, row)?);
            if self.own_positions.len() <= index {
                self.own_positions.resize_with(index + 1, || None);
            }
            self.own_positions[index] = Some(new);
        }
        Ok(self.own_positions[index].as_mut().expect("just made"))
    }

    /// Refits objects to their staged positions. The time counts from `start`.
    pub(crate) fn refit(&mut self, objects: &[u32], start: Option<Instant>) -> Refitted {
        if objects.is_empty() {
            return Refitted { objects: 0, cost_ratio: 1.0, time: Duration::ZERO };
        }
        let mut cost_ratio: f64 = 0.0;
        for object in objects {
            if let Some(Some(own)) = self.own_positions.get_mut(*object as usize) {
                own.refit_staged();
                cost_ratio = cost_ratio.max(own.cost_ratio());
            }
        }
        Refitted { objects: objects.len(), cost_ratio, time: clock::elapsed(start) }
    }

    /// Gives objects the positions before their last refit. The positions of that refit are staged
    /// again.
    pub(crate) fn undo_refit(&mut self, objects: &[u32]) {
        for object in objects {
            if let Some(Some(own)) = self.own_positions.get_mut(*object as usize) {
                own.undo();
            }
        }
    }
}
