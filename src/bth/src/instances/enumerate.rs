//! Enumeration of the instances whose boxes one ray may enter.

use super::World;
use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use super::traverse::{limit, widened_slabs};
use crate::bvh::ray_state::key_limit;
use crate::bvh::stack::BOTTOM;
use crate::intersect::boxes::RaySlabs;
use crate::intersect::prepare::PreparedRay;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Scalar, Simd};
use bth_format::layout::WideNode;
use bth_format::object::ObjectBounds;

impl World {
    /// Calls `visit` with each visible instance whose box a ray in world space may enter within its range of t, nearer boxes
    /// first. `visit` returns the greatest t, rounded to f32, of hits that can still change the result, or `None` to end; instances
    /// beyond are left out. Returns whether `visit` has ended the enumeration.
    pub(crate) fn enumerate(&self, ray: &Ray, visit: &mut dyn FnMut(u32) -> Option<f32>) -> bool {
        let top = &self.top;
        // False for NaN, too.
        let has_range = ray.tmin <= ray.tmax;
        if top.is_empty() || !has_range {
            return false;
        }
        let Some(slabs) = slabs(ray, top) else { return false };
        let isa = Isa::chosen();
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
}

/// The constants of a ray for tests of the boxes in the top level; `None` for rays that cannot hit anything.
fn slabs(ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    if ray.origin.iter().all(|x| x.abs() <= top.reach)
        && let Some(prepared) = PreparedRay::of(Scalar, &ObjectBounds::around(top.greatest_coordinate()), ray)
    {
        return Some(prepared.slabs);
    }
    widened_slabs(ray, top)
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
        let (bits, enter) = slabs.children(s, node, last);
        let child = s.load_u(&node.child);
        // With coordinates near the limit of f32 the test accepts all boxes, also of empty slots, so these are excluded here.
        let used = s.mask_bits(s.lt_u(child, s.splat_u(BOTTOM)));
        s.compress_far_to_near(bits & used, enter, child, codes, keys)
    }
}
