//! The objects of a scene: each source read once, equal geometry stored once, several at once.

use super::at_once::at_once;
use super::compile::Context;
use super::meshes::{self, Found};
use super::object::{self, Built};
use super::sources::File;
use crate::cached::MeshFacts;
use crate::error::{Error, Place, Result};
use crate::pipeline::Clock;
use crate::tets;
use crate::write::FileBuilder;
use bth::layout::kind;
use bth_cache::Digest;
use bth_scene::Manifest;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Objects with more triangles keep all threads busy by themselves, and are compiled one after another.
const LARGE: u64 = 1 << 17;

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
    /// Bytes of its sections that tracing reads.
    #[serde(default)]
    pub resident_bytes: u64,
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

/// The sections of an object, every index of which has been checked.
struct Stored {
    file: Arc<bth::File>,
    object: u32,
    /// Whether the hashes of the sections are known to be right: not in files of the user.
    hashed: bool,
}

/// An object that comes from a mesh.
struct Task<'a> {
    file: &'a File<'a>,
    mesh: Found,
    number: usize,
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
    // Copied objects have their place, the others get it when they are built.
    let mut places: Vec<Option<(Stored, ObjectReport)>> = Vec::new();
    let mut tasks = Vec::new();
    for (file, meshes) in sources.iter().zip(read(sources, context, clock)?) {
        if file.compiled {
            objects.sources.push(("bth".to_owned(), file.digest.file.hex()));
            copy(&mut objects, &mut places, manifest, file, &mut of_content)?;
            continue;
        }
        let format = meshes.first().map_or(String::new(), |m| m.facts.report.format.clone());
        objects.sources.push((format, file.digest.file.hex()));
        for ((_, rows), mesh) in file.parts.iter().zip(meshes) {
            let number = match of_content.entry(content(&mesh.facts)) {
                Entry::Occupied(there) => *there.get(),
                Entry::Vacant(free) => {
                    let number = places.len();
                    tasks.push(Task { file, mesh, number });
                    places.push(None);
                    *free.insert(number as u32)
                }
            };
            rows.iter().for_each(|row| objects.number[*row] = Some(number));
        }
    }
    for (number, built) in build_all(tasks, context, clock)? {
        objects.note_worker(built.facts.worker);
        let stored = Stored { file: Arc::new(built.file), object: 0, hashed: true };
        places[number] = Some((stored, built.facts.object));
    }
    (objects.stored, objects.reports) = places.into_iter().flatten().unzip();
    for (stored, report) in objects.stored.iter().zip(&mut objects.reports) {
        report.resident_bytes = stored.resident_bytes();
    }
    for (row, object) in manifest.objects.iter().enumerate() {
        if let Some(number) = objects.number[row] {
            objects.reports[number as usize].names.push(object.name.clone());
        }
    }
    Ok(objects)
}

/// The meshes of all files, in order; none of compiled ones.
fn read(sources: &[File<'_>], context: &Context<'_>, clock: &mut Clock) -> Result<Vec<Vec<Found>>> {
    let bytes = |file: &&File<'_>| std::fs::metadata(&file.full).map_or(0, |m| m.len());
    // The file and what is made of it.
    let estimate = |file: &&File<'_>| bytes(file).saturating_mul(3);
    at_once(sources.iter().collect(), context, clock, estimate, |context, clock, file| match file.compiled {
        true => Ok(Vec::new()),
        false => clock.time("mesh", || meshes::read(file, context)),
    })
}

/// Builds objects: large ones one by one, the others at once. With the number of each.
fn build_all(tasks: Vec<Task<'_>>, context: &Context<'_>, clock: &mut Clock) -> Result<Vec<(usize, Built)>> {
    let triangles = |task: &Task<'_>| task.mesh.facts.report.triangles;
    let one = |context: &Context<'_>, clock: &mut Clock, mut task: Task<'_>| {
        let built = object::build(task.file, &mut task.mesh, context, task.number, clock)?;
        Ok((task.number, built))
    };
    let (large, small): (Vec<_>, Vec<_>) = tasks.into_iter().partition(|task| triangles(task) > LARGE);
    let mut built = large.into_iter().map(|task| one(context, clock, task)).collect::<Result<Vec<_>>>()?;
    if small.len() == 1 {
        built.extend(small.into_iter().map(|task| one(context, clock, task)).collect::<Result<Vec<_>>>()?);
        return Ok(built);
    }
    context.monitor.stage("objects", Some(small.iter().map(triangles).sum()));
    let estimate = |task: &Task<'_>| object::memory(triangles(task));
    built.extend(at_once(small, context, clock, estimate, |parts, clock, task| {
        let triangles = triangles(&task);
        let done = one(parts, clock, task);
        context.monitor.advance(triangles);
        done
    })?);
    Ok(built)
}

/// A hash of what makes objects equal.
fn content(mesh: &MeshFacts) -> blake3::Hash {
    let shading = mesh.shading.as_ref().map(Digest::hex);
    blake3::hash(format!("mesh {} {shading:?}", mesh.geometry.hex()).as_bytes())
}

/// Takes objects from a compiled file.
fn copy(
    objects: &mut Objects,
    places: &mut Vec<Option<(Stored, ObjectReport)>>,
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
    let read = Arc::new(bth::File::read(path).map_err(|e| unusable(&e))?);
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
            let report = ObjectReport {
                triangles: view.header.triangles.into(),
                degenerate: view.header.dropped.into(),
                tet_leaves: view.tet_leaves.len() as u64,
                tet_triangles: view.tet_faces.len() as u64,
                copied: true,
                ..ObjectReport::default()
            };
            places.push(Some((Stored { file: read.clone(), object, hashed: false }, report)));
            places.len() as u32 - 1
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

    /// Adds the sections of all objects.
    pub(super) fn write<'a>(&'a self, builder: &mut FileBuilder<'a>) -> Result<()> {
        for (number, stored) in self.stored.iter().enumerate() {
            for section in stored.sections() {
                let (e, number) = (section.entry, number as u32);
                match stored.hashed {
                    true => builder.hashed_section(e.kind, number, e.stride, section.bytes.into(), e.hash)?,
                    false => builder.section(e.kind, number, e.stride, section.bytes)?,
                };
            }
        }
        Ok(())
    }

    /// Adds the OBJECT rows only: all that placing instances needs.
    pub(super) fn outline<'a>(&'a self, builder: &mut FileBuilder<'a>) -> Result<()> {
        for (number, stored) in self.stored.iter().enumerate() {
            for section in stored.sections().filter(|s| s.entry.kind == kind::OBJECT) {
                builder.section(kind::OBJECT, number as u32, section.entry.stride, section.bytes)?;
            }
        }
        Ok(())
    }
}

impl Stored {
    /// Its sections; kinds that we do not know may mean what we would break.
    fn sections(&self) -> impl Iterator<Item = bth::file::SectionView<'_>> {
        let known = |e: &bth::layout::SectionEntry| bth::file::kind_stride(e.kind).is_some();
        self.file.sections().filter(move |s| s.entry.object == self.object && known(s.entry))
    }

    /// Bytes of those that tracing reads.
    fn resident_bytes(&self) -> u64 {
        self.sections().map(|s| s.entry).filter(|e| e.kind <= kind::TRIANGLE_HOMES).map(|e| e.length).sum()
    }
}
