//! The variations of the builder: each changes one step.

use super::block_order::{BlockOrder, reordered};
use super::{greedy_collapse, spatial_splits};
use crate::clock::Clock;
use anyhow::Result;
use bth_compile::Silent;
use bth_compile::bvh::{self, CollapseOptions, CollapseReport, Costs, Effort, Plan, Quality};
use bth_compile::comparison::collapse_by;
use bth_compile::sampling;
use bth_compile::write::{self, FileBuilder, ObjectParts};
use bth_import::Mesh;
use std::collections::HashSet;

/// How the binary BVH is built.
enum BinaryTree {
    BuiltVariation(Effort),
    /// With spatial splits (the exponent of their cost), then reinsertion as in compiled files.
    Spatial(f64),
}

/// A way to build.
pub(super) struct Variation {
    pub(super) name: &'static str,
    tree: BinaryTree,
    plan: Plan,
    /// Whether wide nodes are chosen greedily, not at least cost.
    greedy: bool,
    costs: Costs,
    order: BlockOrder,
    /// Whether the wide tree is chosen by what sample rays enter, not by areas.
    by_visits: bool,
}

/// The name of the builder that compiled files are made with: all variations are compared with it.
pub(super) const AS_IN_FILES: &str = "as in files";

/// All variations.
pub(super) fn all() -> Vec<Variation> {
    let effort = Quality::Balanced.effort();
    let treelets = |treelets| Effort { treelets, ..effort.clone() };
    let built = |effort: Effort| Variation {
        name: "",
        tree: BinaryTree::BuiltVariation(effort),
        plan: Plan::default(),
        greedy: false,
        costs: Costs::default(),
        order: BlockOrder::DepthFirst,
        by_visits: true,
    };
    let with = |bins, sweep_count, reinsertion: &[f64]| {
        built(Effort { bins, sweep_count, reinsertion: reinsertion.to_vec(), ..effort.clone() })
    };
    let planned = |greedy, children, triangles| Variation {
        plan: Plan { children, triangles },
        greedy,
        ..built(Quality::Balanced.effort())
    };
    let costs = Costs::default();
    let priced = |costs| Variation { costs, ..built(Quality::Balanced.effort()) };
    let leaves = |by| priced(Costs { indexed: costs.indexed.map(|c| by * c), ..costs });
    let ordered = |order| Variation { order, ..built(Quality::Balanced.effort()) };
    let spatial =
        |exponent| Variation { tree: BinaryTree::Spatial(exponent), ..built(Quality::Balanced.effort()) };
    let sweep = effort.sweep_count;
    let named = |name, variation| Variation { name, ..variation };
    vec![
        named(AS_IN_FILES, built(effort.clone())),
        named("the same again", built(Quality::Balanced.effort())),
        named("16 bins", with(16, 0, &[])),
        named("32 bins", with(32, 0, &[])),
        named("32 bins, sweep of small nodes", with(32, sweep, &[])),
        named("full sweep", with(32, usize::MAX, &[])),
        named("one pass of reinsertion", with(32, sweep, &[0.05])),
        named("`best`", built(Quality::Best.effort())),
        named("no treelets", built(treelets(0))),
        named("treelets of few triangles only", built(treelets(1))),
        named("by areas, no treelets", Variation { by_visits: false, ..built(treelets(0)) }),
        named("greedy collapse", planned(true, 16, 16)),
        named("lines for nothing", priced(Costs { line: 0.0, ..costs })),
        named("leaves at 0.7 of their cost", leaves(0.7)),
        named("leaves at 1.3 of their cost", leaves(1.3)),
        named("leaves beside nodes", ordered(BlockOrder::LeavesBesideNodes)),
        named("breadth first", ordered(BlockOrder::BreadthFirst)),
        named("random order", ordered(BlockOrder::Random)),
        named("spatial splits", spatial(1.0)),
        named("spatial splits, n^0.4", spatial(0.4)),
        named("8 children", planned(false, 8, 16)),
        named("8 triangles", planned(false, 16, 8)),
        named("8 children, 8 triangles", planned(false, 8, 8)),
    ]
}

/// A file that a variation has built, and figures of its building.
pub(super) struct BuiltVariation {
    pub(super) bytes: Vec<u8>,
    pub(super) collapse: CollapseReport,
    /// Nodes of the binary BVH that a random line through the box meets.
    pub(super) visits: f64,
    /// References in leaves over triangles.
    pub(super) references: f64,
    /// CPU seconds of building and collapsing, on one thread.
    pub(super) seconds: f64,
}

impl Variation {
    /// Builds a file with this variation.
    pub(super) fn build(&self, mesh: &Mesh) -> Result<BuiltVariation> {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let mut made = None;
        let clock = Clock::ThreadCpu;
        let seconds = one.install(|| clock.time(|| made = Some(self.make(mesh))));
        let (tree, wide, collapse) = made.expect("the work was done")?;
        let wide = reordered(&wide, self.order);
        let distinct: HashSet<u32> = tree.order.iter().copied().collect();
        let parts = ObjectParts {
            bounds: tree.nodes.first().map(|root| (root.lower, root.upper)),
            root: wide.root,
            triangles: mesh.triangles.len() as u32,
            dropped: (mesh.triangles.len() - distinct.len()) as u32,
            lines: &wide.lines,
            triangle_ids: &wide.triangle_ids,
            ..ObjectParts::default()
        };
        let mut file = FileBuilder::new();
        write::object(&mut file, 0, &parts)?;
        Ok(BuiltVariation {
            bytes: file.finish(),
            visits: bvh::visits(&tree),
            references: tree.order.len() as f64 / distinct.len().max(1) as f64,
            collapse,
            seconds,
        })
    }

    fn make(&self, mesh: &Mesh) -> Result<(bvh::BinaryBvh, bvh::Wide, CollapseReport)> {
        let tree = match &self.tree {
            BinaryTree::BuiltVariation(effort) => {
                let (tree, mut report) = bvh::build_with(mesh, effort, &Silent)?;
                let visits = |tree: &bvh::BinaryBvh| sampling::visits(mesh, tree, None);
                bvh::rebuild_treelets(mesh, tree, effort.treelets, &visits, &mut report, &Silent)?
            }
            BinaryTree::Spatial(exponent) => {
                let tree = spatial_splits::build(mesh, *exponent);
                let passes = Quality::Balanced.effort().reinsertion;
                bvh::reinsert(tree, &passes, &mut bvh::BvhReport::default(), &Silent)?
            }
        };
        let probabilities = self.by_visits.then(|| sampling::visits(mesh, &tree, None));
        let weighed = bvh::Weighed { bvh: &tree, probabilities: probabilities.as_deref() };
        let options = CollapseOptions { plan: self.plan, costs: self.costs, ..CollapseOptions::default() };
        let (wide, report) = match self.greedy {
            true => collapse_by(mesh, weighed, &[], &options, &greedy_collapse::decide, &Silent)?,
            false => bvh::collapse(mesh, weighed, &[], &options, &Silent)?,
        };
        Ok((tree, wide, report))
    }
}
