//! A ray on its way through the wide BVH: what it has found, and the two steps it takes, through a node and
//! through a leaf. How many rays are on their way at once, and in which order they step, is not known here.

use crate::layout::{NONE, WIDTH};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::candidate::{Candidate, open, settle};
use crate::trace::crossing::{Crossing, Estimate, estimate, wide};
use crate::trace::line::Line;
use crate::trace::prepare::{Aim, Frame, Noted};
use crate::trace::query::{Deliver, Named, Query};
use crate::trace::quick::Test;
use crate::trace::sight::{Block, Candidates, Sight};
use crate::trace::slabs::{Boxes, Slabs};
use zerocopy::FromZeros;

/// What keys of the stack may exceed the true depth by, relative: the four lowest bits of f32. Of denormal numbers less
/// than the least normal one.
pub(crate) const KEY_SLACK: f32 = 1.0 / (1 << 19) as f32;

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
    /// Takes in a ray, and its query if it has one; false if it hits nothing whatever there is: see [`Line::new`], or an empty
    /// range of t.
    #[inline(always)]
    pub(crate) fn aim_at(
        &mut self,
        object: &ObjectView<'_>,
        frame: &Frame,
        (place, ray): (u32, &Ray),
        query: Option<Q>,
    ) -> bool {
        let hits = self.aim.set(frame, ray) || self.aim_in_f64(object, ray);
        (self.aim.ray, self.aim.noted) = (place, Noted::NOTHING);
        if let Some(query) = query {
            self.give(query);
        }
        hits
    }

    /// As [`Self::aim_at`], for rays that f32 can't prepare too.
    #[cold]
    #[inline(never)]
    fn aim_in_f64(&mut self, object: &ObjectView<'_>, ray: &Ray) -> bool {
        let Some(line) = Line::new(ray) else { return false };
        let slabs = Slabs::new(ray, &line, object.header);
        let sight = Sight::new(ray, &line, &slabs, object.header);
        self.aim = Aim::new(slabs, sight);
        ray.tmin <= ray.tmax
    }

    /// A place for a ray.
    pub(crate) fn vacant(query: Q) -> Self {
        Flight { aim: Aim::new_zeroed(), query }
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

    /// The query of a ray that was given one.
    #[inline(always)]
    pub(crate) fn query(&mut self) -> &mut Q {
        &mut self.query
    }

    /// Hands on what has been found, but for what waits to be computed.
    #[inline(always)]
    pub(crate) fn hand_on(&self, to: &mut impl Deliver<Q>) {
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
        let limit = self.query.limit();
        self.aim.slabs.last = self.aim.slabs.limit(limit);
        if Q::DEFERS
            && let Some(t) = self.query.found()
        {
            // As far below as the limit lies above.
            self.aim.noted.nearest =
                (((2.0 * t - limit) * f64::from(self.aim.slabs.scale)) as f32).next_down();
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
        self.aim.slabs.last + (self.aim.slabs.last.abs() * KEY_SLACK + f32::MIN_POSITIVE)
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

    /// The child of a node to enter next, of those that the ray may meet, and how many others there are: those are written,
    /// the nearest last. Which is next is found beside the sorting of the others, not after it.
    #[inline(always)]
    pub(crate) fn nearest_child<S: Simd, B: Boxes>(
        &self,
        s: S,
        node: &B,
        (codes, keys): (&mut [u32; WIDTH], &mut [f32; WIDTH]),
    ) -> Option<(u32, usize)> {
        let (bits, enter) = self.aim.slabs.children(s, node, self.aim.slabs.last);
        if bits == 0 {
            return None;
        }
        let first = bits.trailing_zeros() as usize;
        if bits & (bits - 1) == 0 {
            return Some((node.child()[first % WIDTH], 0));
        }
        let children = s.load_u(node.child());
        if Q::ANY {
            return Some((node.child()[first % WIDTH], s.compress(bits & (bits - 1), children, codes)));
        }
        let nearest = nearest_lane(s, bits, enter) % WIDTH;
        let others = bits & !(1 << nearest);
        Some((node.child()[nearest], s.compress_far_to_near(others, enter, children, codes, keys)))
    }

    /// Tests the triangles of a leaf with this code. Of the rays of the batch only its own is looked up, and only if it must be.
    #[inline(always)]
    pub(crate) fn enter_leaf<S: Simd, B: Block, const DEFER: bool>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        (block, code): (&B, u32),
    ) -> Found {
        if Q::TEST != Test::Exact {
            return self.enter_leaf_quickly(s, object, &rays[self.ray()], block);
        }
        let found = self.aim.sight.candidates(s, block, self.aim.slabs.first, self.aim.slabs.last);
        if found.maybe == 0 {
            return Found::Nothing;
        }
        if Q::ANY && found.sure != 0 {
            if DEFER {
                self.aim.noted.decided = Noted::ACCEPTED;
            } else {
                self.query.accept();
            }
            return Found::Enough;
        }
        if DEFER && Q::DEFERS {
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
        let Candidates { mut maybe, sure, nearest, farthest } = found;
        if maybe & (maybe - 1) != 0 && sure != 0 {
            let least = s.least(s.select(s.mask(sure), farthest, s.splat(f32::MAX)));
            maybe &= s.mask_bits(s.le(nearest, s.splat(least)));
        }
        if maybe & (maybe - 1) == 0 && maybe & sure != 0 {
            let (mut near, mut far) = ([0.0; WIDTH], [0.0; WIDTH]);
            s.store(nearest, &mut near);
            s.store(farthest, &mut far);
            let triangle = maybe.trailing_zeros() as usize % WIDTH;
            if far[triangle] < self.aim.noted.nearest {
                let place = (block.first() as usize).wrapping_add(triangle);
                s.prefetch(object.triangle_ids.as_ptr().wrapping_add(place));
                let noted = &mut self.aim.noted;
                (noted.nearest, noted.leaf, noted.triangle) = (near[triangle], code, triangle as u16);
                let nearer = far[triangle] < self.aim.slabs.last;
                if nearer {
                    self.aim.slabs.last = far[triangle];
                    return Found::Nearer;
                }
                return Found::Nothing;
            }
        }
        let ray = &rays[self.ray()];
        self.settle(object, ray);
        self.decide(s, object, ray, block, maybe)
    }

    /// As [`Self::enter_leaf`], as f32 sees the triangles.
    #[inline(always)]
    fn enter_leaf_quickly<S: Simd, B: Block>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        ray: &Ray,
        block: &B,
    ) -> Found {
        let Some(found) =
            self.aim.sight.nearby(s, block, ray, Q::TEST, self.aim.slabs.last, self.aim.slabs.scale)
        else {
            return Found::Nothing;
        };
        let weight = [found.weight[0].into(), found.weight[1].into(), 1.0];
        let place = block.first() + found.triangle as u32;
        self.ask(ray).offer(Named::place(place, object.triangle_ids), Crossing { t: found.t.into(), weight });
        self.settled(Found::Nothing)
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

/// The lane of the least key among those whose bit is set, but for the lowest bits of keys. Negative keys may seem in any
/// order.
#[inline(always)]
fn nearest_lane<S: Simd>(s: S, bits: u32, key: S::F) -> usize {
    const LANE: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
    let low = WIDTH as u32 - 1;
    let key = s.or_u(s.and_u(s.bits(key), s.splat_u(!low)), s.load_u(&LANE));
    let key = s.select(s.mask(bits), s.floats(key), s.splat(f32::MAX));
    (s.least(key).to_bits() & low) as usize
}
