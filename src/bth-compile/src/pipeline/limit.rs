//! The limit on the bytes that tracing reads: what the BVH takes before nodes are chosen, and what is left out when the
//! tetrahedra turn out larger than estimated.

use super::{FileReport, Options, wide};
use crate::coordinates::OnGrid;
use crate::costs::{self, Choice, ProbeReport, Weighed, least_useful};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::{bvh, tets};
use bth_format::layout::Object as Header;
use bth_import as mesh;

/// Tetrahedralizations by their node.
type Built = Vec<(u32, tets::TetMesh)>;

/// How the tetrahedra of a mesh will be stored; under a limit on bytes, beside a BVH of how many.
///
/// # Errors
/// A limit of the format, cancellation.
pub fn storage(
    mesh: &mesh::Mesh,
    tree: &bvh::BinaryBvh,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<costs::Storage> {
    storage_on(mesh, None, tree, options, monitor)
}

pub(super) fn storage_on(
    mesh: &mesh::Mesh,
    on_grid: Option<&OnGrid>,
    tree: &bvh::BinaryBvh,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<costs::Storage> {
    let mut storage = options.storage();
    if options.costs.max_bytes_per_triangle.is_some() {
        storage.plain_bytes = Some(Made { mesh, on_grid, tree, options }.bytes(&[], monitor)?);
    }
    Ok(storage)
}

/// What the stages made of a mesh.
#[derive(Clone, Copy)]
pub(super) struct Made<'a> {
    pub(super) mesh: &'a mesh::Mesh,
    pub(super) on_grid: Option<&'a OnGrid>,
    pub(super) tree: &'a bvh::BinaryBvh,
    pub(super) options: &'a Options,
}

impl Made<'_> {
    /// Leaves out tetrahedralizations, those of least gain for a byte first, until tracing reads at most so many bytes a
    /// triangle; all of them if the rest saves less than the least gain.
    pub(super) fn within(
        &self,
        most: f64,
        mut built: Built,
        choice: &Choice,
        mut probe: Option<&mut ProbeReport>,
        monitor: &dyn Monitor,
    ) -> Result<Built> {
        let costs = &self.options.costs;
        let most = most * self.mesh.triangles.len() as f64;
        let before = built.len();
        while !built.is_empty() {
            let over = self.bytes(&built, monitor)? as f64 - most;
            if over <= 0.0 {
                break;
            }
            let weigh = |(node, tets): &(u32, tets::TetMesh)| Weighed {
                gain: gain(self.tree, choice, probe.as_deref(), *node),
                takes: tets::encoded_bytes(tets, self.options.record) as f64,
            };
            let items: Vec<Weighed> = built.iter().map(weigh).collect();
            let out = least_useful(&items, over);
            let mut row = 0..;
            built.retain(|_| row.next().is_some_and(|row| out.binary_search(&row).is_err()));
        }
        if let Some(probe) = &mut probe
            && built.len() < before
        {
            let is_left = |node: u32| built.iter().any(|(n, _)| *n == node);
            probe.leaves.iter_mut().for_each(|leaf| leaf.kept = leaf.kept && is_left(leaf.node));
            let left: f64 = probe.leaves.iter().filter(|leaf| leaf.kept).map(|leaf| leaf.gain).sum();
            probe.cost_with_tets = probe.cost_bvh - left;
            if left < costs.minimum_gain * probe.cost_bvh {
                probe.leaves.iter_mut().for_each(|leaf| leaf.kept = false);
                probe.cost_with_tets = probe.cost_bvh;
                built.clear();
            }
        }
        Ok(built)
    }

    /// Bytes that tracing reads of the object with these tet leaves.
    fn bytes(&self, built: &[(u32, tets::TetMesh)], monitor: &dyn Monitor) -> Result<u64> {
        let cut: Vec<u32> = built.iter().map(|(node, _)| *node).collect();
        let wide = wide(self.mesh, self.on_grid, self.tree, &cut, self.options, monitor)?.wide;
        let homes = if built.is_empty() { 0 } else { size_of::<u32>() * self.mesh.triangles.len() };
        let rest = size_of::<Header>() + size_of_val(&wide.lines[..]) + size_of_val(&wide.triangle_ids[..]);
        let tets = built.iter().map(|(_, tets)| tets::encoded_bytes(tets, self.options.record));
        Ok((rest + homes) as u64 + tets.sum::<u64>())
    }
}

/// What a tet leaf saves: as probed, else as estimated when it was chosen. A part of a chosen node, which could not be built
/// whole, saves its share.
fn gain(tree: &bvh::BinaryBvh, choice: &Choice, probe: Option<&ProbeReport>, node: u32) -> f64 {
    if let Some(probe) = probe {
        return probe.leaves.iter().find(|leaf| leaf.node == node).map_or(0.0, |leaf| leaf.gain);
    }
    let above = choice.chosen.partition_point(|n| *n <= node).checked_sub(1).map(|k| choice.chosen[k]);
    let verdict = above.and_then(|n| choice.verdicts.iter().find(|v| v.node == n));
    let share = |v: &costs::Verdict| f64::from(tree.nodes[node as usize].count) / f64::from(v.count);
    verdict.map_or(0.0, |v| v.gain * share(v))
}

/// By how much an object is over the limit on bytes, in words; `None` if it is not.
pub(crate) fn over(file: &FileReport, options: &Options) -> Option<String> {
    let most = options.costs.max_bytes_per_triangle?;
    let each = file.resident_bytes_per_triangle;
    let what = if file.tet_leaves == 0 { "the BVH alone" } else { "the tetrahedralization" };
    (each > most)
        .then(|| format!("{what} takes {each:.1} bytes a triangle, more than the limit of {most} allows"))
}

/// Warns, if there is something to warn of.
pub(crate) fn say(over: Option<String>, monitor: &dyn Monitor) {
    over.iter().for_each(|message| monitor.warn(message));
}
