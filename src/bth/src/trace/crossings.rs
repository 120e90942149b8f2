//! Where sixteen rays cross the triangles that f32 is sure they hit: in f64, all at once.

use super::crossing::weigh;
use super::query::reported;
use crate::simd::{LANES, Simd};

/// Sixteen of a number.
pub(crate) type Many = [f32; LANES];

/// Sixteen rays and a triangle of each, along the axes of each ray's projection ([`super::line`]).
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Projected {
    pub(crate) origin: [Many; 3],
    pub(crate) direction: [Many; 3],
    /// `[corner][axis]`.
    pub(crate) corner: [[Many; 3]; 3],
}

impl Projected {
    pub(crate) const NONE: Projected =
        Projected { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], corner: [[[0.0; LANES]; 3]; 3] };
}

/// What f64 makes of the triangles that wait to be computed.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Crossings {
    /// In leaf order.
    pub(crate) place: [u32; LANES],
    pub(crate) t: Many,
    pub(crate) u: Many,
    pub(crate) v: Many,
    /// Lanes that certainly cross theirs, at t, u and v, which are rounded for the answer. (They lie in the rays' ranges,
    /// else the triangles would have been decided upon at once.)
    pub(crate) certain: u32,
    /// The others, which must be looked at one by one. (f32 was sure of all of them, so none is certainly missed.)
    pub(crate) open: u32,
}

impl Crossings {
    pub(crate) const NONE: Crossings = Crossings {
        certain: 0,
        open: 0,
        place: [0; LANES],
        t: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
    };

    /// Computes those of lanes whose bit is set; their places are left as they are.
    #[inline(always)]
    pub(crate) fn compute<S: Simd>(&mut self, s: S, lanes: u32, projected: &Projected) {
        let Projected { origin, direction, corner } = projected;
        let mut certain = [0; LANES];
        // Without branches, so that it is compiled to vectors.
        for i in 0..LANES {
            let at = |rows: &[Many; 3]| [rows[0][i].into(), rows[1][i].into(), rows[2][i].into()];
            let corners = [at(&corner[0]), at(&corner[1]), at(&corner[2])];
            let weighed = weigh(at(origin), at(direction), corners);
            let [_, b, c] = weighed.weight;
            certain[i] = u32::from(weighed.verdict().crossed);
            self.t[i] = reported(weighed.t);
            self.u[i] = reported(b * weighed.share);
            self.v[i] = reported(c * weighed.share);
        }
        self.certain = s.mask_bits(s.lt_u(s.splat_u(0), s.load_u(&certain))) & lanes;
        self.open = lanes & !self.certain;
    }
}
