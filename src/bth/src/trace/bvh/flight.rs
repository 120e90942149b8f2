//! A ray on its way through the wide BVH: what it has found, and the two steps it takes, through a node and
//! through a leaf. How many rays are on their way at once, and in which order they step, is not known here.

use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::candidate::{Candidate, open, settle};
use crate::trace::intersection::{Estimate, estimate, wide};
use crate::trace::prepare::{Aim, Noted};
use crate::trace::query::{Named, Query};
use crate::trace::sight::{Block, Candidates, Certain};
use crate::trace::sink::Sink;
use crate::trace::slabs::Boxes;
use bth_format::layout::{NONE, WIDTH};
use bth_format::object::ObjectView;
use zerocopy::FromZeros;

/// What keys of the stack may exceed the true depth by, relative: the four lowest bits of f32. Of denormal numbers less
/// than the least normal one.
pub(crate) const KEY_SLACK: f32 = 1.0 / (1 << 19) as f32;

/// Keys of the stack beyond this are of no interest where nothing beyond a depth is.
#[inline(always)]
pub(crate) fn key_limit(last: f32) -> f32 {
    last + (last.abs() * KEY_SLACK + f32::MIN_POSITIVE)
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Flight<Q> {
    /// Nothing whose depth certainly exceeds its `last` matters any more.
    aim: Aim,
    /// Of rays of which something had to be decided ([`Noted::ASKED`]): for most nothing is ever, and they don't touch it.
    query: Q,
}

/// What a leaf made of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    Nothing,
    /// Something else in the place of the leaf, to be entered now.
    Again,
    /// A nearer hit than before: what waits farther off need not be entered.
    Nearer,
    /// What the query wants.
    Enough,
}

impl<Q: Query> Flight<Q> {
    /// As [`Self::launch`], for a ray that was not prepared; false if it hits nothing whatever there is ([`Aim::in_f64`]).
    #[cold]
    #[inline(never)]
    pub(crate) fn launch_unprepared(
        &mut self,
        object: &ObjectView<'_>,
        (place, ray): (u32, &Ray),
        query: Option<Q>,
    ) -> bool {
        let aim = Aim::of(&object.bounds, ray).or_else(|| Aim::in_f64(object.header, ray));
        aim.map(|aim| self.launch(&Aim { ray: place, ..aim }, query)).is_some()
    }

    /// A place for a ray.
    pub(crate) fn vacant(query: Q) -> Self {
        Flight { aim: Aim { noted: Noted::NOTHING, ..Aim::new_zeroed() }, query }
    }

    /// Takes in a ray that has been prepared, and its query if it has one.
    #[inline(always)]
    pub(crate) fn launch(&mut self, aim: &Aim, query: Option<Q>) {
        self.aim = *aim;
        if let Some(query) = query {
            self.give(query);
        }
    }

    fn give(&mut self, query: Q) {
        (self.query, self.aim.noted.decided) = (query, Noted::ASKED);
    }

    /// Place of the ray in the batch.
    #[inline(always)]
    pub(crate) fn ray(&self) -> usize {
        self.aim.ray as usize
    }

    /// Hands on what has been found, but for what waits to be computed.
    #[inline(always)]
    pub(crate) fn hand_on(&self, to: &mut Sink<'_, Q>) {
        match self.aim.noted.decided {
            Noted::NEVER_ASKED => {}
            Noted::ACCEPTED => {
                let mut query = Q::new(&Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 });
                query.accept();
                to.query(self.ray(), &query);
            }
            _ => to.query(self.ray(), &self.query),
        }
    }

    /// The query: a new one, unless there is one already.
    #[inline(always)]
    pub(crate) fn ask(&mut self, ray: &Ray) -> &mut Q {
        if self.aim.noted.decided == Noted::NEVER_ASKED {
            self.give(Q::new(ray));
        }
        &mut self.query
    }

    /// Takes over what the query has found meanwhile.
    pub(crate) fn take_over(&mut self) {
        self.aim.slabs.last = self.aim.slabs.limit(self.query.limit());
        if Q::DEFERS {
            self.aim.noted.nearest = self.aim.slabs.nearest(&self.query);
        }
    }

    /// What waits to be computed.
    #[inline(always)]
    pub(crate) fn waiting(&self) -> Candidate {
        let Noted { leaf, triangle, .. } = self.aim.noted;
        Candidate { leaf, triangle: triangle.into() }
    }

    /// Computes what waits.
    #[inline(always)]
    pub(crate) fn settle(&mut self, object: &ObjectView<'_>, ray: &Ray) {
        if Q::DEFERS && self.aim.noted.leaf != NONE {
            let waiting = self.waiting();
            self.aim.noted.leaf = NONE;
            settle(object, ray, [waiting, Candidate::NONE], self.ask(ray));
        }
    }

    /// Keys of the stack beyond this are of no interest any more.
    #[inline(always)]
    pub(crate) fn key_limit(&self) -> f32 {
        key_limit(self.aim.slabs.last)
    }

    /// Writes the children of a node that the ray may meet, the nearest last, and returns how many.
    #[inline(always)]
    pub(crate) fn enter_node<S: Simd, B: Boxes>(
        &self,
        s: S,
        node: &B,
        to: (&mut [u32; WIDTH], &mut [f32; WIDTH]),
    ) -> usize {
        let (bits, enter) = self.aim.slabs.children(s, node, self.aim.slabs.last);
        write_children::<S, Q, B>(s, node, (bits, enter), to)
    }

    /// Tests the triangles of a leaf with this code. Of the rays of the batch only its own is looked up, and only if it must be.
    #[inline(always)]
    pub(crate) fn enter_leaf<S: Simd, B: Block>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        (block, code): (&B, u32),
    ) -> Found {
        let found = self.aim.sight.candidates(s, block, self.aim.slabs.first, self.aim.slabs.last);
        if found.maybe == 0 {
            return Found::Nothing;
        }
        if Q::ANY && found.sure != 0 {
            self.aim.noted.decided = Noted::ACCEPTED;
            return Found::Enough;
        }
        if Q::DEFERS {
            return self.defer(s, object, rays, (block, code), found);
        }
        self.decide(s, object, &rays[self.ray()], block, found.maybe)
    }

    /// Notes the nearest hit of a leaf if that is certain, and nearer than all before; else decides.
    #[inline(always)]
    fn defer<S: Simd, B: Block>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        (block, code): (&B, u32),
        found: Candidates<S>,
    ) -> Found {
        let (maybe, certain) = found.nearest_of_all(s);
        if let Some(Certain { triangle, near, far }) = certain
            && far < self.aim.noted.nearest
        {
            let place = (block.first() as usize).wrapping_add(triangle);
            s.prefetch(object.triangle_ids.as_ptr().wrapping_add(place));
            let noted = &mut self.aim.noted;
            (noted.nearest, noted.leaf, noted.triangle) = (near, code, triangle as u16);
            let nearer = far < self.aim.slabs.last;
            if nearer {
                self.aim.slabs.last = far;
                return Found::Nearer;
            }
            return Found::Nothing;
        }
        let ray = &rays[self.ray()];
        self.settle(object, ray);
        self.decide(s, object, ray, block, maybe)
    }

    /// Offers the candidates of a leaf, a bit each, to the query, as f64 and exact arithmetic see them.
    #[inline(always)]
    fn decide<S: Simd, B: Block>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        ray: &Ray,
        block: &B,
        mut bits: u32,
    ) -> Found {
        self.ask(ray);
        let (origin, direction) = (wide(ray.origin), wide(ray.direction));
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % WIDTH;
            bits &= bits - 1;
            let corners = block.corners(i);
            let crossing = match estimate(origin, direction, corners.map(wide)) {
                Estimate::Missed => None,
                Estimate::Crossed(crossing) => Some(crossing),
                Estimate::Open(_, t) if !self.query.cares(t) => None,
                Estimate::Open(..) => open(ray, corners),
            };
            let Some(crossing) = crossing else { continue };
            let place = block.first() + i as u32;
            s.prefetch(object.triangle_ids.as_ptr().wrapping_add(place as usize));
            if self.query.offer(Named::place(place, object.triangle_ids), crossing) {
                return Found::Enough;
            }
        }
        self.settled(Found::Nothing)
    }

    /// Takes over what the query has found, and says what that means.
    #[inline(always)]
    pub(crate) fn settled(&mut self, otherwise: Found) -> Found {
        // Any hit ends the query; until then nothing changes. (And the stack has no keys.)
        if Q::ANY {
            return otherwise;
        }
        let limit = self.aim.slabs.last;
        self.take_over();
        if self.aim.slabs.last < limit { Found::Nearer } else { otherwise }
    }
}

/// Writes the children of a node whose bits are set, the nearest last; returns how many.
#[inline(always)]
pub(crate) fn write_children<S: Simd, Q: Query, B: Boxes>(
    s: S,
    node: &B,
    (bits, enter): (u32, S::F),
    (codes, keys): (&mut [u32; WIDTH], &mut [f32; WIDTH]),
) -> usize {
    let children = s.load_u(node.child());
    if Q::ANY {
        s.compress(bits, children, codes)
    } else {
        s.compress_far_to_near(bits, enter, children, codes, keys)
    }
}
