//! Costs of rays through a tetrahedralization, by its size.

use super::profile::BvhCosts;
use super::{CostOptions, Start, Walk};
use bth_format::layout::{RecordKind, TetVertex};

/// Tetrahedra and tetrahedron vertices for each triangle, with free-space points, as measured on
/// scans.
const TETS_PER_TRIANGLE: f64 = 3.35;
const VERTICES_PER_TRIANGLE: f64 = 0.85;
/// Assumed share of the lines through a node's box that hit a triangle: the share of a ball in its
/// bounding cube.
pub(super) const LINES_THAT_HIT: f64 = 0.52;

/// Prices under the options.
pub(super) struct Prices<'a> {
    options: &'a CostOptions,
    costs: &'a Walk,
    record: RecordKind,
    /// Factor on the costs of tetrahedra.
    scale: f64,
}

impl<'a> Prices<'a> {
    pub(super) fn new(options: &'a CostOptions, record: RecordKind) -> Self {
        let costs = options.profile.record(record);
        let scale = options.c_tet.map_or(1.0, |c| c / costs.step[0].max(f64::MIN_POSITIVE));
        Prices { options, costs, record, scale }
    }

    /// Costs of the BVH.
    pub(super) fn bvh(&self) -> BvhCosts {
        self.options.profile.bvh
    }

    /// Bytes that walks read: the records and the vertices.
    fn walked(&self, triangles: u32) -> f64 {
        f64::from(triangles)
            * (TETS_PER_TRIANGLE * self.record.stride() as f64
                + VERTICES_PER_TRIANGLE * size_of::<TetVertex>() as f64)
    }

    /// Nanoseconds of a ray through the node's tetrahedra; `hits` is the share of such rays that end
    /// at a triangle.
    pub(super) fn walk(&self, triangles: u32, steps: f64, hits: f64) -> f64 {
        self.scale * self.costs.cost(steps, hits, self.walked(triangles), self.options.profile.bytes)
    }

    /// Steps of the node's tetrahedralization, estimated.
    pub(super) fn steps(&self, start: Start, triangles: u32, average_depth: f64) -> f64 {
        self.options.estimator.steps(start, triangles, average_depth)
    }
}
