//! Vectors of four f64, with AVX2 and with AVX-512.

use crate::simd::Doubles;
use std::arch::x86_64::*;

/// AVX, on machines that have AVX2 and FMA.
#[derive(Clone, Copy, Debug)]
pub(in crate::simd) struct AvxDoubles(());

impl AvxDoubles {
    /// # Safety
    /// The machine must have AVX2 and FMA.
    #[inline(always)]
    pub(in crate::simd) unsafe fn new() -> AvxDoubles {
        AvxDoubles(())
    }
}

/// Methods that are one or two intrinsics on registers.
macro_rules! intrinsics {
    ($($name:ident($($arg:ident),*) = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: __m256d),*) -> __m256d {
            // SAFETY: self proves AVX2 and FMA, and only registers are accessed.
            unsafe { $do }
        }
    )* };
}

impl Doubles for AvxDoubles {
    type V = __m256d;
    #[inline(always)]
    fn widen(self, [x, y, z, w]: [f32; 4]) -> __m256d {
        // SAFETY: self proves AVX2, and only registers are accessed.
        unsafe { _mm256_cvtps_pd(_mm_setr_ps(x, y, z, w)) }
    }
    #[inline(always)]
    fn load(self, [x, y, z, w]: [f64; 4]) -> __m256d {
        // SAFETY: self proves AVX2 and FMA, and only registers are accessed.
        unsafe { _mm256_setr_pd(x, y, z, w) }
    }
    intrinsics! {
        add(a, b) = _mm256_add_pd(a, b);
        sub(a, b) = _mm256_sub_pd(a, b);
        mul(a, b) = _mm256_mul_pd(a, b);
        product_error(a, b, product) = _mm256_fmsub_pd(a, b, product);
        abs(a) = _mm256_andnot_pd(_mm256_set1_pd(-0.0), a);
        max(a, b) = _mm256_max_pd(a, b);
        rotate(a) = _mm256_permute4x64_pd::<0b01_00_10_01>(a);
        with_last(a, b) = _mm256_blend_pd::<0b1000>(a, _mm256_movedup_pd(b));
    }
    #[inline(always)]
    fn array(self, a: __m256d) -> [f64; 4] {
        let mut out = [0.0; 4];
        // SAFETY: self proves AVX2, and 32 bytes are stored to an array of 32.
        unsafe { _mm256_storeu_pd(out.as_mut_ptr(), a) };
        out
    }
}
