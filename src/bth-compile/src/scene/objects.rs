//! The objects of a scene: each source is read once, equal geometry is stored once, and several are compiled in parallel.

use super::context::Context;
use super::file_index::{FileIndex, Hash, ObjectRow, PartRow, SectionRow};
use super::meshes::{self, SourceMesh, content};
use super::object::{self, BuiltObject};
use super::parallel::run_parallel;
use super::previous::Previous;
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::{File, SourcePart};
use crate::error::{Error, Place, Result};
use crate::pipeline::Clock;
use crate::tets;
use crate::write::FileBuilder;
use bth_format::layout::{self, SectionEntry, kind};
use bth_scene::Manifest;
use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap, HashSet};
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
    /// For each part of a mesh file the hash that identifies it, its format and its object.
    parts: Vec<(Hash, String, u32)>,
}

/// An object that is built from a mesh.
struct Task<'a> {
    file: &'a File<'a>,
    mesh: SourceMesh,
    number: usize,
    content: blake3::Hash,
}

/// A part of a source.
pub(super) enum Part {
    /// In the previous file: the format of the source, and the object in that file.
    InPrevious(String, u32),
    Mesh(Box<SourceMesh>),
}

/// Compiles the objects that are used, or takes them from the previous file or the cache.
pub(super) fn build(
    manifest: &Manifest,
    sources: &[File<'_>],
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Objects> {
    let mut objects = Objects { number: vec![None; manifest.objects.len()], ..Objects::default() };
    let mut of_content: HashMap<blake3::Hash, u32> = HashMap::new();
    // Copied objects are filled in at once, the others when they are built.
    let mut places: Vec<Option<Stored>> = Vec::new();
    let mut tasks = Vec::new();
    // Objects that deform, whose geometry is that of an object before: numbers of both.
    let mut copies: Vec<(usize, u32)> = Vec::new();
    let mut deforming = HashSet::new();
    let mut taken = 0;
    for (file, parts) in sources.iter().zip(read(sources, context, clock)?) {
        if file.compiled {
            objects.sources.push(("bth".to_owned(), file.digest.file.hex()));
            copy(&mut objects, &mut places, manifest, file, &mut of_content)?;
            continue;
        }
        let format = match parts.first() {
            Some(Part::InPrevious(format, _)) => format.clone(),
            Some(Part::Mesh(mesh)) => mesh.summary.report.format.clone(),
            None => String::new(),
        };
        objects.sources.push((format.clone(), file.digest.file.hex()));
        for ((part, rows), what) in file.parts.iter().zip(parts) {
            let (old, content) = find(&what, context);
            let number = match of_content.entry(content) {
                Entry::Occupied(there) => *there.get(),
                Entry::Vacant(free) => {
                    let number = places.len();
                    match (old, what) {
                        (Some((file, object)), _) => {
                            taken += 1;
                            objects.note_worker(file.index.worker_of(object).clone());
                            places.push(Some(vec![(
                                ObjectSections::InPrevious { file: file.clone(), object },
                                file.index.report_of(object),
                            )]));
                        }
                        (None, Part::Mesh(mesh)) => {
                            tasks.push(Task { file, mesh: *mesh, number, content });
                            places.push(None);
                        }
                        (None, Part::InPrevious(..)) => {
                            unreachable!("a part without a mesh is in the previous file")
                        }
                    }
                    *free.insert(number as u32)
                }
            };
            objects.parts.push((part_hash(file, *part), format.clone(), number));
            for row in rows {
                let mut own = number;
                // Each deformer moves an object of its own.
                if part.deforms() && !deforming.insert(number) {
                    own = places.len() as u32;
                    copies.push((places.len(), number));
                    places.push(None);
                }
                objects.number[*row] = Some(own);
            }
        }
    }
    context.cache.hits("object", taken);
    for (number, content, built) in build_all(tasks, context, clock)? {
        objects.note_worker(built.record.worker.clone());
        let made = (content, built.record.worker);
        places[number] = Some(stored(built.file, built.record.object, made));
    }
    for (copy, of) in copies {
        places[copy] = places[of as usize].clone();
    }
    objects.fill(places);
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

/// The parts of all files, in order; a compiled file has no parts.
fn read(sources: &[File<'_>], context: &Context<'_>, clock: &mut Clock) -> Result<Vec<Vec<Part>>> {
    let mut all: Vec<Option<Vec<Part>>> =
        sources.iter().map(|file| parts_without_reading(file, context)).collect();
    let bytes = |file: &&File<'_>| match &file.moving {
        Some(moving) => moving.bytes(),
        None => std::fs::metadata(&file.full).map_or(0, |m| m.len()),
    };
    // Memory for the file and for the mesh that is made from it.
    let estimate = |file: &&File<'_>| bytes(file).saturating_mul(3);
    let unknown =
        sources.iter().zip(&all).filter(|(_, known)| known.is_none()).map(|(file, _)| file).collect();
    let found = run_parallel(unknown, context, clock, estimate, |context, clock, file| {
        clock.time("mesh", || meshes::read(file, context))
    })?;
    let meshes =
        found.into_iter().map(|meshes| meshes.into_iter().map(|mesh| Part::Mesh(Box::new(mesh))).collect());
    all.iter_mut()
        .filter(|known| known.is_none())
        .zip(meshes)
        .for_each(|(place, meshes)| *place = Some(meshes));
    Ok(all.into_iter().flatten().collect())
}

/// The parts of a file that need not be read, because it is a compiled one or the previous file has all of them.
pub(super) fn parts_without_reading(file: &File<'_>, context: &Context<'_>) -> Option<Vec<Part>> {
    if file.compiled {
        return Some(Vec::new());
    }
    let previous = context.previous.as_ref()?;
    let part = |part: SourcePart| {
        let row = previous.index.part(&part_hash(file, part))?;
        let format = previous.index.formats[row.format as usize].clone();
        previous.has(row.object).then_some(Part::InPrevious(format, row.object))
    };
    file.parts.iter().map(|(source, _)| part(*source)).collect()
}

/// The object in the previous file, if it has it, and the hash by which equal objects are found.
fn find<'a>(part: &Part, context: &'a Context<'_>) -> (Option<(&'a Arc<Previous>, u32)>, blake3::Hash) {
    let previous = context.previous.as_ref();
    match part {
        Part::InPrevious(_, object) => {
            let hash = previous.map_or([0; 32], |p| p.index.objects[*object as usize].content);
            (previous.map(|p| (p, *object)), blake3::Hash::from_bytes(hash))
        }
        Part::Mesh(mesh) => {
            let content = content(&mesh.summary, mesh.part);
            let old = previous.and_then(|p| Some((p, p.index.object_of(content.as_bytes())?)));
            (old.filter(|(p, object)| p.has(*object)), content)
        }
    }
}

/// The hash that identifies a part of a source.
fn part_hash(file: &File<'_>, part: SourcePart) -> Hash {
    *blake3::hash(file.content(part).as_bytes()).as_bytes()
}

/// Builds objects: large ones one after another, the others in parallel. Returns the number of each.
fn build_all(
    tasks: Vec<Task<'_>>,
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Vec<(usize, blake3::Hash, BuiltObject)>> {
    let triangles = |task: &Task<'_>| task.mesh.summary.report.triangles;
    let one = |context: &Context<'_>, clock: &mut Clock, mut task: Task<'_>| {
        let built = object::build(task.file, &mut task.mesh, context, task.number, clock)?;
        Ok((task.number, task.content, built))
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

/// Takes objects from a compiled file.
fn copy(
    objects: &mut Objects,
    places: &mut Vec<Option<Stored>>,
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
    let read = Arc::new(bth_format::File::read(path).map_err(|e| unusable(&e))?);
    for (part, rows) in &file.parts {
        let SourcePart::Object(object) = *part else { continue };
        let view = read.check(object).map_err(|e| {
            let names: Vec<_> = rows.iter().map(|row| manifest.objects[*row].name.as_str()).collect();
            unusable(&format!("object \"{}\": {e}", names.join("\", \"")))
        })?;
        let in_order = |(row, segment): (usize, &layout::Segment)| segment.object as usize == row;
        let segments = read.sequence(object).segments;
        if !segments.iter().enumerate().all(in_order) || read.check_segments().is_err() {
            let found = format!("object {object} has segments that do not follow it");
            return Err(unusable(&found));
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"compiled");
        for section in read.sections().filter(|s| s.entry.object == object) {
            hasher.update(&section.entry.kind.to_le_bytes()).update(&section.entry.stride.to_le_bytes());
            // The hash is computed here; that of the section table is untrusted.
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
            let one = |object: u32, report| {
                (ObjectSections::InFile { file: read.clone(), object, made: None }, report)
            };
            let behind = (1..read.sequence(object).segments.len() as u32).map(|segment| {
                one(object + segment, ObjectReport { copied: true, ..ObjectReport::default() })
            });
            let first = one(object, report);
            places.push(Some(std::iter::once(first).chain(behind).collect()));
            places.len() as u32 - 1
        });
        rows.iter().for_each(|row| objects.number[*row] = Some(number));
    }
    Ok(())
}

/// An object of a source and the objects of its segments, which follow it in the file.
type Stored = Vec<(ObjectSections, ObjectReport)>;

/// The place of a built object: the first of a file, which holds nothing but it and its segments.
fn stored(
    file: bth_format::File,
    report: ObjectReport,
    made: (blake3::Hash, Option<tets::WorkerStatus>),
) -> Stored {
    let file = Arc::new(file);
    // An object with segments is not taken from the previous file, whose index has single objects.
    let made = (file.object_count() == 1).then_some(made);
    let segments = report.motion.as_ref().map_or(&[][..], |motion| &motion.segments);
    let of_segment = |object: u32| ObjectReport {
        triangles: report.triangles,
        segment_from: segments.get(object as usize).map(|segment| segment.first),
        ..ObjectReport::default()
    };
    let behind: Vec<_> = (1..file.object_count())
        .map(|object| (ObjectSections::InFile { file: file.clone(), object, made: None }, of_segment(object)))
        .collect();
    let mut place = vec![(ObjectSections::InFile { file, object: 0, made }, report)];
    place.extend(behind);
    place
}

impl Objects {
    /// Stores the objects of all places and numbers them; `number` and `parts` hold numbers of places before.
    fn fill(&mut self, places: Vec<Option<Stored>>) {
        let mut first = Vec::with_capacity(places.len());
        for place in places {
            first.push(self.stored.len() as u32);
            let (stored, reports): (Vec<_>, Vec<_>) = place.into_iter().flatten().unzip();
            self.stored.extend(stored);
            self.reports.extend(reports);
        }
        self.number.iter_mut().flatten().for_each(|number| *number = first[*number as usize]);
        self.parts.iter_mut().for_each(|(.., number)| *number = first[*number as usize]);
    }

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
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn image_names(&self) -> Result<BTreeSet<[u8; 16]>> {
        let mut names = BTreeSet::new();
        for stored in &self.stored {
            names.extend(stored.image_names()?);
        }
        Ok(names)
    }

    /// The DEFORMATION row of an object, if its vertices can be moved.
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn deformation(&self, object: u32) -> Result<Option<layout::Deformation>> {
        self.stored[object as usize].deformation()
    }

    /// Adds the OBJECT rows only, which suffice to place instances.
    pub(super) fn write_rows(&self, builder: &mut FileBuilder<'_>) -> Result<()> {
        for (number, stored) in self.stored.iter().enumerate() {
            if let Some(row) = stored.row() {
                let stride = size_of::<layout::Object>() as u32;
                builder.section(kind::OBJECT, number as u32, stride, row.as_bytes().to_vec())?;
            }
        }
        Ok(())
    }

    /// The index of the file with this section table, for the next compilation. Without objects that were copied from
    /// compiled files.
    pub(super) fn file_index(&self, table: &[SectionEntry]) -> FileIndex {
        let mut index = FileIndex::default();
        let mut rows = vec![None; self.stored.len()];
        for (number, (stored, report)) in self.stored.iter().zip(&self.reports).enumerate() {
            let (Some((content, worker)), Some(object)) = (stored.made(), stored.row()) else { continue };
            let first = index.sections.len() as u32;
            let start = table.partition_point(|e| e.object < number as u32);
            let sections = table[start..].iter().take_while(|e| e.object == number as u32);
            index.sections.extend(sections.map(|e| SectionRow {
                kind: e.kind,
                stride: e.stride,
                offset: e.offset,
                length: e.length,
                hash: e.hash,
            }));
            rows[number] = Some(index.objects.len() as u32);
            index.objects.push(ObjectRow {
                content,
                triangles: report.triangles,
                degenerate: report.degenerate,
                tet_leaves: report.tet_leaves,
                tet_triangles: report.tet_triangles,
                object,
                first,
                sections: index.sections.len() as u32 - first,
                worker: FileIndex::row_of(&mut index.workers, worker),
                reserved: 0,
            });
        }
        for (part, format, number) in &self.parts {
            if let Some(object) = rows[*number as usize] {
                let format = FileIndex::row_of(&mut index.formats, format);
                index.parts.push(PartRow { part: *part, object, format });
            }
        }
        index
    }
}
