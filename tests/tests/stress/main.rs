//! Numerical stress: hard rays, hard models, and changes that must not change answers.

mod compiler;
mod inside;
mod instances;
mod invariance;
mod random_meshes;
mod surfaces;
mod tiles;
