//! Traces the same rays again and again, and nothing else, for tools that count what tracing does,
//! such as cache simulators: `repeat SCENE.bth camera|diffuse|ao RAYS TIMES`. Camera rays come from
//! a side of the scene's bounds in tiles of 32 by 32; the others start where camera rays hit, in
//! random directions, and `ao` rays end at a twentieth of the diagonal. Prints the number of
//! rays.

#![allow(clippy::print_stdout)]

use bth::rays::{Hit, Ray, StartRay};
use bth_random::Rng;

/// Rays in a batch.
const BATCH: usize = 1024;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [scene, set, rays, times] = &std::env::args().skip(1).collect::<Vec<_>>()[..] else {
        return Err("usage: repeat SCENE.bth camera|diffuse|ao RAYS TIMES".into());
    };
    let (scene, count, times) = (bth::open(scene)?, rays.parse()?, times.parse::<usize>()?);
    let camera = camera_rays(&scene, count).ok_or("the scene is empty")?;
    let reach = if set == "ao" { 0.05 * diagonal(&scene) } else { f32::INFINITY };
    let rays = match set.as_str() {
        "camera" => repeat(&scene, &camera, false, times),
        "diffuse" | "ao" => repeat(&scene, &bounces(&scene, &camera, reach), set == "ao", times),
        _ => return Err(format!("unknown rays {set:?}: expected camera, diffuse or ao").into()),
    };
    println!("{rays}");
    Ok(())
}

/// Traces the rays `times` times. Returns the number of traced rays.
fn repeat<R: bth::TraceRay>(scene: &bth::Scene, rays: &[R], any: bool, times: usize) -> usize {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    for _ in 0..times {
        for (i, rays) in rays.chunks(BATCH).enumerate() {
            let part = i * BATCH..i * BATCH + rays.len();
            if any {
                scene.batch(rays).any(&mut found[part]);
            } else {
                scene.batch(rays).nearest(&mut hits[part]);
            }
        }
    }
    rays.len()
}

/// The diagonal of the scene's bounds.
fn diagonal(scene: &bth::Scene) -> f32 {
    scene
        .bounds()
        .map_or(0.0, |(lower, upper)| (0..3).map(|k| (upper[k] - lower[k]).powi(2)).sum::<f32>().sqrt())
}

/// About `count` rays from one point in front of the bounds over their middle two thirds.
fn camera_rays(scene: &bth::Scene, count: usize) -> Option<Vec<Ray>> {
    const TILE: usize = 32;
    let (lower, upper) = scene.bounds()?;
    let middle = [0, 1, 2].map(|k| 0.5 * (lower[k] + upper[k]));
    let size = [0, 1, 2].map(|k| upper[k] - lower[k]);
    let eye = [middle[0], middle[1], upper[2] + diagonal(scene)];
    let tiles = ((count as f64).sqrt() as usize).div_ceil(TILE).max(1);
    let along = |tile: usize, at: usize| (tile * TILE + at) as f32 / (tiles * TILE) as f32 - 0.5;
    let mut rays = Vec::new();
    for tile in 0..tiles * tiles {
        for at in 0..TILE * TILE {
            let x = along(tile % tiles, at % TILE) * size[0] / 1.5;
            let y = along(tile / tiles, at / TILE) * size[1] / 1.5;
            rays.push(Ray::new(eye, [middle[0] + x - eye[0], middle[1] + y - eye[1], middle[2] - eye[2]]));
        }
    }
    Some(rays)
}

/// For each of the rays that hits, one of length `reach` from there, on the side from which it
/// came.
fn bounces(scene: &bth::Scene, rays: &[Ray], reach: f32) -> Vec<StartRay> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    let mut rng = Rng::new(1);
    let mut out = Vec::new();
    for (ray, hit) in rays.iter().zip(&hits) {
        let Some([a, b, c]) = hit.is_hit().then(|| scene.triangle(hit.primitive)).flatten() else { continue };
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let dot = |a: [f32; 3], b: [f64; 3]| (0..3).map(|k| f64::from(a[k]) * b[k]).sum::<f64>();
        let mut direction = rng.unit_vector().map(|x| x as f32);
        if dot(direction, normal) * dot(ray.direction, normal) > 0.0 {
            direction = direction.map(|x| -x);
        }
        out.push(StartRay::from_hit(hit, direction).with_tmax(reach));
    }
    out
}
