//! Costs of rays through a tetrahedralization, by its size.

use super::profile::BvhCosts;
use super::{CostOptions, Walk};
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
        let step = options.profile.tets.surface.step[0];
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

    fn cost(&self, walk: &Walk, triangles: u32, steps: f64, hits: f64) -> f64 {
        self.scale * walk.cost(steps, hits, self.walked(triangles), self.options.profile.bytes)
    }

    /// Nanoseconds of a ray that starts on a triangle of the node. The share `hits` of such rays
    /// ends at a triangle.
    pub(super) fn surface(&self, triangles: u32, steps: f64, hits: f64) -> f64 {
        self.cost(&self.options.profile.tets.surface, triangles, steps, hits)
    }

    /// Nanoseconds of a ray that enters the box of the whole object, sixteen rays at a time.
    pub(super) fn outside(&self, triangles: u32, steps: f64, hits: f64) -> f64 {
        self.cost(&self.options.profile.tets.outside, triangles, steps, hits)
    }

    /// Nanoseconds of a ray that enters the box of a leaf below a BVH node, where rays enter one by
    /// one.
    pub(super) fn alone(&self, triangles: u32, steps: f64, hits: f64) -> f64 {
        self.cost(&self.options.profile.tets.alone, triangles, steps, hits)
    }
}
