//! Which rays end, for two parallel triangles: the conformance file `free-directions`. From the upper one nothing is met upwards, from
//! the lower one nothing straight up within 1.

use super::find_rest;
use crate::rays::Ray;
use crate::simd::Isa;
use bth_format::File;
use bth_format::layout::NONE;

const FILE: &[u8] = include_bytes!("../../../../format-spec/conformance/valid/free-directions.bth");

/// Whether a ray ends without being traced, alone and in lanes.
fn ends(ray: Ray, from: u32) -> bool {
    let file = File::from_bytes(FILE).unwrap();
    let object = file.check(0).unwrap();
    let alone = super::certainly_misses(&object, &ray, from);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        let mut rest = Vec::new();
        super::decide(&object, &[ray; 16], &[from; 16], 0..16, &mut rest);
        assert!(rest.is_empty() || rest.len() == 16);
        assert_eq!(rest.is_empty(), alone, "{isa}: {ray:?}");
    }
    Isa::best().choose().unwrap();
    alone
}

fn ray(height: f32, direction: [f32; 3]) -> Ray {
    Ray { origin: [0.25, 0.25, height], tmin: 0.0, direction, tmax: f32::INFINITY }
}

#[test]
fn rays_that_certainly_leave_in_a_free_direction_end() {
    let up = [0.0, 0.0, 1.0];
    assert!(ends(ray(10.01, up), 1));
    assert!(ends(ray(10.01, [0.0, 0.3, 0.4]), 1));
    assert!(ends(ray(10.01, [100.0, 300.0, 400.0]), 1) == ends(ray(10.01, [0.25, 0.75, 1.0]), 1));
    // From before the triangle, with a range that begins behind it.
    assert!(ends(Ray { tmin: 1.5, ..ray(9.0, up) }, 1));
    // Downwards; before the triangle; on it; beside it; too steep; from no or another triangle.
    assert!(!ends(ray(10.01, [0.0, 0.0, -1.0]), 1));
    assert!(!ends(ray(9.99, up), 1));
    assert!(!ends(Ray { tmin: 1.0, ..ray(9.0, up) }, 1));
    assert!(!ends(ray(10.0, up), 1));
    assert!(!ends(Ray { origin: [0.7, 0.7, 10.01], ..ray(0.0, up) }, 1));
    assert!(!ends(ray(10.001, [1.0, 0.0, 0.05]), 1));
    for from in [2, 77, NONE] {
        assert!(!ends(ray(10.01, up), from));
    }
}

#[test]
fn rays_that_end_within_the_reach_end() {
    let up = [0.0, 0.0, 2.0];
    let within = |tmax: f32| ends(Ray { tmax, ..ray(0.01, up) }, 0);
    assert!(within(0.25) && within(0.49) && !within(0.5) && !within(f32::INFINITY));
    // Another bin than the one in the middle.
    assert!(!ends(Ray { tmax: 0.25, ..ray(0.01, [1.0, 0.0, 1.0]) }, 0));
}

#[test]
fn numbers_that_are_none_end_nothing() {
    for x in [0.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE, f32::MAX] {
        assert!(!ends(ray(10.01, [0.0, 0.0, x]), 1));
        assert!(
            !ends(Ray { tmin: -x, ..ray(10.01, [0.0, 0.0, 1.0]) }, 1) || x == 0.0 || x == f32::MIN_POSITIVE
        );
        assert!(!ends(Ray { origin: [x, f32::NAN, 1.0], ..ray(0.0, [0.0, 0.0, 1.0]) }, 1));
    }
}

#[test]
fn batches_of_which_few_rays_end_are_traced_whole() {
    let file = File::from_bytes(FILE).unwrap();
    let object = file.check(0).unwrap();
    let (free, other) = (ray(10.01, [0.0, 0.0, 1.0]), ray(10.01, [0.0, 0.0, -1.0]));
    let rays: Vec<Ray> = (0..192).map(|i| if i % 2 == 0 { free } else { other }).collect();
    let mut rest = Vec::new();
    assert!(find_rest(&object, &rays, &[1; 192], false, &mut rest));
    assert_eq!(rest, (0..192).filter(|i| i % 2 == 1).collect::<Vec<u32>>());
    let mut few = [other; 192];
    few[100] = free;
    assert!(!find_rest(&object, &few, &[1; 192], false, &mut rest));
    assert!(find_rest(&object, &few, &[1; 192], true, &mut rest));
    assert_eq!(rest, (0..192).filter(|i| *i != 100).collect::<Vec<u32>>());
}
