//! The meshes of a source file, from the cache or imported.

use super::context::Context;
use super::of_file::OfFile;
use super::sources::{File, SourcePart};
use crate::cached::{self, MeshSummary, Miss};
use crate::error::Result;
use crate::monitor::{Monitor, Recording};
use crate::opacity;
use crate::pipeline::{Import, ObjectKeys};
use crate::source::TriangleMesh;
use bth_cache::Key;
use bth_import::{self as mesh, GltfPart, Mesh};
use serde::Deserialize;

/// A mesh of a source. The mesh itself is absent while the cache has it; the summary is always
/// present.
pub(super) struct SourceMesh {
    pub(super) summary: MeshSummary,
    /// The part of the file.
    pub(super) part: SourcePart,
    mesh: Option<Mesh>,
}

/// A mesh that has been imported.
struct Imported {
    mesh: Mesh,
    summary: MeshSummary,
}

/// The meshes of a file that are used, in order. Those that the cache lacks are imported together.
///
/// # Errors
/// Errors of the import.
pub(super) fn read(file: &File<'_>, context: &Context<'_>) -> Result<Vec<SourceMesh>> {
    // A mesh in memory is not kept: reading it from the cache would take longer than its import.
    let in_cache = |part| match file.in_memory {
        Some(_) => None,
        None => known(file, part, context),
    };
    let known: Vec<Option<SourceMesh>> = file.parts.iter().map(|(part, _)| in_cache(*part)).collect();
    let lacking: Vec<SourcePart> =
        file.parts.iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(p, _)| p.0).collect();
    let mut imported = import(file, &lacking, context)?.into_iter();
    let found = file.parts.iter().zip(known).map(|((part, _), known)| {
        known.or_else(|| {
            let Imported { mesh, summary } = imported.next()?;
            let bytes = size_of_val(&mesh.positions[..]) + size_of_val(&mesh.triangles[..]);
            // A file of many meshes is not read again for each.
            let stays = context.keeper.has_room_for_mesh(2 * bytes as u64)
                || context.cache.store().is_none() && file.parts.len() > 1;
            Some(SourceMesh { summary, part: *part, mesh: stays.then_some(mesh) })
        })
    });
    let meshes: Vec<SourceMesh> = found.flatten().collect();
    for warning in meshes.iter().filter_map(SourceMesh::left_out) {
        OfFile::new(file, context.monitor).warn(&warning);
    }
    Ok(meshes)
}

impl SourceMesh {
    /// What to warn of where elements of the source became no triangles. It is not kept with the
    /// mesh: reports on single models have the number.
    fn left_out(&self) -> Option<String> {
        let count = Some(self.summary.report.skipped).filter(|count| *count > 0)?;
        let of = self.part.gltf().map_or_else(String::new, |_| format!("{}: ", self.part.name()));
        Some(format!(
            "{of}{count} elements are left out: points, lines and faces of fewer than three corners"
        ))
    }

    /// The mesh itself.
    ///
    /// # Errors
    /// Errors of the import, when the mesh has been evicted from the cache.
    pub(super) fn take(&mut self, file: &File<'_>, context: &Context<'_>) -> Result<Mesh> {
        if let Some(mesh) = self.mesh.take() {
            return Ok(mesh);
        }
        let key = key(file, self.part, context);
        let kept = context.cache.find(&key, context.monitor);
        if let Some(mesh) = kept.and_then(|r| cached::decode(&context.cache.read(&r, context.monitor)?)) {
            return Ok(mesh);
        }
        let mut again = import(file, &[self.part], context)?;
        Ok(again.swap_remove(0).mesh)
    }
}

fn key(file: &File<'_>, part: SourcePart, context: &Context<'_>) -> Key {
    Import::key_of(&file.digest, &file.full, &file.part(part), context.options.wanted())
}

/// The key of an object, if it may be kept.
pub(super) fn object_key(mesh: &MeshSummary, part: SourcePart, context: &Context<'_>) -> Option<Key> {
    if !mesh.deforms() {
        return context.keys.as_ref().map(|keys| keys.of(mesh, None));
    }
    let options = context.options.of_deforming();
    let clip = part.clip();
    context.tetgen.as_ref().map(|tetgen| ObjectKeys::new(&options, tetgen).of(mesh, clip.as_ref()))
}

/// A mesh that the cache has.
fn known(file: &File<'_>, part: SourcePart, context: &Context<'_>) -> Option<SourceMesh> {
    let record = context.cache.find(&key(file, part, context), context.monitor)?;
    let summary = MeshSummary::deserialize(&record.report).ok()?;
    cached::replay(&record.report, &OfFile::new(file, context.monitor));
    Some(SourceMesh { summary, part, mesh: None })
}

/// The objects of a file that the cache lacks, with the reasons.
pub(super) fn missing(file: &File<'_>, context: &Context<'_>) -> Vec<Miss> {
    let one = |source_part: SourcePart| {
        let part = file.name_of(source_part);
        let mesh = key(file, source_part, context);
        let summary = known(file, source_part, context).map(|mesh| mesh.summary);
        let object = summary.as_ref().and_then(|summary| object_key(summary, source_part, context));
        let Some(object) = object else {
            let because = context.cache.reasons(&mesh, &part);
            return Some(Miss { stage: mesh.stage().to_owned(), part, because });
        };
        let found = context.cache.find(&object, context.monitor);
        if found.is_some_and(|record| context.cache.holds(&record)) {
            return None;
        }
        let because = context.cache.reasons(&object, &part);
        Some(Miss { stage: object.stage().to_owned(), part, because })
    };
    file.parts.iter().filter_map(|(part, _)| one(*part)).collect()
}

/// Adds the opacity of triangles to meshes of a file: the whole file's without parts.
fn with_opacity(
    file: &File<'_>,
    parts: &[GltfPart],
    mut meshes: Vec<(Mesh, mesh::Report)>,
    context: &Context<'_>,
) -> Result<Vec<(Mesh, mesh::Report)>> {
    let Context { options, monitor, .. } = context;
    if options.alpha == mesh::AlphaMode::None {
        return Ok(meshes);
    }
    let cutouts = if parts.is_empty() {
        vec![mesh::import_cutouts(&file.full, options.looks(), *monitor)?]
    } else {
        mesh::import_gltf_cutouts(&file.full, parts, options.looks(), *monitor)?
    };
    for ((mesh, report), cutouts) in meshes.iter_mut().zip(&cutouts) {
        opacity::add(mesh, report, cutouts, *monitor)?;
    }
    Ok(meshes)
}

/// Imports meshes of a file and keeps them in the cache.
fn import(file: &File<'_>, parts: &[SourcePart], context: &Context<'_>) -> Result<Vec<Imported>> {
    if parts.is_empty() {
        return Ok(Vec::new());
    }
    // The warnings about a file are kept with the first of its meshes.
    let of_file = OfFile::new(file, context.monitor);
    let recording = Recording::new(&of_file);
    let context = &context.with_monitor(&recording);
    let Context { options, monitor, .. } = context;
    if let Some(TriangleMesh { positions, triangles }) = file.in_memory {
        let read = mesh::import_triangles(&file.full, positions, triangles, options.wanted(), *monitor)?;
        let (mesh, summary) = MeshSummary::of(read);
        return Ok(vec![Imported { mesh, summary }]);
    }
    let single: Vec<GltfPart> = parts.iter().filter_map(|part| part.gltf()).collect();
    let meshes = match &file.moving {
        Some(moving) => vec![moving.import(context)?],
        None if single.is_empty() => vec![mesh::import(&file.full, options.wanted(), *monitor)?],
        None => mesh::import_gltf_parts(&file.full, &single, options.wanted(), *monitor)?,
    };
    let meshes = with_opacity(file, &single, meshes, context)?;
    let meshes = match &file.moving {
        Some(moving) => moving.unchanged(&file.digest, meshes)?,
        None => file.digest.unchanged(&file.full, meshes)?,
    };
    let none = Recording::new(*monitor);
    let keep = |(row, (part, read))| {
        let recording = if row == 0 { &recording } else { &none };
        keep_mesh(file, part, read, context, recording)
    };
    Ok(parts.iter().copied().zip(meshes).enumerate().map(keep).collect())
}

/// Keeps a mesh in the cache.
fn keep_mesh(
    file: &File<'_>,
    part: SourcePart,
    read: (Mesh, mesh::Report),
    context: &Context<'_>,
    recording: &Recording<'_>,
) -> Imported {
    let (mesh, summary) = MeshSummary::of(read);
    let cache = context.cache;
    if cache.store().is_some() {
        let name = file.name_of(part);
        cache.miss(&key(file, part, context), &name);
        cache.put(&key(file, part, context), &name, &cached::encode(&mesh), &summary, recording);
    }
    Imported { mesh, summary }
}
