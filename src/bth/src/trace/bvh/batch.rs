//! Many rays through the wide BVH, a step of each in turn, so that cache misses and mispredictions of one overlap
//! with the work of the others.

use super::flight::{Flight, Found};
use super::landing::Landing;
use super::nodes::{Nodes, prefetch};
use super::stack::{BOTTOM, Place, Stacks};
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use crate::trace::prepare::{Frame, Prepared};
use crate::trace::query::{Deliver, Query};

/// Rays on their way at once.
const IN_FLIGHT: usize = 32;
/// While at least this many rays stand before inner nodes, those before leaves wait.
const ENOUGH: u8 = (IN_FLIGHT / 4) as u8;

/// Slots of rays that wait for the same kind of step.
struct List {
    /// As long as any `u8` reaches; a list is never longer than the rays in flight, plus one.
    slot: [u8; 256],
    len: u8,
}

impl List {
    fn new() -> Self {
        List { slot: [0; 256], len: 0 }
    }
    #[inline(always)]
    fn get(&self, i: u8) -> usize {
        usize::from(self.slot[usize::from(i)]) % IN_FLIGHT
    }
    /// Adds a slot on a condition, without a branch.
    #[inline(always)]
    fn push_if(&mut self, slot: usize, condition: bool) {
        self.slot[usize::from(self.len)] = slot as u8;
        self.len += u8::from(condition);
    }
    /// Empties the list, whose entries can still be read if at most as many are added as were read.
    #[inline(always)]
    fn take(&mut self) -> u8 {
        std::mem::replace(&mut self.len, 0)
    }
}

/// The rays on their way, by what they do next.
struct Lists {
    inner: List,
    leaf: List,
    /// At the bottom of the stack, or before an empty slot of a node.
    bottom: List,
}

impl Lists {
    #[inline(always)]
    fn sort(&mut self, slot: usize, code: u32) {
        let (leaf, bottom) = (code & Child::LEAF_BIT != 0, code >= BOTTOM);
        self.inner.push_if(slot, !leaf);
        self.leaf.push_if(slot, leaf && !bottom);
        self.bottom.push_if(slot, bottom);
    }
}

/// A ray in flight, on cache lines of its own.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Slot<Q>(Flight<Q>);

/// What a step of a ray begins with, apart from the rest of the slots: few cache lines, always at hand.
struct Tops {
    place: [Place; IN_FLIGHT],
    code: [u32; IN_FLIGHT],
}

impl Tops {
    /// Notes the top of a stack; returns the code there.
    #[inline(always)]
    fn set(&mut self, at: usize, top: Place, stacks: &Stacks) -> u32 {
        let code = stacks.code(top);
        (self.place[at], self.code[at]) = (top, code);
        code
    }
}

/// The rays still to be traced.
pub(crate) struct Waiting<'a, Q> {
    /// Places in the batch of those to trace, or all.
    pub(crate) order: Option<&'a [u32]>,
    /// Queries of all rays of the batch, if they have been asked elsewhere already.
    pub(crate) queries: Option<&'a [Q]>,
    /// Per ray of the batch the tet leaf that it has walked already, or `NONE`.
    pub(crate) walked: Option<&'a [u32]>,
}

/// A batch on its way.
pub(crate) struct BatchWalk<'a, Q, D> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    pub(crate) waiting: Waiting<'a, Q>,
    pub(crate) stacks: &'a mut Stacks,
    /// Where answers go.
    pub(crate) to: &'a mut D,
}

/// The next rays, sixteen at a time.
struct Supply {
    /// Where rays start.
    root: u32,
    frame: Frame,
    prepared: Prepared,
    /// Places in the batch of those prepared.
    ray: [u32; LANES],
    /// Lanes that are prepared, and of these those that are gone.
    filled: usize,
    used: usize,
    /// Rays prepared before.
    before: usize,
}

impl<Q: Query, D: Deliver<Q>> BatchWalk<'_, Q, D> {
    /// Traces all rays, and hands on their results. Tet leaves without a subtree are handed to `tets`, which returns whether
    /// the query has what it wants.
    #[inline(always)]
    pub(crate) fn run<S: Simd, N: Nodes>(
        mut self,
        s: S,
        nodes: N,
        mut tets: impl FnMut(u32, &Ray, &mut Q) -> bool,
    ) {
        self.stacks.reserve(self.object, IN_FLIGHT);
        let root = root(self.object);
        let mut supply = Supply {
            root,
            frame: Frame::new(self.object.header),
            prepared: Prepared::new(),
            ray: [0; LANES],
            filled: 0,
            used: 0,
            before: 0,
        };
        let vacant = Q::new(&Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 });
        let mut slots = [Slot(Flight::vacant(vacant)); IN_FLIGHT];
        let mut tops = Tops { place: [Place::NOWHERE; IN_FLIGHT], code: [root; IN_FLIGHT] };
        let mut landing = Landing::new();
        let mut lists = Lists { inner: List::new(), leaf: List::new(), bottom: List::new() };
        for (i, slot) in slots.iter_mut().enumerate() {
            if self.launch(s, &mut supply, i, &mut slot.0, &mut tops) {
                lists.sort(i, root);
            }
        }
        loop {
            self.inner_steps(s, nodes, &slots, &mut tops, &mut lists);
            if lists.leaf.len + lists.bottom.len + lists.inner.len == 0 {
                return landing.clear(s, self.object, self.rays, self.to);
            }
            for i in 0..lists.bottom.take() {
                let at = lists.bottom.get(i);
                if tops.place[at] > self.stacks.bottom(at) {
                    // An empty slot of a node.
                    lists.sort(at, tops.set(at, tops.place[at].below(), self.stacks));
                    continue;
                }
                landing.land(s, self.object, self.rays, &slots[at].0, self.to);
                if self.launch(s, &mut supply, at, &mut slots[at].0, &mut tops) {
                    lists.sort(at, root);
                }
            }
            for i in 0..lists.leaf.take() {
                let at = lists.leaf.get(i);
                let flight = &mut slots[at].0;
                let ray = &self.rays[flight.ray()];
                let (mut indexed, mut raw) = (None, None);
                let (code, top) = (tops.code[at], tops.place[at]);
                let found = match Child::from_code(code) {
                    Some(Child::Indexed(line)) => {
                        let leaf = self.object.indexed(line, &mut indexed);
                        flight.enter_leaf::<S, _, true>(s, self.object, ray, (leaf, code))
                    }
                    Some(Child::Raw(line)) => {
                        let leaf = self.object.raw(line, &mut raw);
                        flight.enter_leaf::<S, _, true>(s, self.object, ray, (leaf, code))
                    }
                    Some(Child::Tets(row)) => {
                        if self.waiting.walked.is_some_and(|walked| walked[flight.ray()] == row) {
                            Found::Nothing
                        } else {
                            enter_tets(self.object, row, ray, (flight, top), self.stacks, &mut tets)
                        }
                    }
                    _ => Found::Nothing,
                };
                let below = top.below();
                let top = match found {
                    // Any-hit queries keep no keys, so nothing can be told of what waits.
                    Found::Nearer if Q::ANY => below,
                    Found::Nothing => below,
                    Found::Again => top,
                    Found::Nearer => self.stacks.keep_up_to(s, at, below, flight.key_limit()),
                    Found::Enough => self.stacks.bottom(at),
                };
                let code = tops.set(at, top, self.stacks);
                prefetch(s, nodes, self.object, code);
                lists.sort(at, code);
            }
        }
    }

    /// Steps through inner nodes until few rays stand before one.
    #[inline(always)]
    fn inner_steps<S: Simd, N: Nodes>(
        &mut self,
        s: S,
        nodes: N,
        slots: &[Slot<Q>; IN_FLIGHT],
        tops: &mut Tops,
        lists: &mut Lists,
    ) {
        while lists.inner.len > 0 {
            for i in 0..lists.inner.take() {
                let at = lists.inner.get(i);
                let (top, node) = (tops.place[at], N::node(self.object, tops.code[at]));
                let count = slots[at].0.enter_node(s, node, self.stacks.room(top));
                let code = tops.set(at, self.stacks.replaced(top, count), self.stacks);
                prefetch(s, nodes, self.object, code);
                lists.sort(at, code);
            }
            if lists.inner.len < ENOUGH && lists.leaf.len + lists.bottom.len > 0 {
                return;
            }
        }
    }

    /// Puts the next ray that can hit anything into a slot; false if there is none.
    #[inline(always)]
    fn launch<S: Simd>(
        &mut self,
        s: S,
        supply: &mut Supply,
        at: usize,
        flight: &mut Flight<Q>,
        tops: &mut Tops,
    ) -> bool {
        loop {
            if supply.used == supply.filled && !self.refill(s, supply) {
                return false;
            }
            let lane = supply.used % LANES;
            supply.used += 1;
            let place = supply.ray[lane];
            let query = self.waiting.queries.map(|queries| queries[place as usize]);
            if let Some(aim) = supply.prepared.aim(lane) {
                flight.launch(aim, query);
            } else {
                let ray = (place, &self.rays[place as usize]);
                if !flight.aim_at(self.object, &supply.frame, ray, query) {
                    continue;
                }
            }
            if query.is_some() {
                flight.take_over();
            }
            tops.place[at] = self.stacks.start(at, supply.root);
            tops.code[at] = supply.root;
            return true;
        }
    }

    /// Prepares the next sixteen rays; false if there are none.
    #[inline(always)]
    fn refill<S: Simd>(&mut self, s: S, supply: &mut Supply) -> bool {
        let total = self.waiting.order.map_or(self.rays.len(), <[u32]>::len);
        let count = (total - supply.before).min(LANES);
        for i in 0..count {
            let place = supply.before + i;
            supply.ray[i] = self.waiting.order.map_or(place as u32, |order| order[place]);
        }
        supply.before += count;
        (supply.used, supply.filled) = (0, count);
        if count > 0 {
            supply.prepared.fill(s, &supply.frame, self.rays, &supply.ray, count);
        }
        count > 0
    }
}

/// Where rays start that need not enter tetrahedra.
fn root(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(row)) if object.tet_leaves[row as usize].subtree != NONE => {
            object.tet_leaves[row as usize].subtree
        }
        _ => object.header.root,
    }
}

#[cold]
#[inline(never)]
fn enter_tets<Q: Query>(
    object: &ObjectView<'_>,
    row: u32,
    ray: &Ray,
    (flight, top): (&mut Flight<Q>, Place),
    stacks: &mut Stacks,
    tets: &mut impl FnMut(u32, &Ray, &mut Q) -> bool,
) -> Found {
    let subtree = object.tet_leaves[row as usize].subtree;
    if subtree != NONE {
        stacks.set_code(top, subtree);
        return Found::Again;
    }
    flight.settle(object, ray);
    let done = tets(row, ray, flight.ask(ray));
    if done { Found::Enough } else { flight.settled(Found::Nothing) }
}
