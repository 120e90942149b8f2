//! Sixteen lanes in four registers of 128 bits: one implementation for SSE4.1, NEON and SIMD128.
//!
//! The files of the instruction sets supply the operations on one register ([`Quad`]); everything
//! that is made of them is here and in [`rows`], [`packing`] and [`register`]. Without registers
//! for whole vectors, code that works on sixteen lanes is long: kernels call their larger parts
//! instead of containing them ([`Simd::INLINES_PARTS`]).

#[cfg(target_arch = "aarch64")]
pub(super) mod neon;
mod packing;
mod register;
mod rows;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub(super) mod simd128;
#[cfg(target_arch = "x86_64")]
pub(super) mod sse4;

use self::register::Register;
use super::{IN_ORDER, LANES, Lanewise, Part, Simd, assert_indices, plain_doubles, scalar, valid_indices};

/// Lanes of a register.
const QUAD: usize = 4;
/// Registers of a vector.
const QUADS: usize = LANES / QUAD;

/// Passes the operations that treat each lane alone to another macro: one list for one register,
/// all four, and a piece.
macro_rules! lane_operations {
    ($then:ident) => {
        $then! {
            add(a: F, b: F) -> F;
            sub(a: F, b: F) -> F;
            mul(a: F, b: F) -> F;
            div(a: F, b: F) -> F;
            fma(a: F, b: F, c: F) -> F;
            fnma(a: F, b: F, c: F) -> F;
            min(a: F, b: F) -> F;
            max(a: F, b: F) -> F;
            abs(a: F) -> F;
            lt(a: F, b: F) -> U;
            le(a: F, b: F) -> U;
            select(m: U, a: F, b: F) -> F;
            add_u(a: U, b: U) -> U;
            and_u(a: U, b: U) -> U;
            or_u(a: U, b: U) -> U;
            xor_u(a: U, b: U) -> U;
            eq_u(a: U, b: U) -> U;
            lt_u(a: U, b: U) -> U;
            and_not(a: U, b: U) -> U;
            bits(a: F) -> U;
            floats(a: U) -> F;
        }
    };
}
use lane_operations;

/// Methods of one register without a body.
macro_rules! declared {
    ($($name:ident($($arg:ident: $of:ident),*) -> $out:ident;)*) => {
        $(fn $name(self, $($arg: Self::$of),*) -> Self::$out;)*
    };
}

/// A token of an instruction set with registers of four lanes, and its operations on them. Unless
/// their docs say otherwise, they do the same as the operations of the same name in [`Simd`].
pub(super) trait Quad: Copy + 'static {
    /// Four f32 lanes.
    type F: Copy;
    /// Four u32 lanes. In a mask all bits of a lane are set, or none.
    type U: Copy;

    /// Implements [`Simd::call`].
    fn call<P: Part<Quads<Self>>>(simd: Quads<Self>, part: P) -> P::Output;

    fn splat(self, x: f32) -> Self::F;
    fn load(self, from: &[f32; QUAD]) -> Self::F;
    fn store(self, a: Self::F, to: &mut [f32; QUAD]);
    lane_operations!(declared);
    /// The smallest of the four lanes. No lane may be NaN.
    fn least(self, a: Self::F) -> f32;
    /// Transposes: lane k of row i becomes lane i of row k.
    fn transpose(self, rows: [Self::F; QUAD]) -> [Self::F; QUAD];
    fn greatest_of_three(self, a: [f32; QUAD]) -> [f32; QUAD] {
        scalar::greatest_of_three(a)
    }

    fn splat_u(self, x: u32) -> Self::U;
    fn load_u(self, from: &[u32; QUAD]) -> Self::U;
    fn store_u(self, a: Self::U, to: &mut [u32; QUAD]);
    /// Loads four bytes, each zero-extended to a lane.
    fn load_bytes(self, from: &[u8; QUAD]) -> Self::U;
    fn shl_u<const K: u32>(self, a: Self::U) -> Self::U;
    /// Byte i of the result is byte `at[i]` of `a`; each `at[i]` must be below 16.
    fn bytes(self, a: Self::U, at: &[u8; LANES]) -> Self::U;
    /// A bit for each lane of a mask of four.
    fn mask_bits(self, m: Self::U) -> u32;
    /// A bit for each lane of a mask of sixteen.
    fn mask_bits_of_all(self, m: [Self::U; QUADS]) -> u32;
    fn prefetch<T>(self, address: *const T);
}

/// The token of an instruction set of 128 bits, for sixteen lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quads<Q>(pub(super) Q);

/// f32 lanes.
type F<Q> = [<Q as Quad>::F; QUADS];
/// u32 lanes.
type U<Q> = [<Q as Quad>::U; QUADS];

/// The four parts of an array of sixteen.
#[inline(always)]
fn split<T>(from: &[T; LANES]) -> &[[T; QUAD]; QUADS] {
    from.as_chunks().0.try_into().expect("sixteen are four times four")
}

/// Like [`split`], mutably.
#[inline(always)]
fn split_mut<T>(to: &mut [T; LANES]) -> &mut [[T; QUAD]; QUADS] {
    to.as_chunks_mut().0.try_into().expect("sixteen are four times four")
}

/// Methods that apply the operation of the same name to each register.
macro_rules! quads {
    ($($name:ident($($arg:ident: $of:ident),*) -> $out:ident;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of<Q>),*) -> $out<Q> {
            [
                self.0.$name($($arg[0]),*),
                self.0.$name($($arg[1]),*),
                self.0.$name($($arg[2]),*),
                self.0.$name($($arg[3]),*),
            ]
        }
    )* };
}

/// A bit for each lane.
const LANE_BITS: [u32; LANES] = {
    let mut bits = [0; LANES];
    let mut i = 0;
    while i < LANES {
        bits[i] = 1 << i;
        i += 1;
    }
    bits
};

/// The indices of the lanes of the mask, and 0 for the other lanes.
#[inline(always)]
fn indices<Q: Quad>(s: Quads<Q>, m: U<Q>, at: U<Q>) -> [u32; LANES] {
    let mut index = [0; LANES];
    s.store_u(s.and_u(at, m), &mut index);
    index
}

impl<Q: Quad> Lanewise for Quads<Q> {
    type F = F<Q>;
    type U = U<Q>;
    type M = U<Q>;
    lane_operations!(quads);
    #[inline(always)]
    fn splat(self, x: f32) -> F<Q> {
        [self.0.splat(x); QUADS]
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> F<Q> {
        let [a, b, c, d] = split(from);
        [self.0.load(a), self.0.load(b), self.0.load(c), self.0.load(d)]
    }
    #[inline(always)]
    fn store(self, a: F<Q>, to: &mut [f32; LANES]) {
        let to = split_mut(to);
        for i in 0..QUADS {
            self.0.store(a[i], &mut to[i]);
        }
    }
    #[inline(always)]
    fn max_abs(self, a: F<Q>, b: F<Q>) -> F<Q> {
        self.max(self.abs(a), self.abs(b))
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> U<Q> {
        [self.0.splat_u(x); QUADS]
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; LANES]) -> U<Q> {
        let [a, b, c, d] = split(from);
        [self.0.load_u(a), self.0.load_u(b), self.0.load_u(c), self.0.load_u(d)]
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; LANES]) -> U<Q> {
        let [a, b, c, d] = split(from);
        [self.0.load_bytes(a), self.0.load_bytes(b), self.0.load_bytes(c), self.0.load_bytes(d)]
    }
    #[inline(always)]
    fn store_rows(self, [x, y, z]: [F<Q>; 3], rows: &mut [[f32; 4]; LANES]) {
        for i in 0..QUADS {
            self.piece(i).store_rows([x[i], y[i], z[i]], rows);
        }
    }
    #[inline(always)]
    fn lookup_rows(self, rows: &[[f32; 4]; LANES], at: &[u8; LANES]) -> [F<Q>; 3] {
        let mut out = [self.splat(0.0); 3];
        for i in 0..QUADS {
            let lanes = self.piece(i).lookup_rows(rows, at);
            for k in 0..3 {
                out[k][i] = lanes[k];
            }
        }
        out
    }
    #[inline(always)]
    fn store_u(self, a: U<Q>, to: &mut [u32; LANES]) {
        let to = split_mut(to);
        for i in 0..QUADS {
            self.0.store_u(a[i], &mut to[i]);
        }
    }
    #[inline(always)]
    fn add_where(self, a: U<Q>, m: U<Q>, b: U<Q>) -> U<Q> {
        self.add_u(a, self.and_u(m, b))
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U<Q>) -> U<Q> {
        let q = self.0;
        [q.shl_u::<K>(a[0]), q.shl_u::<K>(a[1]), q.shl_u::<K>(a[2]), q.shl_u::<K>(a[3])]
    }
    #[inline(always)]
    fn select_u(self, m: U<Q>, a: U<Q>, b: U<Q>) -> U<Q> {
        self.bits(self.select(m, self.floats(a), self.floats(b)))
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> U<Q> {
        let lane = self.load_u(&LANE_BITS);
        self.eq_u(self.and_u(self.splat_u(bits), lane), lane)
    }
    #[inline(always)]
    fn mask_bits(self, m: U<Q>) -> u32 {
        self.0.mask_bits_of_all(m)
    }
    #[inline(always)]
    fn and(self, a: U<Q>, b: U<Q>) -> U<Q> {
        self.and_u(a, b)
    }
    #[inline(always)]
    fn or(self, a: U<Q>, b: U<Q>) -> U<Q> {
        self.or_u(a, b)
    }
}

impl<Q: Quad> Simd for Quads<Q> {
    const INLINES_PARTS: bool = false;
    plain_doubles!();
    type Piece = Register<Q>;
    const PIECES: usize = QUADS;
    #[inline(always)]
    fn greatest_of_three(self, a: [f32; QUAD]) -> [f32; QUAD] {
        self.0.greatest_of_three(a)
    }

    #[inline(always)]
    fn piece(self, i: usize) -> Register<Q> {
        Register { quad: self.0, index: i % QUADS }
    }
    #[inline(always)]
    fn pick(piece: Register<Q>, a: &F<Q>) -> Q::F {
        a[piece.index % QUADS]
    }
    #[inline(always)]
    fn put(piece: Register<Q>, to: &mut F<Q>, a: Q::F) {
        to[piece.index % QUADS] = a;
    }
    #[inline(always)]
    fn store_transposed<const N: usize>(
        piece: Register<Q>,
        columns: [Q::F; LANES],
        to: &mut [[[f32; LANES]; N]; LANES],
        line: usize,
    ) {
        rows::store_transposed(piece, columns, to, line);
    }
    #[inline(always)]
    fn put_mask(piece: Register<Q>, to: &mut U<Q>, m: Q::U) {
        to[piece.index % QUADS] = m;
    }
    #[inline(always)]
    fn pick_mask(piece: Register<Q>, m: &U<Q>) -> Q::U {
        m[piece.index % QUADS]
    }
    #[inline(always)]
    fn call<P: Part<Self>>(self, part: P) -> P::Output {
        Q::call(self, part)
    }
    #[inline(always)]
    fn lookup(self, table: F<Q>, at: U<Q>) -> F<Q> {
        self.floats(self.lookup_u(self.bits(table), at))
    }
    #[inline(always)]
    fn least(self, a: F<Q>) -> f32 {
        let q = self.0;
        q.least(q.min(q.min(a[0], a[1]), q.min(a[2], a[3])))
    }
    #[inline(always)]
    fn rows4(self, m: U<Q>, from: &[[f32; 4]], row: U<Q>) -> [F<Q>; 4] {
        rows::rows4(self, from, indices(self, m, row))
    }
    #[inline(always)]
    fn rows8(self, m: U<Q>, from: &[[u32; 8]], row: U<Q>) -> [U<Q>; 8] {
        rows::rows8(self, from, indices(self, m, row))
    }
    #[inline(always)]
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [U<Q>; 8] {
        rows::rows8(self, rows, IN_ORDER)
    }
    #[inline(always)]
    fn store_rows5(self, columns: [U<Q>; 5], to: &mut [[u32; 5]; LANES]) {
        rows::store_rows5(self, columns, to);
    }
    #[inline(always)]
    fn transpose(self, rows: [F<Q>; LANES]) -> [F<Q>; LANES] {
        rows::transpose(self, rows)
    }
    #[inline(always)]
    fn least_of_each(self, rows: [F<Q>; LANES]) -> F<Q> {
        rows::least_of_each(self, rows)
    }
    #[inline(always)]
    fn expand(self, a: F<Q>, m: U<Q>, from: &[f32; LANES]) -> F<Q> {
        let mut words = [0; LANES];
        self.store_u(self.bits(self.load(from)), &mut words);
        self.floats(self.expand_u(self.bits(a), m, &words))
    }
    #[inline(always)]
    fn lookup_u(self, table: U<Q>, at: U<Q>) -> U<Q> {
        let (mut words, mut index, mut out) = ([0; LANES], [0; LANES], [0; LANES]);
        self.store_u(table, &mut words);
        self.store_u(at, &mut index);
        for i in 0..LANES {
            out[i] = words[index[i] as usize % LANES];
        }
        self.load_u(&out)
    }
    #[inline(always)]
    fn gather_u(self, m: U<Q>, from: &[u32], at: U<Q>) -> U<Q> {
        assert_indices(self, m, at, from.len());
        let (index, mut out) = (indices(self, m, at), [0; LANES]);
        for i in 0..LANES {
            out[i] = from.get(index[i] as usize).copied().unwrap_or(0);
        }
        self.and_u(self.load_u(&out), m)
    }
    #[inline(always)]
    fn gather_pair(self, m: U<Q>, from: &[[u32; 2]], at: U<Q>) -> (U<Q>, U<Q>) {
        let index = valid_indices(self, m, at, from.len());
        let (mut first, mut second) = ([0; LANES], [0; LANES]);
        for i in 0..LANES {
            [first[i], second[i]] = from[index[i] as usize];
        }
        (self.load_u(&first), self.load_u(&second))
    }
    #[inline(always)]
    fn expand_u(self, a: U<Q>, m: U<Q>, from: &[u32; LANES]) -> U<Q> {
        packing::expand(self, a, m, from)
    }
    #[inline(always)]
    fn compress(self, bits: u32, a: U<Q>, to: &mut [u32; LANES]) -> usize {
        packing::compress(self, bits, a, to)
    }
    #[inline(always)]
    fn compress_f(self, bits: u32, a: F<Q>, to: &mut [f32; LANES]) -> usize {
        let mut words = [0; LANES];
        let count = packing::compress(self, bits, self.bits(a), &mut words);
        self.store(self.floats(self.load_u(&words)), to);
        count
    }
    #[inline(always)]
    fn compress_far_to_near(
        self,
        bits: u32,
        key: F<Q>,
        a: U<Q>,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> usize {
        let (mut key_lanes, mut lanes) = ([0.0; LANES], [0; LANES]);
        self.store(key, &mut key_lanes);
        self.store_u(a, &mut lanes);
        scalar::compress_far_to_near(bits, &key_lanes, &lanes, to, keys)
    }
    #[inline(always)]
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
        scalar::keep_up_to(codes, keys, limit)
    }
    #[inline(always)]
    fn prefetch<T>(self, address: *const T) {
        self.0.prefetch(address);
    }
}
