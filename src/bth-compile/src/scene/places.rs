//! The places of objects in the file of a scene while they are collected: equal geometry that looks
//! equal has one.

use super::meshes::SourceMesh;
use super::paint::Paint;
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::File;
use std::collections::HashMap;

/// The number of an object in the file, and its look if the manifest gives one.
pub(super) type Place = (u32, Option<Paint>);

/// An object that is built from a mesh.
pub(super) struct Task<'a> {
    pub(super) file: &'a File<'a>,
    pub(super) mesh: SourceMesh,
    /// The places that it fills.
    pub(super) places: Vec<Place>,
}

/// An object that has a place, and its report.
pub(super) type Stored = (ObjectSections, ObjectReport);

/// The places of objects while they are collected.
#[derive(Default)]
pub(super) struct Places<'a> {
    /// Copied objects are filled in at once, the others when they are built.
    pub(super) stored: Vec<Option<Stored>>,
    /// What is to be built.
    pub(super) tasks: Vec<Task<'a>>,
    task_of: HashMap<blake3::Hash, usize>,
    /// The place of each content and look that several objects of the manifest may share.
    shared: HashMap<(blake3::Hash, Option<Paint>), u32>,
}

impl<'a> Places<'a> {
    /// The places of objects of the manifest, which look so, that are made from a part of a file.
    /// Each deformer moves a separate object.
    pub(super) fn of_part(
        &mut self,
        file: &'a File<'a>,
        mesh: SourceMesh,
        looks: &[Option<Paint>],
    ) -> Vec<u32> {
        let (content, deforms) = (mesh.summary.content(mesh.part.clip()), mesh.part.deforms());
        let task = *self.task_of.entry(content).or_insert_with(|| {
            self.tasks.push(Task { file, mesh, places: Vec::new() });
            self.tasks.len() - 1
        });
        let mut place = |look: &Option<Paint>| {
            let known = self.shared.get(&(content, *look)).filter(|_| !deforms);
            known.copied().unwrap_or_else(|| {
                let place = self.stored.len() as u32;
                self.stored.push(None);
                self.shared.insert((content, *look), place);
                self.tasks[task].places.push((place, *look));
                place
            })
        };
        looks.iter().map(&mut place).collect()
    }

    /// The place of an object of a compiled file that looks so.
    pub(super) fn of_compiled(
        &mut self,
        content: blake3::Hash,
        look: Option<Paint>,
        (sections, report): &Stored,
    ) -> u32 {
        *self.shared.entry((content, look)).or_insert_with(|| {
            self.stored.push(Some((painted(sections, look), report.clone())));
            self.stored.len() as u32 - 1
        })
    }

    /// Fills the places of a task.
    pub(super) fn fill(&mut self, places: &[Place], (sections, report): &Stored) {
        for (place, look) in places {
            self.stored[*place as usize] = Some((painted(sections, *look), report.clone()));
        }
    }
}

fn painted(sections: &ObjectSections, look: Option<Paint>) -> ObjectSections {
    look.map_or_else(|| sections.clone(), |look| look.on(sections))
}
