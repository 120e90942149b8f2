//! Measures the costs of tracing on this machine, as the profile by which the compiler selects
//! nodes.
//!
//! `subject` compiles models into all structures and counts the steps of sampled rays through them;
//! `fit` turns times and counts into costs.

mod fit;
mod subject;

pub(crate) use fit::{Measured, fit};
pub(crate) use subject::{Subject, measure};
