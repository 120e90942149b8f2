//! Objects whose vertices move with the nodes of a file's scene: morph targets, then joints (glTF 2.0 specification, §3.7.2.2 and
//! §3.7.3); and those whose vertices move by themselves ([`sequences`]).
//!
//! [`pose`] gives the matrices of the joints and the weights of the targets at a time, [`evaluate`] the positions of all vertices, for
//! which [`update`] refits the objects ([`crate::deform`]); [`normals`] gives the normals of a triangle's corners where a ray has hit it.
//! All is computed in f64, in an order that is fixed: results have the same bits
//! with any instruction set and number of threads.

pub(crate) mod by_object;
mod evaluate;
mod morph_runs;
pub(crate) mod normals;
pub(crate) mod pose;
mod poses;
mod sequences;
#[cfg(test)]
mod tests;
mod update;

pub use poses::DeformerPoses;
pub(crate) use update::{Deformers, Posed};

/// The matrix of a joint from the space of the object to world space: columns, each with a fourth number of zero, so that four lanes
/// hold one.
pub(crate) type JointMatrix = [[f64; 4]; 4];
