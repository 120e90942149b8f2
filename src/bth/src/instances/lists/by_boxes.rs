//! The instances whose boxes any of sixteen rays may enter, by tests of all rays against one box.
//!
//! Through a top level of few nodes, sixteen rays in all directions reach most of its boxes.
//! Testing each ray against the nodes that it reaches ([`super::by_nodes`]) then takes more
//! instructions, since many lanes of its nodes are vacant.

use super::RaysToList;
use crate::bvh::packet::ray_group::GroupSlabs;
use crate::bvh::stack::BOTTOM;
use crate::instances::top_nodes::INSTANCE;
use crate::intersect::prepare::{CommonAxis, gather_rays, prepare_lanes};
use crate::simd::{LANES, Simd};

/// Max number of boxes that are tested. Beyond some hundred boxes, testing each ray against its
/// nodes is faster.
const MAX_TESTS: usize = 4 * LANES;

/// Sixteen rays, and the instances that any of them may enter: a row for each, with a lane for each
/// ray.
pub(super) struct BoxTests<S: Simd> {
    /// For each row the code of the instance.
    pub(super) codes: [u32; LANES],
    /// For each row the depths at which the rays enter the instance, infinite where they do not.
    pub(super) depths: [S::F; LANES],
    /// For each ray the depth of t = 1.
    pub(super) scale: S::F,
    /// One bit per ray that was tested: f32 prepares it, its range is not empty and begins at 0 or
    /// later, and its origin is within the reach of the top level.
    pub(super) tested: u32,
    /// One bit per ray that may enter an instance, and one per ray that may enter several.
    pub(super) any: u32,
    pub(super) several: u32,
    /// For each ray the code of an instance that it may enter.
    pub(super) code: S::U,
    /// True if the boxes tested were at most the nodes reached, summed over the rays. A test of all
    /// rays against one box takes as long as a test of one ray against a node.
    pub(super) is_worthwhile: bool,
}

impl<S: Simd> BoxTests<S> {
    /// Tests rays. `None` if they may enter more instances than there are rows, or if there are too
    /// many boxes.
    #[inline(always)]
    pub(super) fn of(s: S, rays: &RaysToList<'_>) -> Option<BoxTests<S>> {
        let RaysToList { chunk, at, count } = *rays;
        let (top, rays) = (chunk.top, chunk.rays);
        let used = s.mask(((1u64 << count) - 1) as u32);
        let field = gather_rays(s, used, rays, s.load_u(at));
        // Boxes do not need the major axis.
        let prepared = prepare_lanes(s, &top.cube, field, &CommonAxis(2));
        let slabs = GroupSlabs::of(&prepared);
        let farthest = s.max(s.max(s.abs(field[0]), s.abs(field[1])), s.abs(field[2]));
        let is_near = s.and(s.le(farthest, s.splat(top.reach)), s.le(s.splat(0.0), field[3]));
        let tested = s.mask_bits(s.and(s.and(is_near, used), prepared.usable));
        let nowhere = s.splat(f32::INFINITY);
        let mut met = BoxTests {
            codes: [0; LANES],
            depths: [nowhere; LANES],
            scale: prepared.scale,
            tested,
            any: 0,
            several: 0,
            code: s.splat_u(0),
            is_worthwhile: false,
        };
        let (nodes, mut stack, mut height) = (top.nodes(), [0; MAX_TESTS], 1);
        let (mut tests, mut rows, mut reached) = (0, 0, count);
        while height > 0 {
            height -= 1;
            let node = nodes.node(stack[height % MAX_TESTS]);
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
