//! What the steps of a scene's import share: the document, the manifest so far, and the taken
//! names.

use crate::error::Result;
use crate::gltf::file::GltfFile;
use crate::gltf::placed_mesh::GltfPart;
use crate::gltf::scene::{ImportOptions, ImportReport};
use bth_scene::Manifest;
use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};

/// A manifest in the making.
pub(super) struct Importer<'a, 's> {
    pub(super) file: &'a GltfFile<'s>,
    pub(super) options: &'a ImportOptions,
    /// The path of the document as written in the manifest.
    pub(super) path: &'a str,
    pub(super) manifest: Manifest,
    pub(super) report: ImportReport,
    pub(super) names: TakenNames,
    /// Row of the object of each mesh, and of each node whose mesh is taken at rest.
    pub(super) objects: HashMap<GltfPart, usize>,
    /// For each node of the document its parent.
    pub(super) parents: Vec<Option<usize>>,
    /// For each node of the document true if the chosen animations change its transform.
    pub(super) moved: Vec<bool>,
    /// For each node of the document true if the chosen animations change its morph weights.
    pub(super) morphed: Vec<bool>,
    /// Nodes that deform so far.
    pub(super) deforming: Vec<Deforming>,
}

/// The names so far, by kind.
#[derive(Default)]
pub(super) struct TakenNames {
    pub(super) nodes: Names,
    pub(super) objects: Names,
    pub(super) skins: Names,
    pub(super) cameras: Names,
    pub(super) lights: Names,
}

/// A node whose mesh deforms; its deformer is added when all nodes are there.
pub(super) struct Deforming {
    /// Number of the node in the document.
    pub(super) node: usize,
    /// Row of the node and of its object in the manifest.
    pub(super) row: usize,
    pub(super) object: usize,
    pub(super) weights: Vec<f64>,
}

impl<'a, 's> Importer<'a, 's> {
    /// Returns an importer before anything is imported.
    pub(super) fn new(file: &'a GltfFile<'s>, path: &'a str, options: &'a ImportOptions) -> Self {
        let nodes = file.document.nodes.len();
        Importer {
            file,
            options,
            path,
            manifest: Manifest::default(),
            report: ImportReport { node_rows: vec![None; nodes], ..ImportReport::default() },
            names: TakenNames::default(),
            objects: HashMap::new(),
            parents: file.document.parents(),
            moved: vec![false; nodes],
            morphed: vec![false; nodes],
            deforming: Vec::new(),
        }
    }

    /// Reports something that is not read: an error when strict, else a warning.
    pub(super) fn ignore(&mut self, part: &str, what: String) -> Result<()> {
        if self.options.strict {
            let hint = "leave out --strict to go on without it";
            return Err(self.file.source.error_in_part("BTH-I015", part, what, hint));
        }
        let message = format!("{part}: {what}");
        if !self.report.ignored.contains(&message) {
            self.file.source.monitor.warn(&message);
            self.report.ignored.push(message);
        }
        Ok(())
    }
}

/// The names of one kind that are taken.
#[derive(Default)]
pub(super) struct Names {
    /// Their hashes. A name whose hash another one has counts as taken, too.
    taken: HashSet<u64>,
    /// Per name that came again, the number to try next; it and all numbers below are taken.
    /// Documents may have thousands of nodes of one name: trying all numbers for each would take
    /// long.
    next: HashMap<String, u64>,
}

impl Names {
    /// The given name or else the fallback, without control characters and with a number if it is
    /// taken already. From now on it is taken.
    pub(super) fn unique(&mut self, given: &str, fallback: String) -> String {
        let base: String = given.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let base = if base.is_empty() { fallback } else { base };
        if self.taken.insert(hash(&base)) {
            return base;
        }
        let mut number = self.next.get(&base).copied().unwrap_or(2);
        loop {
            let name = format!("{base} {number}");
            if self.taken.insert(hash(&name)) {
                self.next.insert(base, number + 1);
                return name;
            }
            number += 1;
        }
    }

    /// Gives a name free.
    pub(super) fn remove(&mut self, name: &str) {
        self.taken.remove(&hash(name));
        self.next.clear();
    }
}

fn hash(name: &str) -> u64 {
    // The same in every run, so that names are.
    BuildHasherDefault::<DefaultHasher>::default().hash_one(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_taken_get_the_least_number_that_is_free() {
        let mut names = Names::default();
        let mut of = |given: &str| names.unique(given, "mesh 0".to_owned());
        assert_eq!(
            ["a", "a 3", "a", "a", "a", "a 2"].map(&mut of),
            ["a", "a 3", "a 2", "a 4", "a 5", "a 2 2"]
        );
        assert_eq!(["", "", "b\n", "b "].map(&mut of), ["mesh 0", "mesh 0 2", "b ", "b  2"]);
        names.remove("a 4");
        assert_eq!([names.unique("a", String::new()), names.unique("a", String::new())], ["a 4", "a 6"]);
    }

    #[test]
    fn many_equal_names_are_quick() {
        let mut names = Names::default();
        let start = std::time::Instant::now();
        for _ in 0..100_000 {
            names.unique("Body", String::new());
        }
        assert_eq!(names.unique("Body", String::new()), "Body 100001");
        // Trying all numbers for each takes minutes.
        assert!(start.elapsed().as_secs() < 10);
    }
}
