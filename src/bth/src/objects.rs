//! The objects of a scene: all of one file, or those of several.

use bth_format::File;
use bth_format::layout::Object;
use bth_format::object::ObjectView;

/// The objects of a scene, by their index.
#[derive(Debug)]
pub(crate) enum Objects {
    /// All objects of a file, with the same indices.
    File(File),
    /// The objects of any number of files, in the order in which they were added.
    Several(ObjectTable),
}

/// The objects of several files.
#[derive(Debug, Default)]
pub(crate) struct ObjectTable {
    files: Vec<File>,
    /// For each object its file, as an index of `files`, and its index there.
    rows: Vec<(u32, u32)>,
}

impl ObjectTable {
    /// Adds the objects of another scene. Their files are shared.
    pub(crate) fn add(&mut self, objects: &Objects) {
        match objects {
            Objects::File(file) => {
                let row = self.file_row(file);
                self.rows.extend((0..file.object_count()).map(|object| (row, object)));
            }
            Objects::Several(table) => {
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
    /// Number of objects.
    #[inline]
    pub(crate) fn count(&self) -> u32 {
        match self {
            Objects::File(file) => file.object_count(),
            Objects::Several(table) => table.rows.len() as u32,
        }
    }

    /// The file of an object and the object's index there; `None` if there is no such object.
    pub(crate) fn locate(&self, object: u32) -> Option<(&File, u32)> {
        match self {
            Objects::File(file) => (object < file.object_count()).then_some((file, object)),
            Objects::Several(table) => table.locate(object),
        }
    }

    /// The sections of an object.
    #[inline]
    pub(crate) fn view(&self, object: u32) -> &ObjectView<'_> {
        const CHECKED: &str = "an object below object_count, checked when opened";
        match self {
            Objects::File(file) => file.view(object).expect(CHECKED),
            Objects::Several(table) => {
                let (file, object) = table.locate(object).expect(CHECKED);
                file.view(object).expect(CHECKED)
            }
        }
    }

    /// The `OBJECT` row of an object. Other sections of the object are not read.
    pub(crate) fn header(&self, object: u32) -> &Object {
        let (file, object) = self.locate(object).expect("an object below object_count");
        file.object_header(object)
    }

    /// The file, if the scene is one.
    pub(crate) fn sole_file(&self) -> Option<&File> {
        match self {
            Objects::File(file) => Some(file),
            Objects::Several(_) => None,
        }
    }

    /// Size in bytes of the sections that traversal reads.
    pub(crate) fn resident_bytes(&self) -> u64 {
        match self {
            Objects::File(file) => file.resident_bytes(),
            Objects::Several(table) => {
                table.files.iter().map(File::resident_bytes).fold(0, u64::saturating_add)
            }
        }
    }
}
