//! `bthc verify --deep`: sample rays through each object, traced in all ways and decided in exact
//! arithmetic.
//!
//! A file that passes every check may still answer wrongly, where it tells something of its
//! triangles that is not so: free directions and distances, boxes that were damaged together with
//! their hashes, or a defect of this program. So rays are traced in a batch and one at a time, from
//! an origin and from a start, and compared with every triangle in exact arithmetic; and what is
//! known of the directions of the triangles on which rays start is compared with that, too.

mod bounds;
mod poses;
mod rays;

use crate::failure::Failure;
use crate::output;
use bth::rays::{Hit, PrimitiveRef, Ray, StartRay};
use bth::{Scene, TraceRay};
use bth_compile::{Error, Monitor};
use bth_oracle::{ExactHit, Intersection, Triangle, World, intersection, starts, to_f64, triangles};
use rayon::prelude::*;
use rays::Start;
use serde_json::json;
use std::fmt::Debug;
use std::path::Path;

/// Tests of a ray against a triangle for each object, by which the number of its rays is chosen:
/// some seconds on two cores. Each ray is traced from its origin and from its start.
const TESTS: usize = 100_000_000;
/// An intersection, which is computed exactly, takes as long as this many tests of triangles that a
/// line misses.
const INTERSECTION: usize = 800;
/// Rays by which the number of intersections along a ray is estimated.
const ESTIMATE: usize = 16;
/// Least and most rays of an object where their number is not given.
const RAYS: [usize; 2] = [64, 20_000];
/// What may be wrong: the answer, that ways of tracing differ, what is known of directions.
const CODES: [&str; 3] = ["BTH-V001", "BTH-V002", "BTH-F209"];
/// Differences of each kind that are printed of an object; all are counted.
const PRINTED: usize = 10;
/// Rays of a batch.
const BATCH: usize = 256;

/// What was compared.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Report {
    /// Rays that were traced.
    pub(crate) rays: u64,
    /// Those that hit something.
    pub(crate) hits: u64,
    /// Those in whose direction something is known of the triangle on which they start.
    pub(crate) known: u64,
    /// Those for which something differs.
    pub(crate) wrong: u64,
}

impl Report {
    /// The figures as JSON.
    pub(crate) fn json(&self) -> serde_json::Value {
        json!({"rays": self.rays, "hits": self.hits, "known_directions": self.known, "wrong": self.wrong})
    }
}

/// Compares `count` rays of each object of a file, by default a number that its triangles
/// determine. Prints differences on standard error.
///
/// # Errors
/// A file that cannot be opened; cancellation.
pub(crate) fn check(file: &Path, count: Option<usize>, monitor: &dyn Monitor) -> Result<Report, Failure> {
    let scene = bth::open(file)?;
    let mut report = Report::default();
    for object in 0..scene.object_count() {
        let findings = check_object(&scene, object, count, &mut report, monitor)?;
        for code in CODES {
            let of_code: Vec<&String> = findings.iter().filter(|finding| finding.starts_with(code)).collect();
            for finding in of_code.iter().take(PRINTED) {
                output::error(&format!("{}: object {object}: {finding}", file.display()));
            }
            if of_code.len() > PRINTED {
                let more = of_code.len() - PRINTED;
                output::error(&format!("{}: object {object}: {more} more rays with {code}", file.display()));
            }
        }
        report.wrong += findings.len() as u64;
    }
    Ok(report)
}

/// What differs, a line for each ray.
fn check_object(
    scene: &Scene,
    object: u32,
    count: Option<usize>,
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<Vec<String>, Failure> {
    let poses = poses::of(scene, object);
    let mut findings = Vec::new();
    for pose in &poses {
        let Some((alone, instance)) = poses::alone(scene, object, *pose)? else { continue };
        let all = triangles(&alone.object(alone.instance(instance).object));
        if all.is_empty() {
            break;
        }
        let count = count.unwrap_or_else(|| affordable(&alone, &all));
        let starts = rays::sample(&all, count.div_ceil(poses.len()), u64::from(object));
        findings.extend(check_pose((&alone, instance), &all, &starts, report, monitor)?);
    }
    Ok(findings)
}

/// Number of rays of the only visible instance, which has these triangles, that take some seconds.
/// Where triangles are many times as large as the space between them, lines hit many of them.
fn affordable(alone: &Scene, all: &[Triangle]) -> usize {
    let most = TESTS / all.len();
    if most <= RAYS[0] {
        return RAYS[0];
    }
    let (world, starts) = (World::new(alone), rays::sample(all, ESTIMATE, 0));
    let crossed: usize = starts.par_iter().map(|start| world.crossed(start.ray)).sum();
    let tests = all.len() + INTERSECTION * crossed / starts.len().max(1);
    (TESTS / tests).clamp(RAYS[0], RAYS[1])
}

/// What differs in a scene of one visible instance, which has these triangles, a line for each ray.
fn check_pose(
    (alone, instance): (&Scene, u32),
    all: &[Triangle],
    starts: &[Start],
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<Vec<String>, Failure> {
    let view = alone.object(alone.instance(instance).object);
    monitor.stage("trace exactly", Some(starts.len() as u64));
    let rays: Vec<Ray> = starts.iter().map(|start| start.ray).collect();
    let start_rays: Vec<StartRay> = starts.iter().map(|start| start.start_ray(instance)).collect();
    let plain = trace(alone, &rays, monitor)?;
    let from_starts = trace(alone, &start_rays, monitor)?;
    let world = World::new(alone);
    let corners_of = |id: u32| all.binary_search_by_key(&id, |t| t.id).ok().map(|row| all[row].corners);
    let one = |((start, plain), of_start): ((&Start, &Traced), &Traced)| {
        if monitor.cancelled() {
            return Err(Failure::Compile(Error::Cancelled));
        }
        let (ray, start_ray) = (&start.ray, start.start_ray(instance));
        let (truth, from_start) = (world.nearest(ray), world.nearest(start_ray));
        let at = |id| intersection(ray, corners_of(id)?);
        // The first of two triangles is the start.
        let mut of_two = start_ray;
        of_two.start.primitive.triangle = 0;
        let at_from_start = |id| starts::intersection(&[start.triangle.corners, corners_of(id)?], of_two, 1);
        let t = truth.as_ref().map(ExactHit::t_f64);
        let known = bounds::known(&view, start);
        let found = plain
            .wrong(ray, truth.as_ref(), at)
            .or_else(|| {
                let bound = known.filter(|bound| t.is_some_and(|t| bound.is_broken(t)))?;
                let expected = format!("nothing nearer than {}", bound.distance);
                Some(format!("BTH-F209: {ray:?}: expected {expected}, found t = {t:?}"))
            })
            .or_else(|| {
                // Where a file does not say where triangles lie, there are no starts.
                let has_starts = !view.places.is_empty();
                has_starts.then(|| of_start.wrong(&start_ray, from_start.as_ref(), at_from_start)).flatten()
            });
        monitor.advance(1);
        Ok((found, t.is_some(), known.is_some()))
    };
    let results = starts.par_iter().zip(&plain).zip(&from_starts).map(one).collect::<Result<Vec<_>, _>>()?;
    report.rays += results.len() as u64;
    report.hits += results.iter().filter(|(_, hit, _)| *hit).count() as u64;
    report.known += results.iter().filter(|(_, _, known)| *known).count() as u64;
    Ok(results.into_iter().filter_map(|(found, _, _)| found).collect())
}

/// The answers for a ray.
struct Traced {
    hit: Hit,
    single: Hit,
    any: bool,
}

impl Traced {
    /// What differs between the ways of tracing or from the exact hit, if anything does. `at`
    /// intersects the ray with a triangle.
    fn wrong(
        &self,
        ray: &impl Debug,
        truth: Option<&ExactHit<PrimitiveRef>>,
        at: impl Fn(u32) -> Option<Intersection>,
    ) -> Option<String> {
        let Traced { hit, single, any } = self;
        let bits = |hit: &Hit| ([hit.t, hit.u, hit.v].map(f32::to_bits), hit.primitive);
        if bits(hit) != bits(single) || *any != hit.is_hit() {
            return Some(format!(
                "BTH-V002: {ray:?}: expected {hit:?} in every way, found {single:?} alone, any hit {any}"
            ));
        }
        let is_right = match truth {
            None => !hit.is_hit(),
            Some(truth) => {
                hit.is_hit()
                    && is_rounded(hit.t, truth.t_f64())
                    && (truth.triangles.contains(&hit.primitive)
                        || is_as_near(at(hit.primitive.triangle), truth.t_f64()))
            }
        };
        let t = truth.map(ExactHit::t_f64);
        (!is_right).then(|| format!("BTH-V001: {ray:?}: expected t = {t:?}, found {hit:?}"))
    }
}

/// Traces rays in all ways.
///
/// # Errors
/// Cancellation.
fn trace<R: TraceRay>(alone: &Scene, rays: &[R], monitor: &dyn Monitor) -> Result<Vec<Traced>, Failure> {
    let mut traced = Vec::with_capacity(rays.len());
    let (mut hits, mut found) = ([Hit::MISS; BATCH], [false; BATCH]);
    for rays in rays.chunks(BATCH) {
        let (hits, found) = (&mut hits[..rays.len()], &mut found[..rays.len()]);
        alone.batch(rays).nearest(hits);
        alone.batch(rays).any(found);
        let one = |(ray, (hit, any)): (&R, (&Hit, &bool))| Traced {
            hit: *hit,
            single: alone.nearest(ray).unwrap_or(Hit::MISS),
            any: *any,
        };
        traced.extend(rays.iter().zip(hits.iter().zip(&*found)).map(one));
        if monitor.cancelled() {
            return Err(Failure::Compile(Error::Cancelled));
        }
    }
    Ok(traced)
}

/// Returns true if t is the exact one, rounded to f32, or the next number to that, since it is
/// rounded to f64 before.
fn is_rounded(t: f32, exact: f64) -> bool {
    let exact = exact as f32;
    t == exact || t.to_bits().abs_diff(exact.to_bits()) <= 1
}

/// Bounds the relative rounding of two exact values of t to f64, a thousandfold.
const ORDER_ROUNDING: f64 = 1e-12;

/// Returns true if another triangle is hit at a distance that differs by less than its rounding to
/// f64.
fn is_as_near(at: Option<Intersection>, exact: f64) -> bool {
    at.is_some_and(|at| (to_f64(&at.t) - exact).abs() <= ORDER_ROUNDING * exact.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_compile::Silent;
    use bth_compile::memory::{PositionRows, TriangleMesh, open};
    use bth_compile::pipeline::{CompileOptions, Structure};
    use bth_random::Rng;

    /// The default number of rays for 3,000 triangles of this size with their first corners
    /// anywhere in the unit cube.
    fn rays_of(size: f64) -> usize {
        let mut random = Rng::new(5);
        let mut positions = Vec::new();
        for _ in 0..3000 {
            let first: [f64; 3] = std::array::from_fn(|_| random.unit_f64());
            positions.extend(
                [(); 3]
                    .map(|()| random.unit_vector())
                    .map(|d| -> [f32; 3] { std::array::from_fn(|k| (first[k] + size * d[k]) as f32) }),
            );
        }
        let triangles: Vec<[u32; 3]> = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
        let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
        let scene = open(mesh, &options, &Silent).unwrap();
        affordable(&scene, &triangles_of(&scene))
    }

    fn triangles_of(scene: &Scene) -> Vec<Triangle> {
        triangles(&scene.object(0))
    }

    #[test]
    fn fewer_rays_are_traced_where_each_meets_many_triangles() {
        assert_eq!(rays_of(0.01), RAYS[1]);
        let few = rays_of(1.0);
        assert!((RAYS[0]..2_000).contains(&few), "{few}");
    }
}
