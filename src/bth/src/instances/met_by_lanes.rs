//! The instances whose boxes any of sixteen rays may enter, by tests of all rays against one box at a time.
//!
//! Through a top level of few nodes, sixteen rays in all directions reach most of its boxes, so that takes a part of the instructions of
//! testing each ray against the nodes that it reaches ([`super::listed_rays`]), whose lanes are often vacant.

use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use crate::bvh::packet::ray_group::GroupSlabs;
use crate::bvh::stack::BOTTOM;
use crate::intersect::prepare::{CommonAxis, gather_rays, prepare_lanes};
use crate::rays::Ray;
use crate::simd::{LANES, Simd};

/// Greatest number of boxes that are tested: testing each ray against the nodes that it reaches takes as long as testing all against some
/// hundred boxes.
const MAX_TESTS: usize = 4 * LANES;

/// Up to sixteen rays that are to be tested together.
pub(super) struct RaysTogether<'a> {
    pub(super) top: &'a TopLevel,
    /// The rays of a chunk.
    pub(super) rays: &'a [Ray],
    /// The indices of the rays, and their number.
    pub(super) at: &'a [u32; LANES],
    pub(super) count: usize,
}

/// Sixteen rays, and the instances that any of them may enter. Each is a row with a lane for each ray.
pub(super) struct MetByLanes<S: Simd> {
    /// The codes of the instances, one for each row.
    pub(super) codes: [u32; LANES],
    /// For each row the depths at which the rays enter the instance, infinite where they do not.
    pub(super) depths: [S::F; LANES],
    /// For each ray the depth of t = 1.
    pub(super) scale: S::F,
    /// The rays that are tested, a bit each: those that f32 prepares, whose range is not empty and begins at 0 or later, and whose origin is
    /// within the reach of the top level.
    pub(super) tested: u32,
    /// Those that may enter an instance, and those that may enter several.
    pub(super) any: u32,
    pub(super) several: u32,
    /// For each ray the code of an instance that it may enter.
    pub(super) code: S::U,
    /// Whether no more boxes were tested than nodes are reached by the rays, each counted for itself: a test of all rays against one box takes
    /// as long as one of a ray against a node.
    pub(super) is_worthwhile: bool,
}

impl<S: Simd> MetByLanes<S> {
    /// Tests rays. `None` if they enter more instances than there are rows, or if there are too many boxes to be tested.
    #[inline(always)]
    pub(super) fn of(s: S, rays: &RaysTogether<'_>) -> Option<MetByLanes<S>> {
        let RaysTogether { top, rays, at, count } = *rays;
        let used = s.mask(((1u64 << count) - 1) as u32);
        let field = gather_rays(s, used, rays, s.load_u(at));
        // Boxes do not need to know the greatest axis.
        let prepared = prepare_lanes(s, &top.cube, field, &CommonAxis(2));
        let slabs = GroupSlabs::of(&prepared);
        let farthest = s.max(s.max(s.abs(field[0]), s.abs(field[1])), s.abs(field[2]));
        let is_near = s.and(s.le(farthest, s.splat(top.reach)), s.le(s.splat(0.0), field[3]));
        let tested = s.mask_bits(s.and(s.and(is_near, used), prepared.usable));
        let nowhere = s.splat(f32::INFINITY);
        let mut met = MetByLanes {
            codes: [0; LANES],
            depths: [nowhere; LANES],
            scale: prepared.scale,
            tested,
            any: 0,
            several: 0,
            code: s.splat_u(0),
            is_worthwhile: false,
        };
        let (mut stack, mut height) = ([0; MAX_TESTS], 1);
        let (mut tests, mut rows, mut reached) = (0, 0, count);
        while height > 0 {
            height -= 1;
            let node = top.node(stack[height % MAX_TESTS]);
            let mut slots = s.mask_bits(s.lt_u(s.load_u(&node.child), s.splat_u(BOTTOM)));
            tests += slots.count_ones() as usize;
            if tests > MAX_TESTS {
                return None;
            }
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize % LANES;
                slots &= slots - 1;
                let code = node.child[slot];
                let corners = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
                let (enter, enters) = slabs.enter(s, corners, (true, false));
                let enters = s.mask_bits(enters) & tested;
                if enters == 0 {
                    continue;
                }
                if code & INSTANCE == 0 {
                    // There is room for all boxes that are tested.
                    stack[height % MAX_TESTS] = code;
                    height += 1;
                    reached += enters.count_ones() as usize;
                    continue;
                }
                if rows == LANES {
                    return None;
                }
                let entering = s.mask(enters);
                met.codes[rows] = code;
                met.depths[rows] = s.select(entering, enter, nowhere);
                met.code = s.select_u(entering, s.splat_u(code), met.code);
                met.several |= met.any & enters;
                met.any |= enters;
                rows += 1;
            }
        }
        met.is_worthwhile = tests <= reached;
        Some(met)
    }
}
