//! Rays that are traced again allocate nothing, so threads that trace at the same time do not wait
//! for each other in the allocator.

use crate::measure::largest;
use bth::rays::{Hit, Ray};
use bth::{Isa, TraceRay};
use bth_tests::rays::{assorted, onward};
use bth_tests::structures::every_structure;

/// Coherent rays, which are traced in packets.
fn camera(side: usize) -> Vec<Ray> {
    let at = |i: usize| (i as f32 + 0.5) / side as f32 - 0.5;
    (0..side * side).map(|i| Ray::new([0.1, 0.2, 9.0], [at(i % side), at(i / side), -9.0])).collect()
}

/// Traces all rays in batches and one by one, as nearest and any hits; returns the number of hits.
fn trace<R: TraceRay>(scene: &bth::Scene, rays: &[R], hits: &mut [Hit], found: &mut [bool]) -> usize {
    scene.batch(rays).nearest(hits);
    scene.batch(rays).any(found);
    let single = rays.iter().filter(|ray| scene.nearest(*ray).is_some() && scene.any(*ray));
    single.count() + hits.iter().filter(|hit| hit.is_hit()).count()
}

#[test]
fn rays_that_are_traced_again_allocate_nothing() {
    let model = bth_scenes::knot::torus_knot(4000);
    let corners: Vec<_> = model.triangles.iter().map(|t| t.map(|i| model.positions[i as usize])).collect();
    let mut rays = assorted(&corners, 1024, 1);
    rays.extend(camera(32));
    let kinds = ["bvh", "bth", "tets"];
    let traced = every_structure(&model, true).into_iter().map(|traced| (traced.name, traced.scene));
    let mut structures: Vec<_> =
        traced.filter(|(name, _)| kinds.iter().any(|kind| name.starts_with(kind))).collect();
    assert_eq!(structures.len(), if bth_tests::worker().is_some() { 5 } else { 3 });
    let crowd = bth::from_bytes(&bth_tests::crowd::crowd(300, true)).expect("a valid scene");
    structures.push(("instances".into(), crowd));
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("it is available");
        for (name, scene) in &structures {
            let mut hits = vec![Hit::MISS; rays.len()];
            scene.batch(&rays).nearest(&mut hits);
            let onward = onward(&hits, corners.len(), 2);
            let mut found = vec![false; rays.len()];
            let mut all =
                || trace(scene, &rays, &mut hits, &mut found) + trace(scene, &onward, &mut hits, &mut found);
            // What a thread keeps grows until each way that batches may take was taken once.
            let first = all();
            let mut again = 0;
            let most = largest(|| again = all());
            assert_eq!((most, again), (0, first), "{name}, {isa}: an allocation of {most} bytes");
            assert!(first > 100, "{name}: {first} hits");
        }
    }
}
