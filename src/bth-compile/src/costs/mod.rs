//! Which suitable nodes to tetrahedralize: the paper's Cost_TET < Cost_SAH (§3.2, §3.3).

mod choose;
mod estimate;
mod subtree_sums;

pub use choose::{Choice, Decision, Options, Report, Verdict, choose};
pub use estimate::Estimator;
