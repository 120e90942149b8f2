//! Selection of the suitable nodes to tetrahedralize, by the expected cost of rays.
//!
//! `profile` holds the measured costs of tracing on a machine. `tet_walk` counts steps of
//! [sample rays](bth_bvh::sampling); `estimate` predicts the steps without tracing. `choose`
//! selects the nodes of max saving (`gains`, `bottom_up`). `probe` decides again with sampled rays
//! when the tetrahedra are built.

mod bottom_up;
mod choose;
mod estimate;
mod gains;
mod options;
mod prices;
mod probe;
mod profile;
mod tet_walk;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use choose::{choose, choose_of_all};
pub use estimate::{Estimator, Start};
pub use options::{CostOptions, CostReport, OptimizeFor, Probe, Select};
pub use probe::{ProbeReport, ProbedLeaf, probe};
pub use profile::{BvhCosts, Profile, TetCosts, Walk};
pub use tet_walk::{TetWalker, Walked};
