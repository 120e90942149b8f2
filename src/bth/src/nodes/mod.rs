//! The nodes of a file's scene at a time: tracks ([`tracks`]), the hierarchy with its transforms to
//! world space ([`hierarchy`]), and affine transforms ([`affine`]), also for queries about points
//! ([`placed`]).

pub(crate) mod affine;
#[cfg(test)]
mod affine_tests;
pub(crate) mod hierarchy;
pub(crate) mod placed;
pub(crate) mod tracks;

pub(crate) use affine::{Affine, ObjectRay};
pub(crate) use hierarchy::NodeHierarchy;
