//! Vectors of sixteen f32 or u32 lanes on any machine: the trait over which kernels are generic.
//!
//! An implementation is a token that exists only on machines that have its instructions, so its
//! methods are safe to call, and all `unsafe` code of the kernels is in this folder. All methods,
//! and all functions that are generic over [`Simd`], must be `#[inline(always)]`, so that they are
//! compiled inside the one function per instruction set that enables its features ([`Isa::run`]). A
//! closure, or a library function that takes one (`array::map`), is compiled as a function of its
//! own, without these features, and must not use lanes.
//!
//! The module is public for the compiler alone, and hidden: nothing of it but [`Isa`] is part of
//! the library's interface.
//!
//! The f32 arithmetic of kernels only *excludes* nodes and triangles; hits are decided in f64
//! (`crate::intersect::exact`). Answers therefore do not depend on whether `fma` rounds once or
//! twice.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod caches;
#[cfg(target_arch = "x86_64")]
mod detected;
mod doubles;
mod isa;
#[cfg(any(
    target_arch = "x86_64",
    target_arch = "aarch64",
    all(target_arch = "wasm32", target_feature = "simd128")
))]
mod quads;
mod scalar;
#[cfg(test)]
mod tests;

pub use caches::CacheLevel;
pub use doubles::{Doubles, PlainDoubles};
pub use isa::{Isa, IsaError};
pub(crate) use scalar::Scalar;

/// Number of lanes.
pub const LANES: usize = 16;

/// A function that is generic over the instruction set, with its arguments.
pub trait Kernel: Sized {
    type Output;
    /// True if the kernel is compiled for scalar code, for vectors of 128 bits, and for longer
    /// ones. Large kernels that are no faster than other code are not.
    const SCALAR: bool = true;
    const QUADS: bool = true;
    const LONG_VECTORS: bool = true;
    /// Must be `#[inline(always)]`.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// A part of kernels that is compiled once per instruction set, with its arguments
/// ([`Simd::call`]).
pub trait Part<S> {
    type Output;
    /// Must be `#[inline(always)]`.
    fn run(self, simd: S) -> Self::Output;
    /// Runs the part within the kernel, or calls it: see [`Simd::INLINES_PARTS`].
    #[inline(always)]
    fn inline_or_call(self, simd: S) -> Self::Output
    where
        Self: Sized,
        S: Simd,
    {
        if S::INLINES_PARTS { self.run(simd) } else { simd.call(self) }
    }
    /// Like [`Self::inline_or_call`], for parts that several kernels have in common: see
    /// [`Simd::INLINES_SHARED_PARTS`].
    #[inline(always)]
    fn inline_or_share(self, simd: S) -> Self::Output
    where
        Self: Sized,
        S: Simd,
    {
        if S::INLINES_SHARED_PARTS { self.run(simd) } else { simd.call(self) }
    }
}

/// Operations on vectors that treat each lane alone. A vector has sixteen lanes or, in a
/// [piece](Simd::Piece), some of the sixteen; arrays always have sixteen elements, and a piece
/// reads and writes its part of them. Where masks are given as bits, bit i is lane i of sixteen.
pub trait Lanewise: Copy + 'static {
    /// f32 lanes.
    type F: Copy;
    /// u32 lanes.
    type U: Copy;
    /// A mask: a truth value for each lane.
    type M: Copy;
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
    /// The greater of |a| and |b|; either of them where one is NaN.
    fn max_abs(self, a: Self::F, b: Self::F) -> Self::F;
    /// a < b; false for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// a <= b; false for NaN.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// `a` where the mask is set, else `b`.
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F;
    fn splat_u(self, x: u32) -> Self::U;
    fn load_u(self, from: &[u32; LANES]) -> Self::U;
    /// Loads bytes, each zero-extended to a lane.
    fn load_bytes(self, from: &[u8; LANES]) -> Self::U;
    /// Transposes three vectors to the first three elements of rows, for [`Self::lookup_rows`].
    #[inline(always)]
    fn store_rows(self, columns: [Self::F; 3], rows: &mut [[f32; 4]; LANES]) {
        for k in 0..3 {
            let mut lanes = [0.0; LANES];
            self.store(columns[k], &mut lanes);
            for i in 0..LANES {
                rows[i][k] = lanes[i];
            }
        }
    }
    /// The first three elements of the rows whose indices, modulo 16, are in `at`.
    #[inline(always)]
    fn lookup_rows(self, rows: &[[f32; 4]; LANES], at: &[u8; LANES]) -> [Self::F; 3] {
        let mut out = [[0.0; LANES]; 3];
        for i in 0..LANES {
            for k in 0..3 {
                out[k][i] = rows[usize::from(at[i]) % LANES][k];
            }
        }
        [self.load(&out[0]), self.load(&out[1]), self.load(&out[2])]
    }
    fn store_u(self, a: Self::U, to: &mut [u32; LANES]);
    fn add_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// a + b, wrapping, where the mask is set, else `a`.
    fn add_where(self, a: Self::U, m: Self::M, b: Self::U) -> Self::U;
    fn and_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn or_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn xor_u(self, a: Self::U, b: Self::U) -> Self::U;
    fn shl_u<const K: u32>(self, a: Self::U) -> Self::U;
    fn eq_u(self, a: Self::U, b: Self::U) -> Self::M;
    /// a < b, unsigned.
    fn lt_u(self, a: Self::U, b: Self::U) -> Self::M;
    fn select_u(self, m: Self::M, a: Self::U, b: Self::U) -> Self::U;
    /// The bits of f32 lanes.
    fn bits(self, a: Self::F) -> Self::U;
    /// f32 lanes from their bits.
    fn floats(self, a: Self::U) -> Self::F;
    /// The mask of the sixteen lowest bits.
    fn mask(self, bits: u32) -> Self::M;
    /// The bits of a mask; bits from the sixteenth on are 0.
    fn mask_bits(self, m: Self::M) -> u32;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// a and not b.
    fn and_not(self, a: Self::M, b: Self::M) -> Self::M;
}

/// Operations on vectors of sixteen lanes across lanes and with memory.
pub trait Simd: Lanewise {
    /// True if the lanes are vector registers. Kernels that are faster only with vectors are not
    /// compiled without them.
    const HAS_VECTORS: bool = true;
    /// True if kernels contain their larger parts. Otherwise they call them ([`Self::call`]),
    /// because unrolled in every kernel, with several registers for each vector, these would be the
    /// largest part of the library.
    const INLINES_PARTS: bool = true;
    /// True if kernels contain parts that other kernels contain, too.
    const INLINES_SHARED_PARTS: bool = Self::INLINES_PARTS;
    /// The lanes of one register, where a vector fills several. Parts that are called treat one
    /// piece after the other where they can: all their variables are then in registers, and pieces
    /// without work are skipped.
    type Piece: Lanewise;
    /// Vectors of four f64.
    type Doubles: Doubles;
    fn doubles(self) -> Self::Doubles;
    /// The largest of the first three elements, in all four. No element may be negative. It is
    /// compared by its bits, which takes less time and finds NaN, which is greater than all
    /// numbers.
    #[inline(always)]
    fn greatest_of_three(self, a: [f32; 4]) -> [f32; 4] {
        scalar::greatest_of_three(a)
    }
    /// Number of pieces. Piece i holds the i-th of as many equal parts of the lanes.
    const PIECES: usize;
    fn piece(self, i: usize) -> Self::Piece;
    /// The lanes of a piece.
    fn pick(piece: Self::Piece, a: &Self::F) -> <Self::Piece as Lanewise>::F;
    /// Replaces the lanes of a piece.
    fn put(piece: Self::Piece, to: &mut Self::F, a: <Self::Piece as Lanewise>::F);
    /// Transposes sixteen vectors of a piece to rows, and stores the row of each lane as row `line`
    /// of its record.
    fn store_transposed<const N: usize>(
        piece: Self::Piece,
        columns: [<Self::Piece as Lanewise>::F; LANES],
        to: &mut [[[f32; LANES]; N]; LANES],
        line: usize,
    );
    /// Like [`Self::put`].
    fn put_mask(piece: Self::Piece, to: &mut Self::M, m: <Self::Piece as Lanewise>::M);
    /// Like [`Self::pick`].
    fn pick_mask(piece: Self::Piece, m: &Self::M) -> <Self::Piece as Lanewise>::M;

    /// Calls a part of a kernel as a function that all kernels of the instruction set share: for
    /// parts that many kernels need and that run long compared with a call.
    fn call<P: Part<Self>>(self, part: P) -> P::Output;
    /// Lane `at[i] % 16` of the table.
    fn lookup(self, table: Self::F, at: Self::U) -> Self::F;
    /// The smallest of all lanes. No lane may be NaN.
    fn least(self, a: Self::F) -> f32;
    /// Loads rows of three: lane i of vector k is element k of row `row[i]`.
    ///
    /// # Panics
    /// If the index of a row lies outside of `from`.
    #[inline(always)]
    fn points(self, from: &[[f32; 3]], row: &[u32; LANES]) -> [Self::F; 3] {
        let mut columns = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let point = &from[row[i] as usize];
            for k in 0..3 {
                columns[k][i] = point[k];
            }
        }
        [self.load(&columns[0]), self.load(&columns[1]), self.load(&columns[2])]
    }
    /// Loads rows of four and transposes them: lane i of vector k is element k of row `row[i]`, and
    /// is undefined where the mask is clear. Much faster than four gathers on all instruction sets.
    ///
    /// # Panics
    /// If the index of a row lies outside of `from` where the mask is set.
    fn rows4(self, m: Self::M, from: &[[f32; 4]], row: Self::U) -> [Self::F; 4];
    /// Like [`Self::rows4`], for rows of eight words.
    fn rows8(self, m: Self::M, from: &[[u32; 8]], row: Self::U) -> [Self::U; 8];
    /// Transposes sixteen rows of eight words: lane i of vector k is element k of row i.
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [Self::U; 8];
    /// Transposes five vectors to rows: element k of row i is lane i of vector k.
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
    /// Assigns the elements of `from` in order to the lanes whose mask is set, from `from[0]` on;
    /// the other lanes keep the values of `a`.
    fn expand(self, a: Self::F, m: Self::M, from: &[f32; LANES]) -> Self::F;
    /// Like [`Self::lookup`].
    fn lookup_u(self, table: Self::U, at: Self::U) -> Self::U;
    /// True if [`Self::lookup_f64`] compiles to a few instructions.
    const HAS_FAST_F64_LOOKUP: bool = false;
    /// Elements `at[i] % 16` of the table. With `FIRST_HALF`, elements whose index is not below
    /// eight are undefined.
    #[inline(always)]
    fn lookup_f64<const FIRST_HALF: bool>(self, table: &[f64; LANES], at: Self::U) -> [f64; LANES] {
        let (mut index, mut out) = ([0; LANES], [0.0; LANES]);
        self.store_u(at, &mut index);
        for i in 0..LANES {
            out[i] = table[index[i] as usize % LANES];
        }
        out
    }
    /// Elements of a slice, 0 where the mask is clear.
    ///
    /// # Panics
    /// If an index lies outside of `from` where the mask is set.
    fn gather_u(self, m: Self::M, from: &[u32], at: Self::U) -> Self::U;
    /// First and second words of elements of a slice, undefined where the mask is clear. AVX-512
    /// loads each pair at once.
    ///
    /// # Panics
    /// Like [`Self::gather_u`].
    fn gather_pair(self, m: Self::M, from: &[[u32; 2]], at: Self::U) -> (Self::U, Self::U);
    /// Like [`Self::expand`].
    fn expand_u(self, a: Self::U, m: Self::M, from: &[u32; LANES]) -> Self::U;
    /// True if [`Self::compress`] compiles to a few instructions.
    const HAS_FAST_COMPRESS: bool = false;
    /// Stores the lanes whose bit is set, in order, from `to[0]` on, and returns their number. The
    /// rest of `to` is undefined.
    fn compress(self, bits: u32, a: Self::U, to: &mut [u32; LANES]) -> usize;
    /// Like [`Self::compress`].
    fn compress_f(self, bits: u32, a: Self::F, to: &mut [f32; LANES]) -> usize;
    /// Like [`Self::compress`], sorted by descending keys. The four lowest bits of keys are not
    /// compared; in the stored keys they hold the lane. Negative keys are stored in unspecified
    /// order.
    fn compress_far_to_near(
        self,
        bits: u32,
        key: Self::F,
        a: Self::U,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> usize;
    /// Like [`Self::compress_far_to_near`]; also returns the lane of the last entry, the nearest,
    /// which is undefined if no bit is set.
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
    /// Removes the entries whose key exceeds the limit from `codes` and `keys`, keeping the order,
    /// and returns how many remain.
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize;
    /// Transposes: lane k of row i becomes lane i of row k.
    fn transpose(self, rows: [Self::F; LANES]) -> [Self::F; LANES];
    /// Lane i of the result is the smallest lane of row i; no lane may be NaN.
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
    /// Prefetches a cache line; any address is allowed.
    fn prefetch<T>(self, address: *const T);
    /// Like [`Self::prefetch`], into the second-level cache only, where the machine can.
    #[inline(always)]
    fn prefetch_second<T>(self, address: *const T) {
        self.prefetch(address);
    }
    /// Prefetches `LINES` elements of a cache line each; any address is allowed.
    #[inline(always)]
    fn prefetch_into<const LINES: usize, T>(self, level: CacheLevel, first: *const T) {
        // The level is asked once, not for each line.
        match level {
            CacheLevel::First => {
                for i in 0..LINES {
                    self.prefetch(first.wrapping_add(i));
                }
            }
            CacheLevel::Second => {
                for i in 0..LINES {
                    self.prefetch_second(first.wrapping_add(i));
                }
            }
        }
    }
}

/// The lanes of a [piece](Simd::Piece), one bit per lane.
#[inline(always)]
pub(crate) fn lanes_of_piece<S: Simd>(i: usize) -> u32 {
    let lanes = LANES / S::PIECES;
    (0xffff >> (LANES - lanes)) << (i * lanes)
}

/// Defines the one piece of an instruction set whose vectors are not treated in pieces.
macro_rules! one_piece {
    () => {
        type Piece = Self;
        const PIECES: usize = 1;
        #[inline(always)]
        fn piece(self, _: usize) -> Self {
            self
        }
        #[inline(always)]
        fn pick(_: Self, a: &Self::F) -> Self::F {
            *a
        }
        #[inline(always)]
        fn put(_: Self, to: &mut Self::F, a: Self::F) {
            *to = a;
        }
        #[inline(always)]
        fn store_transposed<const N: usize>(
            piece: Self,
            columns: [Self::F; LANES],
            to: &mut [[[f32; LANES]; N]; LANES],
            line: usize,
        ) {
            let rows = piece.transpose(columns);
            for lane in 0..LANES {
                piece.store(rows[lane], &mut to[lane][line]);
            }
        }
        #[inline(always)]
        fn put_mask(_: Self, to: &mut Self::M, m: Self::M) {
            *to = m;
        }
        #[inline(always)]
        fn pick_mask(_: Self, m: &Self::M) -> Self::M {
            *m
        }
    };
}
use one_piece;

/// Vectors of four f64 in plain code.
macro_rules! plain_doubles {
    () => {
        type Doubles = $crate::simd::PlainDoubles;
        #[inline(always)]
        fn doubles(self) -> Self::Doubles {
            $crate::simd::PlainDoubles
        }
    };
}
use plain_doubles;

/// Vectors of four f64 with AVX, and what else AVX2 and AVX-512 have in common.
#[cfg(target_arch = "x86_64")]
macro_rules! avx_doubles {
    () => {
        type Doubles = $crate::simd::avx2::doubles::AvxDoubles;
        #[inline(always)]
        fn doubles(self) -> Self::Doubles {
            // SAFETY: self proves AVX2.
            unsafe { $crate::simd::avx2::doubles::AvxDoubles::new() }
        }
        #[inline(always)]
        fn greatest_of_three(self, a: [f32; 4]) -> [f32; 4] {
            // SAFETY: self proves AVX2, and so SSE4.1.
            unsafe { $crate::simd::quads::sse4::greatest_of_three(a) }
        }
        #[inline(always)]
        fn call<P: Part<Self>>(self, part: P) -> P::Output {
            // SAFETY: self proves that the machine has the features that `part_entry` enables.
            unsafe { part_entry(self, part) }
        }
        #[inline(always)]
        fn prefetch<T>(self, address: *const T) {
            // SAFETY: a hint that never faults, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
        }
        #[inline(always)]
        fn prefetch_second<T>(self, address: *const T) {
            // SAFETY: as `prefetch`.
            unsafe { _mm_prefetch::<_MM_HINT_T1>(address.cast()) }
        }
    };
}
#[cfg(target_arch = "x86_64")]
use avx_doubles;

/// Defines the token of an x86-64 instruction set, its detection, and the entries of kernels and of
/// their parts, which enable the features. `$simd` is the implementation of [`Simd`] that `$make`
/// makes of the token.
#[cfg(target_arch = "x86_64")]
macro_rules! x86_token {
    ($(#[$doc:meta])* $token:ident, $simd:ty = $make:expr, $($feature:tt)*) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(in crate::simd) struct $token(());

        /// True if this machine has the features.
        static IS_FOUND: $crate::simd::detected::Detected =
            $crate::simd::detected::Detected::new(|| $(is_x86_feature_detected!($feature))&&*);

        impl $token {
            #[inline]
            pub(in crate::simd) fn detect() -> Option<Self> {
                IS_FOUND.get().then_some($token(()))
            }

            /// Like [`Self::detect`]; `None` before that was called.
            #[inline(always)]
            pub(in crate::simd) fn found() -> Option<Self> {
                IS_FOUND.is_found().then_some($token(()))
            }

            /// Runs a kernel compiled for these features.
            #[inline]
            pub(in crate::simd) fn run<K: $crate::simd::Kernel>(self, kernel: K) -> K::Output {
                // SAFETY: self proves that the machine has the features that `entry` enables.
                unsafe { entry($make(self), kernel) }
            }
        }

        #[target_feature($(enable = $feature),*)]
        fn entry<K: $crate::simd::Kernel>(simd: $simd, kernel: K) -> K::Output {
            kernel.run(simd)
        }

        /// Like [`entry`], for a part of kernels.
        #[target_feature($(enable = $feature),*)]
        #[inline(never)]
        fn part_entry<P: $crate::simd::Part<$simd>>(simd: $simd, part: P) -> P::Output {
            part.run(simd)
        }
    };
}
#[cfg(target_arch = "x86_64")]
use x86_token;

/// The lanes in order.
pub(crate) const IN_ORDER: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Panics unless the indices of all lanes of the mask are below `len` and below 2^31, because
/// gathers have signed 32-bit indices.
#[inline(always)]
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
fn assert_indices<S: Simd>(s: S, m: S::M, at: S::U, len: usize) {
    let len = u32::try_from(len).unwrap_or(u32::MAX).min(1 << 31);
    let outside = s.and_not(m, s.lt_u(at, s.splat_u(len)));
    assert!(s.mask_bits(outside) == 0, "an index of a gather lies outside");
}

/// The indices of the lanes of the mask, and 0 for the other lanes, so that every lane has a valid
/// index of a slice of length `len`. Panics if the slice is empty, and as [`assert_indices`].
#[inline(always)]
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
fn valid_indices<S: Simd>(s: S, m: S::M, at: S::U, len: usize) -> [u32; LANES] {
    assert!(len > 0, "rows of nothing");
    assert_indices(s, m, at, len);
    let mut out = [0; LANES];
    s.store_u(s.select_u(m, at, s.splat_u(0)), &mut out);
    out
}
