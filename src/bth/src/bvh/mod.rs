//! Rays through the wide BVH.
//!
//! Three traversals share nodes ([`nodes`]) and what decides about triangles ([`leaf`], [`candidate`]): one ray alone
//! ([`single`], with a stack of its own, [`single_stack`]); many interleaved rays ([`interleaved`]: a pool of ray states,
//! [`ray_pool`] and [`ray_state`], their stacks, [`stack`], and hits that are computed sixteen at a time, [`deferred`]); and
//! packets of rays that go together ([`packet`]).

pub(crate) mod candidate;
pub(crate) mod deferred;
pub(crate) mod interleaved;
pub(crate) mod leaf;
pub(crate) mod nodes;
pub(crate) mod packet;
mod ray_pool;
pub(crate) mod ray_state;
pub(crate) mod single;
pub(crate) mod single_stack;
pub(crate) mod stack;
