//! Triangle tests in single precision over a BVH that loses no ray: what such a test alone gets wrong.
//!
//! The binary BVH is that of our compiler. Its boxes are tested in double precision and a little widened, so that every wrong
//! answer is one of the triangle test.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use crate::triangle_tests::{Intersection, Watertight, moller_trumbore};
use anyhow::Result;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::Silent;
use bth_compile::bvh::{self, BinaryBvh, Node};
use std::time::Instant;

/// Which test decides about triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TriangleTest {
    /// Möller and Trumbore 1997.
    MollerTrumbore,
    /// Woop, Benthin and Wald 2013.
    Watertight,
}

struct F32Tests {
    tree: BinaryBvh,
    /// Corners in the order of the leaves.
    corners: Vec<[[f32; 3]; 3]>,
    test: TriangleTest,
}

/// Builds the BVH of a model.
///
/// # Errors
/// If the model cannot be built a BVH of.
pub(super) fn contender(model: &Model, name: &str, test: TriangleTest) -> Result<Contender> {
    let start = Instant::now();
    let (tree, _) = bvh::build(&model.mesh, &bvh::BvhOptions::default(), &Silent)?;
    let corners: Vec<_> = tree.order.iter().map(|&triangle| model.mesh.corners(triangle)).collect();
    let build_s = start.elapsed().as_secs_f64();
    let bytes = size_of_val(&tree.nodes[..]) + size_of_val(&tree.order[..]) + size_of_val(&corners[..]);
    let tracer = Box::new(F32Tests { tree, corners, test });
    Ok(Contender { name: name.to_owned(), ours: false, tracer, build_s, bytes: Some(bytes as u64) })
}

/// How much later than its exact value a box may be entered at most, relative to t: far more than the rounding errors.
const WIDER: f64 = 1.0 + 1e-12;
/// The relative error of t by which a hit of a triangle test may lie before the box of its triangle.
const ERROR_OF_T: f64 = 1.0 - 1e-3;

/// A ray as boxes are tested against it.
struct BoxRay {
    origin: [f64; 3],
    inverse: [f64; 3],
    tmin: f64,
}

impl BoxRay {
    fn new(ray: &Ray) -> BoxRay {
        let inverse = ray.direction.map(|x| 1.0 / f64::from(x));
        BoxRay { origin: ray.origin.map(f64::from), inverse, tmin: f64::from(ray.tmin) }
    }

    /// Where the ray enters a node's box, if it meets the box before `tmax` or about there.
    fn enters(&self, node: &Node, tmax: f32) -> Option<f64> {
        let (mut near, mut far) = (self.tmin, f64::INFINITY);
        for k in 0..3 {
            let a = (f64::from(node.lower[k]) - self.origin[k]) * self.inverse[k];
            let b = (f64::from(node.upper[k]) - self.origin[k]) * self.inverse[k];
            // A ray within a plane of the box gives NaN, which `max` and `min` pass over.
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far * WIDER && near * ERROR_OF_T <= f64::from(tmax)).then_some(near)
    }
}

impl F32Tests {
    /// Nearest hit by a test of triangles, or with `ANY` the first that is found.
    fn trace<const ANY: bool>(
        &self,
        ray: &Ray,
        stack: &mut Vec<u32>,
        test: impl Fn([[f32; 3]; 3], f32) -> Option<Intersection>,
    ) -> Hit {
        let mut best = Hit { t: ray.tmax, ..Hit::MISS };
        let boxes = BoxRay::new(ray);
        stack.clear();
        if self.tree.nodes.first().is_some_and(|root| boxes.enters(root, best.t).is_some()) {
            stack.push(0);
        }
        while let Some(at) = stack.pop() {
            let node = &self.tree.nodes[at as usize];
            if node.is_leaf() {
                if let Some(Intersection { t, u, v }) = test(self.corners[node.first as usize], best.t) {
                    let triangle = self.tree.order[node.first as usize];
                    best = Hit { t, u, v, primitive: PrimitiveRef { instance: 0, triangle } };
                    if ANY {
                        break;
                    }
                }
                continue;
            }
            let children = [at + 1, node.right];
            let entries = children.map(|child| boxes.enters(&self.tree.nodes[child as usize], best.t));
            // The nearer child is visited first, so it is pushed last.
            let nearer_is_second = matches!(entries, [Some(first), Some(second)] if second < first);
            let order = if nearer_is_second { [0, 1] } else { [1, 0] };
            stack.extend(order.into_iter().filter(|i| entries[*i].is_some()).map(|i| children[i]));
        }
        if best.primitive == PrimitiveRef::NONE { Hit::MISS } else { best }
    }

    fn hit<const ANY: bool>(&self, ray: &Ray, stack: &mut Vec<u32>) -> Hit {
        match self.test {
            TriangleTest::MollerTrumbore => {
                self.trace::<ANY>(ray, stack, |corners, tmax| moller_trumbore(ray, corners, tmax))
            }
            TriangleTest::Watertight => {
                let prepared = Watertight::new(ray);
                self.trace::<ANY>(ray, stack, |corners, tmax| prepared.intersect(corners, tmax))
            }
        }
    }
}

impl Tracer for F32Tests {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let mut stack = Vec::new();
        for (ray, hit) in batch.rays.iter().zip(hits) {
            *hit = self.hit::<false>(ray, &mut stack);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        let mut stack = Vec::new();
        for (ray, found) in batch.rays.iter().zip(found) {
            *found = self.hit::<true>(ray, &mut stack).is_hit();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::on_sphere;
    use bth_random::Rng;

    #[test]
    fn the_bvh_finds_what_testing_every_triangle_finds() {
        let model = Model::load("torus-knot:320").unwrap();
        let (bounds, mut rng) = (model.bounds(), Rng::new(2));
        let (tree, _) = bvh::build(&model.mesh, &bvh::BvhOptions::default(), &Silent).unwrap();
        let corners: Vec<_> = tree.order.iter().map(|&t| model.mesh.corners(t)).collect();
        let tracer = F32Tests { tree, corners, test: TriangleTest::MollerTrumbore };
        let mut hits = 0;
        for _ in 0..2000 {
            let [from, to] =
                [(); 2].map(|()| bounds.center() + on_sphere(&mut rng) * (0.5 * bounds.diagonal()));
            let ray = crate::rays::ray(from, (to - from).normalize(), f64::INFINITY);
            let all = tracer.corners.iter().filter_map(|c| moller_trumbore(&ray, *c, ray.tmax)).map(|h| h.t);
            let expected = all.fold(f32::INFINITY, f32::min);
            let found = tracer.hit::<false>(&ray, &mut Vec::new());
            assert_eq!(
                (found.is_hit(), found.is_hit() && found.t != expected),
                (expected.is_finite(), false)
            );
            assert_eq!(tracer.hit::<true>(&ray, &mut Vec::new()).is_hit(), expected.is_finite());
            hits += usize::from(found.is_hit());
        }
        assert!(hits > 300, "{hits}");
    }
}
