//! Tests that packets give the same bits as single rays with every instruction set, over a surface
//! of triangles with shared edges.

use crate::bvh::height_field::HeightField;
use crate::bvh::packet::runs::{MINIMUM_USE, MinimumUse, PacketCount, PacketScratch, Packets};
use crate::object::{self, Scratch};
use crate::query::sink::{Answers, Sink};
use crate::query::with_batch_goal;
use crate::rays::{Hit, Ray};
use crate::simd::Isa;
use bth_format::object::ObjectView;
use bth_random::Rng;

/// Packets are made of all coherent rays, however few take part in a step.
const ALWAYS: MinimumUse = MinimumUse { coherent: 0, short: 0 };

/// The instruction sets of this machine for which packets are compiled.
fn isas() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| *isa != Isa::Scalar && isa.is_available())
}

fn packed(
    isa: Isa,
    object: &ObjectView<'_>,
    rays: &[Ray],
    least: MinimumUse,
    answers: Answers<'_>,
) -> (PacketCount, Vec<u32>) {
    let mut scratch = PacketScratch::default();
    let count = packed_in(isa, &mut scratch, object, rays, least, answers);
    (count, scratch.rest)
}

/// Like [`packed`], with memory that other batches may have used.
fn packed_in(
    isa: Isa,
    scratch: &mut PacketScratch,
    object: &ObjectView<'_>,
    rays: &[Ray],
    least: MinimumUse,
    answers: Answers<'_>,
) -> PacketCount {
    let either = answers.goal();
    let sink = &mut Sink::new(object.triangle_ids, answers, 0);
    let count = with_batch_goal!(isa, either, goal => {
        isa.run(Packets { object, rays, scratch: &mut *scratch, least, goal, sink })
    });
    assert_eq!(count.rays + scratch.rest.len(), rays.len(), "each ray goes one way");
    count
}

fn bits(hit: &Hit) -> [u32; 4] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive.triangle]
}

/// The answers of a single ray.
fn alone(object: &ObjectView<'_>, ray: &Ray) -> (Hit, bool) {
    (object::nearest(object, ray, 0), object::any(object, ray))
}

/// The answers of a batch: in packets, the rest interleaved.
fn batch(object: &ObjectView<'_>, rays: &[Ray]) -> Vec<(Hit, bool)> {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    for answers in [Answers::Nearest(&mut hits), Answers::Any(&mut found)] {
        let mut sink = Sink::new(object.triangle_ids, answers, 0);
        object::trace_batch(object, rays, None, &mut Scratch::default(), &mut sink);
    }
    hits.into_iter().zip(found).collect()
}

/// Compares packets with single rays; returns the statistics and the number of hits, for nearest
/// and for any-hit queries.
fn check(surface: &HeightField, rays: &[Ray], least: MinimumUse) -> [(PacketCount, usize); 2] {
    let object = surface.view();
    let (mut nearest, mut any) = Default::default();
    let expected: Vec<(Hit, bool)> = rays.iter().map(|ray| alone(&object, ray)).collect();
    let batch = batch(&object, rays);
    for ((ray, (hit, is_hit)), (in_batch, found)) in rays.iter().zip(&expected).zip(&batch) {
        assert_eq!((bits(in_batch), found), (bits(hit), is_hit), "{ray:?}");
    }
    for isa in isas() {
        let mut hits = vec![Hit::MISS; rays.len()];
        let (count, rest) = packed(isa, &object, rays, least, Answers::Nearest(&mut hits));
        let mut found = vec![false; rays.len()];
        let (count_any, rest_any) = packed(isa, &object, rays, least, Answers::Any(&mut found));
        for (i, (ray, (hit, is_hit))) in rays.iter().zip(&expected).enumerate() {
            if !rest.contains(&(i as u32)) {
                assert_eq!(bits(&hits[i]), bits(hit), "{isa}, ray {i}, {ray:?}: {:?}, {hit:?}", hits[i]);
            }
            if !rest_any.contains(&(i as u32)) {
                assert_eq!(found[i], *is_hit, "{isa}, ray {i}, {ray:?}");
            }
        }
        nearest = (count, hits.iter().filter(|h| h.is_hit()).count());
        any = (count_any, found.iter().filter(|&&f| f).count());
    }
    [nearest, any]
}

fn unit(rng: &mut Rng) -> f32 {
    rng.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0
}

/// Runs of 64 rays from near a camera to near a point of the surface; with `exact` they start
/// exactly at the camera and are aimed at points of the surface.
fn bundles(surface: &HeightField, scale: f32, exact: bool, seed: u64) -> Vec<Ray> {
    let mut rng = Rng::new(seed);
    let mut rays = vec![];
    for _ in 0..40 {
        let start = rng.below(surface.points.len() as u64 - 64) as usize;
        let target = surface.points[start];
        let away = [unit(&mut rng), unit(&mut rng), 2.0].map(|x| (x * 40.0).round() * scale);
        let eye = [0, 1, 2].map(|k| target[k] + away[k]);
        for _ in 0..64 {
            let mut jitter = |spread: f32| if exact { 0.0 } else { unit(&mut rng) * spread * scale };
            let origin = eye.map(|x| x + jitter(0.5));
            let point = surface.points[start + rng.below(64) as usize % 15];
            let point = point.map(|x| x + if exact { 0.0 } else { unit(&mut rng) * 2.0 * scale });
            let direction = [0, 1, 2].map(|k| point[k] - origin[k]);
            let tmax = [f32::INFINITY, 1.0, 0.5, 4.0][rng.below(4) as usize];
            rays.push(Ray { origin, tmin: 0.0, direction, tmax });
        }
    }
    rays
}

/// Short rays in all directions, from near a point.
fn short(surface: &HeightField, scale: f32, seed: u64) -> Vec<Ray> {
    let mut rng = Rng::new(seed);
    let mut rays = vec![];
    for _ in 0..40 {
        let point = surface.points[rng.below(surface.points.len() as u64) as usize];
        for _ in 0..64 {
            let origin = point.map(|x| x + unit(&mut rng) * scale);
            let direction = [(); 3].map(|()| unit(&mut rng) * scale);
            rays.push(Ray { origin, tmin: 0.0, direction, tmax: 3.0 });
        }
    }
    rays
}

#[test]
fn coherent_bundles_are_traced_to_the_same_bits_as_single_rays() {
    for (scale, away) in [(1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (0.001, 1e6)] {
        let surface = HeightField::new(scale, away);
        let rays = bundles(&surface, scale, false, 1);
        for (count, hits) in check(&surface, &rays, ALWAYS) {
            assert!(count.coherent >= 5 && hits > 100, "{scale}, {away}: {count:?}, {hits}");
        }
    }
}

#[test]
fn bundles_through_vertices_and_along_edges_are_traced_to_the_same_bits() {
    for scale in [1.0, 0.125] {
        let surface = HeightField::new(scale, 0.0);
        let rays = bundles(&surface, scale, true, 2);
        for (count, hits) in check(&surface, &rays, ALWAYS) {
            assert!(count.coherent >= 5 && hits > 500, "{count:?}, {hits}");
        }
    }
}

/// Packets of rays with the same origin that hit few triangles, or more than the hit cache holds.
#[test]
fn views_from_one_point_are_traced_to_the_same_bits() {
    let mut rng = Rng::new(12);
    let surface = HeightField::new(1.0, 0.0);
    let eye = [30.3, 60.1, 90.7];
    let mut rays = vec![];
    for run in 0..120 {
        let target = surface.points[rng.below(surface.points.len() as u64) as usize];
        let spread = [0.3, 1.5, 3.0, 8.0][run / 3 % 4];
        for _ in 0..64 {
            let direction = [0, 1, 2].map(|k| target[k] + unit(&mut rng) * spread - eye[k]);
            rays.push(Ray::new(eye, direction));
        }
    }
    let [(count, hits), _] = check(&surface, &rays, ALWAYS);
    assert!(count.coherent > 60 && hits > 1000, "{count:?}, {hits}");
    // The numbers of triangles that a packet hits include at most half of the hit cache, more than
    // half, and more than it holds.
    let all: Vec<Hit> = rays.iter().map(|ray| alone(&surface.view(), ray).0).collect();
    let mut runs = [0; 3];
    for run in all.chunks(64) {
        let different: std::collections::BTreeSet<u32> =
            run.iter().filter(|h| h.is_hit()).map(|h| h.primitive.triangle).collect();
        runs[(different.len().max(1) - 1) / 8 % 3] += usize::from(different.len() <= 24);
    }
    assert!(runs.iter().all(|&runs| runs > 5), "{runs:?}");
}

#[test]
fn short_bundles_are_traced_to_the_same_bits() {
    for (scale, away) in [(1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (0.001, 1e6)] {
        let surface = HeightField::new(scale, away);
        let rays = short(&surface, scale, 3);
        let [_, (count, hits)] = check(&surface, &rays, ALWAYS);
        assert!(count.short >= 5 && hits > 100, "{scale}, {away}: {count:?}, {hits}");
    }
}

#[test]
fn a_batch_of_all_kinds_is_split_and_traced_to_the_same_bits() {
    let surface = HeightField::new(1.0, 0.0);
    let (coherent, short) = (bundles(&surface, 1.0, false, 4), short(&surface, 1.0, 5));
    let mut rng = Rng::new(6);
    let mut rays = vec![];
    for (i, (a, b)) in coherent.chunks(64).zip(short.chunks(64)).enumerate() {
        rays.extend_from_slice(if i % 2 == 0 { a } else { b });
        if i % 5 == 0 {
            // Other rays: without a line, from within the surface, with negative t.
            for _ in 0..64 {
                let pick = |rng: &mut Rng, x: f32| if rng.below(60) == 0 { f32::NAN } else { x };
                let origin = [(); 3].map(|()| {
                    let x = unit(&mut rng) * 40.0;
                    pick(&mut rng, x)
                });
                let direction = [(); 3].map(|()| unit(&mut rng).round());
                rays.push(Ray { origin, tmin: unit(&mut rng), direction, tmax: unit(&mut rng) * 50.0 });
            }
        }
    }
    // The last packet is not full.
    rays.extend_from_slice(&coherent[..50]);
    let [(nearest, _), (any, _)] = check(&surface, &rays, ALWAYS);
    assert!(nearest.rays > 0 && nearest.rays < rays.len(), "{nearest:?}");
    assert!(any.coherent > 0 && any.short > 0, "{any:?}");
}

#[test]
fn rays_that_f32_cannot_prepare_are_left_to_single_rays() {
    for scale in [1e15, 1e-42] {
        let surface = HeightField::new(scale, 0.0);
        let rays = bundles(&surface, scale, false, 7);
        for (count, _) in check(&surface, &rays, ALWAYS) {
            assert_eq!(count, PacketCount::default(), "{scale}");
        }
    }
}

#[test]
fn packets_with_few_active_rays_are_followed_by_single_rays() {
    let surface = HeightField::new(1.0, 0.0);
    let rays = poor_bundles(&surface);
    for (count, _) in check(&surface, &rays, MINIMUM_USE) {
        assert!(count.poor > 0 && count.rays < rays.len() / 2, "{count:?}");
    }
}

/// Runs of coherent rays that pass the surface far from one another, so that few take part in a
/// step.
fn poor_bundles(surface: &HeightField) -> Vec<Ray> {
    let mut rays = bundles(surface, 1.0, false, 8);
    let mut rng = Rng::new(9);
    for ray in &mut rays {
        let point = surface.points[rng.below(surface.points.len() as u64) as usize];
        ray.origin = [point[0] - 400.0, point[1] - 300.0, point[2] + 500.0];
        ray.direction = [400.0, 300.0, -500.0];
        ray.tmax = f32::INFINITY;
    }
    rays
}

#[test]
fn what_is_known_of_packets_is_kept_for_the_next_batch_through_the_same_object() {
    let [surface, other] = [HeightField::new(1.0, 0.0), HeightField::new(1.0, 0.0)];
    let rays = poor_bundles(&surface);
    for isa in isas() {
        let mut scratch = PacketScratch::default();
        let mut poor = |surface: &HeightField| {
            let mut hits = vec![Hit::MISS; rays.len()];
            let (object, answers) = (surface.view(), Answers::Nearest(&mut hits));
            packed_in(isa, &mut scratch, &object, &rays, MINIMUM_USE, answers).poor
        };
        let first = poor(&surface);
        assert!(first > 2, "{isa}: {first}");
        assert!(poor(&surface) < first, "{isa}");
        assert_eq!(poor(&other), first, "{isa}");
    }
}

/// Memory that packets keep between batches does not affect the next object.
#[test]
fn nothing_of_a_batch_is_left_for_the_next() {
    let surface = HeightField::new(1.0, 0.0);
    let leaf = surface.one_leaf();
    let mut rng = Rng::new(13);
    let middle = leaf.points[7];
    // Rays through a vertex need decisions in f64.
    let rays: Vec<Ray> = (0..128)
        .map(|_| {
            let away = [(); 3].map(|()| (rng.below(64) as f32 - 31.5) / 128.0);
            let origin = [0, 1, 2].map(|k| middle[k] + away[k]);
            Ray { origin, tmin: 0.0, direction: away.map(|x| -2.0 * x), tmax: 1.0 }
        })
        .collect();
    let before = bundles(&surface, 1.0, false, 14);
    for isa in isas() {
        let mut scratch = PacketScratch::default();
        let mut hits = vec![Hit::MISS; before.len()];
        let answers = Answers::Nearest(&mut hits);
        packed_in(isa, &mut scratch, &surface.view(), &before, ALWAYS, answers);
        assert!(hits.iter().filter(|hit| hit.is_hit()).count() > 500);
        let mut found = vec![false; rays.len()];
        let count = packed_in(isa, &mut scratch, &leaf.view(), &rays, ALWAYS, Answers::Any(&mut found));
        assert!(count.short == 2 && found.iter().all(|&found| found), "{isa}: {count:?}");
    }
}
