//! The places of objects in the file of a scene while they are collected: equal geometry has one.

use super::context::Context;
use super::meshes::SourceMesh;
use super::previous::Previous;
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::{File, SourcePart};
use crate::tets;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A part of a source.
pub(super) enum Part {
    /// In the previous file: the format of the source, the object in that file, and what was warned
    /// of when it was read.
    InPrevious(String, u32, Vec<String>),
    Mesh(Box<SourceMesh>),
}

impl Part {
    /// The format of the source.
    pub(super) fn format(&self) -> &str {
        match self {
            Part::InPrevious(format, ..) => format,
            Part::Mesh(mesh) => &mesh.summary.report.format,
        }
    }

    /// What was warned of while it was read.
    pub(super) fn warnings(&self) -> &[String] {
        match self {
            Part::InPrevious(.., warnings) => warnings,
            Part::Mesh(mesh) => &mesh.warnings,
        }
    }
}

/// An object that is built from a mesh.
pub(super) struct Task<'a> {
    pub(super) file: &'a File<'a>,
    pub(super) mesh: SourceMesh,
    pub(super) number: usize,
    pub(super) content: blake3::Hash,
}

/// An object that has a place, and its report.
pub(super) type Stored = (ObjectSections, ObjectReport);

/// The places of objects while they are collected.
#[derive(Default)]
pub(super) struct Places<'a> {
    /// Copied objects are filled in at once, the others when they are built.
    pub(super) stored: Vec<Option<Stored>>,
    /// The place of each content.
    pub(super) of_content: HashMap<blake3::Hash, u32>,
    /// What is to be built.
    pub(super) tasks: Vec<Task<'a>>,
    /// Places of objects that deform, and the place before of the same geometry.
    pub(super) copies: Vec<(usize, u32)>,
    /// Places that a deformer has.
    deforming: HashSet<u32>,
    /// How many objects come from the previous file.
    pub(super) taken: u64,
    /// The first status of a worker that one of these needed.
    pub(super) worker: Option<tets::WorkerStatus>,
}

impl<'a> Places<'a> {
    /// The place of a part: the place of equal geometry, or a new one, which is filled from the
    /// previous file or by a task.
    pub(super) fn of_part(&mut self, file: &'a File<'a>, part: Part, context: &Context<'_>) -> u32 {
        let (old, content) = find(&part, context);
        let free = match self.of_content.entry(content) {
            Entry::Occupied(there) => return *there.get(),
            Entry::Vacant(free) => free,
        };
        let number = self.stored.len();
        match (old, part) {
            (Some((file, object)), _) => {
                self.taken += 1;
                self.worker = self.worker.take().or_else(|| file.index.worker_of(object).clone());
                let sections = ObjectSections::in_previous(file, object);
                self.stored.push(Some((sections, file.index.report_of(object))));
            }
            (None, Part::Mesh(mesh)) => {
                self.tasks.push(Task { file, mesh: *mesh, number, content });
                self.stored.push(None);
            }
            (None, Part::InPrevious(..)) => unreachable!("a part without a mesh is in the previous file"),
        }
        *free.insert(number as u32)
    }

    /// The place for an object of the manifest whose part has a place: each deformer moves a
    /// separate object.
    pub(super) fn for_row(&mut self, part: SourcePart, number: u32) -> u32 {
        if !part.deforms() || self.deforming.insert(number) {
            return number;
        }
        let own = self.stored.len();
        self.copies.push((own, number));
        self.stored.push(None);
        own as u32
    }
}

/// The object in the previous file, if it has it, and the hash by which equal objects are found.
fn find<'a>(part: &Part, context: &'a Context<'_>) -> (Option<(&'a Arc<Previous>, u32)>, blake3::Hash) {
    let previous = context.previous.as_ref();
    match part {
        Part::InPrevious(_, object, _) => {
            let hash = previous.map_or([0; 32], |p| p.index.objects[*object as usize].content);
            (previous.map(|p| (p, *object)), blake3::Hash::from_bytes(hash))
        }
        Part::Mesh(mesh) => {
            let content = mesh.summary.content(mesh.part.clip());
            let old = previous.and_then(|p| Some((p, p.index.object_of(content.as_bytes())?)));
            (old.filter(|(p, object)| p.has(*object)), content)
        }
    }
}
