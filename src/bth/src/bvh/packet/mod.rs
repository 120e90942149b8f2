//! Packets: up to 64 coherent rays that traverse the BVH together, as four groups of sixteen.
//!
//! [`runs`] finds runs of consecutive rays of a batch that [`coherence`] considers suitable. A packet ([`packet`]) tests boxes
//! first against bounds of all its rays ([`bounds`]: a [`frustum`], or a [`segment_box`] of short rays) and then against each
//! group ([`ray_group`]), one ray in a lane. Leaves ([`leaf`], [`leaf_mesh`], [`points`]) test one triangle at a time against a
//! group. Where few rays of a packet remain, each of them is traversed by itself ([`single_rays`]). Hits are evaluated at the end;
//! rays from one point share the terms that depend only on their origin and the triangle ([`hit_cache`]).

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
