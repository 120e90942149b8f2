//! Rays inside of surfaces of tiles: none may leave, and samples have the answers of all triangles
//! in exact arithmetic.

use super::statistics::Statistics;
use super::tiles::{Tiles, add, sub, times};
use crate::oracle::{ExactRay, to_f64};
use crate::structures::bits;
use bth::TraceRay;
use bth::rays::{Hit, Ray, StartRay};
use bth_random::Rng;
use std::fmt::Debug;
use std::hash::{DefaultHasher, Hash, Hasher};

/// The order of hits may differ from the exact one where t differ by this factor.
const ORDER: f64 = 1.0 / (1u64 << 28) as f64;

/// A ray and what is known of its answer.
struct Known<R> {
    ray: R,
    /// True if it hits the surface.
    hits: bool,
    /// True if it hits at t <= 1.
    hits_before_one: bool,
}

/// Traces `count` rays from inside, and as many from where these hit. Adds what was found, and
/// returns a hash of all answers. One of `one_in` rays is compared with every triangle. With
/// `in_parallel`, batches are traced by the threads of the current pool.
pub fn run_tiles(
    tiles: &Tiles,
    count: usize,
    one_in: usize,
    seed: u64,
    in_parallel: bool,
    statistics: &mut Statistics,
) -> u64 {
    let rng = &mut Rng::new(seed);
    let mut hasher = DefaultHasher::new();
    let rays = from_inside(tiles, count, rng);
    let hits = check(tiles, &rays, (one_in, seed), in_parallel, statistics, &mut hasher);
    let starts = from_hits(tiles, &hits, rng);
    check(tiles, &starts, (one_in, seed), in_parallel, statistics, &mut hasher);
    hasher.finish()
}

fn narrow(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

/// A target on a border: an end, the middle or any point of an edge.
fn border_point(tiles: &Tiles, edge: usize, rng: &mut Rng) -> [f64; 3] {
    let [a, b] = tiles.borders[edge % tiles.borders.len()];
    match rng.below(4) {
        0 | 1 => a,
        2 => add(a, b).map(|x| 0.5 * x),
        _ => add(a, sub(b, a).map(|x| rng.unit_f64() * x)),
    }
}

/// Rays at borders and anywhere; half of them in groups of 64 that go to neighbouring places.
fn from_inside(tiles: &Tiles, count: usize, rng: &mut Rng) -> Vec<Known<Ray>> {
    let mut rays = Vec::with_capacity(count);
    let (mut origin, mut first) = ([0.0; 3], 0);
    while rays.len() < count {
        let (group, place) = (rays.len() / 64 % 2, rays.len() % 64);
        if group == 0 || place == 0 {
            origin = tiles.inside[rng.below(tiles.inside.len() as u64) as usize];
            first = rng.below(tiles.borders.len() as u64) as usize;
        }
        let wide = origin.map(f64::from);
        let target = border_point(tiles, first + place / 8, rng);
        let is_aimed = rng.below(4) > 0;
        let direction = match is_aimed {
            true => narrow(sub(target, wide)),
            false => narrow(times(&tiles.linear, rng.unit_vector())),
        };
        let ray = Ray::new(origin, direction);
        if direction != [0.0; 3] {
            let passes = add(wide, direction.map(f64::from)) == target
                && sub(target, wide) == direction.map(f64::from);
            rays.push(Known { ray, hits: true, hits_before_one: is_aimed && passes && tiles.is_exact });
        }
    }
    rays
}

/// Rays that start where others hit; half of them in groups of nearly one direction.
fn from_hits(tiles: &Tiles, hits: &[Hit], rng: &mut Rng) -> Vec<Known<StartRay>> {
    let mut axis = [0.0; 3];
    let mut ray = |(i, hit): (usize, &Hit)| {
        let mut direction = rng.unit_vector();
        if i / 64 % 2 == 1 {
            if i % 64 == 0 {
                axis = direction;
            }
            direction = add(axis, direction.map(|x| 0.05 * x));
        }
        let direction = narrow(times(&tiles.linear, direction));
        let hits = tiles.leads_inside(hit, direction.map(f64::from));
        Known { ray: StartRay::from_hit(hit, direction), hits, hits_before_one: false }
    };
    hits.iter().enumerate().filter(|(_, hit)| hit.is_hit()).map(&mut ray).collect()
}

/// Traces rays and compares their answers with what is known of them.
fn check<R: TraceRay + Copy + Debug + Into<ExactRay>>(
    tiles: &Tiles,
    known: &[Known<R>],
    (one_in, seed): (usize, u64),
    in_parallel: bool,
    statistics: &mut Statistics,
    hasher: &mut DefaultHasher,
) -> Vec<Hit> {
    let rays: Vec<R> = known.iter().map(|known| known.ray).collect();
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    let batch = || if in_parallel { tiles.scene.batch(&rays).parallel() } else { tiles.scene.batch(&rays) };
    batch().nearest(&mut hits);
    batch().any(&mut found);
    statistics.rays += rays.len() as u64;
    statistics.traced += 2 * rays.len() as u64;
    for (i, ((of, hit), found)) in known.iter().zip(&hits).zip(&found).enumerate() {
        bits(hit).hash(hasher);
        let mut defects = [false; 4];
        defects[0] = of.hits && !hit.is_hit();
        defects[1] = hit.is_hit() && of.hits_before_one && hit.t > 1.0;
        defects[2] = *found != hit.is_hit();
        if one_in > 0 && (i as u64 + seed).is_multiple_of(one_in as u64) {
            statistics.compared += 1;
            defects[2] |= bits(&tiles.scene.nearest(&of.ray).unwrap_or(Hit::MISS)) != bits(hit);
            defects[3] = is_wrong(tiles, &of.ray, hit, statistics);
        }
        statistics.hits += u64::from(hit.is_hit());
        statistics.leaks += u64::from(defects[0]);
        statistics.misses += u64::from(defects[1]);
        statistics.different += u64::from(defects[2]);
        statistics.wrong += u64::from(defects[3]);
        if defects.contains(&true) {
            let names = ["leak", "miss", "different", "wrong"];
            let named: Vec<_> =
                names.iter().zip(defects).filter(|(_, is)| *is).map(|(name, _)| name).collect();
            statistics.add_example(format_args!("{named:?}: {}: {:?} {hit:?}", tiles.name, of.ray));
        }
    }
    hits
}

/// Returns true if a hit is not a nearest one of all triangles in exact arithmetic, or its t is not
/// the exact one, rounded.
fn is_wrong<R: Copy + Into<ExactRay>>(
    tiles: &Tiles,
    ray: &R,
    hit: &Hit,
    statistics: &mut Statistics,
) -> bool {
    let Some(truth) = tiles.world.nearest(*ray) else { return hit.is_hit() };
    let exact = truth.t_f64();
    if !hit.is_hit() {
        return true;
    }
    statistics.error(exact, hit.t);
    let as_near = || {
        let at = tiles.world.intersection(*ray, hit.primitive);
        at.is_some_and(|at| (to_f64(&at.t) - exact).abs() <= ORDER * exact)
    };
    hit.t != exact as f32 || !(truth.triangles.contains(&hit.primitive) || as_near())
}
