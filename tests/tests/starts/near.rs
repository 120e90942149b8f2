//! Walls so near that t is rounded to 0, before and behind a start.

use crate::check::{check, turn};
use bth::rays::{PrimitiveRef, Start, StartRay};
use bth_tests::placed_soup::soups;

#[test]
fn walls_at_a_t_below_any_f32_are_hit_before_a_start_and_not_behind_it() {
    let _turn = turn();
    // The largest sum of weights.
    let above = [0.5, 0.5 + 1.0 / (1 << 22) as f32];
    let at = |z: f32| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
    for gap in [1e-8, 1e-30, 1e-44] {
        // A start on the middle one is between two walls.
        let triangles = [at(0.0), at(gap), at(-gap)];
        for walls in [vec![0, 1, 2], vec![0, 1], vec![0, 2]] {
            let corners: Vec<_> = walls.iter().map(|i| triangles[*i]).collect();
            let leaf = (0..corners.len() as u32).collect();
            let scene = bth::from_bytes(&soups(&[(&corners, vec![leaf])])).unwrap();
            let directions = [3e38, -3e38, 1e18, -1e18, 1.0, -1.0, 1e-40].map(|z| [0.0, 0.0, z]);
            let leaning = [3e38, -3e38].map(|z| [1e36, 0.0, z]);
            let mut rays: Vec<StartRay> = Vec::new();
            for direction in directions.into_iter().chain(leaning) {
                for [u, v] in
                    [[0.25, 0.25], [0.0, 0.0], [0.3, 0.7], [1.0 / 3.0, 0.1], above, [0.75, above[1] - 0.25]]
                {
                    for tmax in [0.0, 1.0, f32::INFINITY] {
                        for triangle in 0..corners.len() as u32 {
                            let primitive = PrimitiveRef { instance: 0, triangle };
                            rays.push(Start { primitive, u, v }.ray(direction).with_tmax(tmax));
                        }
                    }
                }
            }
            let hits = check(&scene, &corners, &rays, &format!("gap {gap}, walls {walls:?}"));
            assert!(hits > rays.len() / 10, "{hits} of {}", rays.len());
        }
    }
}
