//! Traversal of the BVH by packets: up to 64 coherent rays, in four groups of sixteen lanes.
//!
//! [`runs`] finds coherent rays in a batch, by the measures of [`coherence`](crate::coherence) and
//! as long as packets pay ([`backoff`]), and [`prepare_group`] prepares them. A packet
//! ([`traverse`]) tests the boxes of [`children`] first against bounds of all its rays ([`bounds`]:
//! a [`frustum`], or a [`segment_box`] of short rays), then against each group ([`ray_group`]), and
//! the triangles of leaves ([`leaf`], [`leaf_mesh`], [`points`], [`projection`]) with one ray in
//! each lane; what that leaves open is decided ray by ray ([`packet_rays`]). Where few rays are
//! left, these are tested one at a time ([`single_rays`]). Hits are computed at the end; for rays
//! from one point the terms that do not depend on the direction are computed once for each triangle
//! ([`hit_cache`]). [`buffers`] is the memory for all of it.

pub(crate) mod backoff;
pub(crate) mod bounds;
mod buffers;
pub(crate) mod children;
pub(crate) mod entry;
pub(crate) mod frustum;
pub(crate) mod hit_cache;
pub(crate) mod leaf;
pub(crate) mod leaf_mesh;
mod packet_rays;
pub(crate) mod points;
pub(crate) mod prepare_group;
pub(crate) mod projection;
pub(crate) mod ray_group;
pub(crate) mod runs;
pub(crate) mod segment_box;
pub(crate) mod single_rays;
#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64", target_feature = "simd128")))]
mod tests;
pub(crate) mod traverse;

pub(crate) use runs::{MinimumUse, PacketScratch, Packets};
