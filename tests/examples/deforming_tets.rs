//! Measures what tetrahedra under a deforming object cost and bring: time of new positions, how far a model can be twisted before its tet
//! leaves stand aside, and rays that start on its surface. The files are one model, compiled with `--deformable --structure bvh` and `tets`.
//!
//!     cargo run --release -p bth-tests --example deforming_tets -- bvh.bth tets.bth
#![allow(clippy::print_stdout)]

use bth::rays::{Hit, PrimitiveRef, Start, StartRay};
use bth_format::exact::side;
use bth_format::verify::filling_tets;
use bth_random::Rng;
use std::cmp::Ordering;
use std::time::Instant;

/// Rounds of which the fastest counts.
const ROUNDS: usize = 7;
/// Rays that are traced together.
const RAYS: usize = 200_000;

fn main() -> Result<(), bth::Error> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [bvh, tets] = &paths[..] else { panic!("two files: a BVH, and tetrahedra with a BVH") };
    let (mut bvh, mut tets) = (bth::open(bvh)?, bth::open(tets)?);
    let rest = bvh.object(0).positions.to_vec();
    let threads = rayon::current_num_threads();
    let compiled = bth::open(&paths[1])?;
    let all: Vec<Vec<[u32; 4]>> = (0..compiled.object(0).tet_leaves.len())
        .map(|row| filling_tets(&compiled.object(0), row as u32).unwrap_or_default())
        .collect();
    let triangles = f64::from(bvh.object(0).header.triangles);
    let start = Instant::now();
    bth::open(&paths[1])?.set_positions(0, &rest)?;
    let with_open = start.elapsed();
    let start = Instant::now();
    drop(bth::open(&paths[1])?);
    let first = 1e9 * (with_open.as_secs_f64() - start.elapsed().as_secs_f64()) / triangles;
    println!("{threads} threads; the first new positions take {first:.0} ns a triangle");
    println!("| twist, rad | bvh, ns/triangle | tets, ns/triangle | leaves in use | turned over |");
    for twist in [0.0, 0.0001, 0.001, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5] {
        let positions = twisted(&rest, twist);
        let (mut best, mut last) = ([f64::INFINITY; 2], Default::default());
        for _ in 0..ROUNDS {
            for (scene, best) in [&mut bvh, &mut tets].into_iter().zip(&mut best) {
                let start = Instant::now();
                last = scene.set_positions(0, &positions)?;
                *best = best.min(1e9 * start.elapsed().as_secs_f64() / triangles);
            }
        }
        let view = tets.object(0);
        let vertex = |v: u32| view.tet_vertices[v as usize].position;
        let is_bad = |[a, b, c, d]: &[u32; 4]| {
            side(vertex(*a), vertex(*b), vertex(*c), vertex(*d)) != Ordering::Greater
        };
        let bad = all.iter().flatten().filter(|tet| is_bad(tet)).count();
        let (used, leaves) = (last.tet_leaves_in_use, last.tet_leaves_in_use + last.tet_leaves_aside);
        println!("| {twist} | {:.2} | {:.2} | {used} of {leaves} | {bad} |", best[0], best[1]);
        if used > 0 {
            rays(&tets, twist);
        }
    }
    Ok(())
}

/// Times rays from the surface.
fn rays(scene: &bth::Scene, twist: f32) {
    let view = scene.object(0);
    let size = (0..3).map(|k| view.header.upper[k] - view.header.lower[k]).fold(0.0, f32::max);
    for (name, tmax, any) in [("diffuse, nearest", f32::INFINITY, false), ("AO, any", 0.1 * size, true)] {
        let rays = from_surface(scene, tmax);
        let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        let mut best = f64::INFINITY;
        for _ in 0..ROUNDS {
            let start = Instant::now();
            let results = hits.chunks_mut(4096).zip(found.chunks_mut(4096));
            for (rays, (hits, found)) in rays.chunks(4096).zip(results) {
                let batch = scene.batch(rays);
                if any { batch.any(found) } else { batch.nearest(hits) }
            }
            best = best.min(1e9 * start.elapsed().as_secs_f64() / rays.len() as f64);
        }
        println!("  twist {twist}, {name}: {best:.0} ns a ray");
    }
}

/// Rays from points of random triangles to random sides of them, in random directions.
fn from_surface(scene: &bth::Scene, tmax: f32) -> Vec<StartRay> {
    let (view, mut rng) = (scene.object(0), Rng::new(5));
    let ray = |_| {
        let triangle = rng.below(view.triangles.len() as u64) as u32;
        let (u, v) = (rng.unit_f32(), rng.unit_f32());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let direction = rng.point_in_ball().map(|x| x as f32);
        let length = direction.iter().map(|x| x * x).sum::<f32>().sqrt();
        let start = Start { primitive: PrimitiveRef { instance: 0, triangle }, u, v };
        start.ray(direction.map(|x| x / length)).with_tmax(tmax)
    };
    (0..RAYS).map(ray).collect()
}

/// Positions that are turned about the last axis, by an angle that grows along it.
fn twisted(rest: &[[f32; 3]], angle: f32) -> Vec<[f32; 3]> {
    let ends = |k: usize, f: fn(f32, f32) -> f32| rest.iter().map(|p| p[k]).reduce(f).unwrap_or_default();
    let (least, most) = ([0, 1, 2].map(|k| ends(k, f32::min)), [0, 1, 2].map(|k| ends(k, f32::max)));
    let [x, y] = [0, 1].map(|k| 0.5 * (least[k] + most[k]));
    let twist = |p: &[f32; 3]| {
        let (sin, cos) = (angle * (p[2] - least[2]) / (most[2] - least[2])).sin_cos();
        let (a, b) = (p[0] - x, p[1] - y);
        [x + cos * a - sin * b, y + sin * a + cos * b, p[2]]
    };
    rest.iter().map(twist).collect()
}
