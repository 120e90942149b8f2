//! Motion blur of objects that deform (`bth-bench shutter`): positions computed for each time within an open shutter, interpolated
//! between two refits, or interpolated for each ray; what they cost, and how far off their pictures are.

mod interpolated;
mod tables;

use crate::args::Shutter;
use crate::clock::Clock;
use crate::isa;
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::scenes::{FrameRays, Source, compiled};
use anyhow::{Result, ensure};
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::pipeline::MotionOptions;
use interpolated::{Tree, Visits};
use serde::Serialize;
use serde_json::json;

/// Times within the shutter, as `bth-play` has them.
const TIMES: u32 = 64;
/// Times of the pictures that others are compared with.
const REFERENCE_TIMES: u32 = 1024;

/// What was measured of a frame of a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShutterTimes {
    /// Name of the scene.
    pub name: String,
    /// Triangles of the objects that deform.
    pub triangles: usize,
    /// For how many frames the shutter is open.
    pub open: f64,
    /// Milliseconds of one thread to set the scene to all times: positions computed, refit, instances.
    pub exact_ms: f64,
    /// The same for positions between those at both ends of the shutter: interpolation, refit, instances.
    pub linear_ms: f64,
    /// Milliseconds of one thread for a camera ray of every pixel at every time.
    pub trace_ms: f64,
    /// Greatest distance between an interpolated vertex and where it is, relative to the diagonal of the scene's box.
    pub position_error: f64,
    /// Mean differences of pictures from those of 1,024 times: of 64 times, of 64 times between both ends, of an instant.
    pub picture_errors: [f64; 3],
    /// Rays with times of their own, if all instances stand still.
    pub per_ray: Option<PerRay>,
}

/// Plain functions in f32: trees refitted for each time, and boxes and corners interpolated for each ray.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PerRay {
    /// Nanoseconds a ray.
    pub ns: [f64; 2],
    /// Nodes a ray.
    pub nodes: [f64; 2],
    /// Triangles a ray.
    pub triangles: [f64; 2],
    /// Share of rays whose answers differ by more than 1e-4 of t.
    pub differ: f64,
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or scene cannot be used, or the report cannot be written.
pub fn run(arguments: &Shutter) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let progress = Progress::new();
    let options = json!({ "pixels": arguments.size(), "open": arguments.open, "quick": arguments.run.quick });
    let head = Head::now("shutter", isa, options);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut rows = Vec::new();
    for name in &arguments.scenes {
        let source = Source::load(name)?;
        progress.show(format!("{name}: compiling"));
        let mut scene = compiled(&source, MotionOptions::default())?;
        for &open in &arguments.open {
            progress.show(format!("{name}: open for {open} frames"));
            rows.push(pool.install(|| measure(&source, &mut scene, open, arguments))?);
        }
    }
    drop(progress);
    let json = json!({ "head": head, "rows": rows });
    let body = tables::markdown(&rows);
    Report { head: &head, title: "Motion blur of objects that deform", body, json, charts: Vec::new() }
        .write(&arguments.run.output)
}

/// An object that deforms, and its positions when the shutter opens and closes.
struct Deforming {
    object: u32,
    ends: [Vec<[f32; 3]>; 2],
}

/// The shutter of a frame.
struct Exposure {
    /// When it opens, seconds.
    from: f64,
    /// For how long it is open.
    seconds: f64,
}

impl Exposure {
    /// The share of a time among so many, which are the middles of equal parts.
    fn share(time: u32, count: u32) -> f64 {
        (f64::from(time) + 0.5) / f64::from(count)
    }

    fn at(&self, share: f64) -> f64 {
        self.from + share * self.seconds
    }
}

fn measure(source: &Source, scene: &mut Scene, open: f64, arguments: &Shutter) -> Result<ShutterTimes> {
    let (first, last) = (source.manifest.frames.first, source.manifest.frames.last);
    let frame = f64::from(first) + 0.4 * f64::from(last - first);
    let rate = source.manifest.frames.rate;
    let exposure = Exposure { from: (frame - 0.5 * open) / rate, seconds: open / rate };
    scene.set_seconds(frame / rate)?;
    let rays = FrameRays::of(scene, arguments.size())?.sets[0].rays.clone();
    let (lower, upper) = scene.bounds().unwrap_or_default();
    let diagonal = (glam::Vec3::from(upper) - glam::Vec3::from(lower)).as_dvec3().length();
    let deforming = deforming(scene, &exposure)?;
    ensure!(!deforming.is_empty(), "{}: nothing deforms within the shutter", source.name);
    let rounds = if arguments.run.quick { 1 } else { arguments.rounds };
    let (exact_ms, linear_ms) = updates(scene, &exposure, &deforming, rounds)?;
    let position_error = position_error(scene, &exposure, &deforming)? / diagonal;
    let reference_times = if arguments.run.quick { TIMES } else { REFERENCE_TIMES };
    let (reference, _) = picture(scene, &exposure, &rays, (reference_times, None))?;
    let (exact, trace_ms) = picture(scene, &exposure, &rays, (TIMES, None))?;
    let (linear, _) = picture(scene, &exposure, &rays, (TIMES, Some(&deforming)))?;
    let (instant, _) = picture(scene, &exposure, &rays, (1, None))?;
    let picture_errors = [exact, linear, instant].map(|picture| difference(&picture, &reference));
    let triangles = deforming.iter().map(|d| scene.object(d.object).header.triangles as usize).sum();
    let per_ray = per_ray(scene, &exposure, &rays, &deforming, rounds)?;
    let name = source.name.clone();
    Ok(ShutterTimes {
        name,
        triangles,
        open,
        exact_ms,
        linear_ms,
        trace_ms,
        position_error,
        picture_errors,
        per_ray,
    })
}

/// The objects whose positions differ between both ends of the shutter.
fn deforming(scene: &mut Scene, exposure: &Exposure) -> Result<Vec<Deforming>> {
    let mut at = |share: f64| -> Result<Vec<Vec<[f32; 3]>>> {
        scene.set_seconds(exposure.at(share))?;
        let count = scene.object_count();
        Ok((0..count)
            .map(|o| scene.vertex_count(o).map_or(Vec::new(), |_| scene.positions(o).to_vec()))
            .collect())
    };
    let (open, close) = (at(0.0)?, at(1.0)?);
    let pairs = (0..).zip(open.into_iter().zip(close)).filter(|(_, (a, b))| a != b);
    Ok(pairs.map(|(object, (a, b))| Deforming { object, ends: [a, b] }).collect())
}

/// Milliseconds to set the scene to all times, with positions of each and with those between the ends: the least of some rounds.
fn updates(
    scene: &mut Scene,
    exposure: &Exposure,
    deforming: &[Deforming],
    rounds: usize,
) -> Result<(f64, f64)> {
    let (mut exact, mut linear) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..rounds {
        let mut done = Ok(());
        let seconds = Clock::ThreadCpu.time(|| {
            for time in 0..TIMES {
                let update = scene.set_seconds(exposure.at(Exposure::share(time, TIMES)));
                done = std::mem::replace(&mut done, Ok(())).and(update.map(drop));
            }
        });
        done?;
        exact = exact.min(1e3 * seconds);
        let mut done = Ok(());
        let seconds = Clock::ThreadCpu.time(|| {
            for time in 0..TIMES {
                let set = between(scene, deforming, Exposure::share(time, TIMES));
                done = std::mem::replace(&mut done, Ok(())).and(set);
            }
        });
        done?;
        linear = linear.min(1e3 * seconds);
    }
    Ok((exact, linear))
}

/// Gives objects positions between those at both ends of the shutter.
fn between(scene: &mut Scene, deforming: &[Deforming], share: f64) -> Result<()> {
    for Deforming { object, ends: [open, close] } in deforming {
        scene.set_positions_between(*object, [open, close], share)?;
    }
    Ok(())
}

/// The greatest distance between an interpolated vertex and where it is.
fn position_error(scene: &mut Scene, exposure: &Exposure, deforming: &[Deforming]) -> Result<f64> {
    let mut greatest: f64 = 0.0;
    for time in 0..TIMES {
        let share = Exposure::share(time, TIMES);
        scene.set_seconds(exposure.at(share))?;
        let exact: Vec<Vec<[f32; 3]>> =
            deforming.iter().map(|d| scene.positions(d.object).to_vec()).collect();
        between(scene, deforming, share)?;
        for (d, exact) in deforming.iter().zip(exact) {
            for (a, b) in exact.iter().zip(scene.positions(d.object)) {
                let apart = glam::Vec3::from(*a).as_dvec3() - glam::Vec3::from(*b).as_dvec3();
                greatest = greatest.max(apart.length());
            }
        }
    }
    Ok(greatest)
}

/// The mean over so many times of how much surfaces face the camera, 0 where nothing is hit; and the milliseconds of all rays. With
/// objects their positions are those between both ends of the shutter.
fn picture(
    scene: &mut Scene,
    exposure: &Exposure,
    rays: &[Ray],
    (times, linear): (u32, Option<&[Deforming]>),
) -> Result<(Vec<f64>, f64)> {
    let mut sums = vec![0.0; rays.len()];
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut milliseconds = 0.0;
    for time in 0..times {
        let share = Exposure::share(time, times);
        scene.set_seconds(exposure.at(share))?;
        between(scene, linear.unwrap_or_default(), share)?;
        milliseconds += 1e3 * Clock::ThreadCpu.time(|| scene.batch(rays).nearest(&mut hits));
        for ((sum, hit), ray) in sums.iter_mut().zip(&hits).zip(rays) {
            if let Some(surface) = scene.surface(hit) {
                let direction = glam::Vec3::from(ray.direction).as_dvec3().normalize();
                *sum += glam::DVec3::from(surface.geometric_normal).dot(direction).abs() / f64::from(times);
            }
        }
    }
    Ok((sums, milliseconds))
}

/// The mean difference of two pictures, over pixels that are not empty in both.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b).filter(|(a, b)| **a > 0.0 || **b > 0.0);
    let (count, sum) = pairs.fold((0u32, 0.0), |(count, sum), (a, b)| (count + 1, sum + (a - b).abs()));
    sum / f64::from(count.max(1))
}

/// Rays with times of their own through the objects that deform: by trees that are refitted for each time, and by one that is
/// interpolated for each ray. `None` where instances of these objects move.
fn per_ray(
    scene: &mut Scene,
    exposure: &Exposure,
    rays: &[Ray],
    deforming: &[Deforming],
    rounds: usize,
) -> Result<Option<PerRay>> {
    scene.set_seconds(exposure.at(0.5))?;
    let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    if (0..scene.instance_count()).any(|row| scene.instance(row).to_world != identity) {
        return Ok(None);
    }
    let mut trees_at = |share: f64| -> Result<Vec<Tree>> {
        between(scene, deforming, share)?;
        Ok(deforming.iter().map(|d| Tree::of(scene, d.object)).collect())
    };
    let (open, close) = (trees_at(0.0)?, trees_at(1.0)?);
    let moving: Vec<Tree> = open.into_iter().zip(close).map(|(a, b)| Tree::between(a, b)).collect();
    let refitted =
        (0..TIMES).map(|time| trees_at(Exposure::share(time, TIMES))).collect::<Result<Vec<_>>>()?;
    // Rays next to each other take different times, as in the player.
    let time = |ray: usize| (ray as u32).wrapping_mul(0x9e37_79b1) >> (u32::BITS - TIMES.ilog2());
    let mut order: Vec<usize> = (0..rays.len()).collect();
    order.sort_by_key(|ray| time(*ray));
    let nearest = |trees: &[Tree], ray: usize, visits: &mut Visits| {
        let share = Exposure::share(time(ray), TIMES) as f32;
        trees.iter().fold(f32::INFINITY, |t, tree| t.min(tree.nearest(&rays[ray], share, visits)))
    };
    let (mut seconds, mut visits) = ([f64::INFINITY; 2], [Visits::default(); 2]);
    let mut distances = [vec![0.0; rays.len()], vec![0.0; rays.len()]];
    for _ in 0..rounds {
        visits = [Visits::default(); 2];
        let by_time = Clock::ThreadCpu.time(|| {
            for &ray in &order {
                distances[0][ray] = nearest(&refitted[time(ray) as usize], ray, &mut visits[0]);
            }
        });
        let by_ray = Clock::ThreadCpu.time(|| {
            for (ray, distance) in distances[1].iter_mut().enumerate() {
                *distance = nearest(&moving, ray, &mut visits[1]);
            }
        });
        seconds = [seconds[0].min(by_time), seconds[1].min(by_ray)];
    }
    let count = rays.len() as f64;
    let same = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-4 * a.abs();
    let differ = distances[0].iter().zip(&distances[1]).filter(|pair| !same(*pair)).count();
    Ok(Some(PerRay {
        ns: seconds.map(|seconds| 1e9 * seconds / count),
        nodes: visits.map(|visits| visits.nodes as f64 / count),
        triangles: visits.map(|visits| visits.triangles as f64 / count),
        differ: differ as f64 / count,
    }))
}
