//! The kernel of a batch of tet walks: three groups of sixteen lanes, whose steps are interleaved
//! so that their gathers overlap.
//!
//! When several lanes of a group have stopped, their results are evaluated and the lanes are
//! refilled from the queue.

use super::batch::WalkBatch;
use super::lanes::{Lanes, Step, float, word};
use super::queue::PreparedQueue;
use super::walk::Entered;
use super::walks::{WalkStart, Walks, vertices};
use crate::simd::{Kernel, LANES, Simd};
use bth_format::layout::NONE;

/// A group is refilled when at least this many of its lanes are idle.
const MIN_IDLE_LANES: u32 = 6;

/// A group of sixteen lanes.
#[derive(Clone, Copy)]
struct LaneGroup<S: Simd> {
    lanes: Lanes<S>,
    step: Step<S>,
    /// Bits of the lanes that hold a ray, including those that have stopped and are not yet
    /// evaluated.
    held: u32,
    /// For each lane the round in which it received its ray.
    start_round: S::U,
}

/// State of the kernel that the groups share.
struct RefillState {
    /// Number of completed rounds. In a round each lane makes as many steps as the object has
    /// tetrahedra.
    round: u32,
    /// True if the batch may have rays that no lane holds yet.
    rays_left: bool,
}

impl WalkBatch<'_> {
    /// Evaluates stopped lanes and fills idle lanes from the queue, if enough lanes are idle.
    #[inline(always)]
    fn refill<S: Simd>(
        &mut self,
        s: S,
        queue: &mut PreparedQueue,
        group: &mut LaneGroup<S>,
        state: &mut RefillState,
    ) {
        let active = s.mask_bits(group.lanes.active(s));
        let idle = LANES as u32 - active.count_ones();
        if idle < MIN_IDLE_LANES || !(state.rays_left || (active == 0 && group.held != 0)) {
            return;
        }
        let stopped = group.held & !active;
        if stopped != 0 {
            self.evaluate_stopped(s, &group.lanes, stopped);
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
            group.start_round = s.select_u(s.mask(taken), s.splat_u(state.round), group.start_round);
            state.rays_left = taken != 0;
            if !state.rays_left {
                break;
            }
        }
    }

    /// Stops walks that began two rounds ago, and repeats them by a flood. A line passes each
    /// tetrahedron at most once, so such a walk has made more steps than any line needs, which
    /// happens only if the data are inconsistent.
    #[inline(always)]
    fn stop_overlong<S: Simd>(&mut self, s: S, group: &mut LaneGroup<S>, round: u32) {
        let overlong =
            s.and(group.lanes.active(s), s.lt_u(group.start_round, s.splat_u(round.saturating_sub(1))));
        let mut bits = s.mask_bits(overlong);
        let mut rays = [0; LANES];
        s.store_u(group.lanes.words[word::RAY], &mut rays);
        let tet = &mut group.lanes.words[word::TET];
        *tet = s.select_u(overlong, s.splat_u(NONE), *tet);
        group.held &= !bits;
        while bits != 0 {
            self.flood(rays[bits.trailing_zeros() as usize % LANES]);
            bits &= bits - 1;
        }
    }

    /// Evaluates the lanes whose bit is set in `stopped`.
    #[inline(always)]
    fn evaluate_stopped<S: Simd>(&mut self, s: S, lanes: &Lanes<S>, mut stopped: u32) {
        let (mut words, mut rays, mut depth) = ([[0; LANES]; word::AXIS], [0; LANES], [[0.0; LANES]; 3]);
        macro_rules! store {
            ($($i:literal)*) => { $(s.store_u(lanes.words[$i], &mut words[$i]);)* };
        }
        store!(0 1 2 3 4);
        s.store_u(lanes.words[word::RAY], &mut rays);
        if self.walks.keeps_depths {
            s.store(lanes.floats[float::DEPTH], &mut depth[0]);
            s.store(lanes.floats[float::DEPTH + 1], &mut depth[1]);
            s.store(lanes.floats[float::DEPTH + 2], &mut depth[2]);
        }
        while stopped != 0 {
            let lane = stopped.trailing_zeros() as usize % LANES;
            stopped &= stopped - 1;
            let word = |index: usize| words[index][lane];
            let entered = Entered {
                face: [word(word::FACE), word(word::FACE + 1), word(word::FACE + 2)],
                apex: word(word::APEX),
            };
            let start = WalkStart { ray: rays[lane], tet: word(word::TET), entered };
            self.evaluate(start, depth.map(|row| row[lane]));
        }
    }
}

impl Kernel for &mut WalkBatch<'_> {
    const SCALAR: bool = false;
    const QUADS: bool = false;
    type Output = ();

    /// Walks all rays of the batch.
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Walks { links, keeps_depths, .. } = self.walks;
        let vertices = vertices(self.walks.object);
        let mut queue = PreparedQueue::new();
        let idle =
            LaneGroup { lanes: Lanes::idle(s), step: Step::empty(s), held: 0, start_round: s.splat_u(0) };
        let mut groups = [idle; 3];
        // A line passes each tetrahedron at most once, so a valid walk ends within this number of
        // steps.
        let steps_per_round = self.walks.object.records.len();
        let mut state = RefillState { round: 0, rays_left: true };
        let mut steps = 0;
        let one = s.splat_u(std::hint::black_box(1));
        loop {
            // `refill` is called in a loop, so that it is compiled once. The lanes are in memory at
            // this point in any case.
            let mut held = 0;
            for group in &mut groups {
                self.refill(s, &mut queue, group, &mut state);
                held |= group.held;
            }
            if held == 0 {
                return;
            }
            let [a, b, c] = &mut groups;
            a.lanes.fetch_apex(s, &mut a.step, vertices);
            b.lanes.fetch_apex(s, &mut b.step, vertices);
            c.lanes.fetch_apex(s, &mut c.step, vertices);
            a.lanes.choose_exit(s, keeps_depths, &mut a.step);
            b.lanes.choose_exit(s, keeps_depths, &mut b.step);
            c.lanes.choose_exit(s, keeps_depths, &mut c.step);
            a.lanes.follow_link(s, one, &a.step, links);
            b.lanes.follow_link(s, one, &b.step, links);
            c.lanes.follow_link(s, one, &c.step, links);
            steps += 1;
            if steps == steps_per_round {
                (state.round, steps) = (state.round + 1, 0);
                for group in &mut groups {
                    self.stop_overlong(s, group, state.round);
                }
            }
        }
    }
}
