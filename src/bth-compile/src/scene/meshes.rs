//! The meshes of a source file: known from the cache, or imported.

use super::compile::Context;
use super::objects::content;
use super::sources::File;
use crate::cached::{self, MeshFacts, Miss};
use crate::error::Result;
use bth_cache::Key;
use bth_import::{self as mesh, Mesh};

/// A mesh, or what is known of one that the cache has.
pub(super) struct Found {
    pub(super) facts: MeshFacts,
    /// Number of the mesh; `None` for the whole file.
    pub(super) number: Option<u32>,
    mesh: Option<Mesh>,
}

/// The meshes that are used of a file, in order. All that the cache lacks are imported at once.
///
/// # Errors
/// Those of the import.
pub(super) fn read(file: &File<'_>, context: &Context<'_>) -> Result<Vec<Found>> {
    let known: Vec<Option<MeshFacts>> =
        file.parts.iter().map(|(number, _)| known(&key(file, *number, context), context)).collect();
    let lacking: Vec<Option<u32>> =
        file.parts.iter().zip(&known).filter(|(_, k)| k.is_none()).map(|(p, _)| p.0).collect();
    let mut imported = import(file, &lacking, context)?.into_iter();
    let found = file.parts.iter().zip(known).map(|((number, _), facts)| match facts {
        Some(facts) => Some(Found { facts, number: *number, mesh: None }),
        None => {
            let (mesh, facts) = imported.next()?;
            Some(Found { facts, number: *number, mesh: Some(mesh) })
        }
    });
    Ok(found.flatten().collect())
}

impl Found {
    /// The mesh itself.
    ///
    /// # Errors
    /// Those of the import, when the cache does not have it any more.
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
    cached::mesh(&file.digest, &file.full, &file.part(number), context.options.attributes)
}

/// What the cache knows of a mesh.
fn known(key: &Key, context: &Context<'_>) -> Option<MeshFacts> {
    let record = context.cache.find(key, context.monitor)?;
    serde_json::from_value(record.report).ok()
}

/// The objects of a file that neither the file that was there nor the cache has, and why.
pub(super) fn missing(file: &File<'_>, context: &Context<'_>) -> Vec<Miss> {
    let one = |number: Option<u32>| {
        let part = file.name_of(number);
        let mesh = key(file, number, context);
        let (Some(facts), Some(keys)) = (known(&mesh, context), &context.keys) else {
            let because = context.cache.reasons(&mesh, &part);
            return Some(Miss { stage: mesh.stage().to_owned(), part, because });
        };
        let old = context
            .previous
            .as_ref()
            .and_then(|p| Some((p, p.outline.object_of(content(&facts).as_bytes())?)));
        if old.is_some_and(|(previous, object)| previous.has(object)) {
            return None;
        }
        let object = keys.of(&facts);
        let found = context.cache.find(&object, context.monitor);
        if found.is_some_and(|record| context.cache.holds(&record)) {
            return None;
        }
        let because = context.cache.reasons(&object, &part);
        Some(Miss { stage: object.stage().to_owned(), part, because })
    };
    file.parts.iter().filter_map(|(number, _)| one(*number)).collect()
}

/// Imports meshes of a file and keeps them.
fn import(file: &File<'_>, numbers: &[Option<u32>], context: &Context<'_>) -> Result<Vec<(Mesh, MeshFacts)>> {
    if numbers.is_empty() {
        return Ok(Vec::new());
    }
    let Context { options, cache, monitor, .. } = context;
    let single: Vec<u32> = numbers.iter().filter_map(|number| *number).collect();
    let meshes = if single.is_empty() {
        vec![mesh::import(&file.full, options.attributes, *monitor)?]
    } else {
        mesh::import_gltf_meshes(&file.full, &single, options.attributes, *monitor)?
    };
    let meshes = file.digest.unchanged(&file.full, meshes)?;
    let keep = |(number, read): (&Option<u32>, (Mesh, mesh::Report))| {
        let (mesh, facts) = MeshFacts::of(read);
        if cache.store().is_some() {
            let part = file.name_of(*number);
            cache.miss(&key(file, *number, context), &part);
            cache.put(&key(file, *number, context), &part, &cached::encode(&mesh), &facts, *monitor);
        }
        (mesh, facts)
    };
    Ok(numbers.iter().zip(meshes).map(keep).collect())
}
