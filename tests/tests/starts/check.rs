//! What every query must answer.

use bth::rays::{Hit, Ray, StartRay};
use bth::{Accept, Cull, Isa, Scene};
use bth_tests::oracle::{self, starts, to_f64};
use bth_tests::rays::{alone, check_batch};
use bth_tests::structures::bits;
use std::sync::{Mutex, MutexGuard, PoisonError};

pub(crate) type Corners = Vec<[[f32; 3]; 3]>;

/// A condition, and a function that says if a hit satisfies it.
type Condition<'a> = (Accept<'a>, &'a dyn Fn(&Hit) -> bool);

/// The instruction set is a setting of the whole process, so tests that set it run one after the
/// other.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The instruction sets of this machine.
pub(crate) fn isas() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available())
}

/// The corners of an object's triangles by id, as the file stores them. Triangles that it does not
/// hold have no area.
pub(crate) fn corners_of(scene: &Scene, object: u32) -> Corners {
    let view = scene.object(object);
    let mut corners = vec![[[0.0; 3]; 3]; view.header.triangles as usize];
    for triangle in oracle::triangles(&view) {
        let id = triangle.id as usize;
        if id >= corners.len() {
            corners.resize(id + 1, [[0.0; 3]; 3]);
        }
        corners[id] = triangle.corners;
    }
    corners
}

/// Returns true if a reported t is the exact one to half a unit in the last place, but for 2^-28.
fn is_rounded(t: f32, exact: f64) -> bool {
    let t_exact = exact as f32;
    let near = (f64::from(t.next_up()) - f64::from(t)).min(f64::from(t) - f64::from(t.next_down()));
    t == t_exact || (f64::from(t) - exact).abs() <= 0.5 * near + exact.abs() / f64::from(1 << 28)
}

/// Checks a hit of a ray against the exact one.
fn check_nearest(
    corners: &Corners,
    ray: &StartRay,
    hit: &Hit,
    truth: Option<&oracle::ExactHit>,
    context: &str,
) {
    let context = || format!("{context}: {ray:?}: {hit:?}, exactly {truth:?}");
    let Some(truth) = truth else {
        assert!(!hit.is_hit(), "ghost: {}", context());
        return;
    };
    assert!(hit.is_hit(), "miss: {}", context());
    assert!(is_rounded(hit.t, truth.t_f64()), "t: {}", context());
    let triangle = hit.primitive.triangle;
    let at = starts::intersection(corners, ray, triangle);
    let Some(at) = at else { panic!("the triangle is not hit: {}", context()) };
    if !truth.triangles.contains(&triangle) {
        // Another triangle at the same t but for the accuracy of f64.
        let gap = to_f64(&at.t) - truth.t_f64();
        assert!(gap.abs() <= truth.t_f64() / f64::from(1 << 27), "other triangle: {}", context());
    }
    for (reported, exact) in [(hit.u, &at.u), (hit.v, &at.v)] {
        let off = (f64::from(reported) - to_f64(exact)).abs();
        assert!(off <= 4e-8 && reported >= 0.0, "weights, off by {off}: {}", context());
    }
    assert!(hit.u + hit.v <= 1.0 + 1.0 / (1 << 22) as f32, "sum of weights: {}", context());
}

/// Checks the queries for several hits against the exact hits.
fn check_all(scene: &Scene, corners: &Corners, ray: &StartRay, nearest: Option<Hit>, context: &str) {
    let everything = Accept::default();
    let context = || format!("{context}: {ray:?}");
    let (mut all, mut some) = (Vec::new(), Vec::new());
    scene.all_hits(ray, &everything, &mut all);
    let truth = oracle::all_hits(corners, ray);
    let sorted = |ids: Vec<u32>| {
        let mut ids = ids;
        ids.sort_unstable();
        ids
    };
    let ids = sorted(all.iter().map(|hit| hit.primitive.triangle).collect());
    let expected = sorted(truth.iter().map(|(id, _)| *id).collect());
    assert_eq!(ids, expected, "all hits of {}: {all:?} {truth:?}", context());
    for (hit, (_, at)) in all.iter().zip(&truth) {
        assert!(is_rounded(hit.t, to_f64(&at.t)), "order of {}: {all:?} {truth:?}", context());
    }
    assert_eq!(all.first().map(bits), nearest.as_ref().map(bits), "first of all hits of {}", context());
    assert_eq!(scene.count_hits(ray, &everything), all.len(), "{}", context());
    for k in [1, 2, 5] {
        scene.nearest_hits(ray, k, &everything, &mut some);
        assert!(some.iter().map(bits).eq(all.iter().take(k).map(bits)), "nearest {k} of {}", context());
    }
    let even = |_: &Ray, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    let at_origin = Ray::new([0.0; 3], ray.direction);
    let is_front = |hit: &Hit| oracle::is_front(at_origin, corners[hit.primitive.triangle as usize]);
    let conditions: [Condition<'_>; 5] = [
        (Accept { filter: Some(&even), ..everything }, &|hit| hit.primitive.triangle.is_multiple_of(2)),
        (Accept { cull: Cull::Back, ..everything }, &is_front),
        (Accept { cull: Cull::Front, ..everything }, &|hit| !is_front(hit)),
        (Accept { filter: Some(&|_, _| true), ..everything }, &|_| true),
        (Accept { mask: 0, ..everything }, &|_| false),
    ];
    for (accept, keeps) in conditions {
        let left: Vec<_> = all.iter().filter(|hit| keeps(hit)).map(bits).collect();
        let first = scene.nearest_accepted(ray, &accept).as_ref().map(bits);
        assert_eq!(first, left.first().copied(), "{accept:?}: {}", context());
        assert_eq!(scene.any_accepted(ray, &accept), !left.is_empty(), "{accept:?}: {}", context());
        scene.all_hits(ray, &accept, &mut some);
        assert!(some.iter().map(bits).eq(left.iter().copied()), "{accept:?}: {}", context());
        assert_eq!(scene.count_hits(ray, &accept), left.len(), "{accept:?}: {}", context());
    }
    assert_eq!(scene.crossings(ray), oracle::crossings(corners, ray), "crossings of {}", context());
}

/// Checks rays from the triangles of a scene of one object against the oracle, and on every
/// instruction set. Returns how many hit.
pub(crate) fn check(scene: &Scene, corners: &Corners, rays: &[StartRay], context: &str) -> usize {
    check_with(scene, corners, rays, context, &|ray, hit, context| {
        check_all(scene, corners, ray, hit.is_hit().then_some(*hit), context);
    })
}

/// As [`check`], for the nearest hit and any hit, and what `check_one` checks.
pub(crate) fn check_with(
    scene: &Scene,
    corners: &Corners,
    rays: &[StartRay],
    context: &str,
    check_one: &dyn Fn(&StartRay, &Hit, &str),
) -> usize {
    Isa::Scalar.choose().expect("it is everywhere");
    let expected = alone(scene, rays);
    for (ray, hit) in rays.iter().zip(&expected) {
        let truth = oracle::nearest(corners, ray);
        check_nearest(corners, ray, hit, truth.as_ref(), context);
        assert_eq!(scene.any(ray), truth.is_some(), "{context}: any hit of {ray:?}");
        assert_eq!(oracle::any(corners, ray), truth.is_some(), "{ray:?}");
    }
    check_isas(scene, rays, &expected, context, check_one);
    expected.iter().filter(|hit| hit.is_hit()).count()
}

/// Checks on every instruction set that rays have these hits, alone and in batches of all sizes,
/// and calls `check_one` for some of them.
pub(crate) fn check_isas(
    scene: &Scene,
    rays: &[StartRay],
    expected: &[Hit],
    context: &str,
    check_one: &dyn Fn(&StartRay, &Hit, &str),
) {
    let count = rays.len().max(1000);
    let many: Vec<StartRay> = rays.iter().copied().cycle().take(count).collect();
    let hits: Vec<Hit> = expected.iter().copied().cycle().take(count).collect();
    for (turn, isa) in isas().enumerate() {
        isa.choose().expect("it is available");
        let context = format!("{context}, {isa}");
        for (ray, hit) in rays.iter().zip(expected) {
            assert_eq!(bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), bits(hit), "{context}: {ray:?} alone");
            assert_eq!(scene.any(ray), hit.is_hit(), "{context}: any hit of {ray:?} alone");
            assert_eq!(bits(&scene.nearest_counted(ray).0), bits(hit), "{context}: {ray:?} counted");
        }
        for (ray, hit) in rays.iter().zip(expected).skip(turn).step_by(4) {
            check_one(ray, hit, &context);
        }
        for size in [1, 5, 16, 64, 1000] {
            for (rays, hits) in many.chunks(size).zip(hits.chunks(size)) {
                check_batch(scene, rays, hits, format_args!("{context}, {size} rays"));
            }
        }
    }
    Isa::best().choose().expect("the best is available");
}
