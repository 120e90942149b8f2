//! The size of a packet, and an entry of its stack.

use crate::simd::LANES;

/// Groups of sixteen rays in a packet.
pub(crate) const GROUPS: usize = 4;
/// Greatest number of rays in a packet.
pub(crate) const PACKET: usize = GROUPS * LANES;

/// A child node or leaf that is still to be entered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StackEntry {
    /// The rays that entered the parent, as bits; where directions lie in different octants
    /// ([`PacketBounds::MIXED_OCTANTS`](super::bounds::PacketBounds::MIXED_OCTANTS)), those of them that may enter the child's box.
    pub(crate) rays: u64,
    /// Index of the cache line at which the parent begins.
    pub(crate) parent: u32,
    /// Index of the child in its parent.
    pub(crate) slot: u32,
    /// Lower bound of the depth at which any ray enters the child, but for
    /// [`KEY_SLACK`](crate::bvh::ray_state::KEY_SLACK); not set for any-hit queries.
    pub(crate) key: f32,
}
