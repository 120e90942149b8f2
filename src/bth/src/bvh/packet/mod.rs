//! Packets: up to 64 rays that go together through the BVH, four groups of sixteen.
//!
//! [`coherence`] tells which rays go together, and [`runs`] takes them from a batch. A packet ([`packet`]) tests boxes first by
//! what bounds all its rays ([`bounds`]: a [`frustum`], or a [`segment_box`] of short rays), then by group
//! ([`ray_group`]), and triangles of leaves ([`leaf`], [`leaf_mesh`], [`points`]) with a ray in each lane. Where few
//! rays are left they go one at a time ([`single_rays`]). Hits are computed at the end, those of rays from one point with what
//! their triangles share ([`hit_cache`]).

pub(crate) mod bounds;
pub(crate) mod coherence;
pub(crate) mod entry;
pub(crate) mod frustum;
pub(crate) mod hit_cache;
pub(crate) mod leaf;
pub(crate) mod leaf_mesh;
pub(crate) mod packet;
pub(crate) mod points;
pub(crate) mod projection;
pub(crate) mod ray_group;
pub(crate) mod runs;
pub(crate) mod segment_box;
pub(crate) mod single_rays;
#[cfg(test)]
mod tests;

pub(crate) use runs::{MINIMUM_USE, PacketScratch, trace};
