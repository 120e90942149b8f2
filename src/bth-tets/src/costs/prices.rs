//! Costs of rays through a tetrahedralization, by its size.

use super::profile::BvhCosts;
use super::{CostOptions, Start};
use bth_format::layout::{Link32, TetVertex};

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
    /// Factor on the costs of tetrahedra.
    scale: f64,
}

impl<'a> Prices<'a> {
    pub(super) fn new(options: &'a CostOptions) -> Self {
        let step = options.profile.tets.step[0];
        Prices { options, scale: options.c_tet.map_or(1.0, |c| c / step.max(f64::MIN_POSITIVE)) }
    }

    /// Costs of the BVH.
    pub(super) fn bvh(&self) -> BvhCosts {
        self.options.profile.bvh
    }

    /// Bytes that walks read: the records and the vertices.
    fn walked(&self, triangles: u32) -> f64 {
        f64::from(triangles)
            * (TETS_PER_TRIANGLE * size_of::<Link32>() as f64
                + VERTICES_PER_TRIANGLE * size_of::<TetVertex>() as f64)
    }

    /// Nanoseconds of a ray through the node's tetrahedra. The share `hits` of such rays ends at a
    /// triangle.
    pub(super) fn walk(&self, triangles: u32, steps: f64, hits: f64) -> f64 {
        let profile = &self.options.profile;
        self.scale * profile.tets.cost(steps, hits, self.walked(triangles), profile.bytes)
    }

    /// Steps of the node's tetrahedralization, estimated.
    pub(super) fn steps(&self, start: Start, triangles: u32, average_depth: f64) -> f64 {
        self.options.estimator.steps(start, triangles, average_depth)
    }
}
