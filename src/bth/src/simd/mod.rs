//! Sixteen lanes of f32 or u32, whatever the machine: the small vector trait over which kernels are written once.
//!
//! An implementation is a token that exists only on machines that have its instructions, so its methods are
//! safe to call, and every `unsafe` of the kernels lies in the files beside this one. All methods, and
//! everything generic over [`Simd`], must be `#[inline(always)]`: only so does code end up
//! inside the one function per instruction set that enables its features ([`Isa::run`]). A closure, or
//! a library function that takes one (`array::map`), is compiled on its own and must not touch lanes.
//!
//! Kernels use these lanes only to *leave out* what certainly does not matter; hits are decided elsewhere, in f64
//! (`trace::crossing`). So it does no harm that `fma` rounds once or twice, depending on the machine.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod isa;
mod scalar;
#[cfg(test)]
mod tests;

pub use isa::{Isa, IsaError};
pub(crate) use scalar::Scalar;

/// Number of lanes.
pub(crate) const LANES: usize = 16;

/// Work that is generic over the instruction set. `run` must be `#[inline(always)]`.
pub(crate) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Sixteen lanes. Lane i of a mask is bit i.
pub(crate) trait Simd: Copy + 'static {
    /// f32 lanes.
    type F: Copy;
    /// u32 lanes.
    type U: Copy;
    /// A truth value a lane.
    type M: Copy;

    /// Whether the lanes are vectors of the machine. Where they are not, kernels that only pay with vectors are left out.
    const HAS_VECTORS: bool = true;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, from: &[f32; LANES]) -> Self::F;
    fn store(self, a: Self::F, to: &mut [f32; LANES]);
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// a·b + c, rounded once or twice.
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// c - a·b, rounded once or twice.
    fn fnma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// The lesser; `b` where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The greater; `b` where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    /// The greater of |a| and |b|; which of them is open where either is NaN.
    fn max_abs(self, a: Self::F, b: Self::F) -> Self::F;
    /// a < b; false for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// a <= b; false for NaN.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// `a` where the mask is set, else `b`.
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// Lane `at[i] % 16` of the table.
    fn lookup(self, table: Self::F, at: Self::U) -> Self::F;
    /// The least of all lanes; none may be NaN.
    fn least(self, a: Self::F) -> f32;
    /// Rows of four by their columns: lane i of the k-th is element k of row `row[i]`; undefined where the mask is clear.
    /// Panics if a row of a lane that is set lies outside. Much faster than four gathers, on any machine.
    fn rows4(self, m: Self::M, from: &[[f32; 4]], row: Self::U) -> [Self::F; 4];
    /// As [`Self::rows4`], rows of eight words.
    fn rows8(self, m: Self::M, from: &[[u32; 8]], row: Self::U) -> [Self::U; 8];
    /// Sixteen rows of eight words by their columns.
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [Self::U; 8];
    /// Columns of five words as rows: element k of row i is lane i of the k-th.
    #[inline(always)]
    fn store_rows5(self, columns: [Self::U; 5], to: &mut [[u32; 5]; LANES]) {
        let mut words = [[0; LANES]; 5];
        for k in 0..5 {
            self.store_u(columns[k], &mut words[k]);
        }
        for i in 0..LANES {
            to[i] = [words[0][i], words[1][i], words[2][i], words[3][i], words[4][i]];
        }
    }
    /// Where the mask is set, the next elements of `from` in order; else `a`.
    fn expand(self, a: Self::F, m: Self::M, from: &[f32; LANES]) -> Self::F;

    fn splat_u(self, x: u32) -> Self::U;
    fn load_u(self, from: &[u32; LANES]) -> Self::U;
    fn load_bytes(self, from: &[u8; LANES]) -> Self::U;
    fn store_u(self, a: Self::U, to: &mut [u32; LANES]);
    fn add_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// a + b where the mask is set, else `a`.
    fn add_where(self, a: Self::U, m: Self::M, b: Self::U) -> Self::U;
    fn and_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn or_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn xor_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn shl_u<const K: u32>(self, a: Self::U) -> Self::U;
    fn eq_u(self, a: Self::U, b: Self::U) -> Self::M;
    /// a < b, unsigned.
    fn lt_u(self, a: Self::U, b: Self::U) -> Self::M;
    fn select_u(self, m: Self::M, a: Self::U, b: Self::U) -> Self::U;
    fn lookup_u(self, table: Self::U, at: Self::U) -> Self::U;
    /// Whether [`Self::lookup_f64`] takes but a few instructions.
    const LOOKS_UP_F64: bool = false;
    /// Elements `at[i] % 16` of the table; with `FEWEST_OF_GROUP`, only those of its first half are looked up, the others are undefined.
    #[inline(always)]
    fn lookup_f64<const FEWEST_OF_GROUP: bool>(self, table: &[f64; LANES], at: Self::U) -> [f64; LANES] {
        let (mut place, mut out) = ([0; LANES], [0.0; LANES]);
        self.store_u(at, &mut place);
        for i in 0..LANES {
            out[i] = table[place[i] as usize % LANES];
        }
        out
    }
    /// Elements of a slice, 0 where the mask is clear. Panics if a lane that is set lies outside.
    fn gather_u(self, m: Self::M, from: &[u32], at: Self::U) -> Self::U;
    /// Both halves of elements of a slice: one access each where the machine has it. Undefined where the mask is clear.
    fn gather_pair(self, m: Self::M, from: &[[u32; 2]], at: Self::U) -> (Self::U, Self::U);
    fn expand_u(self, a: Self::U, m: Self::M, from: &[u32; LANES]) -> Self::U;
    /// The bits of f32 lanes.
    fn bits(self, a: Self::F) -> Self::U;
    /// f32 lanes from their bits.
    fn floats(self, a: Self::U) -> Self::F;
    /// f32 lanes of these values, which are below 2^24.
    fn numbers(self, a: Self::U) -> Self::F;

    fn mask(self, bits: u32) -> Self::M;
    fn mask_bits(self, m: Self::M) -> u32;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// a and not b.
    fn and_not(self, a: Self::M, b: Self::M) -> Self::M;

    /// Stores the lanes whose bit is set, in order, from `to[0]`; what follows them in `to` is undefined.
    /// Returns how many.
    fn compress(self, bits: u32, a: Self::U, to: &mut [u32; LANES]) -> usize;
    /// As [`Self::compress`].
    fn compress_f(self, bits: u32, a: Self::F, to: &mut [f32; LANES]) -> usize;
    /// As [`Self::compress`], the greatest key first; the four lowest bits of keys are not compared, and hold the lane where
    /// keys are stored. Negative keys may come in any order.
    fn compress_far_to_near(
        self,
        bits: u32,
        key: Self::F,
        a: Self::U,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> usize;
    /// As [`Self::compress_far_to_near`], for at least one lane; also returns the lane of the last, the nearest.
    #[inline(always)]
    fn sort_far_to_near(
        self,
        bits: u32,
        key: Self::F,
        a: Self::U,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> (usize, usize) {
        let count = self.compress_far_to_near(bits, key, a, to, keys);
        (count, keys[count.wrapping_sub(1) % LANES].to_bits() as usize % LANES)
    }
    /// Drops the elements whose key exceeds the limit, keeping the order. Returns how many remain.
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize;

    /// Row i becomes lane i of every row.
    fn transpose(self, rows: [Self::F; LANES]) -> [Self::F; LANES];

    /// Lane i is the least of row i; none may hold a NaN.
    #[inline(always)]
    fn least_of_each(self, rows: [Self::F; LANES]) -> Self::F {
        let mut columns = self.transpose(rows);
        let mut half = LANES / 2;
        while half > 0 {
            for i in 0..half {
                columns[i] = self.min(columns[i], columns[i + half]);
            }
            half /= 2;
        }
        columns[0]
    }

    /// Asks for a cache line.
    fn prefetch<T>(self, place: *const T);
}

/// Panics unless all lanes of the mask lie below `len`, and what lies below it fits the signed 32-bit indices of
/// gathers.
#[inline(always)]
#[cfg(target_arch = "x86_64")]
fn assert_within<S: Simd>(s: S, m: S::M, at: S::U, len: usize) {
    let len = u32::try_from(len).unwrap_or(u32::MAX).min(1 << 31);
    let outside = s.and_not(m, s.lt_u(at, s.splat_u(len)));
    assert!(s.mask_bits(outside) == 0, "an index of a gather lies outside");
}

/// The indices of lanes of the mask, which must lie below `len`, and 0 for the others; a slice of that length that
/// is not empty has them all.
#[inline(always)]
#[cfg(target_arch = "x86_64")]
fn within<S: Simd>(s: S, m: S::M, at: S::U, len: usize) -> [u32; LANES] {
    assert!(len > 0, "rows of nothing");
    assert_within(s, m, at, len);
    let mut out = [0; LANES];
    s.store_u(s.select_u(m, at, s.splat_u(0)), &mut out);
    out
}
