//! Which instruction set the kernels use: found once, or told.

use super::{Kernel, Scalar};
use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicU8, Ordering};

/// Names the instruction set to use in place of the best: `scalar`, `avx2` or `avx512`.
const VARIABLE: &str = "BTH_ISA";

/// An instruction set that kernels are compiled for. Answers are the same bits on all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// Whatever the target has at least.
    Scalar,
    /// AVX2 and FMA (x86-64-v3).
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL (x86-64-v4).
    Avx512,
}

/// An instruction set cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IsaError {
    /// No such name.
    Unknown(String),
    /// This machine lacks it.
    Missing(Isa),
}

impl fmt::Display for IsaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            IsaError::Unknown(name) => {
                write!(f, "unknown instruction set {name:?}: expected scalar, avx2 or avx512")
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

/// 0: not chosen yet; else the place in `ALL`, plus one.
static CHOSEN: AtomicU8 = AtomicU8::new(0);
const SCALAR: u8 = Isa::Scalar as u8 + 1;
const AVX2: u8 = Isa::Avx2 as u8 + 1;

/// UncachedHits, so that what runs kernels stays short.
#[inline(never)]
fn plain<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Scalar)
}

impl Isa {
    /// All, the plainest first.
    pub const ALL: [Isa; 3] = [Isa::Scalar, Isa::Avx2, Isa::Avx512];

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return match self {
            Isa::Scalar => true,
            Isa::Avx2 => super::avx2::Avx2::detect().is_some(),
            Isa::Avx512 => super::avx512::Avx512::detect().is_some(),
        };
        #[cfg(not(target_arch = "x86_64"))]
        return self == Isa::Scalar;
    }

    /// The best that this machine has.
    pub fn best() -> Isa {
        Isa::ALL.into_iter().rev().find(|isa| isa.is_available()).unwrap_or(Isa::Scalar)
    }

    /// What all tracing in this process uses from now on.
    ///
    /// # Errors
    /// [`IsaError::Missing`] when this machine lacks it; nothing changes then.
    pub fn choose(self) -> Result<(), IsaError> {
        if !self.is_available() {
            return Err(IsaError::Missing(self));
        }
        CHOSEN.store(self as u8 + 1, Ordering::Relaxed);
        Ok(())
    }

    /// What tracing uses: what [`Self::choose`] said, else what the environment variable `BTH_ISA` says if this
    /// machine has it, else the best.
    #[inline]
    pub fn chosen() -> Isa {
        match CHOSEN.load(Ordering::Relaxed) {
            0 => Isa::choose_first(),
            SCALAR => Isa::Scalar,
            AVX2 => Isa::Avx2,
            _ => Isa::Avx512,
        }
    }

    #[cold]
    fn choose_first() -> Isa {
        let isa = Isa::from_environment().ok().flatten().unwrap_or_else(Isa::best);
        // Two threads that get here at once store the same.
        CHOSEN.store(isa as u8 + 1, Ordering::Relaxed);
        isa
    }

    /// What the environment variable `BTH_ISA` says, if it is set. Programs check it at their start; the
    /// library passes over what it cannot follow.
    ///
    /// # Errors
    /// When it names none, or one that this machine lacks.
    pub fn from_environment() -> Result<Option<Isa>, IsaError> {
        let Some(name) = std::env::var_os(VARIABLE).filter(|name| !name.is_empty()) else { return Ok(None) };
        let isa: Isa = name.to_string_lossy().parse()?;
        if isa.is_available() { Ok(Some(isa)) } else { Err(IsaError::Missing(isa)) }
    }

    /// Runs a kernel with this instruction set, or with plain code if the machine lacks it.
    #[inline(always)]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // Not by way of `run_wide`, whose result would be one more copy.
        #[cfg(target_arch = "x86_64")]
        match self {
            Isa::Scalar => {}
            Isa::Avx2 => {
                if let Some(simd) = super::avx2::Avx2::detect() {
                    return simd.run(kernel);
                }
            }
            Isa::Avx512 => {
                if let Some(simd) = super::avx512::Avx512::detect() {
                    return simd.run(kernel);
                }
            }
        }
        plain(kernel)
    }

    /// Runs a kernel with this instruction set unless that is plain code: gives it back then. For kernels that are no
    /// gain without vectors, and a lot of code.
    #[inline(always)]
    pub(crate) fn run_wide<K: Kernel>(self, kernel: K) -> Result<K::Output, K> {
        #[cfg(target_arch = "x86_64")]
        match self {
            Isa::Scalar => {}
            Isa::Avx2 => {
                if let Some(simd) = super::avx2::Avx2::detect() {
                    return Ok(simd.run(kernel));
                }
            }
            Isa::Avx512 => {
                if let Some(simd) = super::avx512::Avx512::detect() {
                    return Ok(simd.run(kernel));
                }
            }
        }
        Err(kernel)
    }
}
