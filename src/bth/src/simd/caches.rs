//! Levels of caches, and on which of them memory waits that is prefetched long before its use.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__cpuid, CpuidResult};
#[cfg(target_arch = "x86_64")]
use std::sync::atomic::{AtomicBool, Ordering};

/// A level to prefetch into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CacheLevel {
    First,
    Second,
}

/// True if [`CacheLevel::waiting`] is the second level; false until [`find`] has been called. It is
/// read in the steps of kernels, where a call would empty their registers.
#[cfg(target_arch = "x86_64")]
static SECOND: AtomicBool = AtomicBool::new(false);

impl CacheLevel {
    /// Where memory waits that is needed only after the work on many other rays: in the first level
    /// or, where that was measured to be too small for it (docs/notes/interleaved-rays.md), in the
    /// second. That is so on AMD processors with at most 32 KiB; Zen 5 has 48 KiB. On an Intel
    /// processor with 48 KiB the second level was slower.
    #[inline(always)]
    pub(crate) fn waiting() -> CacheLevel {
        #[cfg(target_arch = "x86_64")]
        if SECOND.load(Ordering::Relaxed) {
            return CacheLevel::Second;
        }
        CacheLevel::First
    }
}

/// Finds out what [`CacheLevel::waiting`] returns from now on.
#[cfg(target_arch = "x86_64")]
pub(super) fn find() {
    /// The function that returns the maker of the processor, in the order EBX, EDX, ECX.
    const MAKER: u32 = 0;
    /// The function that returns the largest extended function in EAX.
    const EXTENDED: u32 = 0x8000_0000;
    /// The function of AMD processors that returns the size of the first-level data cache in KiB,
    /// in bits 24 to 31 of ECX.
    const FIRST_LEVEL: u32 = 0x8000_0005;
    let CpuidResult { ebx, ecx, edx, .. } = __cpuid(MAKER);
    let maker = [ebx, edx, ecx].map(u32::to_le_bytes);
    let second = maker.as_flattened() == b"AuthenticAMD"
        && __cpuid(EXTENDED).eax >= FIRST_LEVEL
        && matches!(__cpuid(FIRST_LEVEL).ecx >> 24, 1..=32);
    SECOND.store(second, Ordering::Relaxed);
}
