//! Measures what tracing costs on this machine: the profile that the compiler selects by.
//!
//! `subject` prepares models in all structures and counts the steps of sampled rays through them; `fit` turns
//! times and counts into costs.

mod fit;
mod subject;

pub(crate) use fit::{Measured, fit};
pub(crate) use subject::{Subject, measure};
