//! Every instruction set against scalar code, on random lanes.

use super::*;
use bth_random::Rng;

fn floats(rng: &mut Rng) -> [f32; LANES] {
    std::array::from_fn(|_| match rng.below(12) {
        0 => 0.0,
        1 => -0.0,
        2 => f32::INFINITY,
        3 => f32::NEG_INFINITY,
        4 => f32::NAN,
        5 => f32::MAX,
        6 => f32::from_bits(rng.below(100) as u32),
        7 => 1.0,
        _ => (rng.below(1 << 24) as f32 - (1 << 23) as f32) / 1024.0,
    })
}

/// Kernel that runs all operations of the trait and returns their results as bits. Its function is
/// long because it is a table of the operations.
struct AllOperations<'a> {
    a: &'a [f32; LANES],
    b: &'a [f32; LANES],
    u: &'a [u32; LANES],
    v: &'a [u32; LANES],
    bits: u32,
}

impl Kernel for AllOperations<'_> {
    type Output = Vec<Vec<u32>>;
    /// A table of all operations, hence its length.
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let f = |x: S::F| {
            let mut out = [0.0; LANES];
            s.store(x, &mut out);
            // Sign and payload of NaN are unspecified.
            out.map(|x| if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() }).to_vec()
        };
        let u = |x: S::U| {
            let mut out = [0; LANES];
            s.store_u(x, &mut out);
            out.to_vec()
        };
        let m = |x: S::M| vec![s.mask_bits(x)];
        let (a, b, x, y) = (s.load(self.a), s.load(self.b), s.load_u(self.u), s.load_u(self.v));
        let mask = s.mask(self.bits);
        let other = s.lt(a, b);
        let index = s.and_u(x, s.splat_u(31));
        let table: Vec<f32> = (0..32).map(|i| i as f32 * 1.5).collect();
        let words: Vec<u32> = (0..32).map(|i| i * 77).collect();
        let pairs: Vec<[u32; 2]> = (0..32).map(|i| [i * 3, i * 5 + 1]).collect();
        let (first, second) = s.gather_pair(mask, &pairs, index);
        let bytes: [u8; LANES] = self.u.map(|x| x as u8);
        let mut compressed = [0; LANES];
        let count = s.compress(self.bits, x, &mut compressed);
        let mut compressed_f = [0.0; LANES];
        assert_eq!(s.compress_f(self.bits, s.floats(x), &mut compressed_f), count);
        assert_eq!(compressed_f.map(f32::to_bits)[..count], compressed[..count]);
        let ordered = self.a.map(|x| if x.is_nan() { 0.5 } else { x.abs() });
        let (mut codes, mut keys) = ([0; LANES], [0.0; LANES]);
        let sorted = s.compress_far_to_near(self.bits, s.load(&ordered), x, &mut codes, &mut keys);
        // The order of equal keys is unspecified.
        let mut pairs: Vec<(u32, u32)> =
            keys[..sorted].iter().zip(&codes).map(|(k, &c)| (k.to_bits() & !15, c)).collect();
        assert!(pairs.is_sorted_by(|p, q| p.0 >= q.0), "far to near: {pairs:?}");
        pairs.sort_unstable();
        for key in [ordered, self.a.map(|x| if x.is_nan() { -0.5 } else { x })] {
            let (count, nearest) = s.sort_far_to_near(self.bits, s.load(&key), x, &mut codes, &mut keys);
            assert_eq!(count, sorted);
            // The lane of the last entry is returned, although the order of negative keys is
            // unspecified.
            if let Some(last) = count.checked_sub(1) {
                assert_eq!(nearest, keys[last].to_bits() as usize % LANES, "of {key:?}");
                assert_eq!(codes[last], self.u[nearest]);
                assert!(self.bits >> nearest & 1 != 0);
            }
        }
        let (mut kept_codes, mut kept_keys) = (self.u.repeat(2), self.a.repeat(2));
        let kept = s.keep_up_to(&mut kept_codes[..19], &mut kept_keys[..19], self.b[3]);
        let mut square = [a; LANES];
        for (i, row) in square.iter_mut().enumerate() {
            *row = s.floats(s.add_u(s.load_u(self.u), s.splat_u(i as u32)));
        }
        let square = s.transpose(square);
        let mut turned = Vec::new();
        for row in square {
            turned.extend(u(s.bits(row)));
        }
        let block: [[u32; 8]; LANES] =
            std::array::from_fn(|i| std::array::from_fn(|k| self.u[i].wrapping_add(k as u32)));
        for column in s.columns8(&block) {
            turned.extend(u(column));
        }
        let mut rows = [[0; 5]; LANES];
        s.store_rows5([x, y, s.bits(a), s.bits(b), s.splat_u(7)], &mut rows);
        turned.extend(rows.as_flattened());
        let mut signed = [s.load(&ordered); LANES];
        for (i, row) in signed.iter_mut().enumerate() {
            *row = s.sub(s.splat(i as f32 - 8.0), s.lookup(*row, s.add_u(x, s.splat_u(i as u32))));
        }
        turned.extend(u(s.bits(s.least_of_each(signed))));
        let rows = [bytes, bytes.map(|x| x / 3), bytes.map(|x| x.wrapping_mul(7))]
            .map(|row| row.map(|x| x % LANES as u8));
        let mut points = [[0.0; 4]; LANES];
        s.store_rows([a, b, s.add(a, b)], &mut points);
        for row in &rows {
            for x in s.lookup_rows(&points, row) {
                turned.extend(f(x));
            }
        }
        let zero = s.splat(0.0);
        for column in s.rows4(mask, table.as_chunks().0, s.and_u(x, s.splat_u(7))) {
            turned.extend(f(s.select(mask, column, zero)));
        }
        for column in s.rows8(mask, words.as_chunks().0, s.and_u(x, s.splat_u(3))) {
            turned.extend(u(s.select_u(mask, column, s.splat_u(0))));
        }
        vec![
            turned,
            f(s.splat(self.a[0])),
            f(s.add(a, b)),
            f(s.sub(a, b)),
            f(s.mul(a, b)),
            f(s.div(a, b)),
            f(s.min(a, b)),
            f(s.max(a, b)),
            f(s.abs(a)),
            f(s.max_abs(s.sub(s.splat(1.0), s.load(&ordered)), s.load(&ordered))),
            m(other),
            m(s.le(a, b)),
            f(s.select(other, a, b)),
            f(s.lookup(a, x)),
            vec![s.least(s.load(&ordered)).to_bits()],
            f(s.expand(a, mask, self.b)),
            u(s.load_bytes(&bytes)),
            u(s.add_u(x, y)),
            u(s.add_where(x, mask, y)),
            u(s.and_u(x, y)),
            u(s.or_u(x, y)),
            u(s.xor_u(x, y)),
            u(s.shl_u::<3>(x)),
            m(s.eq_u(s.and_u(x, s.splat_u(3)), s.and_u(y, s.splat_u(3)))),
            m(s.lt_u(x, y)),
            u(s.select_u(mask, x, y)),
            u(s.lookup_u(x, y)),
            u(s.gather_u(mask, &words, index)),
            u(s.select_u(mask, first, s.splat_u(0))),
            u(s.select_u(mask, second, s.splat_u(0))),
            u(s.expand_u(x, mask, self.v)),
            u(s.bits(a)),
            f(s.floats(s.bits(a))),
            s.greatest_of_three([0, 1, 2, 3].map(|i| self.a[i].abs())).map(f32::to_bits).to_vec(),
            m(mask),
            m(s.and(mask, other)),
            m(s.or(mask, other)),
            m(s.and_not(mask, other)),
            compressed[..count].to_vec(),
            pairs.into_iter().flat_map(|(k, c)| [k, c]).collect(),
            kept_codes[..kept].to_vec(),
            kept_keys[..kept].iter().map(|k| k.to_bits()).collect(),
        ]
    }
}

/// Kernel of `fma` and `fnma`.
struct Fused<'a>(&'a [f32; LANES], &'a [f32; LANES], &'a [f32; LANES]);

impl Kernel for Fused<'_> {
    type Output = [[f32; LANES]; 2];
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let (a, b, c) = (s.load(self.0), s.load(self.1), s.load(self.2));
        let mut out = [[0.0; LANES]; 2];
        s.store(s.fma(a, b, c), &mut out[0]);
        s.store(s.fnma(a, b, c), &mut out[1]);
        out
    }
}

#[test]
fn every_instruction_set_gives_the_results_of_scalar_code() {
    let mut rng = Rng::new(31);
    for _ in 0..3_000 {
        let (a, b) = (floats(&mut rng), floats(&mut rng));
        let [u, v] = [(); 2].map(|()| std::array::from_fn(|_| rng.below(1 << 32) as u32));
        let bits = rng.below(1 << 16) as u32 & rng.below(1 << 16) as u32;
        let input = || AllOperations { a: &a, b: &b, u: &u, v: &v, bits };
        let want = Isa::Scalar.run(input());
        for isa in Isa::ALL {
            for (step, (got, want)) in isa.run(input()).iter().zip(&want).enumerate() {
                assert_eq!(got, want, "{isa}, row {step}");
            }
        }
    }
}

#[test]
fn fused_and_unfused_products_and_sums_agree_within_their_rounding() {
    let mut rng = Rng::new(32);
    for _ in 0..3_000 {
        let mut draw = || std::array::from_fn(|_| (rng.below(1 << 24) as f32 - (1 << 23) as f32) / 4096.0);
        let (a, b, c) = (draw(), draw(), draw());
        for isa in Isa::ALL {
            let got = isa.run(Fused(&a, &b, &c));
            for i in 0..LANES {
                let (p, c) = (f64::from(a[i]) * f64::from(b[i]), f64::from(c[i]));
                let bound = (p.abs() + c.abs()) * 2f64.powi(-23);
                assert!((f64::from(got[0][i]) - (c + p)).abs() <= bound, "{isa}");
                assert!((f64::from(got[1][i]) - (c - p)).abs() <= bound, "{isa}");
            }
        }
    }
}

#[test]
#[cfg(panic = "unwind")]
fn a_gather_outside_of_its_slice_panics_on_every_instruction_set() {
    /// Kernel of one kind of access, with an index for lane 7 and a mask.
    #[derive(Clone, Copy)]
    struct Outside(u32, u32, u32);
    impl Kernel for Outside {
        type Output = [u32; LANES];
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let mut at = [0; LANES];
            at[7] = self.1;
            let (at, m) = (s.load_u(&at), s.mask(self.2));
            let rows = [1.0, 2.0, 3.0];
            let got = match self.0 {
                0 => s.gather_u(m, &rows.map(f32::to_bits), at),
                1 => s.gather_pair(m, &rows.map(|x| [x.to_bits(); 2]), at).1,
                2 => s.bits(s.rows4(m, &rows.map(|x| [x; 4]), at)[3]),
                _ => s.rows8(m, &rows.map(|x| [x.to_bits(); 8]), at)[7],
            };
            let mut out = [0; LANES];
            s.store_u(got, &mut out);
            out
        }
    }
    for isa in Isa::ALL {
        for access in 0..4 {
            for index in [3, 4, 1 << 31, u32::MAX] {
                let caught = std::panic::catch_unwind(|| isa.run(Outside(access, index, 0xffff)));
                assert!(caught.is_err(), "{isa} {access} {index}");
                let first = isa.run(Outside(access, index, 1))[0];
                assert_eq!(first, 1f32.to_bits(), "{isa}: a clear lane is not read");
            }
            assert_eq!(isa.run(Outside(access, 2, 0x80))[7], 3f32.to_bits());
        }
    }
}

#[test]
fn names_parse_back_and_unknown_names_are_rejected() {
    for isa in Isa::ALL {
        assert_eq!(isa.to_string().parse(), Ok(isa));
    }
    assert_eq!("mmx".parse::<Isa>(), Err(IsaError::Unknown("mmx".into())));
    assert!(Isa::Scalar.is_available() && Isa::best().is_available());
}
