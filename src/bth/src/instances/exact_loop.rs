//! The oracle of tests of instances: a loop over all triangles, without any box.

use super::{RayInInstance, World};
use crate::bvh::candidate::Candidate;
use crate::bvh::nodes::{Leaf, LeafMemory, leaf};
use crate::intersect::exact::{RATIO_ERROR, reported};
use crate::intersect::exact_ray::{WorldLines, intersect_in_world};
use crate::intersect::line::Line;
use crate::intersect::vector::wide;
use crate::objects::Objects;
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::Scalar;
use crate::starts::world_ray::WorldRay;
use bth_format::layout::Opacity;
use bth_format::object::ObjectView;

/// The triangles of an object with their ids.
fn triangles(object: &ObjectView<'_>) -> Vec<(u32, [[f32; 3]; 3])> {
    let (mut found, mut stack) = (vec![], vec![object.header.root]);
    while let Some(code) = stack.pop() {
        if let Some(node) = object.node_base().wide_node(code) {
            stack.extend(node.child);
            continue;
        }
        let count = match leaf(Scalar, object, object.node_base(), code, &mut LeafMemory::default()) {
            Leaf::Indexed(block) => block.triangles,
            Leaf::Raw(block) => block.triangles,
            Leaf::None => 0,
            Leaf::Special(_) => panic!("a file with triangle leaves only"),
        };
        for triangle in 0..count {
            let candidate = Candidate { leaf: code, triangle };
            let (index, corners) = candidate.read(object).expect("a leaf");
            found.push((object.triangle_ids[index as usize], corners));
        }
    }
    found
}

/// Adds the hits of a ray in an instance, each with its t before rounding. Every triangle is
/// decided exactly.
pub(crate) fn add_hits(
    object: &ObjectView<'_>,
    (world, objects): (&World, &Objects),
    instance: u32,
    ray: &Ray,
    found: &mut Vec<(f64, Hit)>,
) {
    let of_instance = RayInInstance::new(
        world,
        objects,
        (instance, world.placement(instance)),
        WorldRay::plain(ray),
        ray.tmax,
    );
    let object_ray = &of_instance.of_object;
    if Line::of(&object_ray.line).is_none()
        || ray.tmin.partial_cmp(&ray.tmax).is_none_or(|order| order.is_gt())
    {
        return;
    }
    for (triangle, corners) in triangles(object) {
        let found_before = intersect_in_world((&of_instance, 0), corners.map(wide), |_| true);
        // Exact arithmetic is slow: one miss in sixteen is checked.
        if found_before.is_none() && triangle % 16 != instance % 16 {
            continue;
        }
        let exact = of_instance.exact(0).intersection(corners.map(wide));
        let Some(at) = found_before else {
            assert!(exact.is_none(), "{exact:?} is not found");
            continue;
        };
        let exact = exact.expect("an intersection").t;
        assert!((exact - at.t).abs() <= RATIO_ERROR * exact.abs(), "{} instead of {exact}", at.t);
        let in_object = reported(at.t);
        let t = if object_ray.t_scale == 1.0 { in_object } else { in_object * object_ray.t_scale };
        let Ray { tmin, tmax, .. } = object_ray.ray;
        if tmin <= in_object && in_object <= tmax && ray.tmin <= t && t <= ray.tmax && t.is_finite() {
            let [u, v] = at.uv();
            if object.opacity_at(triangle, u, v) != Opacity::Transparent {
                found.push((at.t, Hit { t, u, v, primitive: PrimitiveRef { instance, triangle } }));
            }
        }
    }
}

/// The hits in the documented order.
pub(crate) fn in_order(mut found: Vec<(f64, Hit)>) -> Vec<Hit> {
    let order = |(exact, hit): &(f64, Hit)| (hit.t, hit.primitive.instance, *exact, hit.primitive.triangle);
    found.sort_by(|a, b| order(a).partial_cmp(&order(b)).expect("no NaN"));
    found.into_iter().map(|(_, hit)| hit).collect()
}
