//! Steps of a ray through the tetrahedralization of a whole model: counted, and as the cost model
//! predicts them.

use crate::model::Model;
use crate::report::{Report, Subject};
use bth_compile::bvh::BinaryBvh;
use bth_compile::comparison::{area_steps, mean_steps};
use bth_compile::costs::{Estimator, Start};
use bth_compile::sampling::{self, SampleRay};
use bth_compile::tets::TetMesh;

/// Sampled rays of a kind.
const RAYS: usize = 4096;

/// Adds counted and predicted steps of rays from outside and from the surface.
pub(super) fn add(model: &Model, tree: &BinaryBvh, tets: &TetMesh, report: &mut Report) {
    let root = &tree.nodes[0];
    let outside = sampling::outside(root.lower, root.upper, RAYS, 21);
    let surface = sampling::from_surface(&model.mesh, tree, 0..tree.order.len(), 2 * RAYS, 22);
    let surface: Vec<SampleRay> = surface.into_iter().filter(|r| r.tmax.is_infinite()).collect();
    let triangles = tree.order.len() as u32;
    for (set, start, rays) in
        [("from outside", Start::Outside, outside), ("from surfaces", Start::Surface, surface)]
    {
        let figures = [
            ("steps counted", mean_steps(tets, &rays)),
            ("steps by face count", Some(Estimator::FaceCount.steps(start, triangles, 0.0))),
            ("steps by area", Some(area_steps(tets, start))),
        ];
        for (engine, steps) in figures {
            let of = Subject { engine, ours: false, model: &model.name, threads: 1 };
            steps.into_iter().for_each(|steps| report.add(&of, set, steps, "steps"));
        }
    }
}
