//! Enumeration of the instances whose boxes one ray may enter.

use super::World;
use super::box_tests::{entered, limit, widened_slabs};
use super::instance_list::{InstanceList, Visit};
use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use crate::bvh::ray_state::key_limit;
use crate::bvh::single_stack::SingleStack;
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::intersect::prepare::PreparedRay;
use crate::query::NearestHit;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Scalar, Simd};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::limits::MAX_DEPTH;
use std::hint::black_box;

impl World {
    /// Calls `visit` with each visible instance whose box a ray in world space may enter within its range of t, nearer boxes
    /// first. Instances beyond what `visit` returns are left out. Returns whether `visit` has ended the enumeration.
    pub(crate) fn enumerate(&self, ray: &Ray, visit: Visit<'_>) -> bool {
        let top = &self.top;
        // False for NaN, too.
        let has_range = ray.tmin <= ray.tmax;
        if top.is_empty() || !has_range {
            return false;
        }
        // Instances whose distances differ by hundreds of powers of two may make a deep tree.
        if top.depth as usize > MAX_DEPTH {
            return enumerate_deep(top, ray, visit);
        }
        Isa::chosen().run(EnumerateKernel { top, ray, visit })
    }
}

/// The constants of a ray for tests of the boxes in the top level; `None` for rays that cannot hit anything.
#[inline(always)]
fn slabs<S: Simd>(s: S, ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    if ray.origin.iter().all(|x| x.abs() <= top.reach)
        && let Some(prepared) = PreparedRay::of(s, &top.cube, ray)
    {
        return Some(prepared.slabs);
    }
    widened_slabs(ray, top)
}

/// The kernel of [`World::enumerate`]. The receiver is called through a table, so that there is one kernel per instruction set.
struct EnumerateKernel<'a> {
    top: &'a TopLevel,
    ray: &'a Ray,
    visit: Visit<'a>,
}

impl Kernel for EnumerateKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let EnumerateKernel { top, ray, visit } = self;
        let Some(slabs) = slabs(s, ray, top) else { return false };
        // Kept in memory: vectors of its numbers would be stored before each visit and loaded after it.
        let slabs = black_box(&slabs);
        let (mut tmax, mut last) = (ray.tmax, limit(slabs.scale, ray.tmax));
        // Lists save visits, but elsewhere they take longer than that.
        if S::HAS_FAST_COMPRESS
            && ray.tmin >= 0.0
            && let Some(list) = InstanceList::of(s, top, slabs, last)
        {
            return list.visit(slabs.scale, tmax, visit);
        }
        // Stack entries with a greater key are dropped.
        let mut keys = key_limit(last);
        let mut stack = SingleStack::new();
        let mut stack = stack.start(0);
        let mut code = 0;
        loop {
            let planes = RaySlabLanes::new(s, slabs);
            // Neither instances nor the bottom of the stack are nodes.
            while code & INSTANCE == 0 {
                let node = top.node(code);
                let (bits, enter) = entered(s, &planes, node, last);
                if bits == 0 {
                    code = stack.pop(keys, NearestHit);
                    continue;
                }
                let free = stack.free_entries();
                let children = s.load_u(&node.child);
                let (count, nearest) = s.sort_far_to_near(bits, enter, children, free.codes, free.keys);
                code = node.child[nearest % WIDTH];
                free.push(count);
            }
            if stack.is_empty() {
                return false;
            }
            match visit(code & !INSTANCE) {
                None => return true,
                Some(t) if t < tmax => {
                    (tmax, last) = (t, limit(slabs.scale, t));
                    keys = key_limit(last);
                }
                Some(_) => {}
            }
            if stack.is_last() {
                return false;
            }
            code = stack.pop(keys, NearestHit);
        }
    }
}

/// As [`World::enumerate`], for a tree of any depth.
#[cold]
#[inline(never)]
fn enumerate_deep(top: &TopLevel, ray: &Ray, visit: Visit<'_>) -> bool {
    let isa = Isa::chosen();
    let Some(slabs) = slabs(Scalar, ray, top) else { return false };
    let (mut tmax, mut last) = (ray.tmax, limit(slabs.scale, ray.tmax));
    let (mut codes, mut keys) = ([0; LANES], [0.0; LANES]);
    // For each instance or node its code and a lower bound of the depth at which the ray enters it.
    let mut stack = vec![(0, f32::NEG_INFINITY)];
    while let Some((code, key)) = stack.pop() {
        if key_limit(last) < key {
            continue;
        }
        if code & INSTANCE == 0 {
            let (codes, keys) = (&mut codes, &mut keys);
            let kernel = ChildrenKernel { slabs: &slabs, node: top.node(code), last, codes, keys };
            let count = isa.run(kernel).min(LANES);
            stack.extend(codes[..count].iter().copied().zip(keys[..count].iter().copied()));
            continue;
        }
        match visit(code & !INSTANCE) {
            None => return true,
            Some(t) if t < tmax => (tmax, last) = (t, limit(slabs.scale, t)),
            Some(_) => {}
        }
    }
    false
}

/// Kernel that writes codes and keys of the children of a node that the ray may enter before the depth `last`, the nearest last,
/// and returns their number.
struct ChildrenKernel<'a> {
    slabs: &'a RaySlabs,
    node: &'a WideNode,
    last: f32,
    codes: &'a mut [u32; LANES],
    keys: &'a mut [f32; LANES],
}

impl Kernel for ChildrenKernel<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> usize {
        let ChildrenKernel { slabs, node, last, codes, keys } = self;
        let (bits, enter) = entered(s, &RaySlabLanes::new(s, slabs), node, last);
        s.compress_far_to_near(bits, enter, s.load_u(&node.child), codes, keys)
    }
}

#[cfg(test)]
#[path = "enumerate_tests.rs"]
mod tests;
