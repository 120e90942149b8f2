//! The size of a packet, and an entry of its stack.

use crate::simd::LANES;

/// Groups of sixteen rays in a packet.
pub(crate) const GROUPS: usize = 4;
/// Rays in a packet at most.
pub(crate) const PACKET: usize = GROUPS * LANES;

/// A child that waits to be entered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StackEntry {
    /// Rays that entered the parent; of those that go into different octants, and are asked at once, which meet the box.
    pub(crate) rays: u64,
    /// Line of the parent, and the slot there.
    pub(crate) parent: u32,
    pub(crate) slot: u32,
    /// Lower bound of the depth at which any ray enters it.
    pub(crate) key: f32,
}
