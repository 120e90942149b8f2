//! A ray on its way through the wide BVH: what it has found, and the two steps it takes, through a node and
//! through a leaf. How many rays are on their way at once, and in which order they step, is not known here.

use super::leaf::Progress;
use crate::bvh::candidate::Candidate;
use crate::intersect::boxes::ChildBoxes;
use crate::intersect::prepare::{HitProgress, PreparedRay};
use crate::query::Query;
use crate::query::sink::Sink;
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::WIDTH;
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
pub(crate) struct RayState<Q> {
    /// Nothing whose depth certainly exceeds its `last` matters any more.
    prepared: PreparedRay,
    /// Of rays of which something had to be decided ([`HitProgress::BY_QUERY`]): for most nothing is ever, and they don't touch it.
    query: Q,
}

impl<Q: Query> RayState<Q> {
    /// As [`Self::start`], for a ray that was not prepared; false if it hits nothing whatever there is ([`PreparedRay::in_f64`]).
    #[cold]
    #[inline(never)]
    pub(crate) fn start_unprepared(
        &mut self,
        object: &ObjectView<'_>,
        (place, ray): (u32, &Ray),
        query: Option<Q>,
    ) -> bool {
        let prepared =
            PreparedRay::of(&object.bounds, ray).or_else(|| PreparedRay::in_f64(object.header, ray));
        prepared.map(|prepared| self.start(&PreparedRay { ray: place, ..prepared }, query)).is_some()
    }

    /// A place for a ray.
    pub(crate) fn vacant(query: Q) -> Self {
        RayState {
            prepared: PreparedRay { progress: HitProgress::NOTHING, ..PreparedRay::new_zeroed() },
            query,
        }
    }

    /// Takes in a ray that has been prepared, and its query if it has one.
    #[inline(always)]
    pub(crate) fn start(&mut self, prepared: &PreparedRay, query: Option<Q>) {
        self.prepared = *prepared;
        if let Some(query) = query {
            self.give(query);
        }
    }

    fn give(&mut self, query: Q) {
        (self.query, self.prepared.progress.decided) = (query, HitProgress::BY_QUERY);
    }

    /// StackPosition of the ray in the batch.
    #[inline(always)]
    pub(crate) fn ray(&self) -> usize {
        self.prepared.ray as usize
    }

    /// Hands on what has been found, but for what waits to be computed.
    #[inline(always)]
    pub(crate) fn report(&self, to: &mut Sink<'_, Q>) {
        match self.prepared.progress.decided {
            HitProgress::UNDECIDED => {}
            HitProgress::ACCEPTED => {
                let mut query = Q::new(&Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 });
                query.accept();
                to.query(self.ray(), &query);
            }
            _ => to.query(self.ray(), &self.query),
        }
    }

    /// Keys of the stack beyond this are of no interest any more.
    #[inline(always)]
    pub(crate) fn key_limit(&self) -> f32 {
        key_limit(self.prepared.slabs.last)
    }

    /// Writes the children of a node that the ray may meet, the nearest last, and returns how many.
    #[inline(always)]
    pub(crate) fn enter_node<S: Simd, B: ChildBoxes>(
        &self,
        s: S,
        node: &B,
        to: (&mut [u32; WIDTH], &mut [f32; WIDTH]),
    ) -> usize {
        let (bits, enter) = self.prepared.slabs.children(s, node, self.prepared.slabs.last);
        write_children::<S, Q, B>(s, node, (bits, enter), to)
    }
}

impl<Q: Query> Progress<Q> for RayState<Q> {
    #[inline(always)]
    fn prepared(&self) -> &PreparedRay {
        &self.prepared
    }
    #[inline(always)]
    fn last(&self) -> f32 {
        self.prepared.slabs.last
    }
    #[inline(always)]
    fn set_last(&mut self, last: f32) {
        self.prepared.slabs.last = last;
    }
    #[inline(always)]
    fn nearest(&self) -> f32 {
        self.prepared.progress.nearest
    }
    #[inline(always)]
    fn set_nearest(&mut self, nearest: f32) {
        self.prepared.progress.nearest = nearest;
    }
    #[inline(always)]
    fn pending(&self) -> Candidate {
        let HitProgress { leaf, triangle, .. } = self.prepared.progress;
        Candidate { leaf, triangle: triangle.into() }
    }
    #[inline(always)]
    fn set_pending(&mut self, pending: Candidate) {
        (self.prepared.progress.leaf, self.prepared.progress.triangle) =
            (pending.leaf, pending.triangle as u16);
    }
    #[inline(always)]
    fn query(&mut self, ray: &Ray) -> &mut Q {
        if self.prepared.progress.decided == HitProgress::UNDECIDED {
            self.give(Q::new(ray));
        }
        &mut self.query
    }
    #[inline(always)]
    fn accept(&mut self) {
        self.prepared.progress.decided = HitProgress::ACCEPTED;
    }
}

/// Writes the children of a node whose bits are set, the nearest last; returns how many.
#[inline(always)]
pub(crate) fn write_children<S: Simd, Q: Query, B: ChildBoxes>(
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
