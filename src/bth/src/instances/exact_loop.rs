//! The oracle of tests of instances: a loop over all triangles, without any box.

use crate::bvh::candidate::Candidate;
use crate::intersect::exact::reported;
use crate::intersect::line::Line;
use crate::nodes::affine::Inverse;
use crate::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::{Child, Opacity};
use bth_format::object::ObjectView;

/// The triangles of an object with their ids.
fn triangles(object: &ObjectView<'_>) -> Vec<(u32, [[f32; 3]; 3])> {
    let (mut found, mut stack) = (vec![], vec![object.header.root]);
    while let Some(code) = stack.pop() {
        let Some(child) = Child::from_code(code) else { continue };
        let count = match child {
            Child::Indexed(at) => object.indexed(at, &mut None).triangles,
            Child::Raw(at) => object.raw(at, &mut None).triangles,
            Child::Node(line) => {
                stack.extend(object.node(line).child);
                continue;
            }
            Child::Tets(_) => panic!("a file without tetrahedra"),
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
    inverse: &Inverse,
    instance: u32,
    ray: &Ray,
    found: &mut Vec<(f64, Hit)>,
) {
    let object_ray = inverse.ray(ray);
    let Some(line) = Line::new(&object_ray.ray) else { return };
    for (triangle, corners) in triangles(object) {
        let Some(at) = line.intersection(corners) else { continue };
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
