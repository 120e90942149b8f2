//! Instances that share borders exactly, as real numbers.

use super::exact::Surface;
use super::sets::{NEAREST, Query, Set, plain};
use bth::rays::PrimitiveRef;
use bth_random::Rng;
use bth_tests::stress::{Tiles, tiles};
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;

/// A closed box of copies of a tile, and rays within it.
pub(super) fn touching(count: usize) -> Set {
    // Of the surfaces of this seed the box is near the origin.
    let found = tiles(1).into_iter().find(|of| of.kind == "box of 96 tiles");
    let Tiles { scene, borders, inside, .. } = found.expect("a box of tiles");
    let mut rng = Rng::new(6);
    let mut any = |count: usize| rng.below(count as u64) as usize;
    // Differences are exact, so that two thirds of the rays pass through borders exactly.
    let ray = |i: usize| {
        let origin = DVec3::from_array(inside[any(inside.len())].map(f64::from));
        let [a, b] = borders[any(borders.len())].map(DVec3::from_array);
        let [c, _] = borders[any(borders.len())].map(DVec3::from_array);
        let target = [a, a.midpoint(b), a.lerp(c, any(1000) as f64 / 1000.0)][i % 3];
        plain(origin.to_array(), (target - origin).to_array())
    };
    let rays = (0..count).map(ray).collect();
    let names = (
        "touching instances",
        "a closed box of 96 instances of a bumpy tile whose borders are the same real numbers; rays from inside \
         through vertices and middles of edges of the borders, and others. Transforms and tile are f32, the images \
         f64. bth and Embree get instances, the others the images as one model",
    );
    let set = Set::new(names, Query::Nearest, &images(&scene), rays, NEAREST, count);
    Set { single: false, scene: Some(Arc::new(scene)), ..set }
}

/// The triangles of all instances in world space, with outward normals. f64 has their corners
/// exactly.
fn images(scene: &bth::Scene) -> Surface {
    let (mut positions, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
    for instance in 0..scene.instance_count() {
        let [x, y, z] = scene.instance(instance).to_world.map(|[x, y, z, _]| DVec3::new(x, y, z));
        let is_mirrored = x.cross(y).dot(z) < 0.0;
        for triangle in 0..scene.object(0).header.triangles {
            let corners = scene.triangle_in_world(PrimitiveRef { instance, triangle }).expect("a triangle");
            let [a, b, c] = corners.map(|corner| {
                // Zeros have one sign.
                *known.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                    positions.push(corner);
                    positions.len() as u32 - 1
                })
            });
            triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
        }
    }
    Surface::new(positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::exact::ExactAnswer;
    use bth_tests::oracle::World;

    /// The images have the exact answers of the instances, and rays hit their borders.
    #[test]
    fn the_images_of_instances_are_exact_and_closed() {
        let set = touching(200);
        let world = World::new(set.scene.as_ref().unwrap());
        let each = set.triangles.len() as u32 / set.scene.as_ref().unwrap().instance_count();
        let mut shared = 0;
        for (question, truth) in set.questions.iter().zip(&set.truths) {
            let ray = bth::rays::Ray64::new(question.origin, question.direction);
            let expected = world.nearest(ray).expect("a ray within a closed box hits it");
            let ids: Vec<u32> = expected.triangles.iter().map(|p| p.instance * each + p.triangle).collect();
            let ExactAnswer::Hit { t, triangles, .. } = truth else { panic!("a miss") };
            assert_eq!((*t, triangles), (expected.t_f64(), &ids));
            shared += usize::from(ids.len() > 1 && ids[0] / each != ids[1] / each);
        }
        assert!(shared > 50, "{shared}");
    }
}
