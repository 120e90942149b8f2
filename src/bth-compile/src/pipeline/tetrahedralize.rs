//! Builds tetrahedralizations of the chosen nodes, and keeps the ones that save time.

use super::choose_nodes::unusable;
use crate::bvh::BinaryBvh;
use crate::cached::{Cache, CachedNodes};
use crate::costs::{self, ProbeReport};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::stage::Stage;
use crate::tets::{self, Leaf, TetReport};
use bth_import::Mesh;
use std::path::Path;

/// Tetrahedralizes nodes. The cache keeps the result of each.
pub(super) struct Tetrahedralize<'a> {
    pub(super) source: &'a Path,
    pub(super) mesh: &'a Mesh,
    pub(super) tree: &'a BinaryBvh,
    pub(super) chosen: &'a [u32],
    pub(super) options: &'a CompileOptions,
    pub(super) cache: &'a Cache<'a>,
}

impl Stage for Tetrahedralize<'_> {
    type Output = (Vec<Leaf>, TetReport);
    const NAME: &'static str = "tets";
    const VERSION: &'static str = CachedNodes::VERSION;

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { source, mesh, tree, chosen, options, cache } = self;
        let nodes = CachedNodes { cache, monitor };
        let made = tets::build_through(mesh, tree, chosen, &options.tets, &nodes, monitor)?;
        let whole = matches!(made.0[..], [(0, _)]);
        if options.structure == Structure::Tets && !tree.nodes.is_empty() && !whole {
            let message = "the model could not be tetrahedralized whole".to_owned();
            let hint = "is the worker bth-tetgen installed? Else use --structure bth";
            return Err(unusable(source, message, hint));
        }
        Ok(made)
    }
}

/// Finds the tetrahedralizations that save time according to sample rays. The tetrahedralization of
/// a whole model is always kept.
pub(super) struct Probe<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) tree: &'a BinaryBvh,
    pub(super) built: Vec<Leaf>,
    pub(super) options: &'a CompileOptions,
}

impl Stage for Probe<'_> {
    type Output = (Vec<Leaf>, Option<ProbeReport>);
    const NAME: &'static str = "probe";
    const VERSION: &'static str = "1";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { mesh, tree, built, options } = self;
        let made = match options.structure {
            Structure::Bth => costs::probe(mesh, tree, built, &options.costs, monitor)?,
            Structure::Bvh | Structure::Tets => (built, None),
        };
        Ok(made)
    }
}
