//! Vectors of four f64, for arithmetic on one pair of a ray and a triangle.

/// Operations on vectors of four f64. As for [`Simd`](super::Simd), an implementation is a token
/// that proves the instructions.
pub trait Doubles: Copy + 'static {
    /// Four f64.
    type V: Copy;
    /// Converts four f32, which is exact.
    fn widen(self, a: [f32; 4]) -> Self::V;
    /// These four numbers.
    fn load(self, a: [f64; 4]) -> Self::V;
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    fn sub(self, a: Self::V, b: Self::V) -> Self::V;
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// The exact error of `product`, the rounded product of `a` and `b`: a·b - `product`.
    fn product_error(self, a: Self::V, b: Self::V, product: Self::V) -> Self::V;
    fn abs(self, a: Self::V) -> Self::V;
    /// The greater; `b` where either is NaN.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
    /// Elements 1, 2, 0 and 1.
    fn rotate(self, a: Self::V) -> Self::V;
    /// The first three elements of `a`, and element 2 of `b` as the last.
    fn with_last(self, a: Self::V, b: Self::V) -> Self::V;
    fn array(self, a: Self::V) -> [f64; 4];
}

/// Plain code.
#[derive(Clone, Copy, Debug)]
pub struct PlainDoubles;

/// The error of a product by Dekker's splitting, without a fused operation.
#[inline(always)]
fn product_error(a: f64, b: f64, product: f64) -> f64 {
    let split = |x: f64| {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    };
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    al * bl - (((product - ah * bh) - al * bh) - ah * bl)
}

/// One operation on each element.
macro_rules! elementwise {
    ($($name:ident($($arg:ident),*) = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: [f64; 4]),*) -> [f64; 4] {
            let element = |i: usize| { $(let $arg = $arg[i];)* $do };
            [element(0), element(1), element(2), element(3)]
        }
    )* };
}

impl Doubles for PlainDoubles {
    type V = [f64; 4];
    #[inline(always)]
    fn widen(self, a: [f32; 4]) -> [f64; 4] {
        [a[0].into(), a[1].into(), a[2].into(), a[3].into()]
    }
    #[inline(always)]
    fn load(self, a: [f64; 4]) -> [f64; 4] {
        a
    }
    elementwise! {
        add(a, b) = a + b;
        sub(a, b) = a - b;
        mul(a, b) = a * b;
        product_error(a, b, product) = product_error(a, b, product);
        abs(a) = a.abs();
        max(a, b) = if a > b { a } else { b };
    }
    #[inline(always)]
    fn rotate(self, a: [f64; 4]) -> [f64; 4] {
        [a[1], a[2], a[0], a[1]]
    }
    #[inline(always)]
    fn with_last(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0], a[1], a[2], b[2]]
    }
    #[inline(always)]
    fn array(self, a: [f64; 4]) -> [f64; 4] {
        a
    }
}
