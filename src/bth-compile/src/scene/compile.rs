//! A manifest into a file: objects that may be seen, then the scene.

use super::objects::{self, ObjectReport};
use super::{encode, visible};
use crate::error::{Error, Place, Result};
use crate::monitor::Monitor;
use crate::pipeline::{Clock, Compiled, Options, StageTime, provenance};
use crate::tets::WorkerStatus;
use crate::write::{self, FileBuilder};
use bth_scene::Manifest;
use serde::Serialize;
use std::path::Path;

/// What a scene file holds and how it was made.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// What each stage took, all objects together.
    pub seconds: Vec<StageTime>,
    /// Objects of the file, in order.
    pub objects: Vec<ObjectReport>,
    /// Objects of the manifest that no visible instance uses.
    pub unused: Vec<String>,
    /// Nodes.
    pub nodes: u64,
    /// Instances that may be seen.
    pub instances: u64,
    /// Tracks.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// First frame.
    pub first_frame: i32,
    /// Last frame.
    pub last_frame: i32,
    /// Frames per second.
    pub rate: f64,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Triangles of all instances.
    pub instanced_triangles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of the objects' sections that traversal reads.
    pub resident_bytes: u64,
    /// The tetrahedralization worker, if one was needed.
    pub worker: Option<WorkerStatus>,
}

/// Compiles a scene; paths of the manifest count from `folder`, `name` stands for the scene in messages.
///
/// # Errors
/// Those of the objects; `BTH-I050` when its first frame cannot be shown.
pub fn compile(
    manifest: &Manifest,
    folder: &Path,
    name: &Path,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<(Compiled, SceneReport)> {
    let mut clock = Clock::default();
    let order = encode::order(manifest);
    let visible = visible::visible(manifest, &order);
    let mut used = vec![false; manifest.objects.len()];
    for (node, _) in manifest.nodes.iter().zip(&visible).filter(|(_, visible)| **visible) {
        node.object.into_iter().for_each(|object| used[object] = true);
    }
    let objects = objects::build(manifest, folder, &used, options, monitor, &mut clock)?;
    let parts = encode::encode(manifest, &order, &visible, &objects.number)?;

    let tetgen = match &objects.worker {
        Some(WorkerStatus::Ready { tetgen }) => Some(tetgen.as_str()),
        _ => None,
    };
    let provenance = provenance::of_scene(&objects.sources, tetgen, options)?;
    let (bytes, resident_bytes) = clock.time("file", || {
        let mut builder = FileBuilder::new();
        let resident = objects.write(&mut builder, options)?;
        write::scene(&mut builder, &parts)?;
        builder.provenance(provenance)?;
        let bytes = builder.finish();
        bth::from_bytes(&bytes).map_err(|e| refused(name, &e))?;
        Ok::<_, Error>((bytes, resident))
    })?;

    let triangles = |object: u32| objects.reports[object as usize].triangles;
    let unused = manifest.objects.iter().zip(&used).filter(|(_, used)| !**used);
    let report = SceneReport {
        seconds: clock.0,
        unused: unused.map(|(object, _)| object.name.clone()).collect(),
        nodes: parts.nodes.len() as u64,
        instances: parts.instances.len() as u64,
        tracks: parts.tracks.len() as u64,
        cameras: parts.cameras.len() as u64,
        lights: parts.lights.len() as u64,
        first_frame: manifest.frames.first,
        last_frame: manifest.frames.last,
        rate: manifest.frames.rate,
        triangles: objects.reports.iter().map(|o| o.triangles).sum(),
        instanced_triangles: parts.instances.iter().map(|i| triangles(i.object)).sum(),
        bytes: bytes.len() as u64,
        resident_bytes,
        worker: objects.worker.clone(),
        objects: objects.reports,
    };
    Ok((Compiled { bytes }, report))
}

/// The error for a file that the library does not take: the scene's fault when its first frame cannot be shown,
/// else ours.
fn refused(name: &Path, error: &bth::Error) -> Error {
    match error.code() {
        bth::Code::Singular | bth::Code::NotFinite => Error::Input {
            code: "BTH-I050",
            place: Place::File(name.to_owned()),
            message: format!("the first frame cannot be shown: {error}"),
            hint: error.hint().to_owned(),
        },
        _ => Error::Internal { code: "BTH-X030", message: format!("the written file fails: {error}") },
    }
}
