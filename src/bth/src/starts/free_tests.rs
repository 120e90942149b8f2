//! Which rays end or begin later, for two parallel triangles: the conformance files `free-directions` and `free-distances`. From the
//! upper one, at the height 10, nothing is met upwards, from the lower one nothing straight up within 4; by the latter file nothing within 1
//! straight down from the upper one, either.

use super::{Rest, find_rest, single};
use crate::rays::Ray;
use crate::simd::Isa;
use bth_format::File;
use bth_format::layout::NONE;
use std::sync::{Mutex, PoisonError};

const DIRECTIONS: &[u8] = include_bytes!("../../../../format-spec/conformance/valid/free-directions.bth");
const DISTANCES: &[u8] = include_bytes!("../../../../format-spec/conformance/valid/free-distances.bth");

/// Where the range of a ray begins that is looked up alone and in lanes; `None` if it ends without being traced.
fn begin(file: &[u8], ray: Ray, from: u32) -> Option<f32> {
    let file = File::from_bytes(file).unwrap();
    let object = file.check(0).unwrap();
    let alone = single::begin(&object, &ray, from);
    let ends = alone == f32::INFINITY || ray.tmax < alone;
    let is_later = alone > ray.tmin;
    assert!(ends || is_later || alone.to_bits() == ray.tmin.to_bits());
    // Which instruction set is used is a setting of the process.
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        let mut rest = Rest { order: Vec::new(), rays: vec![Ray::new([7.0; 3], [7.0; 3]); 17] };
        let later = super::decide(&object, &[ray; 17], &[from; 17], 0..17, &mut rest);
        // The last ray is less than a group, and left as it is; in scalar code there are no groups.
        let groups = if isa == Isa::Scalar { 17 } else { 16 };
        assert_eq!(rest.order.len(), if ends { 17 - groups } else { 17 }, "{isa}: {ray:?}");
        assert_eq!(later, if is_later && !ends { groups } else { 0 }, "{isa}: {ray:?}");
        for (i, of) in rest.rays.iter().enumerate() {
            let begin = of.tmin;
            assert_eq!(bits(&Ray { tmin: ray.tmin, ..*of }), bits(&ray), "{isa}");
            let is_close = begin <= alone && alone - begin <= 1e-2 * (alone - ray.tmin);
            assert!(
                ends || i >= groups || begin.to_bits() == alone.to_bits() || is_close,
                "{isa}: {begin} {alone} {ray:?}"
            );
        }
    }
    Isa::best().choose().unwrap();
    (!ends).then_some(alone)
}

fn bits(ray: &Ray) -> [u32; 8] {
    Ray::rows(std::slice::from_ref(ray))[0]
}

/// Whether a ray ends, by the file with directions.
fn ends(ray: Ray, from: u32) -> bool {
    begin(DIRECTIONS, ray, from).is_none()
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
fn rays_that_end_within_a_distance_end() {
    for file in [DIRECTIONS, DISTANCES] {
        let up = [0.0, 0.0, 2.0];
        let within = |tmax: f32| begin(file, Ray { tmax, ..ray(0.01, up) }, 0).is_none();
        assert!(within(0.25) && within(1.98) && !within(2.0) && !within(f32::INFINITY));
        // Another sector than the one in the middle.
        assert!(begin(file, Ray { tmax: 0.25, ..ray(0.01, [3.0, 0.0, 1.0]) }, 0).is_some());
    }
}

#[test]
fn other_rays_begin_behind_that_distance() {
    let is_about = |begin: Option<f32>, expected: f32| {
        let begin = begin.expect("a ray that does not end");
        assert!(begin <= expected && begin > 0.99 * expected, "{begin} {expected}");
    };
    for file in [DIRECTIONS, DISTANCES] {
        // The line crosses the triangle at a height of 0, at the t of -0.01 and 0.5.
        is_about(begin(file, ray(0.01, [0.0, 0.0, 1.0]), 0), 3.99);
        is_about(begin(file, Ray { tmin: 0.75, ..ray(-1.0, [0.0, 0.0, 2.0]) }, 0), 2.0);
        is_about(begin(file, ray(0.01, [0.1, 0.1, 1.0]), 0), 4.0 / 1.02f32.sqrt() - 0.01);
        // The range begins behind that distance already; in doubt about the crossing; not before `tmin`.
        assert_eq!(begin(file, Ray { tmin: 5.0, ..ray(0.01, [0.0, 0.0, 1.0]) }, 0), Some(5.0));
        assert_eq!(begin(file, ray(0.0, [0.0, 0.0, 1.0]), 0), Some(0.0));
        assert_eq!(begin(file, ray(-1.0, [0.0, 0.0, 1.0]), 0), Some(0.0));
    }
    // Downwards from the upper one, which only the file with distances of both sides tells.
    let down = ray(9.99, [0.0, 0.0, -1.0]);
    assert_eq!(begin(DIRECTIONS, down, 1), Some(0.0));
    is_about(begin(DISTANCES, down, 1), 0.99);
    // From below upwards, and from above through the triangle.
    assert_eq!(begin(DISTANCES, ray(9.99, [0.0, 0.0, 1.0]), 1), Some(0.0));
    is_about(begin(DISTANCES, Ray { tmin: 0.02, ..ray(10.01, [0.0, 0.0, -1.0]) }, 1), 1.01);
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
fn batches_in_which_little_is_saved_are_traced_as_they_are() {
    let file = File::from_bytes(DIRECTIONS).unwrap();
    let object = file.check(0).unwrap();
    let (free, other) = (ray(10.01, [0.0, 0.0, 1.0]), ray(10.01, [0.0, 0.0, -1.0]));
    let rays: Vec<Ray> = (0..192).map(|i| if i % 2 == 0 { free } else { other }).collect();
    let mut rest = Rest::default();
    assert!(find_rest(&object, &rays, &[1; 192], false, &mut rest));
    assert_eq!(rest.order, (0..192).filter(|i| i % 2 == 1).collect::<Vec<u32>>());
    let mut few = [other; 192];
    few[100] = free;
    assert!(!find_rest(&object, &few, &[1; 192], false, &mut rest));
    assert!(find_rest(&object, &few, &[1; 192], true, &mut rest));
    assert_eq!(rest.order, (0..192).filter(|i| *i != 100).collect::<Vec<u32>>());
    assert_eq!(rest.rays.len(), 192);
    // Rays that begin later save something, too.
    assert!(find_rest(&object, &[ray(0.01, [0.0, 0.0, 1.0]); 192], &[0; 192], false, &mut rest));
    assert_eq!(rest.order.len(), 192);
}
