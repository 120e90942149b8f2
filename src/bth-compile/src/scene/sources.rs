//! The files that a scene's objects come from.

use crate::cached;
use crate::error::Result;
use crate::source::SourceDigest;
use bth_files::Digest;
use bth_scene::{Manifest, Source};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A source file and its parts that are used.
pub(super) struct File<'a> {
    /// As the manifest has it.
    pub(super) path: &'a str,
    /// Where it is.
    pub(super) full: PathBuf,
    pub(super) compiled: bool,
    /// Mesh or object (`None` for the whole file), and the manifest's objects that are that.
    pub(super) parts: Vec<(Option<u32>, Vec<usize>)>,
    pub(super) digest: SourceDigest,
}

impl File<'_> {
    /// The name of a part in keys.
    pub(super) fn part(&self, part: Option<u32>) -> String {
        let kind = if self.compiled { "object" } else { "mesh" };
        part.map_or_else(|| "flat".to_owned(), |number| format!("{kind} {number}"))
    }

    /// Identifies a part by content, wherever the file lies.
    pub(super) fn content(&self, part: Option<u32>) -> String {
        format!("{} {} {}", self.digest.text(), self.part(part), cached::extension(&self.full))
    }

    /// The name of a part in explanations of misses.
    pub(super) fn name_of(&self, part: Option<u32>) -> String {
        format!("{} {}", self.path, self.part(part))
    }
}

/// For each object of the manifest the identity of its source in keys; `unused` for those that are not used.
pub(super) fn contents(manifest: &Manifest, sources: &[File<'_>]) -> Vec<String> {
    let mut contents = vec!["unused".to_owned(); manifest.objects.len()];
    for file in sources {
        for (part, rows) in &file.parts {
            let name = file.content(*part);
            rows.iter().for_each(|row| contents[*row].clone_from(&name));
        }
    }
    contents
}

/// The files of the used objects, in order of first use, hashed.
///
/// # Errors
/// When one cannot be read.
pub(super) fn files<'a>(manifest: &'a Manifest, folder: &Path, used: &[bool]) -> Result<Vec<File<'a>>> {
    let mut files: Vec<File<'a>> = Vec::new();
    let nothing = || SourceDigest { file: Digest::of(b""), others: Vec::new() };
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
            let full = folder.join(path);
            files.push(File { path, full, compiled, parts: Vec::new(), digest: nothing() });
            files.len() - 1
        });
        let parts = &mut files[file].parts;
        let place = *row_of_part.entry((file, part)).or_insert_with(|| {
            parts.push((part, Vec::new()));
            parts.len() - 1
        });
        parts[place].1.push(row);
    }
    // Errors are taken in the order of the files, so that the message does not depend on timing.
    let digests: Vec<_> = files.par_iter().map(|file| SourceDigest::of(&file.full)).collect();
    for (file, digest) in files.iter_mut().zip(digests) {
        file.digest = digest?;
    }
    Ok(files)
}
