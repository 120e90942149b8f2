//! The floating-point mode of the processor: programs flush denormals to zero, exact answers need
//! all numbers.
#![allow(unsafe_code)] // Reads and writes the control register.

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
        let former = read();
        if former & CHANGES == 0 {
            return ExactMode(None);
        }
        write(former & !CHANGES);
        ExactMode(Some(former))
    }

    /// Calls a function of the program in its own mode.
    #[inline(always)]
    pub(crate) fn outside<T>(&self, call: impl FnOnce() -> T) -> T {
        let Some(former) = self.0 else { return call() };
        let own = read();
        write(former);
        let result = call();
        write(own);
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
        write(own | CHANGES & !(3 << 13));
        let flushed = read() & CHANGES;
        {
            let mode = ExactMode::enter();
            assert_eq!(read() & CHANGES, 0);
            assert_eq!(mode.outside(|| read() & CHANGES), flushed);
            assert_eq!(read() & CHANGES, 0);
        }
        assert_eq!(read() & CHANGES, flushed);
        write(own);
    }
}
