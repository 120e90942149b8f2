//! A ray on its way through the wide BVH: what it has found, and the two steps it takes, through a node and
//! through a leaf. How many rays are on their way at once, and in which order they step, is not known here.

use super::crossing::{Crossing, Estimate, estimate};
use super::line::Line;
use super::prepare::Prepared;
use super::query::Query;
use super::sight::{Block, Sight};
use super::slabs::Slabs;
use super::stack::Stack;
use crate::layout::WIDTH;
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::Simd;

/// What keys of the stack may exceed the true t by, relative: the four lowest bits of f32.
const KEY_SLACK: f32 = 1.0 / (1 << 19) as f32;

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flight<Q> {
    slabs: Slabs,
    sight: Sight,
    /// Nothing whose scaled t certainly exceeds this matters.
    limit: f32,
    query: Q,
}

impl<Q: Query> Flight<Q> {
    /// None if the ray hits nothing whatever there is: see [`Line::new`], or an empty range of t.
    pub(crate) fn new(object: &ObjectView<'_>, ray: &Ray, query: Q) -> Option<Self> {
        let line = Line::new(ray)?;
        if ray.tmin.partial_cmp(&ray.tmax).is_none_or(|o| o.is_gt()) {
            return None;
        }
        let slabs = Slabs::new(ray, &line, object.header);
        let sight = Sight::new(ray, &line, &slabs, object.header);
        let mut flight = Flight { slabs, sight, limit: 0.0, query };
        flight.take_over();
        Some(flight)
    }

    /// A place for a ray.
    pub(crate) fn vacant(query: Q) -> Self {
        let (slabs, sight) = (Slabs::VACANT, Sight::VACANT);
        Flight { slabs, sight, limit: 0.0, query }
    }

    /// Takes in a ray that has been prepared; false if it has not.
    #[inline(always)]
    pub(crate) fn launch(&mut self, prepared: &Prepared, lane: usize) -> bool {
        prepared.write(lane, &mut self.slabs, &mut self.sight, &mut self.limit)
    }

    #[inline(always)]
    pub(crate) fn query(&mut self) -> &mut Q {
        &mut self.query
    }

    /// Takes over what the query has found meanwhile.
    pub(crate) fn take_over(&mut self) {
        self.limit = self.slabs.limit(self.query.limit());
    }

    /// Replaces the node on top of the stack by its children that the ray may meet, the nearest on top.
    #[inline(always)]
    pub(crate) fn enter_node<S: Simd>(
        &self,
        s: S,
        object: &ObjectView<'_>,
        line: u32,
        stack: &mut Stack<'_>,
    ) {
        let node = object.node(line);
        let (bits, enter) = self.slabs.children(s, node, self.limit);
        let codes = s.load_u(&node.child);
        let (to, keys) = stack.top::<WIDTH>();
        let count = if Q::ANY {
            s.compress(bits, codes, to)
        } else {
            s.compress_far_to_near(bits, enter, codes, to, keys)
        };
        stack.replace_top(count);
    }

    /// Tests the triangles of the leaf on top of the stack and drops it; true if the query has what it wants.
    #[inline(always)]
    pub(crate) fn enter_leaf<S: Simd, B: Block>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        ray: &Ray,
        block: &B,
        stack: &mut Stack<'_>,
    ) -> bool {
        stack.pop();
        let found = self.sight.candidates(s, block, self.slabs.tmin, self.limit);
        if found.maybe == 0 {
            return false;
        }
        if Q::ANY && found.sure != 0 {
            self.query.accept();
            return true;
        }
        let limit = self.limit;
        let done = self.decide(object, ray, block, found.maybe);
        if !Q::ANY && self.limit < limit {
            stack.keep_up_to(s, self.limit + self.limit.abs() * KEY_SLACK);
        }
        done
    }

    /// Offers the candidates of a leaf, a bit each, to the query, as f64 and exact arithmetic see them.
    #[inline(always)]
    fn decide<B: Block>(&mut self, object: &ObjectView<'_>, ray: &Ray, block: &B, mut bits: u32) -> bool {
        let axis = self.sight.axis;
        let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            origin[k] = ray.origin[axis[k] as usize].into();
            direction[k] = ray.direction[axis[k] as usize].into();
        }
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % WIDTH;
            bits &= bits - 1;
            let crossing = match estimate(origin, direction, block.corners_along(axis, i)) {
                Estimate::Missed => None,
                Estimate::Crossed(crossing) => Some(crossing),
                Estimate::Open(..) => open(ray, block.corners(i)),
            };
            let Some(crossing) = crossing else { continue };
            if self.query.offer(object.triangle_ids[block.first() as usize + i], crossing) {
                return true;
            }
        }
        self.take_over();
        false
    }
}

/// What f64 leaves open.
#[cold]
#[inline(never)]
fn open(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Crossing> {
    Line::new(ray)?.crossing(corners)
}
