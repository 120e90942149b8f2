//! Numerical stress: hard rays, hard models, and changes that must change no answer.

mod compiler;
mod instances;
mod invariance;
mod random_meshes;
mod surfaces;
