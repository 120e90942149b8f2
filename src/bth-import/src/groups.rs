//! Groups of triangles: what a source's own parts and materials are.

use bth_format::limits::MAX_NAME;
use std::collections::HashMap;

/// The groups of a mesh's triangles and their materials.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Groups {
    /// The groups that have triangles, in order of their first ones.
    pub groups: Vec<Group>,
    /// Names of the materials that groups use, in order of first use; names may repeat and be
    /// empty.
    pub materials: Vec<String>,
    /// Successive triangles of one group, ascending: the first one of the run, and its group.
    /// Neighbours differ in their groups.
    pub runs: Vec<[u32; 2]>,
}

/// A group of triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// Its name as in the source, at most 4,096 bytes; empty where it has none.
    pub name: String,
    /// Row of the materials.
    pub material: Option<u32>,
}

/// Notes at which triangles groups start, while a source is read.
#[derive(Debug, Default)]
pub(super) struct GroupRecorder {
    groups: Vec<Group>,
    materials: Vec<String>,
    runs: Vec<[u32; 2]>,
}

impl GroupRecorder {
    /// Adds a material. Returns its number.
    pub(super) fn material(&mut self, name: String) -> u32 {
        self.materials.push(shortened(name));
        self.materials.len() as u32 - 1
    }

    /// The names of all materials, by their numbers.
    pub(super) fn material_names(&self) -> &[String] {
        &self.materials
    }

    /// Adds a group. Returns its number.
    pub(super) fn group(&mut self, name: String, material: Option<u32>) -> u32 {
        self.groups.push(Group { name: shortened(name), material });
        self.groups.len() as u32 - 1
    }

    /// Triangles from `first` on belong to `group`. `first` ascends from call to call.
    pub(super) fn start(&mut self, first: usize, group: u32) {
        let first = first as u32;
        self.runs.pop_if(|last| last[0] == first);
        if self.runs.last().is_none_or(|last| last[1] != group) {
            self.runs.push([first, group]);
        }
    }

    /// Returns the groups of a mesh of `triangles` triangles, and the numbers of the materials that
    /// stay. Triangles before the first start get a group without a name. Groups and materials
    /// without triangles are skipped. If the only group has neither name nor material, there are no
    /// groups.
    pub(super) fn finish(mut self, triangles: usize) -> (Groups, Vec<u32>) {
        self.runs.retain(|run| (run[0] as usize) < triangles);
        if triangles > 0 && self.runs.first().is_none_or(|run| run[0] > 0) {
            let unnamed = self.group(String::new(), None);
            self.runs.insert(0, [0, unnamed]);
        }
        let (mut found, mut kept) = (Groups::default(), Vec::new());
        let (mut group_rows, mut material_rows) = (HashMap::new(), HashMap::new());
        for [first, group] in self.runs {
            let row = *group_rows.entry(group).or_insert_with(|| {
                let Group { name, material } = self.groups[group as usize].clone();
                let material = material.map(|material| {
                    *material_rows.entry(material).or_insert_with(|| {
                        found.materials.push(self.materials[material as usize].clone());
                        kept.push(material);
                        found.materials.len() as u32 - 1
                    })
                });
                found.groups.push(Group { name, material });
                found.groups.len() as u32 - 1
            });
            found.runs.push([first, row]);
        }
        // The absence of groups says the same.
        match found.groups.as_slice() {
            [only] if *only == Group::default() => (Groups::default(), kept),
            _ => (found, kept),
        }
    }
}

/// The groups of a source whose groups are told apart by their name and the name of their material:
/// a pair that comes again is the same group.
#[derive(Debug, Default)]
pub(super) struct NamedGroups {
    pub(super) recorder: GroupRecorder,
    name: String,
    material: Option<u32>,
    materials: HashMap<String, u32>,
    groups: HashMap<(String, Option<u32>), u32>,
}

impl NamedGroups {
    /// From the triangle `first` on, triangles belong to groups of this name.
    pub(super) fn name(&mut self, first: usize, name: String) {
        self.name = name;
        self.start(first);
    }

    /// From the triangle `first` on, triangles are of the material of this name; an empty one is
    /// none.
    pub(super) fn material(&mut self, first: usize, name: String) {
        let recorder = &mut self.recorder;
        self.material = (!name.is_empty())
            .then(|| *self.materials.entry(name).or_insert_with_key(|name| recorder.material(name.clone())));
        self.start(first);
    }

    fn start(&mut self, first: usize) {
        let (recorder, material) = (&mut self.recorder, self.material);
        let key = (self.name.clone(), material);
        let group =
            *self.groups.entry(key).or_insert_with_key(|(name, _)| recorder.group(name.clone(), material));
        recorder.start(first, group);
    }
}

/// A name, cut at the end of the last character that fits the format's limit.
fn shortened(mut name: String) -> String {
    name.truncate(name.floor_char_boundary(MAX_NAME as usize));
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_without_triangles_are_left_out_and_the_others_are_numbered_by_first_use() {
        let mut named = NamedGroups::default();
        named.name(2, "unused".into());
        named.material(2, "red".into());
        named.name(2, "a".into());
        named.material(5, "blue".into());
        named.material(7, String::new());
        named.name(9, "a".into());
        named.material(10, "red".into());
        named.name(12, "beyond".into());
        let (groups, kept) = named.recorder.finish(12);
        assert_eq!(kept, [0, 1]);
        let group = |name: &str, material| Group { name: name.into(), material };
        assert_eq!(
            groups.groups,
            [group("", None), group("a", Some(0)), group("a", Some(1)), group("a", None)]
        );
        assert_eq!(groups.materials, ["red", "blue"]);
        assert_eq!(groups.runs, [[0, 0], [2, 1], [5, 2], [7, 3], [10, 1]]);
    }

    #[test]
    fn one_group_without_a_name_is_none() {
        assert_eq!(GroupRecorder::default().finish(0).0, Groups::default());
        assert_eq!(GroupRecorder::default().finish(3).0, Groups::default());
        let mut named = NamedGroups::default();
        named.material(0, "red".into());
        assert_eq!(named.recorder.finish(3).0.runs, [[0, 0]]);
    }

    #[test]
    fn long_names_are_cut_between_characters() {
        let name = shortened("x".repeat(4095) + "\u{fc}tail");
        assert_eq!(name.len(), 4095);
    }
}
