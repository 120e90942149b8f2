//! Traces very many rays from starts on random shapes, and checks them: no ray hits what it leaves,
//! none that starts into a closed surface misses it, none that leaves a convex body hits it,
//! batches and single rays have the same bits on every instruction set, and samples agree with the
//! exact oracle. Prints the counts as JSON; the exit code is 1 if anything was wrong.
//!
//!     cargo run --release -p bth-tests --example starts -- SECONDS [SEED]
#![allow(clippy::print_stdout, clippy::print_stderr)]

use bth::rays::{Hit, PrimitiveRef, Start, StartRay};
use bth::{Isa, Scene, SceneBuilder};
use bth_compile::free::KeepFree;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_format::layout::{GridBits, RecordKind};
use bth_random::Rng;
use bth_scenes::Model;
use bth_tests::meshes::{self, KINDS};
use bth_tests::oracle;
use bth_tests::rays::{coherent_starts, starts, weights};
use bth_tests::stress::{Shape, shapes};
use bth_tests::structures::{bits, compiled, deformed, options};
use rayon::prelude::*;
use std::ops::AddAssign;
use std::process::ExitCode;
use std::time::Instant;

/// Rays that are traced together.
const BATCH: usize = 4096;
/// Batches of a scene.
const BATCHES: usize = 24;
/// One in this many rays is traced alone, too, and one in [`ORACLE`] is compared with the oracle
/// where there are few triangles.
const ALONE: usize = 64;
const ORACLE: usize = 1024;
/// Up to this number of triangles the oracle is asked.
const FEW: usize = 3000;

/// What was found.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    scenes: u64,
    starts: u64,
    traced: u64,
    hits: u64,
    inward: u64,
    outward: u64,
    compared: u64,
    /// Hits of the triangle on which the ray starts.
    own: u64,
    /// Rays into a closed surface that hit nothing.
    leaks: u64,
    /// Rays out of a convex body that hit it.
    ghosts: u64,
    /// Answers that depend on the instruction set, the batch or the query.
    different: u64,
    /// Answers that differ from the oracle.
    wrong: u64,
}

impl Counts {
    fn defects(&self) -> u64 {
        self.own + self.leaks + self.ghosts + self.different + self.wrong
    }

    fn json(&self, seed: u64, seconds: f64) -> serde_json::Value {
        let isas: Vec<String> = isas().iter().map(Isa::to_string).collect();
        serde_json::json!({
            "seed": seed, "seconds": seconds.round(), "instruction_sets": isas, "scenes": self.scenes,
            "starts": self.starts, "traced": self.traced, "hits": self.hits, "inward": self.inward,
            "outward": self.outward, "compared": self.compared, "own": self.own, "leaks": self.leaks,
            "ghosts": self.ghosts, "different": self.different, "wrong": self.wrong,
        })
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        let Counts { scenes, starts, traced, hits, inward, outward, compared, own, .. } = other;
        self.scenes += scenes;
        self.starts += starts;
        self.traced += traced;
        self.hits += hits;
        self.inward += inward;
        self.outward += outward;
        self.compared += compared;
        self.own += own;
        self.leaks += other.leaks;
        self.ghosts += other.ghosts;
        self.different += other.different;
        self.wrong += other.wrong;
    }
}

fn isas() -> Vec<Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect()
}

/// Which way a ray leaves its triangle.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Unknown,
    /// From within a face of a closed surface to its inside.
    Inward,
    /// From within a face of a convex body to its outside.
    Outward,
}

/// A scene, and the rays of a batch.
struct Task {
    name: String,
    scene: Scene,
    corners: Vec<[[f32; 3]; 3]>,
    transforms: Vec<[[f64; 4]; 3]>,
    /// 1 for a closed surface whose corners are counterclockwise as seen from outside, -1 for the
    /// reverse, 0 for others.
    orientation: f64,
    is_convex: bool,
    rng: Rng,
    rays: Vec<StartRay>,
    sides: Vec<Side>,
    first: Vec<Hit>,
    counts: Counts,
}

fn main() -> ExitCode {
    let mut numbers = std::env::args().skip(1).map(|arg| arg.parse::<u64>().expect("a number"));
    let (limit, seed) = (numbers.next().unwrap_or(60) as f64, numbers.next().unwrap_or(1));
    let (start, isas, closed) = (Instant::now(), isas(), shapes(1));
    let (mut total, mut round, mut reported) = (Counts::default(), 0, 0.0);
    while start.elapsed().as_secs_f64() < limit {
        let threads = rayon::current_num_threads() as u64;
        let seeds: Vec<u64> = (0..threads).map(|i| seed << 40 | (round * threads + i)).collect();
        let mut tasks: Vec<Task> =
            seeds.into_par_iter().filter_map(|seed| Task::new(seed, &closed)).collect();
        for batch in 0..BATCHES {
            tasks.par_iter_mut().for_each(|task| task.make_rays(batch));
            // All threads trace with one instruction set at a time, which is a setting of the
            // process.
            for (i, isa) in isas.iter().enumerate() {
                isa.choose().expect("it is available");
                tasks.par_iter_mut().for_each(|task| task.trace(i, *isa, batch));
            }
            tasks.par_iter_mut().for_each(|task| task.check(batch));
        }
        tasks.iter().for_each(|task| total += task.counts);
        round += 1;
        if start.elapsed().as_secs_f64() - reported > 60.0 {
            reported = start.elapsed().as_secs_f64();
            eprintln!("{}", total.json(seed, reported));
        }
    }
    println!("{}", total.json(seed, start.elapsed().as_secs_f64()));
    if total.defects() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A random shape: its name, whether it is closed with an inside, and whether it is convex.
fn shape(rng: &mut Rng, closed: &[Shape]) -> (String, Model, bool, bool) {
    let pick = rng.below((closed.len() + 2 * KINDS) as u64) as usize;
    if let Some(shape) = closed.get(pick) {
        let is_convex = shape.name.contains("coplanar faces") || shape.name == "cube 1e7 radii away";
        return (shape.name.into(), shape.grid.model(), !shape.name.starts_with("sheet"), is_convex);
    }
    let kind = pick % KINDS;
    let model = match rng.below(6) {
        0 if kind == 7 => bth_scenes::knot::torus_knot(500 + rng.below(20_000) as u32),
        1 if kind == 7 => meshes::cube(1 + rng.below(30) as usize, Some(rng)),
        _ => meshes::mesh(kind, rng),
    };
    // Scales are powers of two where the inside must keep its shape.
    let scale = [1.0, 0.03125, 2f32.powi(-60), 2f32.powi(40), 2f32.powi(100)][rng.below(5) as usize];
    let model = if kind == 2 || kind == 4 || rng.below(2) == 0 {
        meshes::placed(model, scale, 0.0)
    } else {
        meshes::placed(model, 0.01 * scale, 30.0 * scale)
    };
    (format!("kind {kind}, scale {scale}"), model, [2, 4, 7].contains(&kind), kind == 2)
}

impl Task {
    /// `None` if a shape has no triangle with area.
    fn new(seed: u64, closed: &[Shape]) -> Option<Task> {
        let mut rng = Rng::new(seed);
        let (name, model, is_closed, is_convex) = shape(&mut rng, closed);
        let all: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
        if all.iter().all(|corners| bth_format::exact::is_zero_area(*corners)) {
            return None;
        }
        let mut of = options(Structure::Bvh, RecordKind::Link32);
        let form = rng.below(8);
        match form {
            1 => of.coordinates.bits = Some(GridBits::B16),
            2 => of.free.keep = KeepFree::All,
            3 => of.free.keep = KeepFree::Distances,
            _ => {}
        }
        let object = match form {
            4 => deformed(&model, seed).scene,
            5 => compiled(&model, &CompileOptions { deformable: true, ..of }),
            _ => compiled(&model, &of),
        };
        // In another scene a deformed object has the shape in which it was compiled.
        let scene = if form != 4 && rng.below(4) == 0 { placed(&object, &mut rng) } else { object };
        let mut corners = vec![[[0.0; 3]; 3]; model.triangles.len()];
        for triangle in oracle::triangles(&scene.object(0)) {
            corners[triangle.id as usize] = triangle.corners;
        }
        // Cells of a grid may close what is open, and turn triangles over.
        let orientation = if is_closed && form != 1 { volume(&corners).signum() } else { 0.0 };
        let transforms = (0..scene.instance_count()).map(|i| scene.instance(i).to_world).collect();
        let counts = Counts { scenes: 1, ..Counts::default() };
        let is_convex = is_convex && form != 1 && scene.instance_count() == 1;
        let (name, rays, sides, first) =
            (format!("{name}, form {form}, seed {seed}"), vec![], vec![], vec![]);
        Some(Task {
            name,
            scene,
            corners,
            transforms,
            orientation,
            is_convex,
            rng,
            rays,
            sides,
            first,
            counts,
        })
    }

    fn make_rays(&mut self, batch: usize) {
        let rng = &mut self.rng;
        self.rays = match batch % 4 {
            0 => starts(&self.corners, BATCH, rng.next()),
            1 => coherent_starts(&self.corners, BATCH / 64, rng.next()),
            // Rays go on from the hits of the last batch, half of them back.
            2 if self.first.iter().any(Hit::is_hit) => {
                let hits = self.first.iter().filter(|hit| hit.is_hit()).cycle();
                let last = self.rays.iter().zip(hits).enumerate();
                let back = last.map(|(i, (ray, hit))| {
                    let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
                    StartRay::from_hit(hit, ray.direction.map(|d| sign * d))
                });
                back.collect()
            }
            _ => (0..BATCH).map(|_| anywhere(&self.corners, rng)).collect(),
        };
        if batch % 4 != 2 {
            let count = self.transforms.len() as u64;
            for ray in &mut self.rays {
                let instance = rng.below(count) as u32;
                ray.start.primitive.instance = instance;
                let rows = self.transforms[instance as usize];
                let d = ray.direction.map(f64::from);
                if count > 1 {
                    ray.direction = rows.map(|row| (row[0] * d[0] + row[1] * d[1] + row[2] * d[2]) as f32);
                }
            }
        }
        let sides = self.rays.iter().map(|ray| self.side(ray)).collect();
        self.sides = sides;
        self.counts.starts += self.rays.len() as u64;
    }

    /// Which way a ray certainly leaves its triangle, whose inside it leaves.
    fn side(&self, ray: &StartRay) -> Side {
        let Start { primitive, u, v } = ray.start;
        let within = u > 1e-3 && v > 1e-3 && u + v < 0.999;
        if !within || self.orientation == 0.0 || ray.tmax < f32::INFINITY {
            return Side::Unknown;
        }
        let [a, b, c] = self.corners[primitive.triangle as usize].map(|p| p.map(f64::from));
        let rows = self.transforms[primitive.instance as usize];
        let along = |p: [f64; 3]| rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
        let [p, q] = [b, c].map(|corner| along([0, 1, 2].map(|k| corner[k] - a[k])));
        let d = ray.direction.map(f64::from);
        let norm = |v: [f64; 3]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let product = dot(d, cross(p, q)) * self.orientation * determinant(&rows).signum();
        // Directions are rounded into the space of the object.
        if product.abs() < 1e-4 * norm(d) * norm(p) * norm(q) {
            return Side::Unknown;
        }
        match product < 0.0 {
            true => Side::Inward,
            false if self.is_convex => Side::Outward,
            false => Side::Unknown,
        }
    }

    fn trace(&mut self, turn: usize, isa: Isa, batch: usize) {
        let count = self.rays.len();
        let (mut hits, mut found) = (vec![Hit::MISS; count], vec![false; count]);
        self.scene.batch(&self.rays).nearest(&mut hits);
        self.scene.batch(&self.rays).any(&mut found);
        self.counts.traced += 2 * count as u64;
        if turn == 0 {
            self.first.clone_from(&hits);
        }
        for i in 0..count {
            let is_alone = i % ALONE == (batch + turn) % ALONE;
            let (ray, first) = (&self.rays[i], &self.first[i]);
            let mut is_same = bits(&hits[i]) == bits(first) && found[i] == first.is_hit();
            if is_alone {
                let alone = self.scene.nearest(ray).unwrap_or(Hit::MISS);
                is_same &= bits(&alone) == bits(first) && self.scene.any(ray) == first.is_hit();
                self.counts.traced += 2;
            }
            if !is_same {
                self.counts.different += 1;
                eprintln!("different, {isa}, {}: {ray:?}: {first:?} {:?} {}", self.name, hits[i], found[i]);
            }
        }
    }

    fn check(&mut self, batch: usize) {
        for (i, (ray, hit)) in self.rays.iter().zip(&self.first).enumerate() {
            let counts = &mut self.counts;
            counts.hits += u64::from(hit.is_hit());
            counts.inward += u64::from(self.sides[i] == Side::Inward);
            counts.outward += u64::from(self.sides[i] == Side::Outward);
            let own = hit.is_hit() && hit.primitive == ray.start.primitive;
            let leak = self.sides[i] == Side::Inward && !hit.is_hit();
            let ghost = self.sides[i] == Side::Outward && hit.is_hit();
            counts.own += u64::from(own);
            counts.leaks += u64::from(leak);
            counts.ghosts += u64::from(ghost);
            let asked = i % ORACLE == batch && self.corners.len() <= FEW && self.transforms.len() == 1;
            let mut wrong = false;
            if asked {
                counts.compared += 1;
                wrong = !is_right(&self.corners, ray, hit);
                counts.wrong += u64::from(wrong);
            }
            if own || leak || ghost || wrong {
                eprintln!(
                    "own {own}, leak {leak}, ghost {ghost}, wrong {wrong}, {}: {ray:?} {hit:?}",
                    self.name
                );
            }
        }
    }
}

/// Returns true if a hit is the exact one, or one at the same t but for the accuracy of f64, with t
/// rounded to f32.
fn is_right(corners: &[[[f32; 3]; 3]], ray: &StartRay, hit: &Hit) -> bool {
    let Some(truth) = oracle::nearest(corners, ray) else { return !hit.is_hit() };
    let (t, exact) = (f64::from(hit.t), truth.t_f64());
    let half = 0.5 * f64::from(hit.t - hit.t.next_down());
    let at = oracle::starts::intersection(corners, ray, hit.primitive.triangle);
    let gap = at.map(|at| oracle::to_f64(&at.t) - exact);
    let slack = exact / f64::from(1 << 27);
    hit.t == exact as f32 || (t - exact).abs() <= half * 2.0 && gap.is_some_and(|gap| gap <= slack)
}

/// A ray from any point of any triangle in any direction.
fn anywhere(corners: &[[[f32; 3]; 3]], rng: &mut Rng) -> StartRay {
    let triangle = rng.below(corners.len() as u64) as usize;
    let [a, b, _] = corners[triangle];
    let size = (0..3).fold(0.0, |size: f32, k| size.max((b[k] - a[k]).abs()));
    let [u, v] = if rng.below(4) == 0 { weights(rng) } else { [0.49, 0.49].map(|x| x * rng.unit_f32()) };
    let primitive = PrimitiveRef { instance: 0, triangle: triangle as u32 };
    Start { primitive, u, v }.ray(rng.unit_vector().map(|x| x as f32 * size))
}

/// Some instances of an object that overlap, turned, mirrored, scaled and moved.
fn placed(object: &Scene, rng: &mut Rng) -> Scene {
    let mut builder = SceneBuilder::new();
    let index = builder.add(object);
    let header = object.object(0).header;
    let size = (0..3).fold(0.0, |size: f32, k| size.max(header.upper[k] - header.lower[k]));
    for _ in 0..2 + rng.below(20) {
        let scale = [1.0, -0.3, 4.0, 0.01][rng.below(4) as usize];
        let mut rows = [0.0; 12];
        for k in 0..3 {
            (0..3).for_each(|j| {
                rows[4 * k + j] = scale * (rng.unit_f32() - 0.5 + if j == k { 1.5 } else { 0.0 });
            });
            rows[4 * k + 3] = (rng.unit_f32() - 0.5) * 2.0 * size;
        }
        builder.instance(index, &rows).expect("an object");
    }
    builder.commit().expect("transforms that can be inverted");
    builder.into_scene()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn determinant(rows: &[[f64; 4]; 3]) -> f64 {
    let [a, b, c] = rows.map(|[x, y, z, _]| [x, y, z]);
    dot(a, cross(b, c))
}

/// Six times the volume within a closed surface.
fn volume(corners: &[[[f32; 3]; 3]]) -> f64 {
    let origin = corners[0][0].map(f64::from);
    let of = |triangle: &[[f32; 3]; 3]| {
        let [a, b, c] = triangle.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - origin[k]));
        dot(a, cross(b, c))
    };
    corners.iter().map(of).sum()
}
