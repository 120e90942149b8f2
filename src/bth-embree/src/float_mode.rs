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
/// Reading the register waits for all floating-point operations before, so a sum tells the mode:
/// of a denormal number and 0, of numbers that differ by a denormal one, and of 1 and a quarter of
/// the distance to its neighbours. The register is read only where a thread has a mode for the
/// first time; its other bits, exception masks and flags, are taken to be as they were then.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn foreign_mode() -> Option<Control> {
    #[repr(align(16))]
    struct Row([u32; 4]);
    const TINY: u32 = 1 << 22;
    const NORMAL: u32 = 1 << 23;
    static NUMBERS: Row = Row([TINY, NORMAL | TINY, ONE, ONE]);
    // 0, the negated smallest normal number, 2^-25 and -2^-26.
    static ADDED: Row = Row([0, 1 << 31 | NORMAL, 102 << 23, 1 << 31 | 101 << 23]);
    static EXPECTED: Row = Row([TINY, TINY, ONE, ONE]);
    const ONE: u32 = 127 << 23;
    let equal: u32;
    // SAFETY: the instructions read 16 aligned bytes each, and change only the two registers that
    // are named.
    unsafe {
        std::arch::asm!(
            "movaps {row}, [{numbers}]",
            "addps {row}, [{added}]",
            "pcmpeqd {row}, [{expected}]",
            "movmskps {equal:e}, {row}",
            row = out(xmm_reg) _,
            numbers = in(reg) &raw const NUMBERS.0,
            added = in(reg) &raw const ADDED.0,
            expected = in(reg) &raw const EXPECTED.0,
            equal = lateout(reg) equal,
            options(nostack, readonly, preserves_flags),
        );
    }
    if equal == 0b1111 {
        return None;
    }
    thread_local!(static KNOWN: Cell<(u32, Control)> = const { Cell::new((u32::MAX, 0)) });
    let (mode, former) = KNOWN.get();
    if mode == equal {
        return Some(former);
    }
    let former = read();
    KNOWN.set((equal, former));
    Some(former)
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
