//! The size of a packet, and the entries of its stack.

use crate::simd::LANES;

/// Groups of sixteen rays in a packet.
pub(crate) const GROUPS: usize = 4;
/// Largest number of rays in a packet.
pub(crate) const PACKET: usize = GROUPS * LANES;
/// Smallest number of rays of a packet.
pub(crate) const MIN_RAYS: usize = 2 * LANES;

/// A stacked child.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StackEntry {
    /// A bit for each ray that entered the parent. In packets with different octants only rays that
    /// may hit the child's box are set.
    pub(crate) rays: u64,
    /// Index of the parent's cache line.
    pub(crate) parent: u32,
    /// Index of the child in the parent.
    pub(crate) slot: u32,
    /// Lower bound of the depth at which any ray enters the child.
    pub(crate) key: f32,
}
