//! No number becomes denormal while ordinary rays are traced. On Intel processors each operation
//! that makes or reads a denormal number takes hundreds of cycles, in one lane of sixteen as in
//! all, so that one of them doubles the time of a ray. Processors note them in flags.
#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)] // The flags of floating-point operations are read by an instruction.

use bth::rays::{Hit, Ray, StartRay};
use bth::{Isa, Scene, TraceRay};
use bth_random::Rng;
use bth_tests::meshes::cube;
use bth_tests::rays::onward;
use bth_tests::structures::{every_structure, structures_named};
use std::arch::asm;

/// Flags of MXCSR: an operand was denormal (DE), a result was (UE).
const DENORMAL: u32 = 1 << 1 | 1 << 4;
/// All exceptions masked, rounding to nearest, no flag set: what programs start with.
const DEFAULT: u32 = 0x1f80;

/// Runs `trace`; returns the flags of denormal numbers that it sets.
fn denormal_flags(trace: impl FnOnce()) -> u32 {
    let (default, mut after) = (DEFAULT, 0u32);
    // SAFETY: MXCSR is set to its default value, and read to a word.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const default, options(nostack, readonly)) };
    trace();
    // SAFETY: as above.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut after, options(nostack)) };
    after & DENORMAL
}

/// Rays from around the model to points in it, as renderers send them: `tmin` 0, small or the
/// smallest normal number, `tmax` a length, a large number, the largest or infinite.
fn ordinary(count: usize, tmin: f32, tmax: f32) -> Vec<Ray> {
    let mut rng = Rng::new(7);
    let mut point = |size: f32| [(); 3].map(|()| (rng.unit_f32() - 0.5) * size);
    let ray = |_| {
        let (origin, target) = (point(8.0), point(3.0));
        let toward = [0, 1, 2].map(|k| target[k] - origin[k]);
        let length = toward.iter().map(|x| x * x).sum::<f32>().sqrt();
        Ray { tmin, tmax, ..Ray::new(origin, toward.map(|x| x / length)) }
    };
    (0..count).map(ray).collect()
}

/// Traces the rays one by one and in batches.
fn trace<R: TraceRay>(scene: &Scene, rays: &[R], hits: &mut [Hit], found: &mut [bool]) {
    for ray in rays {
        std::hint::black_box((scene.nearest(ray), scene.any(ray)));
    }
    scene.batch(rays).nearest(hits);
    scene.batch(rays).any(found);
}

#[test]
fn no_number_of_an_ordinary_ray_is_denormal() {
    let model = bth_scenes::knot::torus_knot(4000);
    let mut scenes: Vec<_> =
        every_structure(&model, true).into_iter().map(|traced| (traced.name, traced.scene)).collect();
    let crowd = bth::from_bytes(&bth_tests::crowd::crowd(300, true)).expect("a valid scene");
    scenes.push(("instances".into(), crowd));
    let count = 600;
    let (mut hits, mut found) = (vec![Hit::MISS; count], vec![false; count]);
    // Scalar code is for processors without SSE4.1, and the compiler chooses what lies in unused
    // lanes.
    for isa in [Isa::Sse4, Isa::Avx2, Isa::Avx512].into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("it is available");
        for (name, scene) in &scenes {
            for (tmin, tmax) in [
                (0.0, f32::INFINITY),
                (1e-4, f32::MAX),
                (0.0, 1e30),
                (1e-3, 2.5),
                (f32::MIN_POSITIVE, f32::MAX),
            ] {
                // Walks through tetrahedra multiply tmin by areas, and without a fused
                // multiplication there are more products.
                if tmin == f32::MIN_POSITIVE && (isa == Isa::Sse4 || !name.starts_with("bvh")) {
                    continue;
                }
                let rays = ordinary(count, tmin, tmax);
                scene.batch(&rays).nearest(&mut hits);
                let some = hits.iter().filter(|hit| hit.is_hit()).count();
                assert!(some > 20, "{name}: {some} hits");
                let onward: Vec<StartRay> = onward(&hits, model.triangles.len(), 2)
                    .into_iter()
                    .map(|ray| ray.with_tmax(tmax))
                    .collect();
                let flags = denormal_flags(|| trace(scene, &rays, &mut hits, &mut found));
                assert_eq!(flags, 0, "{name}, {isa}, rays from {tmin} to {tmax}");
                let flags = denormal_flags(|| trace(scene, &onward, &mut hits, &mut found));
                assert_eq!(flags, 0, "{name}, {isa}, rays from starts to {tmax}");
            }
        }
    }
}

#[test]
fn no_number_of_a_ray_from_the_hit_itself_is_denormal() {
    let model = cube(4, None);
    let mut rng = Rng::new(11);
    // From a side of the cube, with t = 0 where the ray hits it.
    let rays: Vec<Ray> = (0..600)
        .map(|i| {
            let mut origin = [(); 3].map(|()| (rng.unit_f32() - 0.5) * 7.9);
            origin[i % 3] = if i % 2 == 0 { 4.0 } else { -4.0 };
            Ray::new(origin, rng.unit_vector().map(|x: f64| x as f32))
        })
        .collect();
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    for isa in [Isa::Sse4, Isa::Avx2, Isa::Avx512].into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("it is available");
        for traced in structures_named(&model, false, |name| name.starts_with("bvh")) {
            traced.scene.batch(&rays).nearest(&mut hits);
            assert!(hits.iter().all(|hit| hit.t == 0.0), "{}", traced.name);
            let flags = denormal_flags(|| trace(&traced.scene, &rays, &mut hits, &mut found));
            assert_eq!(flags, 0, "{}, {isa}", traced.name);
        }
    }
}

#[test]
fn the_flags_tell_denormal_numbers() {
    let product = |a: f32, b: f32| {
        denormal_flags(|| {
            std::hint::black_box(std::hint::black_box(a) * b);
        })
    };
    assert_eq!(product(1e-20, 1e-10), 0);
    assert_ne!(product(1e-20, 1.23e-20), 0, "a denormal product");
    assert_ne!(product(1e-40, 1e10), 0, "a denormal factor");
}
