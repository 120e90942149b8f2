//! Which rays end or begin later, for two parallel triangles: the conformance files
//! `free-directions` and `free-distances`. From the upper one, at the height 10, nothing is hit
//! upwards, from the lower one nothing straight up within 4; by the latter file nothing within 1
//! straight down from the upper one, either.

use crate::rays::{Hit, PrimitiveRef, Start, StartRay};
use crate::simd::Isa;
use crate::starts::prepare::PreparedStarts;
use bth_format::File;
use bth_format::layout::NONE;
use bth_random::Rng;
use std::sync::{Mutex, PoisonError};

const DIRECTIONS: &[u8] = include_bytes!("../../../../../format-spec/conformance/valid/free-directions.bth");
const DISTANCES: &[u8] = include_bytes!("../../../../../format-spec/conformance/valid/free-distances.bth");
const UP: [f32; 3] = [0.0, 0.0, 1.0];
const DOWN: [f32; 3] = [0.0, 0.0, -1.0];

/// A ray that starts within a triangle.
fn ray(triangle: u32, direction: [f32; 3]) -> StartRay {
    Start { primitive: PrimitiveRef { instance: 0, triangle }, u: 0.25, v: 0.25 }.ray(direction)
}

/// How a ray is prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PreparedByKernel {
    /// It starts on no triangle.
    Unusable,
    /// It ends without being traced.
    Ended,
    /// Its range begins here.
    Begins(f32),
}

/// The rays, prepared with this instruction set.
fn prepared(isa: Isa, file: &[u8], rays: &[StartRay]) -> Vec<PreparedByKernel> {
    // Which instruction set is used is a setting of the process.
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let file = File::from_bytes(file).unwrap();
    let object = file.check(0).unwrap();
    // What was prepared before does not matter.
    let mut prepared = PreparedStarts::default();
    prepared.fill(&object, &[ray(1, UP), ray(0, DOWN), ray(7, UP)].repeat(11), 0);
    isa.choose().unwrap();
    prepared.fill(&object, rays, 0);
    Isa::best().choose().unwrap();
    assert!(prepared.order.is_sorted(), "{isa}");
    let of = |i: usize| {
        let (point, of_object) = (&prepared.points[i], &prepared.rays[i]);
        let goes_on = prepared.order.contains(&(i as u32));
        if !point.is_on_triangle() {
            assert!(!goes_on, "{isa}: {:?}", rays[i]);
            return PreparedByKernel::Unusable;
        }
        let StartRay { start, direction, tmax } = rays[i];
        let height = start.primitive.triangle as f32 * 10.0;
        assert_eq!(of_object.origin, [start.u, start.v, height], "{isa}: {:?}", rays[i]);
        let same = direction.map(f32::to_bits) == of_object.direction.map(f32::to_bits);
        assert!(same && of_object.tmax.to_bits() == tmax.to_bits(), "{isa}: {of_object:?} {:?}", rays[i]);
        if goes_on { PreparedByKernel::Begins(of_object.tmin) } else { PreparedByKernel::Ended }
    };
    (0..rays.len()).map(of).collect()
}

fn available() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available())
}

/// How a ray is prepared alone. In lanes it is about the same.
fn begin(file: &[u8], ray: StartRay) -> PreparedByKernel {
    let [alone] = prepared(Isa::Scalar, file, &[ray])[..] else { unreachable!("one ray") };
    for isa in available() {
        // The last ray is less than a group.
        let all = prepared(isa, file, &[ray; 17]);
        assert_eq!(all[16], alone, "{isa}: {ray:?}");
        for of in all {
            let is_close = match (of, alone) {
                (PreparedByKernel::Begins(of), PreparedByKernel::Begins(alone)) => {
                    of <= alone && of >= 0.99 * alone
                }
                _ => of == alone,
            };
            assert!(is_close, "{isa}: {of:?} {alone:?} {ray:?}");
        }
    }
    alone
}

/// Returns true if a ray ends, by the file with directions.
fn ends(ray: StartRay) -> bool {
    begin(DIRECTIONS, ray) == PreparedByKernel::Ended
}

#[test]
fn rays_that_leave_in_a_free_direction_end() {
    assert!(ends(ray(1, UP)));
    assert!(ends(ray(1, [0.0, 0.3, 0.4])));
    assert!(ends(ray(1, [0.0, 0.0, 400.0])));
    // From an edge and a corner.
    for [u, v] in [[0.0, 0.5], [0.5, 0.5], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
        let at = ray(1, UP);
        assert!(ends(StartRay { start: Start { u, v, ..at.start }, ..at }));
    }
    // Downwards; too steep; along the triangle.
    assert!(!ends(ray(1, DOWN)));
    assert!(!ends(ray(1, [1.0, 0.0, 0.05])));
    assert!(!ends(ray(1, [1.0, 0.0, 0.0])));
    for triangle in [2, 77, NONE] {
        assert_eq!(begin(DIRECTIONS, ray(triangle, UP)), PreparedByKernel::Unusable);
    }
    let mut elsewhere = ray(1, UP);
    elsewhere.start.primitive.instance = 1;
    assert_eq!(begin(DIRECTIONS, elsewhere), PreparedByKernel::Unusable);
}

#[test]
fn rays_that_end_within_a_distance_end() {
    for file in [DIRECTIONS, DISTANCES] {
        let up = ray(0, [0.0, 0.0, 2.0]);
        let within = |tmax: f32| begin(file, up.with_tmax(tmax)) == PreparedByKernel::Ended;
        assert!(within(0.25) && within(1.98) && !within(2.0) && !within(f32::INFINITY));
        // Another sector than the one in the middle.
        assert_eq!(begin(file, ray(0, [3.0, 0.0, 1.0]).with_tmax(0.25)), PreparedByKernel::Begins(0.0));
    }
}

#[test]
fn other_rays_begin_behind_that_distance() {
    let is_about = |begin: PreparedByKernel, expected: f32| {
        let PreparedByKernel::Begins(begin) = begin else { panic!("a ray that does not end") };
        assert!(begin <= expected && begin > 0.99 * expected, "{begin} {expected}");
    };
    for file in [DIRECTIONS, DISTANCES] {
        is_about(begin(file, ray(0, UP)), 4.0);
        is_about(begin(file, ray(0, [0.0, 0.0, 2.0])), 2.0);
        is_about(begin(file, ray(0, [0.1, 0.1, 1.0])), 4.0 / 1.02f32.sqrt());
    }
    // Of the lower one's back only the file with distances of both sides tells the last level.
    assert_eq!(begin(DIRECTIONS, ray(0, DOWN)), PreparedByKernel::Begins(0.0));
    is_about(begin(DISTANCES, ray(0, DOWN)), 4.0);
    // Downwards from the upper one, which only the file with distances of both sides tells.
    assert_eq!(begin(DIRECTIONS, ray(1, DOWN)), PreparedByKernel::Begins(0.0));
    is_about(begin(DISTANCES, ray(1, DOWN)), 1.0);
    is_about(begin(DISTANCES, ray(1, UP)), 4.0);
}

#[test]
fn numbers_that_are_none_end_nothing() {
    for x in [0.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE, f32::MAX] {
        assert!(!ends(ray(1, [0.0, 0.0, x])));
        assert!(!ends(ray(1, [x, f32::NAN, 1.0])));
    }
    for bad in [f32::NAN, f32::INFINITY, -0.1, 1.1, f32::NEG_INFINITY] {
        let mut at = ray(1, UP);
        at.start.u = bad;
        assert_eq!(begin(DIRECTIONS, at), PreparedByKernel::Unusable, "{bad}");
        (at.start.u, at.start.v) = (0.0, bad);
        assert_eq!(begin(DIRECTIONS, at), PreparedByKernel::Unusable, "{bad}");
    }
}

/// Rays that differ in one group, on both triangles and on none.
#[test]
fn lanes_decide_as_single_rays() {
    let mut rng = Rng::new(17);
    let mut unit = || rng.below(1 << 12) as f32 / (1 << 11) as f32 - 1.0;
    let rays: Vec<StartRay> = (0..16 * 200)
        .map(|i| {
            let direction = [(); 3].map(|()| unit() * [1.0, 1e-3, 100.0][i % 3]);
            let tmax = if i % 5 == 0 { unit().abs() * 8.0 } else { f32::INFINITY };
            // Runs of rays start on one triangle.
            let triangle = [0, 0, 0, 1, 1, 0, 1, 2][i / [1, 3, 16][i / 96 % 3] % 8];
            let mut ray = ray(triangle, direction).with_tmax(tmax);
            ray.start.u = (unit().abs() * 0.5).min(0.5);
            ray
        })
        .collect();
    for file in [DIRECTIONS, DISTANCES] {
        let expected = prepared(Isa::Scalar, file, &rays);
        for isa in available() {
            let found = prepared(isa, file, &rays);
            let mut different = 0;
            for (i, (found, expected)) in found.into_iter().zip(&expected).enumerate() {
                let same = match (found, *expected) {
                    (PreparedByKernel::Begins(found), PreparedByKernel::Begins(expected)) => {
                        found <= expected && found >= 0.9 * expected
                    }
                    _ => found == *expected,
                };
                // Near the border of a bin they may differ.
                different += usize::from(!same);
                let unusable = [found, *expected].map(|of| of == PreparedByKernel::Unusable);
                assert!(unusable[0] == unusable[1], "{isa}, ray {i}: {found:?} {expected:?}");
            }
            assert!(different * 100 < rays.len(), "{isa}: {different} of {}", rays.len());
        }
        let ended = expected.iter().filter(|of| **of == PreparedByKernel::Ended).count();
        let later =
            expected.iter().filter(|of| matches!(of, PreparedByKernel::Begins(t) if *t > 0.0)).count();
        assert!(ended > 50 && later > 50, "{ended} ended, {later} begin later");
    }
}

/// Batches in which no rays, few rays and most rays end.
#[test]
fn rays_that_end_change_no_answer() {
    for file in [DIRECTIONS, DISTANCES] {
        let scene = crate::from_bytes(file).unwrap();
        for share in [0, 100, 9, 7, 2, 1] {
            let rays: Vec<StartRay> = (0..192)
                .map(|i| if share > 0 && i % share == 0 { ray(1, UP) } else { ray((i % 2) as u32, DOWN) })
                .map(|of| if of.start.primitive.triangle == 0 { ray(0, UP) } else { of })
                .collect();
            let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            scene.batch(&rays).nearest(&mut hits);
            scene.batch(&rays).any(&mut found);
            for (i, ray) in rays.iter().enumerate() {
                let is_hit = ray.direction == DOWN || ray.start.primitive.triangle == 0;
                assert_eq!((hits[i].is_hit(), found[i]), (is_hit, is_hit), "{share}, {i}: {ray:?}");
                assert_eq!(scene.nearest(ray), is_hit.then_some(hits[i]), "{share}, {i}: {ray:?}");
                assert!(!is_hit || hits[i].t == 10.0, "{:?}", hits[i]);
            }
        }
    }
}
