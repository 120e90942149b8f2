//! Memory of a thread that batches use, kept from one to the next.

use super::strategy::StrategyTable;
use crate::bvh::packet::PacketScratch;
use crate::bvh::stack::Stacks;
use std::cell::Cell;

/// Memory that traversals need, kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub(super) stacks: Stacks,
    pub(super) packets: PacketScratch,
    pub(super) choices: StrategyTable,
}

/// Lends the thread's scratch memory.
#[inline(always)]
pub(crate) fn with_scratch<R>(work: impl FnOnce(&mut Scratch) -> R) -> R {
    thread_local! {
        static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
    }
    // Taken out while it is in use, so that a panic leaves nothing half done behind.
    SCRATCH.with(|lent| {
        let mut scratch = lent.take().unwrap_or_default();
        let result = work(&mut scratch);
        lent.set(Some(scratch));
        result
    })
}
