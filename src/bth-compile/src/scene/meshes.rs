//! The meshes of a source file, from the cache or imported.

use super::context::Context;
use super::sources::File;
use crate::cached::{self, MeshSummary, Miss};
use crate::error::Result;
use crate::opacity;
use crate::source::TriangleMesh;
use bth_cache::Key;
use bth_files::Digest;
use bth_import::{self as mesh, Mesh};

/// A mesh of a source. The mesh itself is absent while the cache has it; the summary is always present.
pub(super) struct SourceMesh {
    pub(super) summary: MeshSummary,
    /// Number of the mesh; `None` for the whole file.
    pub(super) number: Option<u32>,
    mesh: Option<Mesh>,
}

/// The meshes of a file that are used, in order. Those that the cache lacks are imported together.
///
/// # Errors
/// Those of the import.
pub(super) fn read(file: &File<'_>, context: &Context<'_>) -> Result<Vec<SourceMesh>> {
    // A mesh in memory is not kept: reading it from the cache would take longer than its import.
    let in_cache = |number| match file.in_memory {
        Some(_) => None,
        None => known(&key(file, number, context), context),
    };
    let known: Vec<Option<MeshSummary>> = file.parts.iter().map(|(number, _)| in_cache(*number)).collect();
    let lacking: Vec<Option<u32>> =
        file.parts.iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(p, _)| p.0).collect();
    let mut imported = import(file, &lacking, context)?.into_iter();
    let found = file.parts.iter().zip(known).map(|((number, _), summary)| match summary {
        Some(summary) => Some(SourceMesh { summary, number: *number, mesh: None }),
        None => {
            let (mesh, summary) = imported.next()?;
            Some(SourceMesh { summary, number: *number, mesh: Some(mesh) })
        }
    });
    Ok(found.flatten().collect())
}

impl SourceMesh {
    /// The mesh itself.
    ///
    /// # Errors
    /// Those of the import, when the mesh has been evicted from the cache.
    pub(super) fn take(&mut self, file: &File<'_>, context: &Context<'_>) -> Result<Mesh> {
        if let Some(mesh) = self.mesh.take() {
            return Ok(mesh);
        }
        let key = key(file, self.number, context);
        let kept = context.cache.find(&key, context.monitor);
        if let Some(mesh) = kept.and_then(|r| cached::decode(&context.cache.read(&r, context.monitor)?)) {
            return Ok(mesh);
        }
        let mut again = import(file, &[self.number], context)?;
        Ok(again.swap_remove(0).0)
    }
}

fn key(file: &File<'_>, number: Option<u32>, context: &Context<'_>) -> Key {
    cached::mesh(&file.digest, &file.full, &file.part(number), context.options.wanted())
}

/// The summary of a mesh that the cache has.
fn known(key: &Key, context: &Context<'_>) -> Option<MeshSummary> {
    let record = context.cache.find(key, context.monitor)?;
    serde_json::from_value(record.report).ok()
}

/// The objects of a file that neither the previous file nor the cache has, with the reasons.
pub(super) fn missing(file: &File<'_>, context: &Context<'_>) -> Vec<Miss> {
    let one = |number: Option<u32>| {
        let part = file.name_of(number);
        let mesh = key(file, number, context);
        let (Some(summary), Some(keys)) = (known(&mesh, context), &context.keys) else {
            let because = context.cache.reasons(&mesh, &part);
            return Some(Miss { stage: mesh.stage().to_owned(), part, because });
        };
        let old = context
            .previous
            .as_ref()
            .and_then(|p| Some((p, p.index.object_of(content(&summary).as_bytes())?)));
        if old.is_some_and(|(previous, object)| previous.has(object)) {
            return None;
        }
        let object = keys.of(&summary);
        let found = context.cache.find(&object, context.monitor);
        if found.is_some_and(|record| context.cache.holds(&record)) {
            return None;
        }
        let because = context.cache.reasons(&object, &part);
        Some(Miss { stage: object.stage().to_owned(), part, because })
    };
    file.parts.iter().filter_map(|(number, _)| one(*number)).collect()
}

/// A hash of a mesh's content, which does not depend on the file of the mesh.
pub(super) fn content(mesh: &MeshSummary) -> blake3::Hash {
    let shading = mesh.shading.as_ref().map(Digest::hex);
    let opacity =
        mesh.opacity.as_ref().map_or_else(String::new, |opacity| format!(" opacity {}", opacity.hex()));
    let groups = mesh.groups.as_ref().map_or_else(String::new, |groups| format!(" groups {}", groups.hex()));
    let materials = mesh.materials.as_ref();
    let materials = materials.map_or_else(String::new, |materials| format!(" materials {}", materials.hex()));
    blake3::hash(format!("mesh {} {shading:?}{opacity}{groups}{materials}", mesh.geometry.hex()).as_bytes())
}

/// Adds the opacity of triangles to meshes of a file: the whole file's without numbers.
fn with_opacity(
    file: &File<'_>,
    numbers: &[u32],
    mut meshes: Vec<(Mesh, mesh::Report)>,
    context: &Context<'_>,
) -> Result<Vec<(Mesh, mesh::Report)>> {
    let Context { options, monitor, .. } = context;
    if options.alpha == mesh::AlphaMode::None {
        return Ok(meshes);
    }
    let cutouts = if numbers.is_empty() {
        vec![mesh::import_cutouts(&file.full, options.alpha, *monitor)?]
    } else {
        mesh::import_gltf_cutouts(&file.full, numbers, options.alpha, *monitor)?
    };
    for ((mesh, report), cutouts) in meshes.iter_mut().zip(&cutouts) {
        opacity::add(mesh, report, cutouts, *monitor)?;
    }
    Ok(meshes)
}

/// Imports meshes of a file and keeps them in the cache.
fn import(
    file: &File<'_>,
    numbers: &[Option<u32>],
    context: &Context<'_>,
) -> Result<Vec<(Mesh, MeshSummary)>> {
    if numbers.is_empty() {
        return Ok(Vec::new());
    }
    let Context { options, cache, monitor, .. } = context;
    if let Some(TriangleMesh { positions, triangles }) = file.in_memory {
        let read = mesh::import_triangles(&file.full, positions, triangles, options.wanted(), *monitor)?;
        return Ok(vec![MeshSummary::of(read)]);
    }
    let single: Vec<u32> = numbers.iter().filter_map(|number| *number).collect();
    let meshes = if single.is_empty() {
        vec![mesh::import(&file.full, options.wanted(), *monitor)?]
    } else {
        mesh::import_gltf_meshes(&file.full, &single, options.wanted(), *monitor)?
    };
    let meshes = with_opacity(file, &single, meshes, context)?;
    let meshes = file.digest.unchanged(&file.full, meshes)?;
    let keep = |(number, read): (&Option<u32>, (Mesh, mesh::Report))| {
        let (mesh, summary) = MeshSummary::of(read);
        if cache.store().is_some() {
            let part = file.name_of(*number);
            cache.miss(&key(file, *number, context), &part);
            cache.put(&key(file, *number, context), &part, &cached::encode(&mesh), &summary, *monitor);
        }
        (mesh, summary)
    };
    Ok(numbers.iter().zip(meshes).map(keep).collect())
}
