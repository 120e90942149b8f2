//! Packet bounds of short rays that lie close together: a box.

use super::bounds::{FrustumView, PacketBounds};
use crate::intersect::vector::splat3;
use crate::simd::Simd;
use bth_format::layout::{WIDTH, WideNode};

/// A box of all points at which the rays can hit something
/// ([`Span::segments`](crate::coherence::Span::segments)).
pub(crate) struct SegmentBox<S: Simd> {
    lower: [S::F; 3],
    upper: [S::F; 3],
}

impl<S: Simd> SegmentBox<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, [lower, upper]: [[f32; 3]; 2]) -> Self {
        SegmentBox { lower: splat3(s, lower), upper: splat3(s, upper) }
    }
}

impl<S: Simd> PacketBounds<S> for SegmentBox<S> {
    const MIXED_OCTANTS: bool = true;
    const COMMON_ORIGIN: bool = false;
    const IS_ANY: Option<bool> = Some(true);

    #[inline(always)]
    fn view(&self) -> Option<&FrustumView> {
        None
    }

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, _limit: f32) -> (u32, S::F) {
        let mut bits = 0xffff;
        for k in 0..3 {
            bits &= s.mask_bits(s.le(s.load(&node.bounds[k][0]), self.upper[k]));
            bits &= s.mask_bits(s.le(self.lower[k], s.load(&node.bounds[k][1])));
        }
        (bits, s.splat(f32::NEG_INFINITY))
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let mut out = s.splat_u(0);
        for k in 0..3 {
            let (above, below) = (s.lt(self.upper[k], rows[k]), s.lt(rows[k], self.lower[k]));
            out = s.or_u(out, s.select_u(above, s.splat_u(1 << (2 * k)), s.splat_u(0)));
            out = s.or_u(out, s.select_u(below, s.splat_u(2 << (2 * k)), s.splat_u(0)));
        }
        out
    }

    #[inline(always)]
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2] {
        let mut out = [[0.0; 3]; 2];
        for k in 0..3 {
            out[0][k] = node.bounds[k][0][slot % WIDTH];
            out[1][k] = node.bounds[k][1][slot % WIDTH];
        }
        out
    }
}
