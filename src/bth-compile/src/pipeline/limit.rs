//! The limit on the bytes that tracing reads: determines the size of the BVH before nodes are
//! chosen, and drops tetrahedralizations when they are larger than estimated.

use super::report::FileReport;
use super::traced::{TracedMesh, TracedRef, collapse};
use crate::costs::{self, Choice, ProbeReport, Weighed, least_useful};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::stage::Stage;
use crate::{bvh, tets};
use bth_format::layout::{FreeLevels, NONE, Object as Header};
use bth_import::Mesh;

/// How the tetrahedra of a mesh will be stored; under a limit on bytes also the size of the object
/// without them.
///
/// # Errors
/// A limit of the format, cancellation.
pub fn storage(
    mesh: &Mesh,
    tree: &bvh::BinaryBvh,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<costs::Storage> {
    storage_of(TracedRef { mesh, on_grid: None, tree, probabilities: None }, options, monitor)
}

/// Returns the same as [`storage`] for a mesh that may be on a grid.
pub(super) fn storage_of(
    traced: TracedRef<'_>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<costs::Storage> {
    let mut storage = options.storage();
    if options.costs.max_bytes_per_triangle.is_some() {
        storage.plain_bytes = Some(bytes(traced, &[], options, monitor)?);
    }
    Ok(storage)
}

/// The limit that applies to tet leaves. The tetrahedralization of a whole model is not limited.
pub(super) fn bytes_per_triangle(options: &CompileOptions) -> Option<f64> {
    options.costs.max_bytes_per_triangle.filter(|_| options.structure == Structure::Bth)
}

/// Drops tetrahedralizations, the lowest gain per byte first, until tracing reads at most `most`
/// bytes a triangle. Drops all of them if the rest saves less than the smallest gain. Updates the
/// probe's report.
pub(super) struct FitLimit<'a> {
    pub(super) traced: &'a TracedMesh,
    pub(super) most: f64,
    pub(super) leaves: Vec<tets::Leaf>,
    pub(super) choice: &'a Choice,
    pub(super) probe: Option<ProbeReport>,
    pub(super) options: &'a CompileOptions,
}

impl Stage for FitLimit<'_> {
    type Output = (Vec<tets::Leaf>, Option<ProbeReport>);
    const NAME: &'static str = "limit";
    const VERSION: &'static str = "1";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { traced, most, mut leaves, choice, mut probe, options } = self;
        let traced = traced.by_ref();
        let most = most * traced.mesh.triangles.len() as f64;
        let before = leaves.len();
        while !leaves.is_empty() {
            let excess = bytes(traced, &leaves, options, monitor)? as f64 - most;
            if excess <= 0.0 {
                break;
            }
            let weigh = |(node, tets): &tets::Leaf| Weighed {
                gain: gain(traced.tree, choice, probe.as_ref(), *node),
                takes: tets::encoded_bytes(tets, options.record) as f64,
            };
            let items: Vec<Weighed> = leaves.iter().map(weigh).collect();
            let out = least_useful(&items, excess);
            let mut row = 0..;
            leaves.retain(|_| row.next().is_some_and(|row| out.binary_search(&row).is_err()));
        }
        if let Some(probe) = &mut probe
            && leaves.len() < before
        {
            follow(probe, &mut leaves, &options.costs);
        }
        Ok((leaves, probe))
    }
}

/// Brings the probe's report up to date after leaves were dropped, and drops the rest if it saves
/// too little.
fn follow(probe: &mut ProbeReport, leaves: &mut Vec<tets::Leaf>, costs: &costs::CostOptions) {
    let is_left = |node: u32| leaves.iter().any(|(n, _)| *n == node);
    probe.leaves.iter_mut().for_each(|leaf| leaf.kept = leaf.kept && is_left(leaf.node));
    let left: f64 = probe.leaves.iter().filter(|leaf| leaf.kept).map(|leaf| leaf.gain).sum();
    probe.cost_with_tets = probe.cost_bvh - left;
    if left < costs.minimum_gain * probe.cost_bvh {
        probe.leaves.iter_mut().for_each(|leaf| leaf.kept = false);
        probe.cost_with_tets = probe.cost_bvh;
        leaves.clear();
    }
}

/// Bytes for each triangle that the limit leaves to rows of free directions.
pub(super) fn row_bytes(
    traced: &TracedMesh,
    leaves: &[tets::Leaf],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<usize> {
    let Some(most) = options.costs.max_bytes_per_triangle else { return Ok(usize::MAX) };
    let of_levels = size_of::<FreeLevels>();
    let others = bytes(traced.by_ref(), leaves, options, monitor)? as usize + of_levels;
    let triangles = traced.mesh.triangles.len().max(1);
    Ok(((most * triangles as f64) as usize).saturating_sub(others) / triangles)
}

/// Bytes that tracing reads of the object with these tet leaves.
fn bytes(
    traced: TracedRef<'_>,
    leaves: &[tets::Leaf],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<u64> {
    let cut: Vec<u32> = leaves.iter().map(|(node, _)| *node).collect();
    let wide = collapse(traced, &cut, options, monitor)?.0;
    let row_per_triangle = size_of::<u32>() * traced.mesh.triangles.len();
    let face_of_triangle = if leaves.is_empty() { 0 } else { row_per_triangle };
    let places = if wide.root == NONE { 0 } else { row_per_triangle };
    let rest = size_of::<Header>() + size_of_val(&wide.lines[..]) + size_of_val(&wide.triangle_ids[..]);
    let tets = leaves.iter().map(|(_, tets)| tets::encoded_bytes(tets, options.record));
    Ok((rest + face_of_triangle + places) as u64 + tets.sum::<u64>())
}

/// The gain of a tet leaf as probed, or without a probe as estimated when the node was chosen. A
/// cell of a chosen node that could not be built whole is assigned a share of the node's gain by
/// its triangles.
fn gain(tree: &bvh::BinaryBvh, choice: &Choice, probe: Option<&ProbeReport>, node: u32) -> f64 {
    if let Some(probe) = probe {
        return probe.leaves.iter().find(|leaf| leaf.node == node).map_or(0.0, |leaf| leaf.gain);
    }
    let above = choice.chosen.partition_point(|n| *n <= node).checked_sub(1).map(|k| choice.chosen[k]);
    let verdict = above.and_then(|n| choice.verdicts.iter().find(|v| v.node == n));
    let share = |v: &costs::Verdict| f64::from(tree.nodes[node as usize].count) / f64::from(v.count);
    verdict.map_or(0.0, |v| v.gain * share(v))
}

/// Warns if an object is over the limit on bytes.
pub(crate) fn warn_over_limit(file: &FileReport, options: &CompileOptions, monitor: &dyn Monitor) {
    let Some(most) = options.costs.max_bytes_per_triangle else { return };
    let each = file.resident_bytes_per_triangle;
    if each > most {
        let what = if file.tet_leaves == 0 { "what tracing reads" } else { "the tetrahedralization" };
        monitor
            .warn(&format!("{what} takes {each:.1} bytes a triangle, more than the limit of {most} allows"));
    }
}
