//! The objects of a scene: each source is read once, equal geometry is stored once, and several are
//! compiled in parallel.

use super::context::Context;
use super::meshes::{self, SourceMesh};
use super::object::{self, BuiltObject};
use super::paint::Paint;
use super::parallel::run_parallel;
use super::places::{Place, Places, Task};
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::{File, SourcePart};
use crate::error::{self, Error, Result};
use crate::stage::Clock;
use crate::tets;
use crate::write::{self, DiskFile, FileBuilder};
use bth_format::Code;
use bth_format::layout::{self, kind};
use bth_scene::Manifest;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use zerocopy::IntoBytes;

/// Objects with more triangles use all threads by themselves and are compiled one after another.
const LARGE: u64 = 1 << 17;

/// The objects of the file.
#[derive(Default)]
pub(super) struct Objects {
    stored: Vec<ObjectSections>,
    pub(super) reports: Vec<ObjectReport>,
    /// Per object of the manifest its number in the file; `None` for those that are not used.
    pub(super) number: Vec<Option<u32>>,
    /// Format and BLAKE3 of each source file, in order of first use.
    pub(super) sources: Vec<(String, String)>,
    /// Status of the worker, where one was needed.
    pub(super) worker: Option<tets::WorkerStatus>,
}

/// Compiles the objects that are used, or takes them from the cache.
pub(super) fn build(
    manifest: &Manifest,
    sources: &[File<'_>],
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Objects> {
    let mut objects = Objects { number: vec![None; manifest.objects.len()], ..Objects::default() };
    let mut places = Places::default();
    for (file, parts) in sources.iter().zip(read(sources, context, clock)?) {
        if file.compiled {
            objects.sources.push(("bth".to_owned(), file.digest.file.hex()));
            copy(&mut objects, &mut places, manifest, file)?;
            continue;
        }
        let format = parts.first().map_or_else(String::new, |mesh| mesh.summary.report.format.clone());
        objects.sources.push((format, file.digest.file.hex()));
        for ((_, rows), mesh) in file.parts.iter().zip(parts) {
            let looks: Vec<_> = rows.iter().map(|row| look(manifest, *row)).collect();
            let numbers = places.of_part(file, mesh, &looks);
            rows.iter().zip(numbers).for_each(|(row, number)| objects.number[*row] = Some(number));
        }
    }
    for (filled, built) in build_all(std::mem::take(&mut places.tasks), context, clock)? {
        objects.note_worker(built.record.worker);
        places.fill(&filled, &(built.sections, built.record.object));
    }
    (objects.stored, objects.reports) = places.stored.into_iter().flatten().unzip();
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

/// How the manifest says that an object looks.
fn look(manifest: &Manifest, row: usize) -> Option<Paint> {
    manifest.objects[row].material.as_ref().map(Paint::from)
}

/// The meshes of all files, in order; a compiled file has none.
fn read(sources: &[File<'_>], context: &Context<'_>, clock: &mut Clock) -> Result<Vec<Vec<SourceMesh>>> {
    let bytes = |file: &&File<'_>| match &file.moving {
        Some(moving) => moving.bytes(),
        None => std::fs::metadata(&file.full).map_or(0, |m| m.len()),
    };
    // Memory for the file and for the mesh that is made from it.
    let estimate = |file: &&File<'_>| bytes(file).saturating_mul(3);
    let models = sources.iter().filter(|file| !file.compiled).collect();
    let mut meshes = run_parallel(models, context, clock, estimate, |context, clock, file| {
        clock.time("mesh", || meshes::read(file, context))
    })?
    .into_iter();
    let of = |file: &File<'_>| if file.compiled { None } else { meshes.next() };
    Ok(sources.iter().map(of).map(Option::unwrap_or_default).collect())
}

/// Builds objects: large ones one after another, the others in parallel. Returns the places of
/// each.
fn build_all(
    tasks: Vec<Task<'_>>,
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Vec<(Vec<Place>, BuiltObject)>> {
    let triangles = |task: &Task<'_>| task.mesh.summary.report.triangles;
    let one = |context: &Context<'_>, clock: &mut Clock, mut task: Task<'_>| {
        let built = object::build(task.file, &mut task.mesh, context, clock)?;
        Ok((task.places, built))
    };
    let (large, small): (Vec<_>, Vec<_>) = tasks.into_iter().partition(|task| triangles(task) > LARGE);
    let mut built = large.into_iter().map(|task| one(context, clock, task)).collect::<Result<Vec<_>>>()?;
    if small.len() == 1 {
        built.extend(small.into_iter().map(|task| one(context, clock, task)).collect::<Result<Vec<_>>>()?);
        return Ok(built);
    }
    context.monitor.stage("objects", Some(small.iter().map(triangles).sum()));
    let estimate = |task: &Task<'_>| object::memory(triangles(task));
    built.extend(run_parallel(small, context, clock, estimate, |parts, clock, task| {
        let triangles = triangles(&task);
        let done = one(parts, clock, task);
        context.monitor.advance(triangles);
        done
    })?);
    Ok(built)
}

/// Takes objects from a compiled file, in which they stay until they are copied.
fn copy(objects: &mut Objects, places: &mut Places<'_>, manifest: &Manifest, file: &File<'_>) -> Result<()> {
    let path = file.full.as_path();
    let table = bth_format::file::read_table(path).map_err(|e| unusable(path, "", &e))?;
    let count = table.iter().filter(|e| e.kind == kind::OBJECT).count();
    let disk = Arc::new(DiskFile::at(path));
    for (part, rows) in &file.parts {
        let SourcePart::Object(object) = *part else { continue };
        let refused = |e: &bth_format::Error| {
            let names: Vec<_> = rows.iter().map(|row| manifest.objects[*row].name.as_str()).collect();
            unusable(path, &format!("object \"{}\": ", names.join("\", \"")), e)
        };
        if object as usize >= count {
            let expected = format!("an object below {count}");
            return Err(refused(&bth_format::Error::of_call(
                Code::NoSuchObject,
                expected,
                object.to_string(),
            )));
        }
        let sections = ObjectSections::on_disk(&disk, &table, object).map_err(|e| write::read_failed(&e))?;
        let alone = sections.file()?;
        let view = match alone.check(0) {
            Ok(view) => view,
            // The error with its place in the file itself.
            Err(e) => {
                let read = bth_format::File::read(path);
                return Err(refused(
                    &read.and_then(|whole| whole.check(object).map(drop)).err().unwrap_or(e),
                ));
            }
        };
        let report = ObjectReport {
            triangles: view.header.triangles.into(),
            degenerate: view.header.dropped.into(),
            tet_leaves: view.tet_leaves.len() as u64,
            tet_triangles: view.tet_faces.len() as u64,
            copied: true,
            ..ObjectReport::default()
        };
        let stored = (sections, report);
        let content = stored.0.content();
        for row in rows {
            objects.number[*row] = Some(places.of_compiled(content, look(manifest, *row), &stored));
        }
    }
    Ok(())
}

/// The error for a compiled file that cannot be used; `what` names a part of it.
pub(super) fn unusable(path: &Path, what: &str, error: &bth_format::Error) -> Error {
    Error::Input {
        code: "BTH-I051",
        place: error::Place::File(path.to_owned()),
        message: format!("expected a compiled file that can be used: {what}{}", error.without_hint()),
        hint: error.hint().to_owned(),
    }
}

impl Objects {
    /// Keeps the first status of a worker that was needed.
    fn note_worker(&mut self, needed: Option<tets::WorkerStatus>) {
        if self.worker.is_none() {
            self.worker = needed;
        }
    }

    /// Adds the sections of all objects.
    pub(super) fn write(&self, builder: &mut FileBuilder<'_>) -> Result<()> {
        for (number, stored) in self.stored.iter().enumerate() {
            stored.write(number as u32, builder)?;
        }
        Ok(())
    }

    /// Names of the images that textures of the objects refer to.
    pub(super) fn image_names(&self) -> BTreeSet<[u8; 16]> {
        self.stored.iter().flat_map(ObjectSections::image_names).collect()
    }

    /// The DEFORMATION row of an object, if its vertices can be moved.
    pub(super) fn deformation(&self, object: u32) -> Option<layout::Deformation> {
        self.stored[object as usize].deformation()
    }

    /// Adds the OBJECT rows only, which suffice to place instances.
    pub(super) fn write_rows(&self, builder: &mut FileBuilder<'_>) -> Result<()> {
        for (number, stored) in self.stored.iter().enumerate() {
            let (stride, row) = (size_of::<layout::Object>() as u32, stored.row.as_bytes().to_vec());
            builder.section(kind::OBJECT, number as u32, stride, row)?;
        }
        Ok(())
    }
}
