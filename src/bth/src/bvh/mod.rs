//! Rays through the wide BVH.
//!
//! Three traversals share the node formats ([`nodes`]) and the decisions about triangles ([`leaf`],
//! [`candidate`]):
//!
//! - [`single`]: one ray, with its stack ([`single_stack`]), guesses of where it goes ([`guesses`])
//!   and its certain hit ([`certain_hit`]);
//! - [`interleaved`]: a pool of rays ([`ray_pool`], [`ray_state`]) that step in turn, with their
//!   stacks ([`stack`]) and with hits that are computed for sixteen rays at a time ([`deferred`]);
//! - [`packet`]: coherent rays that enter nodes together.
//!
//! Where rays begin instead of the root, and leaves that hold no block of triangles, are the matter
//! of [`crate::shortcuts`].
//!
//! All other queries take one walk ([`walk`]); [`enumerate`] passes every triangle that a ray may
//! hit to a receiver.

#[cfg(test)]
pub(crate) mod box_oracle;
pub(crate) mod candidate;
pub(crate) mod certain_hit;
pub(crate) mod deferred;
pub(crate) mod enumerate;
pub(crate) mod guesses;
#[cfg(test)]
pub(crate) mod height_field;
pub(crate) mod interleaved;
pub(crate) mod leaf;
pub(crate) mod nodes;
pub(crate) mod packet;
mod ray_pool;
pub(crate) mod ray_state;
pub(crate) mod single;
pub(crate) mod single_stack;
pub(crate) mod stack;
pub(crate) mod walk;
