//! Queries that are converted to one of either goal, and back.

use super::*;
use bth_random::Rng;

/// One of a few values, so that equal ones are frequent. Some lie at the ends of ranges, some are
/// infinite or NaN.
fn value(rng: &mut Rng) -> f32 {
    const VALUES: [f32; 10] =
        [f32::NEG_INFINITY, -1.0, -0.0, 0.5, 1.0, 1.000_000_1, 2.0, f32::MAX, f32::INFINITY, f32::NAN];
    VALUES[rng.below(VALUES.len() as u64) as usize]
}

/// What a query lets others see of itself.
fn state<G: Goal>(query: &RayQuery<G>, ids: &[u32]) -> (String, u64, Option<u64>) {
    let found = query.found().map(f64::to_bits);
    (format!("{:?}", query.answer(ids, 7)), query.limit().to_bits(), found)
}

/// Offers the same intersections to a query, to one that is converted there and back after each of
/// them, and to one of either goal.
fn converted_queries_are_the_same<G: Goal>(goal: G, rng: &mut Rng) -> bool {
    let ids = [5, 3, 9, 1, 0, 2];
    let ray = Ray { origin: [0.0; 3], tmin: value(rng), direction: [1.0; 3], tmax: value(rng) };
    let mut query = RayQuery::new(goal, &ray);
    let (mut back, mut either) = (query, query.to_either());
    for _ in 0..rng.below(6) {
        let number = rng.below(ids.len() as u64) as u32;
        let triangle = match rng.below(2) {
            0 => TriangleRef::id(number, &ids),
            _ => TriangleRef::index(number, &ids),
        };
        let weight = [0.0; 3].map(|_| rng.below(3) as f64);
        let intersection = Intersection { t: f64::from(value(rng)), weight };
        let done = query.offer(triangle, intersection);
        assert_eq!(back.offer(triangle, intersection), done, "{ray:?}");
        assert_eq!(either.offer(triangle, intersection), done, "{ray:?}");
        back = back.to_either().with_goal(back.goal());
        let expected = state(&query, &ids);
        assert_eq!(state(&back, &ids), expected, "{ray:?}");
        assert_eq!(state(&either, &ids), expected, "{ray:?}");
        if done {
            break;
        }
    }
    either.answer(&ids, 7).is_hit()
}

#[test]
fn queries_that_are_converted_there_and_back_give_the_same_answers() {
    let mut rng = Rng::new(83);
    let mut hits = [0; 4];
    for _ in 0..20_000 {
        hits[0] += u32::from(converted_queries_are_the_same(NearestHit, &mut rng));
        hits[1] += u32::from(converted_queries_are_the_same(AnyHit, &mut rng));
        for (is_any, hits) in [false, true].into_iter().zip(&mut hits[2..]) {
            *hits += u32::from(converted_queries_are_the_same(EitherGoal { is_any }, &mut rng));
        }
    }
    assert!(hits.iter().all(|hits| (2_000..18_000).contains(hits)), "{hits:?}");
}

/// A t beyond the finite numbers of f32, in either direction, is not a hit: it does not give a
/// point.
#[test]
fn hits_at_infinity_are_none() {
    let ray = Ray::new([0.0; 3], [1.0; 3]).with_range(f32::NEG_INFINITY, f32::INFINITY);
    for (t, is_hit) in [(3.5e38, false), (3.4e38, true), (-3.4e38, true), (-3.5e38, false)] {
        let (triangle, intersection) = (TriangleRef::id(0, &[]), Intersection { t, weight: [0.0, 0.0, 1.0] });
        let (mut nearest, mut any) = (RayQuery::new(NearestHit, &ray), RayQuery::new(AnyHit, &ray));
        nearest.offer(triangle, intersection);
        assert_eq!(nearest.answer(&[], 0).is_hit(), is_hit, "{t}");
        assert_eq!(any.offer(triangle, intersection), is_hit, "{t}");
        let mut either = EitherQuery::new(EitherGoal { is_any: true }, &ray);
        assert_eq!(either.offer_bounds((t, t)), is_hit, "{t}");
        let in_object =
            Hit { t: (t / 4.0) as f32, u: 0.0, v: 0.0, primitive: PrimitiveRef { instance: 0, triangle: 0 } };
        assert_eq!(better(&ray, &Hit::MISS, &in_object, 4.0).is_some(), is_hit, "{t}");
    }
}

#[test]
fn bounds_complete_queries_for_any_hit_only_if_all_t_between_them_do() {
    let mut rng = Rng::new(84);
    let mut completed = 0;
    for _ in 0..20_000 {
        let ray = Ray { origin: [0.0; 3], tmin: value(&mut rng), direction: [1.0; 3], tmax: value(&mut rng) };
        let (a, b) = (f64::from(value(&mut rng)), f64::from(value(&mut rng)));
        let new = |is_any| EitherQuery::new(EitherGoal { is_any }, &ray);
        let (mut nearest, mut any) = (new(false), new(true));
        assert!(!nearest.offer_bounds((a, b)) && nearest.found().is_none(), "{ray:?}");
        let done = any.offer_bounds((a, b));
        assert_eq!(any.answer(&[], 0).is_hit(), done, "{ray:?}");
        completed += u32::from(done);
        for t in [a, b, (a + b) / 2.0].into_iter().filter(|t| done && (a..=b).contains(t)) {
            let intersection = Intersection { t, weight: [0.0, 0.0, 1.0] };
            assert!(new(true).offer(TriangleRef::id(0, &[]), intersection), "{ray:?}: {t}");
        }
    }
    assert!(completed > 1_000, "{completed}");
}

#[test]
fn bits_are_compared_as_numbers_are() {
    let tiny = f32::from_bits(1);
    let some = [0.0, tiny, 1e-40, f32::MIN_POSITIVE, 0.5, 1.0, f32::MAX, f32::INFINITY];
    for t in some.iter().flat_map(|x| [*x, -x]) {
        for tmin in some.iter().flat_map(|x| [*x, -x]) {
            assert_eq!(reaches(t, tmin), tmin <= t, "{t} {tmin}");
        }
    }
}
