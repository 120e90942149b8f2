//! The pipeline's stages as a decorator: results come from the cache where it has them.

use super::codec::{self, MeshSummary};
use super::nodes::CachedNodes;
use super::topology::Topology;
use super::{Cache, decode, encode, keys};
use crate::coordinates::{self, OnGrid};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::pipeline::{Direct, Stages, TreeOptions, timed};
use crate::source::Model;
use crate::{bvh, free, marks, tets};
use bth_files::Digest;
use bth_import::{self as mesh, Mesh, Wanted};
use std::path::Path;

/// The stages of one object.
pub(crate) struct CachedStages<'a> {
    cache: &'a Cache<'a>,
    /// Name of the object within the source, which explanations of misses contain.
    part: &'a str,
    /// Hash of the geometry that the next stage reads, computed when a stage first needs it.
    geometry: Option<Digest>,
}

impl<'a> CachedStages<'a> {
    /// The stages of a model.
    pub(super) fn of_model(cache: &'a Cache<'a>) -> Self {
        Self { cache, part: "", geometry: None }
    }

    /// The stages of an object whose mesh has been imported; `geometry` is the hash of its geometry.
    pub(crate) fn of_object(cache: &'a Cache<'a>, part: &'a str, geometry: Digest) -> Self {
        Self { cache, part, geometry: Some(geometry) }
    }
}

/// The hash of a mesh's geometry, computed unless it is known.
fn hash_once(known: &mut Option<Digest>, mesh: &Mesh) -> Digest {
    *known.get_or_insert_with(|| codec::geometry(mesh))
}

impl Stages for CachedStages<'_> {
    fn import(
        &mut self,
        model: &Model<'_>,
        wanted: Wanted,
        monitor: &dyn Monitor,
    ) -> Result<(Mesh, mesh::Report)> {
        if self.cache.store().is_none() {
            return Direct.import(model, wanted, monitor);
        }
        let (mesh, summary) = self.cache.get_or_build(
            (keys::mesh(model.digest, model.path, "flat", wanted), ""),
            monitor,
            decode,
            encode,
            |monitor| Ok(MeshSummary::of(Direct.import(model, wanted, monitor)?)),
        )?;
        self.geometry = Some(summary.geometry);
        Ok((mesh, summary.report))
    }

    fn coordinates(
        &mut self,
        source: &Path,
        mesh: Mesh,
        options: &coordinates::CoordinateOptions,
    ) -> Result<(Mesh, Option<OnGrid>)> {
        let (mesh, on_grid) = Direct.coordinates(source, mesh, options)?;
        if on_grid.is_some() {
            self.geometry = None;
        }
        Ok((mesh, on_grid))
    }

    fn bvh(
        &mut self,
        mesh: &Mesh,
        options: &TreeOptions<'_>,
        monitor: &dyn Monitor,
    ) -> Result<(bvh::BinaryBvh, bvh::BvhReport)> {
        if self.cache.store().is_none() {
            return Direct.bvh(mesh, options, monitor);
        }
        let geometry = hash_once(&mut self.geometry, mesh);
        self.cache.get_or_build(
            (keys::bvh(&geometry, options), self.part),
            monitor,
            |bytes| decode::<Topology>(bytes)?.over(mesh),
            |tree| encode(&Topology::of(tree)),
            |monitor| Direct.bvh(mesh, options, monitor),
        )
    }

    fn free(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        (built, options): (&TreeOptions<'_>, &free::FreeOptions),
        monitor: &dyn Monitor,
    ) -> Result<(free::Free, free::FreeReport)> {
        if self.cache.store().is_none() {
            return Direct.free(mesh, tree, (built, options), monitor);
        }
        let geometry = hash_once(&mut self.geometry, mesh);
        self.cache.get_or_build(
            (keys::free(&geometry, built, options), self.part),
            monitor,
            |bytes| decode(bytes).filter(|found: &free::Free| found.is_of(mesh.triangles.len())),
            encode,
            |monitor| Direct.free(mesh, tree, (built, options), monitor),
        )
    }

    fn marks(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        options: &TreeOptions<'_>,
        monitor: &dyn Monitor,
    ) -> Result<(marks::Marks, marks::MarkReport)> {
        if self.cache.store().is_none() {
            return Direct.marks(mesh, tree, options, monitor);
        }
        let geometry = hash_once(&mut self.geometry, mesh);
        self.cache.get_or_build(
            (keys::marks(&geometry, options), self.part),
            monitor,
            |bytes| decode(bytes).filter(|m: &marks::Marks| m.suitable.len() == tree.nodes.len()),
            encode,
            |monitor| Direct.marks(mesh, tree, options, monitor),
        )
    }

    fn tets(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        chosen: &[u32],
        options: &tets::TetOptions,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<tets::Leaf>, tets::TetReport)> {
        let nodes = CachedNodes { cache: self.cache, monitor };
        timed(|| tets::build_through(mesh, tree, chosen, options, &nodes, monitor))
    }
}
