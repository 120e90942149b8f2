//! Positions that are computed from tracks: morph targets, then joints (glTF 2.0 specification,
//! §3.7.2.2 and §3.7.3), and the frames of sequences ([`sequences`]).
//!
//! [`pose`] computes the matrices of the joints and the weights of the targets at a time,
//! [`positions`] the positions of all vertices. [`update`] stages them for a refit
//! ([`crate::refit`]). [`normals`] computes the normals of a triangle's corners where a ray hits
//! it. All is computed in f64, in a fixed order: results have the same bits with any instruction
//! set and number of threads.

mod animated_file;
mod morph_runs;
pub(crate) mod normals;
mod pose;
mod poses;
mod positions;
mod sequences;
#[cfg(test)]
mod tests;
mod update;

pub(crate) use animated_file::AnimatedFile;
pub use poses::DeformerPoses;
pub(crate) use update::{Animation, StagedPoses};

/// The matrix of a joint from the space of the object to world space: columns, each with a fourth
/// number of zero, so that four lanes hold one.
pub(crate) type JointMatrix = [[f64; 4]; 4];
