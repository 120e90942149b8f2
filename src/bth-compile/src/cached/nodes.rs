//! Tetrahedralizations of single nodes from the cache.

use super::rows::{HashedRows, Sink};
use super::{Cache, decode, encode};
use crate::error::Result;
use crate::monitor::{Monitor, Recording};
use crate::tets::{
    NodeInput, NodeJob, NodeReport, NodeResult, NodeRunner, Outcome, TetMesh, TetOptions, TimedNodes,
};
use bth_cache::Key;

/// Takes results of nodes from the cache. Results that do not depend on clocks and machines are
/// kept, including failures.
pub(crate) struct CachedNodes<'a> {
    pub(crate) cache: &'a Cache<'a>,
    pub(crate) monitor: &'a dyn Monitor,
}

impl CachedNodes<'_> {
    /// Version of tetrahedralizations.
    pub(crate) const VERSION: &'static str = "1";

    /// The options that the attempts at a node depend on: neither the path of the worker nor the
    /// number of workers.
    pub(crate) fn attempts(options: &TetOptions) -> String {
        let TetOptions {
            worker: _,
            workers: _,
            free_space,
            inflation,
            deadline,
            deadline_per_triangle,
            memory,
            // Which nodes there are depends on these.
            cells: _,
            minimum: _,
            planted: _,
        } = options;
        format!(
            "free space {free_space}, inflation {inflation:?}, deadline {deadline:?} + {deadline_per_triangle:?}, memory {memory}"
        )
    }
}

/// The key of the tetrahedralization of a node: its corners and triangles, in the order of their
/// rows in the mesh.
fn key_of(input: &NodeInput, options: &TetOptions, tetgen: &str) -> Key {
    let mut hasher = HashedRows::new("node");
    hasher.add(&input.vertices);
    hasher.add(&input.triangles);
    // Part of the key because a node that can be replaced by smaller ones gets fewer attempts.
    let smaller = options.cells.iter().any(|&size| (size as usize) < input.triangles.len());
    Key::new("tets")
        .with("geometry", hasher.finish().hex())
        .with("tetrahedralization", CachedNodes::attempts(options))
        .with("cells below", smaller.to_string())
        .with("tetgen", tetgen)
        .with("tets version", CachedNodes::VERSION)
}

impl NodeRunner for CachedNodes<'_> {
    fn run(&self, job: &NodeJob<'_>, build: &mut dyn FnMut() -> Result<NodeResult>) -> Result<NodeResult> {
        if self.cache.store().is_none() || job.options.planted.is_some() {
            return TimedNodes.run(job, build);
        }
        // The key contains the triangles only, because the box around them follows from the
        // options.
        let Some(input) = job.input() else { return TimedNodes.run(job, build) };
        let key = key_of(&input, job.options, job.tetgen);
        if let Some((record, bytes)) = self.cache.fetch(&key, "", self.monitor)
            && let Ok(mut report) = serde_json::from_value::<NodeReport>(record.report)
            && let Some(built) = with_ids_of_mesh(&bytes, &input, report.outcome)
        {
            report.node = job.node;
            return Ok(NodeResult { built, report, no_worker: false, reproducible: true });
        }
        self.cache.miss(&key, "");
        let result = TimedNodes.run(job, build)?;
        if result.reproducible {
            let encoded = |mesh| encode(&with_ids_of_node(mesh, &input));
            let bytes = result.built.as_ref().map_or(Vec::new(), encoded);
            self.cache.put(&key, "", &bytes, &result.report, &Recording::new(self.monitor));
        }
        Ok(result)
    }
}

/// The tetrahedralization with triangles numbered within the node, so that it does not depend on
/// where in a model the node is.
fn with_ids_of_node(mesh: &TetMesh, input: &NodeInput) -> TetMesh {
    let mut mesh = mesh.clone();
    for face in &mut mesh.faces {
        let number = input.ids.binary_search(&face.triangle);
        face.triangle = number.expect("every face is a triangle of the node") as u32;
    }
    mesh
}

/// The reverse of [`with_ids_of_node`], from bytes. The inner `None` is a failure that was kept,
/// the outer one means damaged bytes.
fn with_ids_of_mesh(bytes: &[u8], input: &NodeInput, outcome: Outcome) -> Option<Option<TetMesh>> {
    if outcome != Outcome::Built {
        return bytes.is_empty().then_some(None);
    }
    let mut mesh: TetMesh = decode(bytes)?;
    if mesh.faces.len() != input.ids.len() {
        return None;
    }
    for face in &mut mesh.faces {
        face.triangle = *input.ids.get(face.triangle as usize)?;
    }
    Some(Some(mesh))
}
