//! Rays that are traced again allocate nothing: threads that trace at the same time do not meet in the allocator.

use crate::measure::largest;
use bth::Isa;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_tests::rays::{assorted, onward};
use bth_tests::structures::every_structure;

/// Coherent rays, which are traced in packets.
fn camera(side: usize) -> Vec<Ray> {
    let at = |i: usize| (i as f32 + 0.5) / side as f32 - 0.5;
    (0..side * side).map(|i| Ray::new([0.1, 0.2, 9.0], [at(i % side), at(i / side), -9.0])).collect()
}

/// Traces all rays in batches and one by one, as nearest and any hits, with and without hints; returns the number of hits.
fn trace(
    scene: &bth::Scene,
    rays: &[Ray],
    from: &[PrimitiveRef],
    hits: &mut [Hit],
    found: &mut [bool],
) -> usize {
    for hints in [None, Some(from)] {
        scene.batch(rays).from(hints).nearest(hits);
        scene.batch(rays).from(hints).any(found);
    }
    let single = rays.iter().zip(from).filter(|(ray, from)| {
        scene.nearest(ray).is_some()
            && scene.nearest_from(ray, **from).is_some()
            && scene.any_from(ray, **from)
    });
    single.count() + hits.iter().filter(|hit| hit.is_hit()).count()
}

#[test]
fn rays_that_are_traced_again_allocate_nothing() {
    let model = bth_scenes::knot::torus_knot(4000);
    let corners: Vec<_> = model.triangles.iter().map(|t| t.map(|i| model.positions[i as usize])).collect();
    let mut rays = assorted(&corners, 1024, 1);
    rays.extend(camera(32));
    // The other records are walked by the same code.
    let kinds = ["bvh", "bth link32", "bth with subtrees", "tets link32"];
    let traced = every_structure(&model, true).into_iter().map(|traced| (traced.name, traced.scene));
    let mut structures: Vec<_> =
        traced.filter(|(name, _)| kinds.iter().any(|kind| name.starts_with(kind))).collect();
    assert_eq!(structures.len(), if bth_tests::worker().is_some() { 8 } else { 4 });
    let crowd = bth::from_bytes(&bth_tests::crowd::crowd(300, true)).expect("a valid scene");
    structures.push(("instances".into(), crowd));
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("it is available");
        for (name, scene) in &structures {
            let mut hits = vec![Hit::MISS; rays.len()];
            scene.batch(&rays).nearest(&mut hits);
            let (rays, from): (Vec<_>, Vec<_>) = onward(&rays, &hits, corners.len(), 2)
                .into_iter()
                .chain(rays.iter().map(|r| (*r, PrimitiveRef::NONE)))
                .unzip();
            let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            let mut first = 0;
            // What a thread keeps grows until each way that batches may take was taken once: which one is faster is measured while tracing.
            for _ in 0..20 {
                first = trace(scene, &rays, &from, &mut hits, &mut found);
            }
            let mut again = 0;
            let most = largest(|| again = trace(scene, &rays, &from, &mut hits, &mut found));
            assert_eq!((most, again), (0, first), "{name}, {isa}: an allocation of {most} bytes");
            assert!(first > 100, "{name}: {first} hits");
        }
    }
}
