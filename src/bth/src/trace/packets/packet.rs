//! Packets: up to 64 rays that go together through the wide BVH.
//!
//! A node's sixteen children are tested against what all the rays together can meet ([`super::hull`]), and those that
//! remain against the rays, sixteen at a time. f32 lanes leave out what certainly does not matter, as everywhere;
//! a triangle that is certainly hit, and certainly nearer than all before, only takes its place as the one to
//! be computed at the end; what is not certain is decided at once ([`crate::trace::candidate`]).

use super::few::{FEW_OF_ALL, Lone};
use super::group::Group;
use super::hull::Hull;
use super::leaf::{Leaf, Rays};
use super::met::{Looks, Met};
use super::points::{Points, Relative};
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use crate::trace::bvh::flight::KEY_SLACK;
use crate::trace::bvh::nodes::{Wide, prefetch};
use crate::trace::intersections::{Intersections, SeenFromPoint};
use crate::trace::query::Query;
use crate::trace::sink::Sink;
use bth_format::layout::{Child, NONE, WIDTH, WideNode};
use bth_format::limits::MAX_DEPTH;
use bth_format::object::ObjectView;
use std::any::Any;

/// Groups of sixteen rays in a packet.
pub(crate) const GROUPS: usize = 4;
/// Rays in a packet at most.
pub(crate) const PACKET: usize = GROUPS * LANES;

/// A child that waits to be entered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Entry {
    /// Rays that entered the parent; of those that go into different octants, and are asked at once, which meet the box.
    pub(crate) rays: u64,
    /// Line of the parent, and the slot there.
    pub(crate) parent: u32,
    pub(crate) slot: u32,
    /// Lower bound of the depth at which any ray enters it.
    pub(crate) key: f32,
}

/// Memory that packets need, kept from one batch to the next.
#[derive(Debug)]
pub(crate) struct Room {
    stack: Vec<Entry>,
    points: Points,
    relative: Relative,
    lone: Lone,
    pub(crate) met: Met,
    seen: SeenFromPoint,
    crossings: [Intersections; GROUPS],
}

impl Default for Room {
    fn default() -> Self {
        Room {
            stack: Vec::new(),
            points: Points::NONE,
            relative: Relative::NONE,
            lone: Lone::NONE,
            met: Met::NONE,
            seen: SeenFromPoint::NONE,
            crossings: [Intersections::NONE; GROUPS],
        }
    }
}

/// Groups of the instruction set that was last asked for: to clear them for every batch would take as long as to trace a few rays.
#[derive(Debug, Default)]
pub(crate) struct KeptGroups(Option<Box<dyn Any>>);

impl KeptGroups {
    #[inline(always)]
    pub(crate) fn of<S: Simd>(&mut self, s: S) -> &mut [Group<S>; GROUPS] {
        if !self.0.as_ref().is_some_and(|groups| groups.is::<[Group<S>; GROUPS]>()) {
            self.0 = Some(Box::new([Group::vacant(s); GROUPS]));
        }
        self.0.as_mut().and_then(|groups| groups.downcast_mut()).expect("just made")
    }
}

/// The rays of a packet, prepared, and what is decided of them.
pub(crate) struct Packets<'a, S: Simd, Q> {
    pub(crate) groups: &'a mut [Group<S>; GROUPS],
    queries: [Q; PACKET],
    pub(crate) room: &'a mut Room,
}

/// How a packet did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Rays that took part in an average step, per cent.
    Lanes(u32),
    /// There is something that only single rays can do; nothing has been handed on.
    Refused,
}

impl<'a, S: Simd, Q: Query> Packets<'a, S, Q> {
    #[inline(always)]
    pub(crate) fn new(
        object: &ObjectView<'_>,
        groups: &'a mut [Group<S>; GROUPS],
        room: &'a mut Room,
        ray: &Ray,
    ) -> Self {
        // At every level all children but the one entered wait.
        let entries = (object.header.depth as usize).min(MAX_DEPTH) * (WIDTH - 1) + 1 + WIDTH;
        if room.stack.len() < entries {
            room.stack.resize(entries, Entry::default());
        }
        Packets { groups, queries: [Q::new(ray); PACKET], room }
    }

    /// Traces rays for which the groups have been prepared, and hands on the place and query of those that hit
    /// something.
    #[inline(always)]
    pub(crate) fn trace<H: Hull<S>>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        hull: &H,
        rays: &[Ray],
        to: &mut Sink<'_, Q>,
    ) -> Use {
        let Packets { groups, queries, room } = self;
        let Room { stack, points, relative, lone, met, seen, crossings } = &mut **room;
        let groups = &mut groups[..rays.len().div_ceil(LANES)];
        let all = u64::MAX >> (PACKET - rays.len());
        lone.clear();
        let mut rays = Rays { object, rays, queries, lone, met, asked: 0, alive: all };
        if let Some(group) = groups.last_mut() {
            // Lanes without a ray hold nothing up.
            let valid = s.mask((all >> ((rays.rays.len() - 1) / LANES * LANES)) as u32);
            group.limit = s.select(valid, group.limit, s.splat(f32::MIN));
        }
        let mut limit = farthest_limit(s, groups);
        let (mut code, mut mask, mut top) = (object.header.root, all, 0);
        let (mut steps, mut used) = (0u32, 0);
        'steps: loop {
            steps += 1;
            used += mask.count_ones();
            match Child::from_code(code) {
                Some(Child::Node(line)) => {
                    let node = object.node(line);
                    let room = stack[top..].first_chunk_mut().expect("as many levels as the header says");
                    top += if H::MIXED && mask.count_ones() <= FEW_OF_ALL {
                        rays.lone.children(s, groups, mask, (line, node), room)
                    } else {
                        children::<S, H, Q>(s, hull, groups, mask, (line, node), limit, room)
                    };
                }
                Some(Child::Indexed(line)) => {
                    let mut room = None;
                    let leaf = Leaf { block: object.indexed(line, &mut room), code };
                    if rays.enter_leaf(s, hull, groups, (points, relative), &leaf, mask) && !Q::ANY {
                        limit = farthest_limit(s, groups);
                    }
                }
                Some(Child::Raw(line)) => {
                    let mut room = None;
                    let leaf = Leaf { block: object.raw(line, &mut room), code };
                    if rays.enter_leaf(s, hull, groups, (points, relative), &leaf, mask) && !Q::ANY {
                        limit = farthest_limit(s, groups);
                    }
                }
                Some(Child::Tets(row)) => {
                    code = object.tet_leaves[row as usize].subtree;
                    if code == NONE {
                        return Use::Refused;
                    }
                    continue;
                }
                Some(Child::Packed(_)) => return Use::Refused,
                None => {}
            }
            if rays.alive == 0 {
                break;
            }
            loop {
                if top == 0 {
                    break 'steps;
                }
                top -= 1;
                let entry = stack[top];
                mask = entry.rays & rays.alive;
                if mask == 0 || (!Q::ANY && entry.key > limit + limit.abs() * KEY_SLACK) {
                    continue;
                }
                let node = object.node(entry.parent);
                code = node.child[entry.slot as usize % WIDTH];
                prefetch(s, Wide, object.ground(), code);
                // Later: hits may have come between, which leave less of it to meet.
                if !H::MIXED {
                    mask &= meeting(s, hull, groups, mask, node, entry.slot);
                }
                if mask != 0 {
                    break;
                }
            }
        }
        finish::<S, H, Q>(s, groups, (seen, crossings), &mut rays, all, to);
        let steps = u64::from(steps);
        Use::Lanes((u64::from(used) * 100 / (steps * rays.rays.len() as u64)) as u32)
    }
}

/// Writes the children of a node that rays of the packet may meet together before a depth, the nearest last, and of rays that go into
/// different octants which ones do; returns how many.
#[inline(always)]
fn children<S: Simd, H: Hull<S>, Q: Query>(
    s: S,
    hull: &H,
    groups: &[Group<S>],
    rays: u64,
    (parent, node): (u32, &WideNode),
    limit: f32,
    to: &mut [Entry; WIDTH],
) -> usize {
    let slots = s.load_u(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    let (bits, keys) = hull.children(s, node, limit);
    let (mut slot, mut key) = ([0; LANES], [0.0; LANES]);
    let count = if Q::ANY {
        s.compress(bits, slots, &mut slot)
    } else {
        s.compress_far_to_near(bits, keys, slots, &mut slot, &mut key)
    };
    let mut some = 0;
    for i in 0..count {
        let slot = slot[i];
        let rays = if H::MIXED { rays & meeting(s, hull, groups, rays, node, slot) } else { rays };
        to[some % WIDTH] = Entry { rays, parent, slot, key: key[i] };
        some += usize::from(rays != 0);
    }
    some
}

/// Which of these rays, a bit each, meet the box of a child. Groups none of whose rays is asked about are left out.
#[inline(always)]
fn meeting<S: Simd, H: Hull<S>>(
    s: S,
    hull: &H,
    groups: &[Group<S>],
    rays: u64,
    node: &WideNode,
    slot: u32,
) -> u64 {
    let corners = hull.corners(node, slot as usize % WIDTH);
    let mut meets = 0;
    for (i, group) in groups.iter().enumerate() {
        if rays >> (i * LANES) & 0xffff != 0 {
            let bits = group.meets::<H>(s, corners);
            meets |= u64::from(bits) << (i * LANES);
        }
    }
    meets
}

/// Computes what is still to be computed, and hands on what was found.
#[inline(always)]
fn finish<S: Simd, H: Hull<S>, Q: Query>(
    s: S,
    groups: &[Group<S>],
    (seen, crossings): (&mut SeenFromPoint, &mut [Intersections; GROUPS]),
    rays: &mut Rays<'_, Q>,
    all: u64,
    to: &mut Sink<'_, Q>,
) {
    if Q::ANY {
        let mut hit = all & !rays.alive;
        let mut query = Q::new(&rays.rays[0]);
        query.accept();
        while hit != 0 {
            to.query(hit.trailing_zeros() as usize, &query);
            hit &= hit - 1;
        }
        return;
    }
    // First all, then what comes of them: so the divisions of one group overlap with the next.
    let mut looks = Looks { origin: rays.rays[0].origin, ids: rays.object.triangle_ids, met: rays.met, seen };
    for (group, crossings) in groups.iter().zip(&mut *crossings) {
        group.cross::<H>(s, &mut looks, crossings);
    }
    for (i, (group, crossings)) in groups.iter().zip(crossings.iter()).enumerate() {
        let asked = (rays.asked >> (i * LANES)) as u32 & 0xffff;
        let clear = crossings.certain & !asked;
        if clear != 0 {
            to.hits(s, i * LANES, clear, crossings);
        }
        let rest = crossings.open | crossings.certain & asked;
        if rest != 0 {
            rays.settle_last(s, group, i, rest);
        }
    }
    // Those of which something had to be decided alone.
    let mut asked = rays.asked;
    while asked != 0 {
        let ray = asked.trailing_zeros() as usize;
        asked &= asked - 1;
        to.query(ray, &rays.queries[ray]);
    }
}

/// The greatest limit of all rays.
#[inline(always)]
fn farthest_limit<S: Simd>(s: S, groups: &[Group<S>]) -> f32 {
    let mut farthest = groups[0].limit;
    for group in groups {
        farthest = s.max(farthest, group.limit);
    }
    -s.least(s.sub(s.splat(0.0), farthest))
}
