//! Options of the selection, and its report.

use super::{Estimator, Profile};
use bth_bvh::sampling::KnownRays;
use serde::{Serialize, Serializer};
use std::sync::Arc;

/// How nodes are selected.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Select {
    /// The selection of min expected time, over all suitable nodes, for the rays of
    /// [`OptimizeFor`].
    #[default]
    Best,
    /// These nodes of the binary BVH, none below another. For measurements.
    Nodes(Vec<u32>),
}

/// The mixture of rays for which the file is optimized.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimizeFor {
    /// Rays from outside only.
    Camera,
    /// Rays that start on known surfaces only.
    Secondary,
    /// Three rays from surfaces to one from outside.
    #[default]
    Balanced,
}

impl OptimizeFor {
    /// Shares of rays from outside and from surfaces; their sum is 1.
    pub fn weights(self) -> [f64; 2] {
        match self {
            OptimizeFor::Camera => [1.0, 0.0],
            OptimizeFor::Secondary => [0.0, 1.0],
            OptimizeFor::Balanced => [0.25, 0.75],
        }
    }
}

/// The criterion by which tetrahedra stay in the file after they are built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Probe {
    /// Steps of sampled rays, counted and priced by the profile, with the same result on every
    /// machine.
    #[default]
    Steps,
    /// None: all tetrahedra that were built stay.
    Off,
}

/// Costs of the structures, and which nodes are considered. Times are per ray on one
/// thread.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostOptions {
    /// How nodes are selected.
    pub select: Select,
    /// The mixture of rays.
    pub optimize_for: OptimizeFor,
    /// How to estimate the steps through a tetrahedralization.
    pub estimator: Estimator,
    /// Costs of tracing. Files and cache keys contain its hash.
    #[serde(serialize_with = "by_hash")]
    pub profile: Profile,
    /// Cost of a step from one tetrahedron to the next, nanoseconds, instead of the profile's; the
    /// other costs of tetrahedra are scaled by the same factor.
    pub c_tet: Option<f64>,
    /// Nodes of fewer triangles are not tetrahedralized.
    pub minimum_triangles: u32,
    /// Nodes of more triangles are not tetrahedralized as a whole; nodes below them may be.
    pub maximum_triangles: u32,
    /// Min saving of all chosen nodes together, as a share of the cost of the model's BVH; below it
    /// no node is chosen, because tet leaves take several times the memory of a BVH.
    pub minimum_gain: f64,
    /// The criterion by which tetrahedra stay after they are built.
    pub probe: Probe,
    /// Rays that weight the nodes of the object: in addition to sampled ones for the BVH, instead
    /// of sampled ones for tetrahedra. Cache keys contain their hash.
    #[serde(serialize_with = "rays_by_hash")]
    pub rays: Option<Arc<KnownRays>>,
}

fn rays_by_hash<S: Serializer>(rays: &Option<Arc<KnownRays>>, to: S) -> Result<S::Ok, S::Error> {
    match rays {
        Some(rays) => to.serialize_str(&rays.hash()),
        None => to.serialize_none(),
    }
}

fn by_hash<S: Serializer>(profile: &Profile, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&profile.hash())
}

impl CostOptions {
    /// Returns true if the gain of the selection cannot become less where more nodes are suitable.
    pub fn more_suitable_gain_more(&self) -> bool {
        matches!(self.select, Select::Best)
    }
}

impl Default for CostOptions {
    fn default() -> Self {
        CostOptions {
            select: Select::default(),
            optimize_for: OptimizeFor::default(),
            estimator: Estimator::default(),
            profile: Profile::default(),
            c_tet: None,
            minimum_triangles: 2048,
            maximum_triangles: 1 << 20,
            minimum_gain: 0.02,
            probe: Probe::default(),
            rays: None,
        }
    }
}

/// Report of the selection.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CostReport {
    /// The costs that were used.
    pub options: CostOptions,
    /// Nodes examined.
    pub examined: u64,
    /// Nodes chosen.
    pub chosen: u64,
    /// Triangles in chosen nodes.
    pub triangles: u64,
    /// Share of the triangles of the BVH that are in chosen nodes, 0 to 1.
    pub share: f64,
    /// Suitable nodes of fitting size that were refused for their cost.
    pub refused_for_cost: u64,
    /// Expected cost of a ray through the BVH, nanoseconds.
    pub cost_bvh: f64,
    /// Expected cost of a ray with the chosen nodes tetrahedralized, nanoseconds.
    pub cost_with_tets: f64,
}
