//! The source files of a scene's objects.

use super::clips::Clips;
use super::moving::{Moving, unhashed};
use super::paint::Paint;
use crate::error::Result;
use crate::source::{SourceDigest, TriangleMesh, extension};
use bth_files::Digest;
use bth_import::{AlphaMode, GltfPart, Looks, Unreadable};
use bth_scene::{JointSet, Manifest, Source};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The part of a source file that an object is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum SourcePart {
    /// The whole model.
    Whole,
    /// A part of a glTF file.
    Gltf(GltfPart),
    /// A mesh of a glTF file that a clip of the scene poses, for which its tree is built.
    Posed(u32, JointSet, Digest),
    /// An object of a compiled file.
    Object(u32),
}

impl SourcePart {
    /// The part that a source of a manifest names, and that a clip may pose.
    fn of(source: &Source, clip: Option<Digest>) -> SourcePart {
        match *source {
            Source::Model { mesh: None, .. } => SourcePart::Whole,
            Source::Model { mesh: Some(mesh), .. } => SourcePart::Gltf(GltfPart::Mesh(mesh)),
            Source::Deforming { mesh, without, .. } => match clip {
                Some(clip) => SourcePart::Posed(mesh, without, clip),
                None => SourcePart::Gltf(GltfPart::Deforming { mesh, without }),
            },
            Source::RigidPart { mesh, joint, .. } => SourcePart::Gltf(GltfPart::Rigid { mesh, joint }),
            Source::AtRest { node, .. } => SourcePart::Gltf(GltfPart::AtRest(node)),
            // Those named as a whole that are still there have one object.
            Source::Compiled { object, .. } => SourcePart::Object(object.unwrap_or(0)),
            Source::Cached { mesh: Some(mesh), .. } => SourcePart::Gltf(GltfPart::Mesh(mesh)),
            Source::Sequence { .. } | Source::Cached { .. } => SourcePart::Whole,
        }
    }

    /// The part of a glTF file that is read for it.
    pub(super) fn gltf(self) -> Option<GltfPart> {
        match self {
            SourcePart::Gltf(part) => Some(part),
            SourcePart::Posed(mesh, without, _) => Some(GltfPart::Deforming { mesh, without }),
            SourcePart::Whole | SourcePart::Object(_) => None,
        }
    }

    /// The clip that poses it.
    pub(super) fn clip(self) -> Option<Digest> {
        match self {
            SourcePart::Posed(.., clip) => Some(clip),
            SourcePart::Whole | SourcePart::Gltf(_) | SourcePart::Object(_) => None,
        }
    }

    /// Its name in keys of meshes, which do not depend on the clip.
    pub(super) fn name(self) -> String {
        match self {
            SourcePart::Whole => "flat".to_owned(),
            SourcePart::Posed(mesh, without, _) => {
                SourcePart::Gltf(GltfPart::Deforming { mesh, without }).name()
            }
            SourcePart::Gltf(GltfPart::Mesh(mesh)) => format!("mesh {mesh}"),
            SourcePart::Gltf(GltfPart::Deforming { mesh, without }) => {
                let mut name = format!("deforming mesh {mesh}");
                if !without.is_empty() {
                    let joints: Vec<_> = without.iter().map(|joint| joint.to_string()).collect();
                    name = format!("{name} without joints {}", joints.join(" "));
                }
                name
            }
            SourcePart::Gltf(GltfPart::Rigid { mesh, joint }) => format!("joint {joint} of mesh {mesh}"),
            SourcePart::Gltf(GltfPart::AtRest(node)) => format!("node {node} at rest"),
            SourcePart::Object(object) => format!("object {object}"),
        }
    }

    /// Returns true if its vertices can be moved, so that each deformer needs a separate object.
    pub(super) fn deforms(self) -> bool {
        matches!(self, SourcePart::Gltf(GltfPart::Deforming { .. }) | SourcePart::Posed(..))
    }
}

/// A source file and its parts that are used, or a mesh in memory in the place of one.
pub(super) struct File<'a> {
    /// Path as in the manifest.
    pub(super) path: &'a str,
    /// The path in warnings, where the scene has several files.
    pub(super) shown: Option<&'a str>,
    /// Full path.
    pub(super) full: PathBuf,
    pub(super) compiled: bool,
    /// Parts of the file, each with the manifest's objects that refer to it.
    pub(super) parts: Vec<(SourcePart, Vec<usize>)>,
    pub(super) digest: SourceDigest,
    /// What moves the vertices; the file is the first of several then.
    pub(super) moving: Option<Moving>,
    /// What poses the parts that are [`SourcePart::Posed`].
    pub(super) clips: Arc<Clips>,
    /// What takes the place of the file's content.
    pub(super) in_memory: Option<TriangleMesh<'a>>,
}

impl File<'_> {
    /// The name of a part in keys.
    pub(super) fn part(&self, part: SourcePart) -> String {
        self.moving.as_ref().map_or_else(|| part.name(), Moving::part)
    }

    /// Identity of a part by content, which does not depend on the path of the file.
    pub(super) fn content(&self, part: SourcePart) -> String {
        let alpha = match self.digest.looks.alpha {
            AlphaMode::None => String::new(),
            mode => format!(" {mode:?}"),
        };
        let materials = if self.digest.looks.materials { " materials" } else { "" };
        let lenient = if self.digest.looks.unreadable == Unreadable::LeftOut { " lenient" } else { "" };
        let clip = part.clip().map_or_else(String::new, |clip| format!(" clip {}", clip.hex()));
        format!(
            "{} {} {}{alpha}{materials}{lenient}{clip}",
            self.digest.text(),
            self.part(part),
            extension(&self.full)
        )
    }

    /// The name of a part in explanations of misses.
    pub(super) fn name_of(&self, part: SourcePart) -> String {
        format!("{} {}", self.path, self.part(part))
    }
}

/// For each object of the manifest the identity of its source in keys; `unused` for those that are
/// not used.
pub(super) fn contents(manifest: &Manifest, sources: &[File<'_>]) -> Vec<String> {
    let mut contents = vec!["unused".to_owned(); manifest.objects.len()];
    for file in sources {
        for (part, rows) in &file.parts {
            let name = file.content(*part);
            for row in rows {
                let look = manifest.objects[*row].material.as_ref().map(|look| Paint::from(look).name());
                contents[*row] = name.clone() + look.as_deref().unwrap_or_default();
            }
        }
    }
    contents
}

/// Hashes the files of the used objects; the files are in order of first use.
///
/// # Errors
/// When one cannot be read.
pub(super) fn files<'a>(
    manifest: &'a Manifest,
    folder: &Path,
    used: &[bool],
    (looks, clips): (Looks, Arc<Clips>),
) -> Result<Vec<File<'a>>> {
    let mut files: Vec<File<'a>> = Vec::new();
    let mut row_of_file: HashMap<(&str, bool, bool, Option<usize>), usize> = HashMap::new();
    let mut row_of_part: HashMap<(usize, SourcePart), usize> = HashMap::new();
    for (row, object) in manifest.objects.iter().enumerate().filter(|(row, _)| used[*row]) {
        let part = SourcePart::of(&object.source, clips.of_object(row));
        let compiled = matches!(part, SourcePart::Object(_));
        let path = object.source.path();
        // A glTF file as a whole and its single meshes are read in different ways, so they count as
        // different sources.
        let moving = Moving::of(manifest, &object.source, folder)?;
        let own = moving.is_some().then_some(row);
        let whole = part == SourcePart::Whole;
        let file = *row_of_file.entry((path, compiled, !whole, own)).or_insert_with(|| {
            let full = moving.as_ref().map_or_else(|| folder.join(path), |moving| moving.first().to_owned());
            let digest = unhashed(looks);
            let (parts, clips) = (Vec::new(), clips.clone());
            let (shown, in_memory) = (None, None);
            files.push(File { path, shown, full, compiled, parts, digest, moving, clips, in_memory });
            files.len() - 1
        });
        let parts = &mut files[file].parts;
        let place = *row_of_part.entry((file, part)).or_insert_with(|| {
            parts.push((part, Vec::new()));
            parts.len() - 1
        });
        parts[place].1.push(row);
    }
    if files.len() > 1 {
        files.iter_mut().for_each(|file| file.shown = Some(file.path));
    }
    // The first error in the order of the files is returned, so that the message does not depend on
    // timing.
    let digest = |file: &File<'_>| match &file.moving {
        Some(moving) => moving.digest(looks),
        None => SourceDigest::of(&file.full, looks),
    };
    let digests: Vec<_> = files.par_iter().map(digest).collect();
    for (file, digest) in files.iter_mut().zip(digests) {
        file.digest = digest?;
    }
    Ok(files)
}
