//! Scratch memory of a thread, which is reused from one batch to the next.

use crate::bvh::packet::PacketScratch;
use crate::bvh::stack::Stacks;
use crate::shortcuts::SpecialScratch;
use crate::starts::prepare::PreparedStarts;
use std::cell::Cell;

/// Memory that the traversals of batches use.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    pub(super) stacks: Stacks,
    pub(super) packets: PacketScratch,
    pub(super) special: SpecialScratch,
    pub(super) starts: PreparedStarts,
}

/// The first scratch memory of a thread.
#[cold]
#[inline(never)]
fn new_scratch() -> Box<Scratch> {
    Box::default()
}

/// Calls `work` with the thread's scratch memory.
#[inline(always)]
pub(crate) fn with_scratch<R>(work: impl FnOnce(&mut Scratch) -> R) -> R {
    thread_local! {
        static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
    }
    // The memory is taken out of the cell while it is in use, so that after a panic the next batch
    // begins with new memory.
    SCRATCH.with(|cell| {
        let mut scratch = cell.take().unwrap_or_else(new_scratch);
        let result = work(&mut scratch);
        cell.set(Some(scratch));
        result
    })
}
