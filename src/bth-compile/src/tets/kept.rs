//! One node, from the cache if it has it.

use crate::bvh::BinaryBvh;
use crate::cached::{Cache, decode, encode, tets_of_node};
use crate::error::Result;
use crate::monitor::Monitor;
use bth_import::Mesh;

use super::gather::{Input, gather};
use super::node::{self, Done};
use super::pool::Slot;
use super::report::Outcome;
use super::{Options, TetMesh};

/// As [`node::tetrahedralize`]; what does not depend on clocks and machines is kept, failures too. `cache` comes with the
/// version of TetGen.
///
/// # Errors
/// Cancelled.
pub(super) fn tetrahedralize(
    slot: &mut Slot<'_>,
    mesh: &Mesh,
    bvh: &BinaryBvh,
    node: u32,
    options: &Options,
    (cache, tetgen): (&Cache<'_>, &str),
    monitor: &dyn Monitor,
) -> Result<Done> {
    let build = |slot: &mut Slot<'_>| node::tetrahedralize(slot, mesh, bvh, node, options, monitor);
    if cache.store().is_none() || options.planted.is_some() {
        return build(slot);
    }
    // Without a box around it a node has no inflation that could fail.
    let Ok(input) = gather(mesh, bvh, node, 0.0) else { return build(slot) };
    let key = tets_of_node(&input.vertices, &input.triangles, options, tetgen);
    if let Some((record, bytes)) = cache.fetch(&key, "", monitor)
        && let Ok(mut report) = serde_json::from_value::<super::NodeReport>(record.report)
        && let Some(built) = revive(&bytes, &input, report.outcome)
    {
        report.node = node;
        return Ok(Done { built, report, hopeless: false, certain: true });
    }
    let done = build(slot)?;
    if done.certain {
        let bytes = done.built.as_ref().map_or(Vec::new(), |mesh| encode(&local(mesh, &input)));
        cache.put(&key, "", &bytes, &done.report, monitor);
    }
    Ok(done)
}

/// With triangles by their place among the node's.
fn local(mesh: &TetMesh, input: &Input) -> TetMesh {
    let mut mesh = mesh.clone();
    for face in &mut mesh.faces {
        let place = input.ids.binary_search(&face.triangle);
        face.triangle = place.expect("every face is a triangle of the node") as u32;
    }
    mesh
}

/// With triangles by their ids again. Outer `None`: the bytes are not what they should be.
fn revive(bytes: &[u8], input: &Input, outcome: Outcome) -> Option<Option<TetMesh>> {
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
