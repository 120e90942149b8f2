//! The wide BVH of a mesh of very many triangles, built in parts: a binary tree takes several times
//! the memory of the mesh and of the wide tree. Many machines can build the parts into the cache;
//! without them the cache keeps no parts.

use super::hashed::Hashed;
use super::object::{Collapse, Hierarchy};
use super::tree::{BuildTree, CountVisits, TreeOptions};
use crate::bvh::{self, BvhReport, CollapseOptions, CollapseReport, Node, Part, Parts, Weighed, Wide};
use crate::cached::{Cache, Codec, RowReader, Sink, decode, encode, text};
use crate::error::Result;
use crate::free::KeepFree;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::shard::Shard;
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;
use rayon::slice::ParallelSliceMut;
use std::path::Path;

/// Builds the wide tree of a mesh in parts of at most `most` triangles.
pub(super) struct BuildInParts<'a> {
    pub(super) mesh: Hashed<'a>,
    pub(super) options: TreeOptions<'a>,
    pub(super) most: usize,
    pub(super) cache: &'a Cache<'a>,
    /// Names the object within the source in explanations of misses.
    pub(super) name: &'a str,
}

/// Returns true if a mesh of this size is built in parts with these options: those that need the
/// binary tree of all triangles exclude it.
pub(crate) fn in_parts(triangles: u64, options: &CompileOptions) -> bool {
    triangles > options.part_triangles
        && !options.deformable
        && options.structure != Structure::Tets
        && options.free.keep == KeepFree::None
        && options.costs.rays.is_none()
}

/// Returns false if a model has too few bytes for an object that is built in parts, so that it need
/// not be imported to know. glTF, FBX and 3MF files may be compressed, or refer to others; of other
/// formats the triangles take at least four bytes.
pub(crate) fn may_be_in_parts(model: &Path, options: &CompileOptions) -> bool {
    let bytes = std::fs::metadata(model).map_or(0, |metadata| metadata.len());
    in_parts(bytes / 4, options) || bth_import::is_scene(model) && in_parts(u64::MAX, options)
}

impl Stage for BuildInParts<'_> {
    type Output = (Hierarchy, BvhReport, CollapseReport);
    const NAME: &'static str = "parts";
    const VERSION: &'static str = "2";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Parts { ids, whole } = Parts::of(self.mesh.mesh, self.most, monitor)?;
        let area = whole.map_or(0.0, |whole| whole.half_area());
        let count = ids.len();
        let (mut parts, mut reports) = (Vec::with_capacity(count), BvhReport::default());
        for (number, ids) in ids.into_iter().enumerate() {
            let part = self.part(&ids, whole, (number, count));
            let found = self.cache.take(&part, &self.name_of(number), monitor);
            let ((wide, root), (bvh, report)) = found.map_or_else(|| part.run(monitor), Ok)?;
            reports.add(&bvh, if area > 0.0 { root.half_area() / area } else { 0.0 });
            parts.push(Part { wide, root, report });
        }
        reports.dropped = self.mesh.mesh.triangles.len() as u64 - reports.triangles;
        let (wide, report) = bvh::join(parts)?;
        let bounds = whole.map(|whole| (whole.lower, whole.upper));
        Ok((Hierarchy { wide, bounds, dropped: reports.dropped as u32 }, reports, report))
    }
}

impl BuildInParts<'_> {
    /// Builds the parts into the cache that belong to a shard, where the first part is this work.
    /// Returns their number.
    pub(super) fn build_shard(&self, (shard, first): (Shard, u64), monitor: &dyn Monitor) -> Result<u64> {
        let Parts { ids, whole } = Parts::of(self.mesh.mesh, self.most, monitor)?;
        let parts = (0..ids.len()).filter(|number| shard.has(first + *number as u64));
        let build = |number: usize| {
            let part = self.part(&ids[number], whole, (number, ids.len()));
            self.cache.run(part, &self.name_of(number), monitor).map(|_| 1)
        };
        parts.map(build).sum()
    }

    fn part<'b>(&'b self, ids: &'b [u32], whole: Option<Node>, number: (usize, usize)) -> BuildPart<'b> {
        BuildPart { mesh: self.mesh, options: self.options, ids, whole, number }
    }

    fn name_of(&self, number: usize) -> String {
        format!("{} part {}", self.name, number + 1).trim_start().to_owned()
    }
}

/// Builds the wide tree of one part.
struct BuildPart<'a> {
    mesh: Hashed<'a>,
    options: TreeOptions<'a>,
    ids: &'a [u32],
    /// A node over all parts.
    whole: Option<Node>,
    /// Its number from 0, and the number of all.
    number: (usize, usize),
}

/// The wide tree of a part, and the root of its binary tree.
type PartTree = (Wide, Node);

impl Stage for BuildPart<'_> {
    type Output = (PartTree, (BvhReport, CollapseReport));
    const NAME: &'static str = "part";
    const VERSION: &'static str = BuildInParts::VERSION;

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { mesh, options, ids, whole, .. } = self;
        let (tree, bvh) = bvh::build_part(mesh.mesh, ids, options.bvh.quality, monitor)?;
        let visits = CountVisits { built: BuildTree { mesh, options }, tree: &tree }.run(monitor)?;
        let weighed = Weighed { bvh: &tree, probabilities: visits.as_deref() };
        let options = CollapseOptions { whole, ..CollapseOptions::default() };
        let (wide, collapse) = bvh::collapse(mesh.mesh, weighed, &[], &options, monitor)?;
        Ok(((wide, tree.nodes[0]), (bvh, collapse)))
    }
}

impl CachedStage<PartTree, (BvhReport, CollapseReport)> for BuildPart<'_> {
    fn key(&self) -> Key {
        Key::new(Self::NAME)
            .with("geometry", self.mesh.hash())
            .with("quality", text(&self.options.bvh.quality))
            .with("part", format!("{} of {}", self.number.0 + 1, self.number.1))
            .with("bvh version", BuildTree::VERSION)
            .with("collapse version", Collapse::VERSION)
            .with("part version", Self::VERSION)
    }

    fn encode(tree: &PartTree) -> Vec<u8> {
        encode(tree)
    }

    fn decode(&self, bytes: &[u8]) -> Option<PartTree> {
        let tree: PartTree = decode(bytes)?;
        let mut ids = tree.0.triangle_ids.clone();
        ids.par_sort_unstable();
        (ids == self.ids).then_some(tree)
    }
}

impl Codec for PartTree {
    fn write(&self, to: &mut impl Sink) {
        let (wide, Node { lower, upper, first, count, right }) = self;
        let Wide { lines, triangle_ids, leaf_vertices: _, widened_boxes, root, depth } = wide;
        to.add(lines);
        to.add(triangle_ids);
        to.add(&[u32::from(*widened_boxes), *root, *depth, *first, *count, *right]);
        to.add(&[*lower, *upper]);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let (lines, triangle_ids) = (from.take()?, from.take()?);
        let [widened_boxes, root, depth, first, count, right] = Codec::read(from)?;
        let [lower, upper] = Codec::read(from)?;
        let (leaf_vertices, widened_boxes) = (Vec::new(), widened_boxes == 1);
        let wide = Wide { lines, triangle_ids, leaf_vertices, widened_boxes, root, depth };
        Some((wide, Node { lower, upper, first, count, right }))
    }
}

#[cfg(test)]
#[path = "parts_tests.rs"]
mod tests;
