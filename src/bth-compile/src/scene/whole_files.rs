//! Compiled files that a manifest names as a whole: their scenes become groups of nodes.

use super::objects::unusable;
use crate::error::{Error, Place, Result};
use crate::monitor::Monitor;
use crate::write::{DiskFile, FileBuilder, assembled};
use bth_format::SceneView;
use bth_format::layout::{self as on_disk, NODE_GROUP, NODE_HIDDEN, NODE_MATRIX, NONE, kind};
use bth_scene::{Interpolation, Manifest, Node, Object, Property, Source, Track, Transform};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// The manifest with the scenes of such files as groups. A file of one object without a scene is
/// that object.
///
/// # Errors
/// `BTH-I051` if a file cannot be used.
pub(super) fn expanded<'a>(
    manifest: &'a Manifest,
    folder: &Path,
    monitor: &dyn Monitor,
) -> Result<Cow<'a, Manifest>> {
    let mut manifest = Cow::Borrowed(manifest);
    for row in 0..manifest.objects.len() {
        let Source::Compiled { path, object: None } = &manifest.objects[row].source else { continue };
        let (path, full) = (path.clone(), folder.join(path));
        let file = rows_of(&full)?;
        let view = file.check_scene().map_err(|e| unusable(&full, "", &e))?;
        let count = file.object_count();
        if view.is_none() && count == 1 {
            continue;
        }
        let manifest = manifest.to_mut();
        let mut expansion = Expansion { manifest, row, path, first: row, group: 0 };
        expansion.add_objects(count);
        match &view {
            Some(view) => {
                expansion.add_scene(view);
                let left = view.cameras.len() + view.lights.len();
                if left > 0 {
                    let path = &expansion.path;
                    monitor.warn(&format!("{path}: its {left} cameras and lights are not in the group"));
                }
            }
            None => expansion.add_in_place(count),
        }
        expansion.show();
    }
    Ok(manifest)
}

/// The scene of a file and the rows of its objects.
fn rows_of(path: &Path) -> Result<bth_format::File> {
    let table = bth_format::file::read_table(path).map_err(|e| unusable(path, "", &e))?;
    if table.iter().any(|e| e.kind == kind::DEFORMERS && e.count > 0) {
        return Err(Error::Input {
            code: "BTH-I051",
            place: Place::File(path.to_owned()),
            message: "expected a file that can be a group, found skins or morph targets".to_owned(),
            hint: "name its source instead, or one of its objects by `object`".to_owned(),
        });
    }
    let mut builder = FileBuilder::new();
    let rows = table.iter().filter(|e| e.kind == kind::OBJECT || kind::is_scene(e.kind));
    builder.copied(&Arc::new(DiskFile::at(path)), rows)?;
    assembled(&builder)
}

/// A file that becomes a group.
struct Expansion<'a> {
    manifest: &'a mut Manifest,
    /// The object of the manifest that names the file.
    row: usize,
    path: String,
    /// The object of the manifest that is object 1 of the file; object 0 is at `row`.
    first: usize,
    /// The first node of the group.
    group: usize,
}

impl Expansion<'_> {
    fn name(&self, what: &str) -> String {
        format!("{}/{what}", self.manifest.objects[self.row].name)
    }

    /// Adds the objects of the file and the first node of the group.
    fn add_objects(&mut self, count: u32) {
        let material = self.manifest.objects[self.row].material;
        let source = |object| Source::Compiled { path: self.path.clone(), object: Some(object) };
        let object = |i| Object { material, ..Object::new(self.name(&format!("object {i}")), source(i)) };
        let others: Vec<_> = (1..count).map(object).collect();
        self.manifest.objects[self.row].source = source(0);
        (self.first, self.group) = (self.manifest.objects.len(), self.manifest.nodes.len());
        self.manifest.objects.extend(others);
        let name = self.manifest.objects[self.row].name.clone();
        self.add_node(name, None, None);
    }

    /// The object of the manifest that is an object of the file.
    fn object(&self, object: u32) -> usize {
        if object == 0 { self.row } else { self.first + object as usize - 1 }
    }

    fn add_node(&mut self, name: String, parent: Option<usize>, object: Option<usize>) {
        let transform = Transform::default();
        self.manifest.nodes.push(Node { name: &name, parent, transform, object, group: None, visible: true });
    }

    /// Adds an instance of each object of a file without a scene.
    fn add_in_place(&mut self, count: u32) {
        for object in 0..count {
            let name = self.name(&format!("object {object}"));
            self.add_node(name, Some(self.group), Some(self.object(object)));
        }
    }

    /// Adds the nodes, instances and tracks of the scene of the file.
    fn add_scene(&mut self, view: &SceneView<'_>) {
        let first = self.manifest.nodes.len();
        let row = |node: u32| first + node as usize;
        for (i, node) in view.nodes.iter().enumerate() {
            let parent = match node.parent {
                NONE => (node.flags & NODE_GROUP == 0).then_some(self.group),
                parent => Some(row(parent)),
            };
            let t = &node.transform;
            let transform = match node.flags & NODE_MATRIX {
                0 => Transform::Parts {
                    translation: [t[0], t[1], t[2]],
                    rotation: [t[3], t[4], t[5], t[6]],
                    scale: [t[7], t[8], t[9]],
                },
                _ => Transform::Matrix([0, 4, 8].map(|k| [t[k], t[k + 1], t[k + 2], t[k + 3]])),
            };
            let name = self.name(view.node_name(i as u32));
            let visible = node.flags & NODE_HIDDEN == 0;
            let node = Node { name: &name, parent, transform, object: None, group: None, visible };
            self.manifest.nodes.push(node);
        }
        for instance in view.instances {
            let mut node = row(instance.node);
            let Node { object, group, .. } = self.manifest.nodes.get(node);
            if object.is_some() || group.is_some() {
                // A node of a manifest has one instance; the others are at nodes below.
                let name = self.name(view.node_name(instance.node));
                self.add_node(name, Some(node), None);
                node = self.manifest.nodes.len() - 1;
            }
            let (object, group) = match instance.group() {
                Some(group) => (None, Some(row(group))),
                None => (Some(self.object(instance.object)), None),
            };
            self.manifest.nodes.set_shown(node, object, group);
        }
        for track in view.tracks {
            let property = match on_disk::Property::from_code(track.property) {
                Some(on_disk::Property::Translation) => Property::Translation,
                Some(on_disk::Property::Rotation) => Property::Rotation,
                Some(on_disk::Property::Scale) => Property::Scale,
                Some(on_disk::Property::Visible) => Property::Visible,
                // A file with deformers was refused.
                Some(on_disk::Property::Weights) | None => continue,
            };
            let interpolation = on_disk::Interpolation::from_code(track.interpolation);
            let interpolation = interpolation.unwrap_or(on_disk::Interpolation::Linear);
            let width = view.width_of(track) * interpolation.values_per_key();
            let (times, values) = view.keys(track, width);
            let interpolation = match interpolation {
                on_disk::Interpolation::Step => Interpolation::Step,
                on_disk::Interpolation::Linear => Interpolation::Linear,
                on_disk::Interpolation::Cubic => Interpolation::Cubic,
            };
            let (node, times, values) = (row(track.node), times.to_vec(), values.to_vec());
            self.manifest.tracks.push(Track { node, property, interpolation, times, values });
        }
    }

    /// Makes the instances of the object that named the file instances of the group.
    fn show(&mut self) {
        let nodes = &mut self.manifest.nodes;
        for node in 0..self.group {
            if nodes.object(node) == Some(self.row) {
                nodes.set_shown(node, None, Some(self.group));
            }
        }
    }
}
