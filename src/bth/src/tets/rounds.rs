//! The kernel of a batch of tet walks: three groups of sixteen lanes that make one step each in turn.
//!
//! When several lanes of a group have stopped, their results are taken and the lanes are refilled from the queue.

use super::batch::{WalkBatch, WalkStart, vertices};
use super::lanes::{Lanes, Step, float, word};
use super::queue::ReadyQueue;
use super::records::Entered;
use crate::query::Query;
use crate::simd::{Kernel, LANES, Simd};
use bth_format::layout::NONE;

/// A group is refilled when at least this many of its lanes are idle.
const MIN_IDLE_LANES: u32 = 6;

/// A group of sixteen lanes.
#[derive(Clone, Copy)]
struct LaneGroup<S: Simd> {
    lanes: Lanes<S>,
    step: Step<S>,
    /// Bits of the lanes that hold a ray, which may have stopped.
    held: u32,
    /// For each lane the round in which it received its ray.
    since: S::U,
}

/// State that the groups share.
struct Clock {
    /// Number of rounds; in a round each lane makes as many steps as the object has tetrahedra.
    round: u32,
    /// Whether the queue may yield more rays.
    more: bool,
}

impl<Q: Query + Copy> WalkBatch<'_, Q> {
    /// Takes the results of stopped lanes and fills idle lanes from the queue.
    #[inline(always)]
    fn refill<S: Simd>(&mut self, s: S, queue: &mut ReadyQueue, group: &mut LaneGroup<S>, clock: &mut Clock) {
        let active = s.mask_bits(group.lanes.active(s));
        let idle = LANES as u32 - active.count_ones();
        if idle < MIN_IDLE_LANES || !(clock.more || (active == 0 && group.held != 0)) {
            return;
        }
        let stopped = group.held & !active;
        if stopped != 0 {
            self.take_stopped(s, &group.lanes, stopped);
        }
        group.held = active;
        let mut idle = !active & 0xffff;
        while idle != 0 {
            if queue.len() == 0 {
                self.fill(s, queue);
            }
            let taken = queue.pop(s, idle, &mut group.lanes);
            idle &= !taken;
            group.held |= taken;
            group.since = s.select_u(s.mask(taken), s.splat_u(clock.round), group.since);
            clock.more = taken != 0;
            if !clock.more {
                break;
            }
        }
    }

    /// Stops walks that began two rounds ago, and repeats them by a flood. A line passes each tetrahedron at most once, so such a walk
    /// has made more steps than it can need, which happens only with inconsistent data.
    #[inline(always)]
    fn stop_endless<S: Simd>(&mut self, s: S, group: &mut LaneGroup<S>, round: u32) {
        let old = s.and(group.lanes.active(s), s.lt_u(group.since, s.splat_u(round.saturating_sub(1))));
        let mut bits = s.mask_bits(old);
        let mut slot = [0; LANES];
        s.store_u(group.lanes.words[word::SLOT], &mut slot);
        let tet = &mut group.lanes.words[word::TET];
        *tet = s.select_u(old, s.splat_u(NONE), *tet);
        group.held &= !bits;
        while bits != 0 {
            self.flood(slot[bits.trailing_zeros() as usize % LANES]);
            bits &= bits - 1;
        }
    }

    /// Evaluates the lanes whose bit is set in `stopped`.
    #[inline(always)]
    fn take_stopped<S: Simd>(&mut self, s: S, lanes: &Lanes<S>, mut stopped: u32) {
        let (mut words, mut slot, mut depth) = ([[0; LANES]; word::AXIS], [0; LANES], [[0.0; LANES]; 3]);
        macro_rules! store {
            ($($i:literal)*) => { $(s.store_u(lanes.words[$i], &mut words[$i]);)* };
        }
        store!(0 1 2 3 4 5);
        s.store_u(lanes.words[word::SLOT], &mut slot);
        if Q::KEEPS_DEPTHS {
            s.store(lanes.floats[float::DEPTH], &mut depth[0]);
            s.store(lanes.floats[float::DEPTH + 1], &mut depth[1]);
            s.store(lanes.floats[float::DEPTH + 2], &mut depth[2]);
        }
        while stopped != 0 {
            let lane = stopped.trailing_zeros() as usize % LANES;
            stopped &= stopped - 1;
            let word = |name: usize| words[name][lane];
            let entered = Entered {
                face: [word(word::FACE), word(word::FACE + 1), word(word::FACE + 2)],
                apex: word(word::APEX),
                behind: word(word::BEHIND),
            };
            let start = WalkStart { slot: slot[lane], tet: word(word::TET), entered };
            self.evaluate(start, depth.map(|row| row[lane]));
        }
    }
}

impl<Q: Query + Copy> Kernel for &mut WalkBatch<'_, Q> {
    type Output = ();

    /// Walks all rays.
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let records = self.records;
        let vertices = vertices(self.object);
        let mut queue = ReadyQueue::new();
        let idle = LaneGroup { lanes: Lanes::idle(s), step: Step::none(s), held: 0, since: s.splat_u(0) };
        let mut groups = [idle; 3];
        // A line passes each tetrahedron at most once.
        let most = self.object.records.len();
        let mut clock = Clock { round: 0, more: true };
        let mut steps = 0;
        let one = s.splat_u(std::hint::black_box(1));
        loop {
            // This is a loop, so that `refill` is compiled once; the lanes are in memory at this point in any case.
            let mut held = 0;
            for group in &mut groups {
                self.refill(s, &mut queue, group, &mut clock);
                held |= group.held;
            }
            if held == 0 {
                return;
            }
            let [a, b, c] = &mut groups;
            a.lanes.fetch(s, one, &mut a.step, &records, vertices);
            b.lanes.fetch(s, one, &mut b.step, &records, vertices);
            c.lanes.fetch(s, one, &mut c.step, &records, vertices);
            macro_rules! onward {
                ($depths:literal $($group:ident)*) => {
                    $($group.lanes.choose::<$depths>(s, &mut $group.step);)*
                    $($group.lanes.follow::<$depths>(s, one, &$group.step, &records);)*
                };
            }
            if Q::KEEPS_DEPTHS {
                onward!(true a b c);
            } else {
                onward!(false a b c);
            }
            steps += 1;
            if steps == most {
                (clock.round, steps) = (clock.round + 1, 0);
                for group in &mut groups {
                    self.stop_endless(s, group, clock.round);
                }
            }
        }
    }
}
