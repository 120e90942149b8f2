//! The floating-point mode of the processor: programs flush denormals to zero, exact answers need
//! all numbers.
#![allow(unsafe_code)] // Reads and writes the control register.

#[cfg(target_arch = "x86_64")]
use std::cell::Cell;

/// The mode of the program, which comes back when this is dropped.
#[derive(Debug)]
pub(crate) struct ExactMode(Option<Control>);

#[cfg(target_arch = "x86_64")]
type Control = u32;
#[cfg(target_arch = "aarch64")]
type Control = u64;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
type Control = u32;

impl ExactMode {
    /// Switches to the mode of IEEE 754, if the program has another one.
    #[inline(always)]
    pub(crate) fn enter() -> ExactMode {
        ExactMode(foreign_mode().inspect(|former| write(former & !CHANGES)))
    }

    /// Calls a function of the program in its own mode.
    #[inline(always)]
    pub(crate) fn outside<T>(&self, call: impl FnOnce() -> T) -> T {
        let Some(former) = self.0 else { return call() };
        write(former);
        let result = call();
        write(former & !CHANGES);
        result
    }
}

impl Drop for ExactMode {
    #[inline(always)]
    fn drop(&mut self) {
        if let Some(former) = self.0 {
            write(former);
        }
    }
}

/// The control register, if it says another mode than IEEE 754.
///
/// Reading the register waits for all floating-point operations before, so sums tell the mode. It
/// is read only where a thread has a mode for the first time; its other bits, exception masks and
/// flags, are taken to be as they were then.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn foreign_mode() -> Option<Control> {
    // A denormal number and 0: their sum is 0 where denormal numbers are zeros, or are flushed.
    // 1 and a quarter of the distance to its neighbours: 1 where numbers are rounded to nearest.
    static MODES: Sums = Sums([[TINY, ONE, ONE, 0], [0, UP, DOWN, 0], [TINY, ONE, ONE, 0]]);
    if MODES.equal() == ALL_EQUAL {
        return None;
    }
    // Tells numbers that are flushed from numbers that are zeros: in the IEEE mode, a denormal
    // difference of normal numbers would take a hundred cycles.
    static WHICH: Sums =
        Sums([[TINY, NORMAL | TINY, ONE, ONE], [0, 1 << 31 | NORMAL, UP, DOWN], [TINY, TINY, ONE, ONE]]);
    thread_local!(static KNOWN: Cell<(u32, Control)> = const { Cell::new((u32::MAX, 0)) });
    let (equal, (mode, former)) = (WHICH.equal(), KNOWN.get());
    if mode == equal {
        return Some(former);
    }
    let former = read();
    KNOWN.set((equal, former));
    Some(former)
}

/// Bits of numbers, of numbers that are added to them, and of the sums in the mode of IEEE 754.
#[cfg(target_arch = "x86_64")]
#[repr(align(16))]
struct Sums([[u32; 4]; 3]);

#[cfg(target_arch = "x86_64")]
const TINY: u32 = 1 << 22;
#[cfg(target_arch = "x86_64")]
const NORMAL: u32 = 1 << 23;
#[cfg(target_arch = "x86_64")]
const ONE: u32 = 127 << 23;
/// 2^-25.
#[cfg(target_arch = "x86_64")]
const UP: u32 = 102 << 23;
/// -2^-26.
#[cfg(target_arch = "x86_64")]
const DOWN: u32 = 1 << 31 | 101 << 23;
#[cfg(target_arch = "x86_64")]
const ALL_EQUAL: u32 = 0b1111;

#[cfg(target_arch = "x86_64")]
impl Sums {
    /// Bits of the lanes whose sum is as in the mode of IEEE 754.
    #[inline(always)]
    fn equal(&'static self) -> u32 {
        let equal: u32;
        // SAFETY: the instructions read 16 aligned bytes each, and change only the two registers
        // that are named.
        unsafe {
            std::arch::asm!(
                "movaps {row}, [{sums}]",
                "addps {row}, [{sums} + 16]",
                "pcmpeqd {row}, [{sums} + 32]",
                "movmskps {equal:e}, {row}",
                row = out(xmm_reg) _,
                sums = in(reg) &raw const self.0,
                equal = lateout(reg) equal,
                options(nostack, readonly, preserves_flags),
            );
        }
        equal
    }
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn foreign_mode() -> Option<Control> {
    Some(read()).filter(|former| former & CHANGES != 0)
}

/// Flush to zero, denormals are zero, and the two bits of the rounding mode.
#[cfg(target_arch = "x86_64")]
const CHANGES: Control = 1 << 15 | 1 << 6 | 3 << 13;

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn read() -> Control {
    let mut control: Control = 0;
    // SAFETY: the instruction stores the register at this address, which is valid for writes.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
    }
    control
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn write(control: Control) {
    // SAFETY: the instruction loads the register from this address; the value was read from it but
    // for bits that may be 0 or 1, so no reserved bit is set. The code that runs under it is ours
    // or the program's, which sets this register itself.
    unsafe {
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, preserves_flags));
    }
}

/// Flush to zero and the two bits of the rounding mode.
#[cfg(target_arch = "aarch64")]
const CHANGES: Control = 1 << 24 | 3 << 22;

#[cfg(target_arch = "aarch64")]
#[inline(always)]
fn read() -> Control {
    let control: Control;
    // SAFETY: the instruction reads a register that all programs may read.
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack)) };
    control
}

#[cfg(target_arch = "aarch64")]
#[inline(always)]
fn write(control: Control) {
    // SAFETY: as for x86-64.
    unsafe { std::arch::asm!("msr fpcr, {}", in(reg) control, options(nostack)) };
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const CHANGES: Control = 0;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn read() -> Control {
    0
}
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn write(_control: Control) {}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::*;

    #[test]
    fn the_mode_of_the_program_comes_back() {
        let own = read();
        assert!(foreign_mode().is_none());
        // Each bit alone, and all together.
        let bits = (0..Control::BITS).map(|bit| 1 << bit).filter(|bit| CHANGES & bit != 0);
        for changed in bits.chain([CHANGES]) {
            write(own | changed);
            {
                let mode = ExactMode::enter();
                assert_eq!(read() & CHANGES, 0, "{changed:#x}");
                assert_eq!(mode.outside(|| read() & CHANGES), changed);
                assert_eq!(read() & CHANGES, 0);
            }
            assert_eq!(read() & CHANGES, changed);
        }
        write(own);
    }
}
