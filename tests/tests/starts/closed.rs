//! Closed surfaces: a ray that starts into one hits it again.

use crate::check::{corners_of, isas, turn};
use bth::Isa;
use bth::rays::{Hit, PrimitiveRef, Start, StartRay};
use bth_compile::pipeline::Structure;
use bth_random::Rng;
use bth_tests::meshes::{cube, placed};
use bth_tests::oracle::is_front;
use bth_tests::rays::alone;
use bth_tests::structures::{compiled, options};

#[test]
fn starts_into_a_closed_surface_hit_it_again() {
    let _turn = turn();
    let rng = &mut Rng::new(2);
    let knot = bth_scenes::knot::torus_knot(2000);
    let far = placed(knot.clone(), 1.0, 3000.0);
    let tiny = placed(knot.clone(), 1e-30, 0.0);
    let models = [knot, far, tiny, cube(4, None), cube(3, Some(rng)), bth_scenes::gyroid::gyroid(1500)];
    for (i, model) in models.iter().enumerate() {
        let scene = compiled(model, &options(Structure::Bvh));
        assert_eq!(scene.is_closed(0), Some(true));
        let corners = corners_of(&scene, 0);
        let (mut inward, mut outward) = (Vec::new(), Vec::new());
        while inward.len() < 3000 {
            let triangle = rng.below(corners.len() as u64) as u32;
            // Inside of the face.
            let [u, v] = [0, 1].map(|_| 0.001 + 0.498 * rng.unit_f32());
            let direction = rng.point_in_ball().map(|x| x as f32);
            let ray: StartRay =
                Start { primitive: PrimitiveRef { instance: 0, triangle }, u, v }.ray(direction);
            let line = bth::rays::Ray::new([0.0; 3], direction);
            let to_front = bth::rays::Ray::new([0.0; 3], direction.map(|x| -x));
            if is_front(line, corners[triangle as usize]) {
                inward.push(ray);
            } else if is_front(to_front, corners[triangle as usize]) {
                outward.push(ray);
            }
        }
        for (rays, parity) in [(&inward, 1), (&outward, 0)] {
            let expected = alone(&scene, rays);
            for (ray, hit) in rays.iter().zip(&expected) {
                let crossings = scene.crossings(ray);
                assert_eq!(crossings.count % 2, parity, "model {i}: {ray:?}: {crossings:?}");
                assert_eq!(crossings.winding, parity as i32, "model {i}: {ray:?}: {crossings:?}");
                assert!(parity == 0 || hit.is_hit(), "model {i}: a leak of {ray:?}");
                assert_ne!(hit.primitive, ray.start.primitive, "model {i}: {ray:?} hits what it leaves");
            }
            for isa in isas() {
                isa.choose().unwrap();
                bth_tests::rays::check_batch(&scene, rays, &expected, format_args!("model {i}, {isa}"));
            }
            Isa::best().choose().unwrap();
        }
    }
}

/// From corners and edges of a convex body, straight to points inside.
#[test]
fn starts_at_corners_and_edges_into_a_cube_hit_it() {
    let _turn = turn();
    for scale in [1.0, 3.0, 1e-25, 1e25] {
        let scene = compiled(&placed(cube(3, None), scale, 0.0), &options(Structure::Bvh));
        let rng = &mut Rng::new(7);
        let corners = corners_of(&scene, 0);
        let rays: Vec<StartRay> = (0..3000)
            .map(|_| {
                let triangle = rng.below(corners.len() as u64) as usize;
                let [u, v] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.0, 0.25], [0.75, 0.25]]
                    [rng.below(6) as usize];
                let [a, b, c] = corners[triangle];
                let from = [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                let to = rng.point_in_ball().map(|x| x as f32 * 2.0 * scale);
                let primitive = PrimitiveRef { instance: 0, triangle: triangle as u32 };
                Start { primitive, u, v }.ray([0, 1, 2].map(|k| to[k] - from[k]))
            })
            .collect();
        for (ray, hit) in rays.iter().zip(alone(&scene, &rays)) {
            assert!(hit.is_hit(), "{scale}: a leak of {ray:?}");
            let crossings = scene.crossings(ray);
            assert_eq!((crossings.count, crossings.winding), (1, 1), "{scale}: {ray:?}");
            // Beyond it there is nothing, from the corner, the edge or the face that was hit.
            let onward = StartRay::from_hit(&hit, ray.direction);
            assert_eq!(scene.nearest(&onward).unwrap_or(Hit::MISS), Hit::MISS, "{scale}: {onward:?}");
            // And back to where it came from there is a hit at about the same distance.
            let back = scene.nearest(&StartRay::from_hit(&hit, ray.direction.map(|d| -d)));
            assert!(back.is_some_and(|back| (back.t - hit.t).abs() <= 1e-5 * hit.t), "{scale}: {back:?}");
        }
    }
}
