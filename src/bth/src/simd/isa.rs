//! Choice of the instruction set of the kernels: detected once, or set by environment variable or
//! call.

use super::{Kernel, Simd};
use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicU8, Ordering};

/// Environment variable with the name of the instruction set to use instead of the best: a name of
/// [`Isa::ALL`].
const ISA_VARIABLE: &str = "BTH_ISA";

/// An instruction set for which kernels are compiled. Answers have the same bits on all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// The baseline of the compilation target.
    Scalar,
    /// SSE4.1 (with SSSE3 and POPCNT), on x86-64.
    Sse4,
    /// NEON, on every AArch64.
    Neon,
    /// SIMD128 of WebAssembly, in modules that are compiled for it.
    Simd128,
    /// AVX2 and FMA (x86-64-v3).
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL (x86-64-v4).
    Avx512,
}

/// Why an instruction set cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IsaError {
    /// There is no instruction set of this name.
    Unknown(String),
    /// This machine does not have the instruction set.
    Missing(Isa),
}

impl fmt::Display for IsaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            IsaError::Unknown(name) => {
                write!(
                    f,
                    "unknown instruction set {name:?}: expected scalar, sse4, neon, simd128, avx2 or avx512"
                )
            }
            IsaError::Missing(isa) => {
                write!(f, "this machine does not have {isa}; the best is {}", Isa::best())
            }
        }
    }
}

impl std::error::Error for IsaError {}

impl fmt::Display for Isa {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Isa::Scalar => "scalar",
            Isa::Sse4 => "sse4",
            Isa::Neon => "neon",
            Isa::Simd128 => "simd128",
            Isa::Avx2 => "avx2",
            Isa::Avx512 => "avx512",
        })
    }
}

impl FromStr for Isa {
    type Err = IsaError;
    fn from_str(name: &str) -> Result<Self, IsaError> {
        Isa::ALL
            .into_iter()
            .find(|isa| isa.to_string() == name)
            .ok_or_else(|| IsaError::Unknown(name.to_owned()))
    }
}

/// 0 as long as none is chosen, else the index in [`Isa::ALL`] plus one.
static CHOSEN_ISA: AtomicU8 = AtomicU8::new(0);
const SCALAR: u8 = Isa::Scalar as u8 + 1;
const SSE4: u8 = Isa::Sse4 as u8 + 1;
const NEON: u8 = Isa::Neon as u8 + 1;
const SIMD128: u8 = Isa::Simd128 as u8 + 1;
const AVX2: u8 = Isa::Avx2 as u8 + 1;

/// Evaluates the expression with the token of an instruction set if the kernel type is compiled for
/// its vectors, it is compiled for this target, and this machine has it. `$detect` is the function
/// that returns the token: `detect` or, where it is known which instruction sets there are,
/// `found`.
macro_rules! with_vectors {
    ($isa:expr, $kernel:ident, $detect:ident, $simd:ident => $do:expr) => {
        match $isa {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 if $kernel::LONG_VECTORS => {
                if let Some($simd) = super::avx2::Avx2::$detect() {
                    $do;
                }
            }
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 if $kernel::LONG_VECTORS => {
                if let Some($simd) = super::avx512::Avx512::$detect() {
                    $do;
                }
            }
            #[cfg(target_arch = "x86_64")]
            Isa::Sse4 if $kernel::QUADS => {
                if let Some($simd) = super::quads::sse4::Sse4::$detect() {
                    $do;
                }
            }
            #[cfg(target_arch = "aarch64")]
            Isa::Neon if $kernel::QUADS => {
                let $simd = super::quads::neon::Neon::new();
                $do;
            }
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Isa::Simd128 if $kernel::QUADS => {
                let $simd = super::quads::simd128::Simd128::new();
                $do;
            }
            _ => {}
        }
    };
}

/// Runs a kernel in scalar code. Not inlined, so that callers of [`Isa::run`] stay small.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown", target_feature = "simd128")))]
#[inline(never)]
fn run_scalar<K: Kernel>(kernel: K) -> K::Output {
    if K::SCALAR { kernel.run(super::Scalar) } else { panic!("the kernel is not compiled for scalar code") }
}

/// A module of WebAssembly for browsers that is compiled for SIMD128 has no scalar kernels, which
/// would be half of its size.
#[cfg(all(target_arch = "wasm32", target_os = "unknown", target_feature = "simd128"))]
fn run_scalar<K: Kernel>(kernel: K) -> K::Output {
    if K::QUADS {
        super::quads::simd128::Simd128::new().run(kernel)
    } else {
        panic!("not compiled for SIMD128")
    }
}

impl Isa {
    /// All instruction sets, from the smallest to the most capable.
    pub const ALL: [Isa; 6] = [Isa::Scalar, Isa::Sse4, Isa::Neon, Isa::Simd128, Isa::Avx2, Isa::Avx512];

    /// Returns true if this machine has the instruction set.
    pub fn is_available(self) -> bool {
        struct IsCompiled;
        impl Kernel for IsCompiled {
            type Output = bool;
            #[inline(always)]
            fn run<S: Simd>(self, _: S) -> bool {
                true
            }
        }
        match self {
            // See `run_scalar`.
            Isa::Scalar => {
                !cfg!(all(target_arch = "wasm32", target_os = "unknown", target_feature = "simd128"))
            }
            // `run` would take other code where the target does not have the instructions.
            _ => {
                with_vectors!(self, IsCompiled, detect, simd => return simd.run(IsCompiled));
                false
            }
        }
    }

    /// Returns true if its vectors have more than 128 bits.
    pub(crate) fn has_long_vectors(self) -> bool {
        matches!(self, Isa::Avx2 | Isa::Avx512)
    }

    /// The most capable instruction set of this machine.
    pub fn best() -> Isa {
        Isa::ALL.into_iter().rev().find(|isa| isa.is_available()).unwrap_or(Isa::Scalar)
    }

    /// Uses this instruction set for all tracing in this process from now on.
    ///
    /// # Errors
    /// [`IsaError::Missing`] if this machine does not have it; the choice is then unchanged.
    pub fn choose(self) -> Result<(), IsaError> {
        if !self.is_available() {
            return Err(IsaError::Missing(self));
        }
        self.store();
        Ok(())
    }

    /// The instruction set that tracing uses: the last one set by [`Self::choose`], else the one
    /// named by the environment variable `BTH_ISA` if this machine has it, else the best.
    #[inline]
    pub fn chosen() -> Isa {
        Isa::already_chosen().unwrap_or_else(Isa::choose_first)
    }

    /// Like [`Self::chosen`]; `None` where none is chosen, as before the first trace.
    #[inline(always)]
    pub(crate) fn already_chosen() -> Option<Isa> {
        Some(match CHOSEN_ISA.load(Ordering::Relaxed) {
            0 => return None,
            SCALAR => Isa::Scalar,
            SSE4 => Isa::Sse4,
            NEON => Isa::Neon,
            SIMD128 => Isa::Simd128,
            AVX2 => Isa::Avx2,
            _ => Isa::Avx512,
        })
    }

    #[cold]
    fn choose_first() -> Isa {
        let isa = Isa::from_environment().ok().flatten().unwrap_or_else(Isa::best);
        // Threads that run this concurrently store the same value.
        isa.store();
        isa
    }

    fn store(self) {
        #[cfg(target_arch = "x86_64")]
        super::caches::find();
        CHOSEN_ISA.store(self as u8 + 1, Ordering::Relaxed);
    }

    /// The instruction set named by the environment variable `BTH_ISA`; None if it is not set or
    /// empty. Programs report the error at their start; the library ignores an invalid value.
    ///
    /// # Errors
    /// [`IsaError`] if the value names no instruction set, or one that this machine does not have.
    pub fn from_environment() -> Result<Option<Isa>, IsaError> {
        let Some(name) = std::env::var_os(ISA_VARIABLE).filter(|name| !name.is_empty()) else {
            return Ok(None);
        };
        let isa: Isa = name.to_string_lossy().parse()?;
        if isa.is_available() { Ok(Some(isa)) } else { Err(IsaError::Missing(isa)) }
    }

    /// Runs a kernel with this instruction set, or in scalar code if the machine does not have it.
    ///
    /// # Panics
    /// If the kernel is not compiled for it.
    #[doc(hidden)]
    #[inline(always)]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        with_vectors!(self, K, detect, simd => return simd.run(kernel));
        run_scalar(kernel)
    }

    /// Like [`Self::run`], for the chosen instruction set, which is known to be available. The only
    /// call is then the call of the kernel, so callers save no registers.
    #[inline(always)]
    pub(crate) fn run_found<K: Kernel>(self, kernel: K) -> K::Output {
        with_vectors!(self, K, found, simd => return simd.run(kernel));
        run_scalar(kernel)
    }
}
