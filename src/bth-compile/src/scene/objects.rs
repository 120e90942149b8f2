//! The objects of a scene: each source read once, equal geometry stored once.

use super::compile::Context;
use super::meshes;
use crate::cached::{self, MeshFacts, SourceDigest};
use crate::costs;
use crate::error::{Error, Place, Result};
use crate::pipeline::{self, Clock, Options, parts};
use crate::tets;
use crate::write::{self, FileBuilder, object};
use bth::layout::kind;
use bth_cache::Digest;
use bth_scene::{Manifest, Source};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What is stored of an object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectReport {
    /// Its names in the manifest; several for equal geometry.
    pub names: Vec<String>,
    /// Triangles.
    pub triangles: u64,
    /// Triangles of zero area.
    pub degenerate: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Triangles in tet leaves.
    pub tet_triangles: u64,
    /// Whether it was taken from a compiled file as it is.
    pub copied: bool,
}

/// The objects of the file.
#[derive(Default)]
pub(super) struct Objects {
    stored: Vec<Stored>,
    pub(super) reports: Vec<ObjectReport>,
    /// Per object of the manifest its number in the file; `None` for those that are not used.
    pub(super) number: Vec<Option<u32>>,
    /// Format and BLAKE3 of each source file, in order of first use.
    pub(super) sources: Vec<(String, String)>,
    /// What became of the worker, where one was needed.
    pub(super) worker: Option<tets::WorkerStatus>,
}

enum Stored {
    Built(Box<pipeline::Object>),
    /// From a file of the user.
    Copied(std::rc::Rc<bth::File>, u32),
    /// From the cache.
    Kept(bth::File),
}

/// What the cache says of an object.
#[derive(Serialize, Deserialize)]
struct Facts {
    object: ObjectReport,
    worker: Option<tets::WorkerStatus>,
}

/// Reads and builds the objects that are used, or takes them from the cache.
pub(super) fn build(
    manifest: &Manifest,
    sources: &[File<'_>],
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Objects> {
    let mut objects = Objects { number: vec![None; manifest.objects.len()], ..Objects::default() };
    let mut of_content: HashMap<blake3::Hash, u32> = HashMap::new();
    for file in sources {
        if file.compiled {
            objects.sources.push(("bth".to_owned(), file.digest.file.hex()));
            copy(&mut objects, manifest, file, &mut of_content)?;
            continue;
        }
        let meshes = clock.time("mesh", || meshes::read(file, context))?;
        let format = meshes.first().map_or(String::new(), |m| m.facts.report.format.clone());
        objects.sources.push((format, file.digest.file.hex()));
        for ((_, rows), mesh) in file.parts.iter().zip(meshes) {
            let number = match of_content.entry(content(&mesh.facts)) {
                std::collections::hash_map::Entry::Occupied(there) => *there.get(),
                std::collections::hash_map::Entry::Vacant(free) => {
                    let (stored, facts) = object_of(file, mesh, context, objects.stored.len(), clock)?;
                    objects.note_worker(facts.worker);
                    let number = objects.stored.len() as u32;
                    objects.reports.push(facts.object);
                    objects.stored.push(stored);
                    *free.insert(number)
                }
            };
            rows.iter().for_each(|row| objects.number[*row] = Some(number));
        }
    }
    for (row, object) in manifest.objects.iter().enumerate() {
        if let Some(number) = objects.number[row] {
            objects.reports[number as usize].names.push(object.name.clone());
        }
    }
    Ok(objects)
}

/// An object, from the cache or built.
fn object_of(
    file: &File<'_>,
    mut mesh: meshes::Found,
    context: &Context<'_>,
    number: usize,
    clock: &mut Clock,
) -> Result<(Stored, Facts)> {
    let Context { cache, monitor, .. } = context;
    let weighed;
    let options = match context.weights.as_ref().and_then(|weights| weights.get(number)) {
        Some(rays) => {
            let costs = costs::Options { scene: Some(rays.clone()), ..context.options.costs.clone() };
            weighed = Options { costs, ..context.options.clone() };
            &weighed
        }
        None => context.options,
    };
    let key = context.tetgen.as_ref().map(|tetgen| cached::object(&mesh.facts, options, tetgen));
    let part = file.name_of(mesh.number);
    if let Some(key) = &key
        && let Some((record, bytes)) = cache.fetch(key, &part, *monitor)
        && let Ok(facts) = serde_json::from_value::<Facts>(record.report)
        && let Ok(kept) = bth::File::from_bytes(&bytes)
        && kept.object_count() == 1
    {
        return Ok((Stored::Kept(kept), facts));
    }
    let triangles = clock.time("mesh", || mesh.take(file, context))?;
    let geometry = (triangles, &mesh.facts.geometry);
    let (built, reports) = pipeline::build(&file.full, &part, geometry, options, cache, *monitor, clock)?;
    let object = ObjectReport {
        triangles: mesh.facts.report.triangles,
        degenerate: mesh.facts.report.degenerate,
        tet_leaves: built.tet_leaves,
        tet_triangles: built.tet_triangles,
        ..ObjectReport::default()
    };
    let worker = reports.tets.map(|r| r.worker).filter(|w| *w != tets::WorkerStatus::NotNeeded);
    let facts = Facts { object, worker };
    if let Some(key) = key {
        let mut builder = FileBuilder::new();
        write::object(&mut builder, 0, &parts::parts(&built, options))?;
        let bytes = builder.finish();
        write::self_check(&bytes, false)?;
        cache.put(&key, &part, &bytes, &facts, *monitor);
    }
    Ok((Stored::Built(Box::new(built)), facts))
}

/// A source file and what of it is used.
pub(super) struct File<'a> {
    /// As the manifest has it.
    pub(super) path: &'a str,
    /// Where it is.
    pub(super) full: PathBuf,
    pub(super) compiled: bool,
    /// Mesh or object (`None` for the whole file), and the manifest's objects that are that.
    pub(super) parts: Vec<(Option<u32>, Vec<usize>)>,
    pub(super) digest: SourceDigest,
}

impl File<'_> {
    /// How a part of it stands in keys.
    pub(super) fn part(&self, part: Option<u32>) -> String {
        let kind = if self.compiled { "object" } else { "mesh" };
        part.map_or_else(|| "flat".to_owned(), |number| format!("{kind} {number}"))
    }

    /// What stands for a part of it when misses of the cache are explained.
    pub(super) fn name_of(&self, part: Option<u32>) -> String {
        format!("{} {}", self.path, self.part(part))
    }
}

/// What each used object of the manifest is made from, as it stands in keys; `unused` for the others.
pub(super) fn contents(manifest: &Manifest, sources: &[File<'_>]) -> Vec<String> {
    let mut contents = vec!["unused".to_owned(); manifest.objects.len()];
    for file in sources {
        for (part, rows) in &file.parts {
            let name =
                format!("{} {} {}", file.digest.text(), file.part(*part), cached::extension(&file.full));
            rows.iter().for_each(|row| contents[*row].clone_from(&name));
        }
    }
    contents
}

/// The files of the used objects, in order of first use, hashed.
///
/// # Errors
/// When one cannot be read.
pub(super) fn files<'a>(manifest: &'a Manifest, folder: &Path, used: &[bool]) -> Result<Vec<File<'a>>> {
    let mut files: Vec<File<'a>> = Vec::new();
    let nothing = || SourceDigest { file: Digest::of(b""), others: Vec::new() };
    let mut row_of_file: HashMap<(&str, bool, bool), usize> = HashMap::new();
    let mut row_of_part: HashMap<(usize, Option<u32>), usize> = HashMap::new();
    for (row, object) in manifest.objects.iter().enumerate().filter(|(row, _)| used[*row]) {
        let (compiled, part) = match &object.source {
            Source::Model { mesh, .. } => (false, *mesh),
            Source::Compiled { object, .. } => (true, Some(*object)),
        };
        let path = object.source.path();
        // The whole of a glTF file and single meshes are read in different ways.
        let file = *row_of_file.entry((path, compiled, part.is_some())).or_insert_with(|| {
            let full = folder.join(path);
            files.push(File { path, full, compiled, parts: Vec::new(), digest: nothing() });
            files.len() - 1
        });
        let parts = &mut files[file].parts;
        let place = *row_of_part.entry((file, part)).or_insert_with(|| {
            parts.push((part, Vec::new()));
            parts.len() - 1
        });
        parts[place].1.push(row);
    }
    for file in &mut files {
        file.digest = SourceDigest::of(&file.full)?;
    }
    Ok(files)
}

/// A hash of what makes objects equal.
fn content(mesh: &MeshFacts) -> blake3::Hash {
    let shading = mesh.shading.as_ref().map(Digest::hex);
    blake3::hash(format!("mesh {} {shading:?}", mesh.geometry.hex()).as_bytes())
}

/// Takes objects from a compiled file.
fn copy(
    objects: &mut Objects,
    manifest: &Manifest,
    file: &File<'_>,
    of_content: &mut HashMap<blake3::Hash, u32>,
) -> Result<()> {
    let path = file.full.as_path();
    let unusable = |e: &dyn std::fmt::Display| Error::Input {
        code: "BTH-I051",
        place: Place::File(path.to_owned()),
        message: format!("expected a compiled file that can be used: {e}"),
        hint: "compile it again".to_owned(),
    };
    let read = std::rc::Rc::new(bth::File::read(path).map_err(|e| unusable(&e))?);
    for (part, rows) in &file.parts {
        let object = part.unwrap_or(0);
        let view = read.check(object).map_err(|e| {
            let names: Vec<_> = rows.iter().map(|row| manifest.objects[*row].name.as_str()).collect();
            unusable(&format!("object \"{}\": {e}", names.join("\", \"")))
        })?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"compiled");
        for section in read.sections().filter(|s| s.entry.object == object) {
            hasher.update(&section.entry.kind.to_le_bytes()).update(&section.entry.stride.to_le_bytes());
            // Not the hash that the file gives: whoever made the file made that too.
            hasher.update(blake3::hash(section.bytes).as_bytes());
        }
        let number = *of_content.entry(hasher.finalize()).or_insert_with(|| {
            objects.stored.push(Stored::Copied(read.clone(), object));
            objects.reports.push(ObjectReport {
                triangles: view.header.triangles.into(),
                degenerate: view.header.dropped.into(),
                tet_leaves: view.tet_leaves.len() as u64,
                tet_triangles: view.tet_faces.len() as u64,
                copied: true,
                ..ObjectReport::default()
            });
            objects.stored.len() as u32 - 1
        });
        rows.iter().for_each(|row| objects.number[*row] = Some(number));
    }
    Ok(())
}

impl Objects {
    /// Keeps what says most of the worker.
    fn note_worker(&mut self, needed: Option<tets::WorkerStatus>) {
        if self.worker.is_none() {
            self.worker = needed;
        }
    }

    /// Adds the sections of all objects; returns how many bytes of them tracing reads.
    pub(super) fn write<'a>(&'a self, builder: &mut FileBuilder<'a>, options: &Options) -> Result<u64> {
        let mut resident = 0;
        for (number, stored) in self.stored.iter().enumerate() {
            let number = number as u32;
            match stored {
                Stored::Built(built) => {
                    let parts = parts::parts(built, options);
                    object(builder, number, &parts)?;
                    resident += parts::resident_bytes(&parts);
                }
                Stored::Kept(file) => {
                    for section in file.sections() {
                        // The content was checked against its name, so the hashes in it are right.
                        let e = section.entry;
                        builder.hashed_section(e.kind, number, e.stride, section.bytes.into(), e.hash)?;
                    }
                    resident += file.resident_bytes();
                }
                Stored::Copied(file, from) => {
                    for section in file.sections().filter(|s| s.entry.object == *from) {
                        let e = section.entry;
                        // Kinds that we do not know may mean what we would break.
                        if bth::file::kind_stride(e.kind).is_none() {
                            continue;
                        }
                        builder.section(e.kind, number, e.stride, section.bytes)?;
                        resident += if e.kind <= kind::TRIANGLE_HOMES { e.length } else { 0 };
                    }
                }
            }
        }
        Ok(resident)
    }
}
