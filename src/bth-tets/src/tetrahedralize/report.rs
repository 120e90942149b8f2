//! Reports of the tets stage.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Report on the chosen nodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TetReport {
    /// The worker that was used, or why there was none.
    pub worker: WorkerStatus,
    /// Nodes that were to be tetrahedralized.
    pub chosen: u64,
    /// Triangles below them.
    pub chosen_triangles: u64,
    /// Nodes that were tetrahedralized, cells of failed nodes included.
    pub built: u64,
    /// Triangles in them.
    pub built_triangles: u64,
    /// Nodes that failed and were replaced by cells.
    pub split: u64,
    /// Nodes that failed and stay in the BVH.
    pub given_up: u64,
    /// Triangles that stay in the BVH although they were chosen.
    pub given_up_triangles: u64,
    /// Jobs that were sent to workers.
    pub attempts: u64,
    /// Attempts that failed, by reason.
    pub failures: BTreeMap<String, u64>,
    /// Tetrahedra.
    pub tets: u64,
    /// Their vertices.
    pub vertices: u64,
    /// Vertices that are neither corners of triangles nor of boxes: free-space points and TetGen's.
    pub steiner_points: u64,
    /// Of these, the free-space points.
    pub free_points: u64,
    /// Points that were moved by a few units in the last place after rounding.
    pub nudged: u64,
    /// Worker processes that were started.
    pub workers_started: u64,
    /// Every node that was tried, ascending by node.
    pub nodes: Vec<NodeReport>,
}

/// The worker program.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WorkerStatus {
    /// No node was chosen, so no worker was searched for.
    #[default]
    NotNeeded,
    /// The worker works.
    Ready {
        /// TetGen's version.
        tetgen: String,
    },
    /// No worker was found; all triangles stay in the BVH.
    Missing {
        /// How to install one.
        hint: String,
    },
    /// The worker that was found does not work; all triangles stay in the BVH.
    Unusable {
        /// The program and the error.
        reason: String,
    },
}

/// Report on one node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeReport {
    /// Index in the binary BVH.
    pub node: u32,
    /// Triangles below it.
    pub triangles: u32,
    /// Outcome.
    pub outcome: Outcome,
    /// Why attempts failed, in order.
    pub failures: Vec<String>,
    /// Tetrahedra.
    pub tets: u32,
    /// Their vertices.
    pub vertices: u32,
    /// Free-space points and TetGen's.
    pub steiner_points: u32,
    /// Free-space points.
    pub free_points: u32,
    /// Points moved after rounding.
    pub nudged: u32,
    /// Wall-clock seconds of all attempts.
    pub seconds: f64,
}

/// Outcome of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It is a tet leaf.
    Built,
    /// It was replaced by cells.
    Split,
    /// It stays in the BVH.
    GivenUp,
}
