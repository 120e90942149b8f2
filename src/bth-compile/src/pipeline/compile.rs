//! The compilation of a model through the cache, from a file or from memory.

use super::compiler::Compiler;
use super::keys;
use super::object::Compiled;
use super::parts::may_be_in_parts;
use super::report::CompileReport;
use crate::cached::{Cache, Miss, replay, with_warnings};
use crate::error::{Error, Result};
use crate::monitor::{Monitor, Recording};
use crate::options::{CompileOptions, Structure};
use crate::shard::Shard;
use crate::source::{MESH_NAME, Model, SourceDigest, TriangleMesh};
use crate::stage::Clock;
use crate::write::Content;
use bth_cache::{Key, Record};
use bth_import::import_triangles;
use serde::Serialize;
use serde_json::Value;
use std::cell::OnceCell;
use std::path::Path;

/// Result of a compilation through the cache.
#[derive(Debug)]
pub struct CachedCompilation<R> {
    /// The compiled file; absent when the cache has it and the caller does not need the bytes.
    pub content: Option<Content>,
    /// The report of the stages; absent when the file came from the cache.
    pub built: Option<R>,
    /// The record of the compiled file, if the cache has one.
    pub record: Option<Record>,
    /// The report as JSON, of the compilation that made the file, which may be an earlier one.
    pub report: Value,
}

impl<R> CachedCompilation<R> {
    /// The content and the report of a compilation without a cache.
    pub(crate) fn into_built(self) -> (Content, R) {
        match (self.content, self.built) {
            (Some(content), Some(report)) => (content, report),
            _ => unreachable!("without a cache everything is built"),
        }
    }
}

/// Prediction of a compilation through the cache.
#[derive(Clone, Debug, Default)]
pub struct DryRun {
    /// The record of the compiled file, if the cache has it.
    pub record: Option<Record>,
    /// Differences from the last compilation of the same source, if the cache does not have the
    /// file.
    pub because: Vec<String>,
    /// Objects of a scene that would be built.
    pub parts: Vec<Miss>,
    /// Number of a scene's objects that would come from the cache.
    pub reused: u64,
}

impl DryRun {
    /// Looks a key up.
    pub(crate) fn of(key: Option<&Key>, cache: &Cache<'_>, monitor: &dyn Monitor) -> Self {
        let record = key.and_then(|key| cache.find(key, monitor));
        let because = match (&record, key) {
            (Some(_), _) => Vec::new(),
            (None, Some(key)) => cache.reasons(key, ""),
            (None, None) => vec!["no cache".to_owned()],
        };
        Self { record, because, ..Self::default() }
    }
}

/// What a file with one object is made from: the path of a model, or triangles in memory.
#[derive(Clone, Copy, Debug)]
pub enum CompileInput<'a> {
    /// A model file.
    Model(&'a Path),
    /// Triangles in memory. Their imported mesh is not kept in the cache.
    Triangles(TriangleMesh<'a>),
}

impl<'a, P: AsRef<Path> + ?Sized> From<&'a P> for CompileInput<'a> {
    fn from(path: &'a P) -> Self {
        CompileInput::Model(path.as_ref())
    }
}

impl<'a> From<TriangleMesh<'a>> for CompileInput<'a> {
    fn from(mesh: TriangleMesh<'a>) -> Self {
        CompileInput::Triangles(mesh)
    }
}

impl<'a> CompileInput<'a> {
    /// Its path, or its name in messages.
    fn path(self) -> &'a Path {
        match self {
            CompileInput::Model(path) => path,
            CompileInput::Triangles(_) => Path::new(MESH_NAME),
        }
    }

    /// Reads and hashes it.
    fn digest(self, options: &CompileOptions) -> Result<SourceDigest> {
        match self {
            CompileInput::Model(path) => SourceDigest::of(path, options.looks()),
            CompileInput::Triangles(mesh) => Ok(SourceDigest::of_triangles(mesh)),
        }
    }
}

/// Compiles a model from its path, or from a [`TriangleMesh`].
///
/// # Errors
/// Errors of the stages: a source that cannot be used or read, a limit of the format, cancellation.
/// For triangles in memory `BTH-I005` for an index that is not a row of the positions, and
/// `BTH-I004` for a corner that is not finite, both with the row of the triangle.
pub fn compile<'a>(
    source: impl Into<CompileInput<'a>>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Compiled, CompileReport)> {
    let (content, report) = compile_cached(source, options, &Cache::none(), &|_| true, monitor)?.into_built();
    Ok((Compiled { bytes: content.bytes()?.into_owned() }, report))
}

/// Compiles a model, or takes results from the cache that were made from the same content. `needed`
/// returns true to read the bytes of a file in the cache; with `&|_| true` the result always has
/// the content.
///
/// # Errors
/// The errors of [`compile`]; `BTH-O002` when the model changes meanwhile.
pub fn compile_cached<'a>(
    source: impl Into<CompileInput<'a>>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<CompileReport>> {
    compile_source(source.into(), options, cache, needed, monitor)
}

/// Builds those parts of a model into the cache that belong to a shard, if its object is built in
/// parts and the cache does not have the compiled file. Returns their number; `None` if there is
/// no part to build on any machine.
///
/// # Errors
/// The errors of [`compile_cached`].
pub fn compile_parts(
    source: &Path,
    options: &CompileOptions,
    cache: &Cache<'_>,
    shard: Shard,
    monitor: &dyn Monitor,
) -> Result<Option<u64>> {
    if !may_be_in_parts(source, options) {
        return Ok(None);
    }
    let mut clock = Clock::default();
    let (digest, key) = identify(CompileInput::Model(source), options, cache, monitor, &mut clock)?;
    let record = key.and_then(|key| cache.find(&key, monitor));
    if record.is_some_and(|record| cache.holds(&record)) {
        return Ok(None);
    }
    let mut compiler = Compiler { source, part: "", options, cache, clock: &mut clock, monitor };
    let (mesh, _, hash) = compiler.import(&Model { path: source, digest: &digest })?;
    compiler.parts_of(mesh, hash, (shard, 0))
}

/// What [`compile_cached`] would do. Only reads and hashes the model.
///
/// # Errors
/// When the model cannot be read.
pub fn dry_run(
    source: &Path,
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<DryRun> {
    let (_, key) = identify(CompileInput::Model(source), options, cache, monitor, &mut Clock::default())?;
    Ok(DryRun::of(key.as_ref(), cache, monitor))
}

fn compile_source(
    source: CompileInput<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<CompileReport>> {
    let mut clock = Clock::default();
    let (digest, key) = identify(source, options, cache, monitor, &mut clock)?;
    let model = Model { path: source.path(), digest: &digest };
    compile_or_fetch(cache, key.as_ref(), needed, monitor, |monitor| {
        let mut compiler =
            Compiler { source: model.path, part: "", options, cache, clock: &mut clock, monitor };
        let imported = match source {
            CompileInput::Model(_) => compiler.import(&model)?,
            CompileInput::Triangles(TriangleMesh { positions, triangles }) => {
                let import = || import_triangles(model.path, positions, triangles, options.wanted(), monitor);
                let (mesh, report) = compiler.clock.time("mesh", import)?;
                (mesh, report, OnceCell::new())
            }
        };
        let (file, report) = compiler.file(&model, imported)?;
        Ok((file.into(), report, true))
    })
}

/// Hashes a source. Returns its key too, if the compiled file may be kept.
fn identify(
    source: CompileInput<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
    clock: &mut Clock,
) -> Result<(SourceDigest, Option<Key>)> {
    if cache.store().is_none() {
        return Ok((clock.time("hash", || source.digest(options))?, None));
    }
    // In parallel, because starting the worker takes as long as hashing a small model.
    let (digest, tetgen) = std::thread::scope(|scope| {
        let name = || tetgen_in_keys(options, cache, monitor);
        let tetgen = std::thread::Builder::new().spawn_scoped(scope, name);
        let digest = clock.time("hash", || source.digest(options));
        // Where the system gives no more threads, one after the other.
        (digest, tetgen.map_or_else(|_| Ok(name()), |tetgen| tetgen.join()))
    });
    let digest = digest?;
    let tetgen = tetgen.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    let key = tetgen.map(|tetgen| keys::file(&digest, source.path(), options, &tetgen));
    Ok((digest, key))
}

/// The name of the tetrahedralizer in keys, empty if none is needed; `None` when nothing may be
/// kept.
pub(crate) fn tetgen_in_keys(
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<Option<String>> {
    if cache.store().is_none() || options.tets.planted.is_some() {
        return Ok(None);
    }
    match options.built_structure() {
        Structure::Bvh => Ok(Some(String::new())),
        _ => Ok(cache.tetgen(&options.tets, monitor)?.map(str::to_owned)),
    }
}

/// The file of a key: from the cache if it is there, else built, by one process if several want the
/// same. `build` also returns true if the bytes are to be kept.
pub(crate) fn compile_or_fetch<R: Serialize>(
    cache: &Cache<'_>,
    key: Option<&Key>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
    build: impl FnOnce(&dyn Monitor) -> Result<(Content, R, bool)>,
) -> Result<CachedCompilation<R>> {
    let fetched = || key.and_then(|key| fetch(cache, key, needed, monitor));
    let (found, _working) = cache.find_or_lock((key, ""), monitor, fetched)?;
    if let Some(found) = found {
        return Ok(found);
    }
    let recording = Recording::new(monitor);
    let (content, built, keep) = build(&recording)?;
    let report = with_warnings(&built, &recording).map_err(|e| Error::Internal {
        code: "BTH-X081",
        message: format!("the report cannot be written: {e}"),
    })?;
    let record = match (key, keep) {
        (Some(key), true) => cache.put_written(key, "", &|out| content.write_to(out), &report, &recording),
        (Some(key), false) => cache.put_name(key, (content.name(), content.length()), &report, monitor),
        (None, _) => None,
    };
    Ok(CachedCompilation { content: Some(content), built: Some(built), record, report })
}

/// The file of a key, if the cache has it.
fn fetch<R>(
    cache: &Cache<'_>,
    key: &Key,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Option<CachedCompilation<R>> {
    let mut record = cache.find(key, monitor)?;
    let content = if needed(&record) { Some(cache.read(&record, monitor)?.into()) } else { None };
    cache.hit(key, "");
    replay(&record.report, monitor);
    cache.store()?.touch(&record);
    let report = std::mem::take(&mut record.report);
    Some(CachedCompilation { content, built: None, report, record: Some(record) })
}
