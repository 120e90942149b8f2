//! What `costs` measured, as it is written to JSON.

use crate::output::Head;
use serde::Serialize;

/// The estimators of N_avg, the mean number of steps. The first two need no tetrahedra and are affine in the octree's levels; the
/// others need tetrahedra.
pub const ESTIMATORS: [&str; 4] = ["face count", "average depth", "area", "sampling"];

/// Where rays start; pairs of numbers in results are in this order.
pub const STARTS: [&str; 2] = ["outside", "surface"];

/// A node of a model, tetrahedralized.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredNode {
    /// Its model.
    pub model: String,
    /// Index in the binary BVH.
    pub node: u32,
    /// Its triangles.
    pub triangles: u32,
    /// Bytes of its tetrahedra and vertices.
    pub bytes: f64,
    /// Mean steps of 8,192 rays.
    pub steps: [f64; 2],
    /// Share of the rays that end at a triangle.
    pub hits: [f64; 2],
    /// Measured nanoseconds of a ray.
    pub nanoseconds: [f64; 2],
    /// Predictions of each estimator: levels for the first two, steps for the others.
    pub estimates: [[f64; 2]; ESTIMATORS.len()],
    /// Share of the rays that end at a triangle, as the sampling estimator finds it.
    pub sampled_hits: [f64; 2],
    /// Microseconds that each estimator takes.
    pub micros: [f64; ESTIMATORS.len()],
}

/// Constants that were fitted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Constants {
    /// Steps at least and per level, of face count and average depth.
    pub levels: [[[f64; 2]; 2]; 2],
    /// Factors of the area's steps.
    pub area: [f64; 2],
    /// Nanoseconds: entry, the triangle where a ray ends, a step in the smaller size, in the larger.
    pub walk: [[f64; 4]; 2],
    /// Mean share of the rays that end at a triangle: for estimators that do not predict it.
    pub hits: [f64; 2],
    /// The smaller and the larger size, in bytes.
    pub sizes: [[f64; 2]; 2],
}

/// How well an estimator predicts on models that its constants were not fitted on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimatorError {
    /// The estimator; `measured steps` for the cost of the steps themselves.
    pub name: String,
    /// Where rays start.
    pub start: &'static str,
    /// Median microseconds it takes for a node.
    pub micros: f64,
    /// Rank correlation with measured steps, and median relative error.
    pub steps: [Option<f64>; 2],
    /// Rank correlation with measured nanoseconds, and median relative error.
    pub nanoseconds: [Option<f64>; 2],
}

/// A selection on a small model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    /// Its name, or its nodes.
    pub name: String,
    /// Nodes that became tet leaves.
    pub nodes: Vec<u32>,
    /// Nanoseconds of a ray, a quarter of the camera's, the others from surfaces.
    pub nanoseconds: f64,
    /// By which share it is slower than the best selection.
    pub regret: f64,
}

/// Selections on a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Regret {
    /// The model.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// How many selections were measured.
    pub tried: usize,
    /// The best of all, and those of the rules.
    pub selections: Vec<Selection>,
}

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostsResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// Models that constants were fitted on.
    pub fitted_on: Vec<String>,
    /// Models that the estimators' errors were measured on.
    pub judged_on: Vec<String>,
    /// The constants.
    pub constants: Constants,
    /// How well each estimator predicts.
    pub judged: Vec<EstimatorError>,
    /// Selections on small models.
    pub regrets: Vec<Regret>,
    /// Nodes that the constants were fitted on.
    pub fitted: Vec<MeasuredNode>,
    /// Nodes that the errors were measured on.
    pub nodes: Vec<MeasuredNode>,
}
