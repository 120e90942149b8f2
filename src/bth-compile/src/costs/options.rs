//! Options of the selection, and its verdict on each node.

use super::{Estimator, Profile, Weighting};
use serde::{Serialize, Serializer};
use std::sync::Arc;

/// How nodes are selected.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Select {
    /// The selection of least expected time, over all suitable nodes, for the rays of [`OptimizeFor`].
    #[default]
    Best,
    /// The paper's rule (§3.2): from the root down, the first nodes whose tetrahedra are the cheaper for
    /// rays from outside.
    Paper,
    /// These nodes of the binary BVH, of which none lies below another: for measurements.
    Nodes(Vec<u32>),
}

/// Which rays the file is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimizeFor {
    /// Rays from outside only.
    Camera,
    /// Rays that start on known surfaces only.
    Secondary,
    /// Three rays from surfaces for one from outside.
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

/// What decides, after the tetrahedra are built, whether they stay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Probe {
    /// Steps of sampled rays, counted and priced by the profile: the same on every machine.
    #[default]
    Steps,
    /// Nothing: all that was built stays.
    Off,
}

/// What the structures cost, and which nodes are considered. Times are of one ray on one thread.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Options {
    /// How nodes are selected.
    pub select: Select,
    /// Which rays count.
    pub optimize_for: OptimizeFor,
    /// How to estimate the steps through a tetrahedralization.
    pub estimator: Estimator,
    /// What tracing costs. Enters files and keys by its hash.
    #[serde(serialize_with = "by_hash")]
    pub profile: Profile,
    /// Takes a step from one tetrahedron to the next to cost so many nanoseconds, and scales the other costs of
    /// tetrahedra alike.
    pub c_tet: Option<f64>,
    /// Nodes of fewer triangles stay BVH.
    pub minimum_triangles: u32,
    /// Nodes of more triangles are not taken whole.
    pub maximum_triangles: u32,
    /// Least saving for which any node is chosen, as a share of the cost of the model's BVH: tet leaves
    /// take several times the memory, and a few small ones in a large scene save next to nothing.
    pub minimum_gain: f64,
    /// Bytes that traversal may read for each triangle of the model, the BVH included. Sizes are estimated before
    /// tetrahedra are built; what is over the limit then is left out.
    pub max_bytes_per_triangle: Option<f64>,
    /// Seconds of one thread that tetrahedralization may take, by the profile's estimate and not by the clock, so
    /// that the same nodes are chosen on every machine.
    pub budget: Option<f64>,
    /// What decides in the end.
    pub probe: Probe,
    /// For objects of a scene: take the rays of its cameras, lights and frames.
    pub for_scene: bool,
    /// The rays of a scene that concern the object, which then count instead of sampled ones. Enter keys by their hash.
    #[serde(serialize_with = "rays_by_hash")]
    pub scene: Option<Arc<Weighting>>,
}

fn rays_by_hash<S: Serializer>(scene: &Option<Arc<Weighting>>, to: S) -> Result<S::Ok, S::Error> {
    match scene {
        Some(scene) => to.serialize_str(&scene.hash()),
        None => to.serialize_none(),
    }
}

fn by_hash<S: Serializer>(profile: &Profile, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&profile.hash())
}

impl Default for Options {
    fn default() -> Self {
        Options {
            select: Select::default(),
            optimize_for: OptimizeFor::default(),
            estimator: Estimator::default(),
            profile: Profile::default(),
            c_tet: None,
            minimum_triangles: 2048,
            maximum_triangles: 1 << 20,
            minimum_gain: 0.02,
            max_bytes_per_triangle: None,
            budget: None,
            probe: Probe::default(),
            for_scene: false,
            scene: None,
        }
    }
}

/// Why a node was or was not chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decision {
    /// It becomes a tet leaf.
    Chosen,
    /// Its BVH is estimated to be the cheaper.
    RefusedCost,
    /// Nodes below it save more.
    RefusedParts,
    /// It has fewer triangles than the minimum.
    RefusedSmall,
    /// It has more triangles than the maximum.
    RefusedLarge,
    /// It would be chosen, but all such nodes together save too small a share of the model's cost.
    RefusedGain,
    /// It would be chosen, but for the limits on bytes or time.
    RefusedLimit,
    /// Some of its triangles are in bad contact.
    Unsuitable,
}

impl std::fmt::Display for Decision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Decision::Chosen => "chosen",
            Decision::RefusedCost => "no: the BVH costs less",
            Decision::RefusedParts => "no: its parts save more",
            Decision::RefusedSmall => "no: too few triangles",
            Decision::RefusedLarge => "no: too many triangles",
            Decision::RefusedGain => "no: too little gained on the whole",
            Decision::RefusedLimit => "no: over the limit of bytes or time",
            Decision::Unsuitable => "no: bad contacts",
        })
    }
}

/// What was found of one node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Index in the binary BVH.
    pub node: u32,
    /// Triangles below it.
    pub count: u32,
    /// Whether they are free of bad contacts.
    pub suitable: bool,
    /// Estimated cost with its tetrahedralization, nanoseconds for each ray that may use it: by the paper's rule one
    /// that meets its box, else one that starts on it.
    pub cost_tet: f64,
    /// The same with its BVH.
    pub cost_bvh: f64,
    /// Estimated steps of a ray through its tetrahedralization.
    pub n_avg: f64,
    /// What tetrahedra save, nanoseconds for each ray of the model.
    pub gain: f64,
    /// What follows.
    pub decision: Decision,
}

/// The selection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Nodes that become tet leaves, ascending; none lies below another.
    pub chosen: Vec<u32>,
    /// The nodes that were examined, ascending: neither below a chosen one nor below a small one.
    pub verdicts: Vec<Verdict>,
}

/// What the selection came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// The costs and limits that were used.
    pub options: Options,
    /// Nodes examined.
    pub examined: u64,
    /// Nodes chosen.
    pub chosen: u64,
    /// Triangles in chosen nodes.
    pub triangles: u64,
    /// Those over all triangles of the BVH, 0 to 1.
    pub share: f64,
    /// Suitable nodes of fitting size that were refused for their cost.
    pub refused_for_cost: u64,
    /// Expected cost of a ray through the BVH, nanoseconds.
    pub cost_bvh: f64,
    /// The same with the chosen nodes tetrahedralized.
    pub cost_with_tets: f64,
    /// Wall-clock time of the stage as the pipeline measures it, seconds; 0 where the stage is called on its own.
    pub seconds: f64,
}
