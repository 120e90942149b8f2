//! The places of objects in the file of a scene while they are collected: equal geometry has one.

use super::meshes::SourceMesh;
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::{File, SourcePart};
use std::collections::{HashMap, HashSet};

/// An object that is built from a mesh.
pub(super) struct Task<'a> {
    pub(super) file: &'a File<'a>,
    pub(super) mesh: SourceMesh,
    pub(super) number: usize,
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
}

impl<'a> Places<'a> {
    /// The place of a part: the place of equal geometry, or a new one, which a task fills.
    pub(super) fn of_part(&mut self, file: &'a File<'a>, mesh: SourceMesh) -> u32 {
        let content = mesh.summary.content(mesh.part.clip());
        *self.of_content.entry(content).or_insert_with(|| {
            let number = self.stored.len();
            self.tasks.push(Task { file, mesh, number });
            self.stored.push(None);
            number as u32
        })
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
