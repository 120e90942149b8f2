//! Rays at the end of their way whose nearest hit is certain, and where it is still to be computed: sixteen at a time.

use super::flight::Flight;
use crate::layout::{NONE, WIDTH};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use crate::trace::candidate::{Candidate, Reader, settle};
use crate::trace::crossings::{Crossings, Projected};
use crate::trace::query::{Deliver, Query};
use crate::trace::sight::Block;

/// Rays that have ended, up to sixteen.
pub(crate) struct Landing {
    count: usize,
    /// Places in the batch.
    ray: [usize; LANES],
    axis: [[u32; 3]; LANES],
    candidate: [Candidate; LANES],
    projected: Projected,
    crossings: Crossings,
}

/// Notes the corners of a triangle.
struct Note<'a> {
    projected: &'a mut Projected,
    lane: usize,
    axis: [u32; 3],
}

impl Reader for Note<'_> {
    type Output = ();
    #[inline(always)]
    fn read<B: Block>(self, block: &B, triangle: usize) {
        for c in 0..3 {
            for k in 0..3 {
                self.projected.corner[c][k][self.lane] =
                    block.coordinate(triangle % WIDTH, c, self.axis[k] as usize);
            }
        }
    }
}

impl Landing {
    pub(crate) fn new() -> Self {
        Landing {
            count: 0,
            ray: [0; LANES],
            axis: [[0; 3]; LANES],
            candidate: [Candidate::NONE; LANES],
            projected: Projected::NONE,
            crossings: Crossings::NONE,
        }
    }

    /// Takes in a ray at the end of its way, at this place of the batch.
    #[inline(always)]
    pub(crate) fn land<S: Simd, Q: Query>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        flight: &Flight<Q>,
        to: &mut impl Deliver<Q>,
    ) {
        let (at, candidate) = (flight.ray(), flight.waiting());
        if !Q::DEFERS || candidate.leaf == NONE {
            return flight.hand_on(to);
        }
        let (lane, axis) = (self.count % LANES, flight.axis());
        let ray = &rays[at];
        for k in 0..3 {
            self.projected.origin[k][lane] = ray.origin[axis[k] as usize];
            self.projected.direction[k][lane] = ray.direction[axis[k] as usize];
        }
        let note = Note { projected: &mut self.projected, lane, axis };
        let Some((place, ())) = candidate.read(object, note) else { return };
        self.crossings.place[lane] = place;
        self.ray[lane] = at;
        self.axis[lane] = axis;
        self.candidate[lane] = candidate;
        self.count = lane + 1;
        if self.count == LANES {
            self.clear(s, object, rays, to);
        }
    }

    /// Computes the hits of all that have landed, and hands them on.
    #[inline(always)]
    pub(crate) fn clear<S: Simd, Q: Query>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        to: &mut impl Deliver<Q>,
    ) {
        let all = ((1u64 << self.count) - 1) as u32;
        self.count = 0;
        let crossings = &mut self.crossings;
        crossings.compute(s, all, &self.projected);
        for lane in 0..LANES {
            if crossings.certain >> lane & 1 != 0 {
                let (t, u, v) = (crossings.t[lane], crossings.u[lane], crossings.v[lane]);
                to.hit(self.ray[lane], crossings.place[lane], t, u, v);
            }
        }
        let mut rest = all & !crossings.certain;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let ray = &rays[self.ray[lane]];
            let mut query = Q::new(ray);
            settle(object, ray, self.axis[lane], [self.candidate[lane], Candidate::NONE], &mut query);
            to.query(self.ray[lane], &query);
        }
    }
}
