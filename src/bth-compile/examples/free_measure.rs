//! Scratch measurement.
#![allow(unsafe_code)]
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::{free::{FreeOptions, KeepFree}, pipeline::{self, CompileOptions, Structure}, Silent};
use bth_random::Rng;
use std::time::Instant;

fn cpu() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut t) };
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}
fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] { [a[0]-b[0], a[1]-b[1], a[2]-b[2]] }
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] { [a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0]] }
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 { a[0]*b[0]+a[1]*b[1]+a[2]*b[2] }
fn unit(a: [f64; 3]) -> [f64; 3] { let l = dot(a, a).sqrt(); a.map(|x| x / l) }

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let inside = args.get(2).is_some_and(|a| a == "inside");
    let rounds: usize = std::env::var("ROUNDS").ok().and_then(|r| r.parse().ok()).unwrap_or(7);
    let reach: f64 = std::env::var("REACH").ok().and_then(|r| r.parse().ok()).unwrap_or(0.0625);
    let mut options = CompileOptions { structure: Structure::Bvh, ..Default::default() };
    let path = std::path::Path::new(&args[1]);
    let start = Instant::now();
    options.free = FreeOptions { keep: if std::env::var("AUTO").is_ok() { KeepFree::Auto } else { KeepFree::All }, reach };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (with, seconds, report) = pool.install(|| {
        let before = cpu();
        let (c, r) = pipeline::compile(path, &options, &Silent).unwrap();
        (c, cpu() - before, r)
    });
    let free = report.free.unwrap();
    eprintln!("wall {:.1} cpu {seconds:.1}", start.elapsed().as_secs_f64());
    let scene = bth::from_bytes(&with.bytes).unwrap();
    let triangles = report.mesh.triangles;
    println!("{} triangles {} free {:.3} near {:.3} us/tri {:.1} (wall) bytes/tri {:.1}", args[1], triangles, free.free, free.free_nearby, 1e6 * free.seconds / triangles as f64, report.file.resident_bytes_per_triangle);
    let view = scene.object(0);
    let (lo, hi) = (view.header.lower.map(f64::from), view.header.upper.map(f64::from));
    let center: [f64; 3] = std::array::from_fn(|k| (lo[k] + hi[k]) / 2.0);
    let diag = dot(sub(hi, lo), sub(hi, lo)).sqrt();
    let mut random = Rng::new(7);
    let mut primary = Vec::new();
    let (w, h) = (480usize, 320usize);
    let eye = if inside {
        let mut best = (0.0, center);
        for _ in 0..64 {
            let p: [f64; 3] = std::array::from_fn(|k| random.between(lo[k] + 0.1*(hi[k]-lo[k]), hi[k] - 0.1*(hi[k]-lo[k])));
            let mut sum = 0.0; let mut all = true;
            for _ in 0..64 {
                let d = random.unit_vector();
                match scene.nearest(&Ray::new(p.map(|x| x as f32), d.map(|x| x as f32))) { Some(hit) => sum += f64::from(hit.t).min(diag), None => { all = false; } }
            }
            if all && sum > best.0 { best = (sum, p); }
        }
        best.1
    } else { std::array::from_fn(|k| center[k] + diag * [0.7, 0.5, 0.9][k]) };
    let forward = if inside { unit([0.7, -0.1, 0.6]) } else { unit(sub(center, eye)) };
    let right = unit(cross(forward, [0.0, 1.0, 0.0]));
    let up = cross(right, forward);
    let spread = if inside { 0.8 } else { 0.45 };
    for ty in 0..h / 4 { for tx in 0..w / 4 { for y in 0..4 { for x in 0..4 {
        let (px, py) = ((tx * 4 + x) as f64 / w as f64 * 2.0 - 1.0, (ty * 4 + y) as f64 / h as f64 * 2.0 - 1.0);
        let d: [f64; 3] = std::array::from_fn(|k| forward[k] + spread * (px * right[k] * 1.5 + py * up[k]));
        primary.push(Ray::new(eye.map(|x| x as f32), d.map(|x| x as f32)));
    }}}}
    let mut hits = vec![Hit::MISS; primary.len()];
    scene.batch(&primary).nearest(&mut hits);
    let (mut diffuse, mut dfrom, mut ao, mut afrom) = (vec![], vec![], vec![], vec![]);
    for (ray, hit) in primary.iter().zip(&hits) {
        if !hit.is_hit() { continue; }
        let c = view.triangles[hit.primitive.triangle as usize].map(|v| view.positions[v as usize].map(f64::from));
        let mut n = unit(cross(sub(c[1], c[0]), sub(c[2], c[0])));
        if dot(n, ray.direction.map(f64::from)) > 0.0 { n = n.map(|x| -x); }
        let p: [f64; 3] = std::array::from_fn(|k| f64::from(ray.origin[k]) + f64::from(hit.t) * f64::from(ray.direction[k]) + 2e-5 * diag * n[k]);
        let mut d = || { let u = random.unit_vector(); unit(std::array::from_fn(|k| n[k] * 1.0001 + u[k])).map(|x| x as f32) };
        diffuse.push(Ray::new(p.map(|x| x as f32), d())); dfrom.push(hit.primitive);
        for _ in 0..4 { ao.push(Ray::new(p.map(|x| x as f32), d()).with_range(0.0, (0.05 * diag) as f32)); afrom.push(hit.primitive); }
    }
    println!("  {} diffuse {} ao", diffuse.len(), ao.len());
    for (name, rays, from) in [("diffuse", &diffuse, &dfrom), ("ao", &ao, &afrom)] {
        let (mut done, mut free_bits, mut near_bits, mut n) = (0, 0, 0, 0);
        for (ray, f) in rays.iter().zip(from.iter()).take(20000) {
            n += 1;
            let (_, steps) = scene.nearest_counted(ray, *f);
            let (_, plain) = scene.nearest_counted(ray, PrimitiveRef::NONE);
            done += usize::from(steps == Default::default() && plain != Default::default());
            let class = view.free[f.triangle as usize].class(bth_format::layout::free_bin(ray.direction));
            free_bits += usize::from(class == bth_format::layout::FreeClass::All);
            near_bits += usize::from(class == bth_format::layout::FreeClass::Near);
        }
        println!("  {name}: done {:.3} class all {:.3} near {:.3}", done as f64 / n as f64, free_bits as f64 / n as f64, near_bits as f64 / n as f64);
    }
    for batch in [1024usize, 1] {
        for (name, rays, from, any) in [("diffuse", &diffuse, &dfrom, false), ("ao", &ao, &afrom, true)] {
            if batch == 1 && rays.len() < 10 { continue; }
            let rays = &rays[..rays.len().min(if batch == 1 { 40_000 } else { 200_000 })];
            let mut hits = [vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]];
            let mut found = [vec![false; rays.len()], vec![false; rays.len()]];
            let mut times = [vec![], vec![]];
            for round in 0..2 * rounds {
                let which = round % 2;
                let before = cpu();
                for first in (0..rays.len()).step_by(batch) {
                    let end = (first + batch).min(rays.len());
                    let hints: Option<&[PrimitiveRef]> = (which == 1).then_some(&from[first..end]);
                    let b = scene.batch(&rays[first..end]).from(hints);
                    if any { b.any(&mut found[which][first..end]) } else { b.nearest(&mut hits[which][first..end]) }
                }
                times[which].push((cpu() - before) / rays.len() as f64 * 1e9);
            }
            assert_eq!(found[0], found[1]);
            assert!(hits[0].iter().zip(&hits[1]).all(|(a, b)| a == b));
            let miss = if any { found[0].iter().filter(|f| !**f).count() } else { hits[0].iter().filter(|h| !h.is_hit()).count() };
            let median = |t: &mut Vec<f64>| { t.sort_by(f64::total_cmp); (t[t.len() / 2], t[0]) };
            let (a, b) = (median(&mut times[0]), median(&mut times[1]));
            println!("  batch {batch} {name}: without {:.1} with {:.1} ns, ratio {:.2} (least {:.2}); misses {:.3}", a.0, b.0, a.0 / b.0, a.1 / b.1, miss as f64 / rays.len() as f64);
        }
    }
}
