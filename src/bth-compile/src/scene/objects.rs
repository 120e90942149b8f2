//! The objects of a scene: each source read once, equal geometry stored once.

use crate::error::{Error, Place, Result};
use crate::mesh::{self, Mesh};
use crate::monitor::Monitor;
use crate::pipeline::{self, Clock, Options, parts, provenance};
use crate::tets;
use crate::write::{FileBuilder, object};
use bth::layout::kind;
use bth_scene::{Manifest, Source};
use serde::Serialize;
use std::collections::HashMap;
use std::path::Path;
use zerocopy::IntoBytes;

/// What is stored of an object.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    Copied(std::rc::Rc<bth::File>, u32),
}

/// Reads and builds the objects that are used.
pub(super) fn build(
    manifest: &Manifest,
    folder: &Path,
    used: &[bool],
    options: &Options,
    monitor: &dyn Monitor,
    clock: &mut Clock,
) -> Result<Objects> {
    let mut objects = Objects { number: vec![None; manifest.objects.len()], ..Objects::default() };
    let mut of_geometry: HashMap<blake3::Hash, u32> = HashMap::new();
    for file in files(manifest, used) {
        let path = folder.join(file.path);
        let digest = clock.time("hash", || provenance::hash(&path))?;
        if file.compiled {
            objects.sources.push(("bth".to_owned(), digest));
            copy(&mut objects, manifest, &file, &path, &mut of_geometry)?;
            continue;
        }
        let meshes = clock.time("mesh", || import(&file, &path, options, monitor))?;
        let format = meshes.first().map_or(String::new(), |(_, report)| report.format.clone());
        objects.sources.push((format, digest));
        for ((_, rows), (mesh, report)) in file.parts.iter().zip(meshes) {
            let number = match of_geometry.entry(geometry(&mesh)) {
                std::collections::hash_map::Entry::Occupied(there) => *there.get(),
                std::collections::hash_map::Entry::Vacant(free) => {
                    let (built, reports) = pipeline::build(&path, mesh, options, monitor, clock)?;
                    objects.note_worker(reports.tets);
                    let number = objects.stored.len() as u32;
                    objects.reports.push(ObjectReport {
                        triangles: report.triangles,
                        degenerate: report.degenerate,
                        tet_leaves: built.tet_leaves,
                        tet_triangles: built.tet_triangles,
                        ..ObjectReport::default()
                    });
                    objects.stored.push(Stored::Built(Box::new(built)));
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

/// A source file and what of it is used.
struct File<'a> {
    path: &'a str,
    compiled: bool,
    /// Mesh or object (`None` for the whole file), and the manifest's objects that are that.
    parts: Vec<(Option<u32>, Vec<usize>)>,
}

/// The files of the used objects, in order of first use.
fn files<'a>(manifest: &'a Manifest, used: &[bool]) -> Vec<File<'a>> {
    let mut files: Vec<File<'a>> = Vec::new();
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
            files.push(File { path, compiled, parts: Vec::new() });
            files.len() - 1
        });
        let parts = &mut files[file].parts;
        let place = *row_of_part.entry((file, part)).or_insert_with(|| {
            parts.push((part, Vec::new()));
            parts.len() - 1
        });
        parts[place].1.push(row);
    }
    files
}

fn import(
    file: &File<'_>,
    path: &Path,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Vec<(Mesh, mesh::Report)>> {
    let meshes: Vec<u32> = file.parts.iter().filter_map(|(mesh, _)| *mesh).collect();
    if meshes.is_empty() {
        return Ok(vec![mesh::import(path, options.attributes, monitor)?]);
    }
    mesh::import_gltf_meshes(path, &meshes, options.attributes, monitor)
}

/// A hash of what makes objects equal.
fn geometry(mesh: &Mesh) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
    };
    add(b"mesh");
    add(mesh.positions.as_bytes());
    add(mesh.triangles.as_bytes());
    if let Some(attributes) = &mesh.attributes {
        add(attributes.corners.as_bytes());
        add(attributes.normals.as_bytes());
        add(attributes.uvs.as_bytes());
    }
    hasher.finalize()
}

/// Takes objects from a compiled file.
fn copy(
    objects: &mut Objects,
    manifest: &Manifest,
    file: &File<'_>,
    path: &Path,
    of_geometry: &mut HashMap<blake3::Hash, u32>,
) -> Result<()> {
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
        let number = *of_geometry.entry(hasher.finalize()).or_insert_with(|| {
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
    fn note_worker(&mut self, report: Option<tets::Report>) {
        let needed = report.map(|r| r.worker).filter(|w| *w != tets::WorkerStatus::NotNeeded);
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
