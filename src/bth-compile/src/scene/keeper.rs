//! Keeps the sections of objects until the scene's file is written: in memory while they are few,
//! then on disk.

use super::sections::ObjectSections;
use crate::cached::Cache;
use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::write::{Bytes, DiskFile, FileBuilder, assembled, defect, unread};
use bth_cache::Record;
use bth_format::file::read_table;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes of objects that are kept in memory.
const MEMORY: u64 = 64 << 20;
/// Bytes of a section that are collected before they go to disk.
const IN_PIECES: u64 = 16 << 20;
/// Bytes of a file without a name. A scene may need many of them: each is gone when the last of its
/// sections has been written.
const SPOOL: u64 = 1 << 30;
/// Bytes of meshes that are kept in memory until they are compiled.
const MESHES: u64 = 256 << 20;
/// Objects of this size in the cache are copied from there, not read into memory.
const LARGE: u64 = 4 << 20;
/// Objects in the cache whose files may be open at a time.
const MAX_PINNED: usize = 128;

/// Keeps sections, from several threads.
pub(super) struct Keeper {
    /// Where a file without a name may be; `None` to keep everything in memory.
    folder: Option<PathBuf>,
    /// Bytes that are kept in memory.
    memory: u64,
    state: Mutex<Held>,
}

/// What has been kept.
#[derive(Default)]
struct Held {
    bytes: u64,
    meshes: u64,
    pinned: usize,
    spool: Option<Arc<DiskFile>>,
    /// Bytes that the current file without a name has.
    spooled: u64,
}

impl Keeper {
    /// Keeps what exceeds the memory on disk: in the folder of the cache, else in the one for
    /// temporary files.
    pub(super) fn on_disk(cache: &Cache<'_>) -> Self {
        let folder = || cache.store().map_or_else(std::env::temp_dir, |store| store.folder().to_owned());
        // In a browser there are no files.
        let folder = (!cfg!(target_family = "wasm")).then(folder);
        Self { folder, memory: MEMORY, state: Mutex::default() }
    }

    /// Keeps everything in memory.
    pub(super) fn in_memory() -> Self {
        Self { folder: None, memory: MEMORY, state: Mutex::default() }
    }

    /// Returns true if a mesh of this size may stay in memory. Else it is read again when it is
    /// compiled.
    pub(super) fn has_room_for_mesh(&self, bytes: u64) -> bool {
        let mut state = self.state();
        state.meshes += bytes;
        self.folder.is_none() || state.meshes <= MESHES
    }

    fn state(&self) -> MutexGuard<'_, Held> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sections of the object in a file.
    ///
    /// # Errors
    /// `BTH-O020` when they cannot be written to disk.
    pub(super) fn keep(&self, file: bth_format::File) -> Result<ObjectSections> {
        let mut sections = ObjectSections::in_file(file);
        if let Some(spool) = self.spool_for(sections.bytes_in_all()) {
            sections.move_to(&mut |bytes| self.append(&spool, bytes))?;
        }
        Ok(sections)
    }

    /// Bytes of a section that need not be in memory any more; `None` where they may stay.
    ///
    /// # Errors
    /// The errors of [`Self::keep`].
    pub(super) fn keep_bytes(&self, bytes: &[u8]) -> Result<Option<Bytes<'static>>> {
        self.spool_for(bytes.len() as u64).map(|spool| self.append(&spool, bytes)).transpose()
    }

    fn append(&self, spool: &Arc<DiskFile>, bytes: &[u8]) -> Result<Bytes<'static>> {
        let range = spool.append(bytes).map_err(|e| self.unwritten(&e))?;
        Ok(Bytes::OnDisk(spool.clone(), range))
    }

    /// A section that is made in pieces.
    pub(super) fn pieces(&self) -> Pieces<'_> {
        Pieces { keeper: self, bytes: Vec::new(), file: None, written: 0, hasher: blake3::Hasher::new() }
    }

    /// The file of a builder, which need not stay in memory. Its header and table have been
    /// checked.
    ///
    /// # Errors
    /// The errors of [`assembled`]; `BTH-O020` when it cannot be written to disk.
    pub(super) fn assembled(&self, builder: FileBuilder<'_>) -> Result<bth_format::File> {
        let Some(folder) = self.folder.as_ref().filter(|_| builder.file_length() > self.memory) else {
            return assembled(&builder);
        };
        let write = |file: &mut std::fs::File| builder.write_to(&mut |bytes| file.write_all(bytes));
        let map = bth_files::mapped(folder, write);
        let map = map.map_err(|e| unread(&e).unwrap_or_else(|| self.unwritten(&e)))?;
        bth_format::File::from_map(map).map_err(defect)
    }

    fn unwritten(&self, error: &std::io::Error) -> Error {
        Error::File {
            code: "BTH-O020",
            path: self.folder.clone().unwrap_or_default(),
            message: format!("cannot write a temporary file: {error}"),
        }
    }

    /// The file that takes these bytes; `None` while memory has room for them.
    fn spool_for(&self, bytes: u64) -> Option<Arc<DiskFile>> {
        let mut state = self.state();
        let folder = self.folder.as_ref().filter(|_| state.bytes + bytes > self.memory);
        let Some(folder) = folder else {
            state.bytes += bytes;
            return None;
        };
        if state.spool.is_none() || state.spooled >= SPOOL {
            // Where no file can be made, memory has to do.
            let file = bth_files::nameless(folder).ok()?;
            state.spool = Some(Arc::new(DiskFile::open(folder, file)));
            state.spooled = 0;
        }
        state.spooled += bytes;
        state.spool.clone()
    }

    /// The sections of a large object that the cache has, which stay there; `None` where it is not
    /// large, or cannot be kept there.
    pub(super) fn pin(
        &self,
        record: &Record,
        cache: &Cache<'_>,
        monitor: &dyn Monitor,
    ) -> Option<ObjectSections> {
        {
            let mut state = self.state();
            if self.folder.is_none() || record.bytes < LARGE || state.pinned >= MAX_PINNED {
                return None;
            }
            state.pinned += 1;
        }
        let pin = cache.pin(record, monitor)?;
        let table = read_table(&pin.path).ok()?;
        ObjectSections::on_disk(&Arc::new(DiskFile::open(&pin.path, pin.file)), &table, 0).ok()
    }
}

/// A section that is made in pieces: in memory while it is small, then in a separate file.
pub(super) struct Pieces<'a> {
    keeper: &'a Keeper,
    /// What is not in the file.
    bytes: Vec<u8>,
    file: Option<Arc<DiskFile>>,
    /// Bytes in the file.
    written: u64,
    hasher: blake3::Hasher,
}

impl Pieces<'_> {
    /// Adds a piece.
    ///
    /// # Errors
    /// `BTH-O020` when it cannot be written to disk.
    pub(super) fn add(&mut self, piece: &[u8]) -> Result<()> {
        self.hasher.update(piece);
        self.bytes.extend_from_slice(piece);
        if (self.bytes.len() as u64) < IN_PIECES.min(self.keeper.memory) {
            return Ok(());
        }
        if let (None, Some(folder)) = (&self.file, &self.keeper.folder) {
            // Where no file can be made, memory has to do.
            let file = bth_files::nameless(folder).ok();
            self.file = file.map(|file| Arc::new(DiskFile::open(folder, file)));
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<()> {
        if let Some(file) = &self.file {
            file.append(&self.bytes).map_err(|e| self.keeper.unwritten(&e))?;
            self.written += self.bytes.len() as u64;
            self.bytes.clear();
        }
        Ok(())
    }

    /// The bytes of the section and their hash.
    ///
    /// # Errors
    /// The errors of [`Self::add`].
    pub(super) fn finish(mut self) -> Result<(Bytes<'static>, [u8; 16])> {
        self.flush()?;
        let hash = self.hasher.finalize().as_bytes()[..16].try_into().expect("32 bytes hold 16");
        let bytes = match self.file {
            Some(file) => Bytes::OnDisk(file, 0..self.written),
            None => Bytes::Owned(self.bytes.into()),
        };
        Ok((bytes, hash))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::CompileOptions;
    use crate::scene::compile::{CachePolicy, SceneSource, compile_in};
    use crate::scene::context::Context;
    use bth_import::Silent;
    use std::path::Path;

    const MANIFEST: &str = "version = 1\n\
        objects = [{ name = \"a\", model = \"a.obj\" }, { name = \"b\", model = \"a.obj\", color = [1, 0, 0] }]\n\
        [[nodes]]\nname = \"1\"\nobject = \"a\"\n[[nodes]]\nname = \"2\"\nobject = \"b\"\n";

    #[test]
    fn what_is_kept_on_disk_comes_to_the_same_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let manifest = bth_scene::parse(MANIFEST, Path::new("m")).unwrap();
        let (options, cache) = (CompileOptions::default(), Cache::none());
        let source = SceneSource { folder: folder.path(), name: Path::new("m") };
        let compiled = |keeper: Keeper| {
            let context = Context::new(&options, &cache, &Silent).unwrap();
            let context = Context { keeper: Arc::new(keeper), ..context };
            let policy = CachePolicy { whole: false, needed: &|_| true };
            let (content, _) = compile_in(&manifest, source, &context, policy).unwrap().into_built();
            (content.bytes().unwrap().into_owned(), context.keeper.state().spool.is_some())
        };
        let (in_memory, spooled) = compiled(Keeper::in_memory());
        assert!(!spooled);
        let on_disk = Keeper { memory: 0, ..Keeper::on_disk(&cache) };
        assert_eq!(compiled(on_disk), (in_memory, true));
    }
}
