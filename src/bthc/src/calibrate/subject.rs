//! A model to measure on: its compiled structures, sampled rays, and the traversal steps that these
//! take.

use crate::failure::Failure;
use crate::measure::{QueryKind, Rays, TimedRun, nanoseconds};
use bth::Scene;
use bth_compile::costs::{TetWalker, Walked};
use bth_compile::pipeline::{self, CompileOptions, Structure};
use bth_compile::sampling::{self, SampleRay};
use bth_compile::tets::WorkerStatus;
use bth_compile::{Error, Monitor, bvh, tets};
use bth_format::layout::RecordKind;
use bth_import::Mesh;
use std::time::Instant;

/// Rays of each kind to a small model: few enough that they and the model stay in the caches of the
/// core wherever the system places their pages.
const RAYS_TO_SMALL: usize = 4096;
/// Rays of each kind to a large model.
const RAYS_TO_LARGE: usize = 16384;
/// Rays whose steps are counted.
const COUNTED: usize = 4096;

/// Number of records.
const RECORDS: usize = RecordKind::ALL.len();
/// Triangles of the largest small model.
const SMALL_TRIANGLES: usize = 20_000;
/// Number of times that small models are tetrahedralized to measure the time.
const REPETITIONS: usize = 16;

/// Number of times that models and rays are copied to new addresses during the rounds, since the
/// addresses decide which data share a set of a cache.
const COPIES: usize = 3;

/// Rays of one kind and their mean steps.
#[derive(Clone)]
struct Kind {
    rays: Rays,
    /// Entered nodes of the binary BVH, and tetrahedra.
    visits: f64,
    steps: f64,
    /// Share that ends at a triangle.
    hits: f64,
}

impl Kind {
    /// Counts the steps of the first [`COUNTED`] rays.
    fn new(samples: &[SampleRay], mesh: &Mesh, tree: &bvh::BinaryBvh, walker: &TetWalker<'_>) -> Kind {
        let counted = &samples[..samples.len().min(COUNTED)];
        let visits: f64 =
            counted.iter().map(|r| f64::from(sampling::walk(mesh, tree, r, |_| {}).visits)).sum();
        let walked: Vec<Walked> = counted.iter().filter_map(|r| walker.walk(r)).collect();
        let mean = |of: fn(&Walked) -> u32| {
            walked.iter().map(|w| f64::from(of(w))).sum::<f64>() / counted.len().max(1) as f64
        };
        Kind {
            rays: Rays::new(samples),
            visits: visits / counted.len().max(1) as f64,
            steps: mean(|w| w.steps),
            hits: mean(|w| u32::from(w.hit)),
        }
    }
}

/// Times of one kind of rays, with their steps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Timed {
    /// Nanoseconds through the BVH.
    pub(crate) bvh: f64,
    /// Entered nodes of the binary BVH.
    pub(crate) visits: f64,
    /// Nanoseconds through the tetrahedra, by record.
    pub(crate) tets: [f64; RECORDS],
    /// Nanoseconds through the tetrahedra one ray a call, by record.
    pub(crate) single: [f64; RECORDS],
    /// Tetrahedra on the query.
    pub(crate) steps: f64,
    /// Share of the rays that end at a triangle.
    pub(crate) hits: f64,
}

/// What was measured on a model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Times {
    /// Rays that miss the box.
    pub(crate) nothing: f64,
    /// Lines from outside.
    pub(crate) outside: Timed,
    /// Bounces that miss, then bounces that hit a triangle; each with few steps and with many.
    pub(crate) bounces: [Timed; 4],
    /// Short rays from surfaces.
    pub(crate) short: Timed,
    /// Wide nodes and leaves that lines from outside enter.
    pub(crate) wide: [f64; 2],
    /// Bytes of the tetrahedra and vertices, by record.
    pub(crate) bytes: [f64; RECORDS],
    /// Tetrahedralization, microseconds a triangle; of a small model the mean of several.
    pub(crate) tetrahedralize: f64,
}

/// A model in all structures.
pub(crate) struct Subject {
    /// The BVH, then the tetrahedra in each record.
    files: Vec<Vec<u8>>,
    nothing: Rays,
    outside: Kind,
    bounces: [Kind; 4],
    short: Kind,
    wide: [f64; 2],
    bytes: [f64; RECORDS],
    tetrahedralize: f64,
}

impl Subject {
    /// Compiles a model in every structure.
    ///
    /// # Errors
    /// If it cannot be tetrahedralized whole, or the worker is missing.
    pub(crate) fn new(name: &str, mesh: &Mesh, monitor: &dyn Monitor) -> Result<Subject, Failure> {
        let options =
            CompileOptions { structure: Structure::Tets, keep_subtrees: false, ..CompileOptions::default() };
        let (tree, _) = bvh::build(mesh, &options.bvh, monitor)?;
        let (built, report) = tets::build(mesh, &tree, &[0], &options.tets, monitor)?;
        let [(0, tets)] = &built[..] else {
            let message = match report.worker {
                WorkerStatus::Missing { hint } => hint,
                WorkerStatus::Unusable { reason } => reason,
                _ => format!("{name} could not be tetrahedralized whole"),
            };
            return Err(Error::Input {
                code: "BTH-I061",
                place: bth_compile::error::Place::File(name.into()),
                message,
                hint: "costs of tetrahedra need the worker bth-tetgen and models without bad contacts".into(),
            }
            .into());
        };
        let small = mesh.triangles.len() <= SMALL_TRIANGLES;
        let seconds = match small {
            true => repeated_seconds(mesh, &tree, &options, monitor)?,
            false => report.nodes.iter().map(|n| n.seconds).sum(),
        };
        let file = |built: &[(u32, tets::TetMesh)], record: RecordKind| {
            let options = CompileOptions { record, geometry: false, ..options.clone() };
            pipeline::assemble(mesh, &tree, built, &options, monitor).map(|compiled| compiled.bytes)
        };
        let mut files = vec![file(&[], RecordKind::Link32)?];
        for record in RecordKind::ALL {
            files.push(file(&built, record)?);
        }
        let plain = bth::from_bytes(&files[0])?;
        let root = &tree.nodes[0];
        let count = if small { RAYS_TO_SMALL } else { RAYS_TO_LARGE };
        let lines = sampling::outside(root.lower, root.upper, count, 11);
        // The opposite half of each line leads away from the model.
        let away = |ray: &SampleRay| SampleRay { direction: ray.direction.map(|x| -x), ..*ray };
        let nothing: Vec<SampleRay> = lines.iter().map(away).collect();
        let surface = sampling::from_surface(mesh, &tree, 0..tree.order.len(), 6 * count, 12);
        let (bounce, mut short): (Vec<SampleRay>, Vec<SampleRay>) =
            surface.into_iter().partition(|ray| ray.tmax.is_infinite());
        short.truncate(count);
        let walker = TetWalker::new(tets);
        let bounces = parts(&walker, &bounce);
        let kind = |samples: &[SampleRay]| Kind::new(samples, mesh, &tree, &walker);
        let outside = kind(&lines);
        Ok(Subject {
            wide: wide(&plain, &lines[..lines.len().min(COUNTED)]),
            bytes: RecordKind::ALL
                .map(|record| (tets.tets.len() * record.stride() + tets.vertices.len() * 16) as f64),
            tetrahedralize: 1e6 * seconds / mesh.triangles.len().max(1) as f64,
            files,
            nothing: Rays::new(&nothing),
            bounces: bounces.each_ref().map(|rays| kind(rays)),
            short: kind(&short),
            outside,
        })
    }

    /// A copy of the scenes and the rays at new addresses.
    fn copied(&self) -> Result<SubjectCopy, Failure> {
        let scenes = self.files.iter().map(|file| bth::from_bytes(file)).collect::<Result<_, _>>()?;
        let kinds = self.kinds().map(|(kind, query)| (kind.rays.clone(), query)).collect();
        Ok(SubjectCopy { scenes, nothing: self.nothing.clone(), kinds })
    }

    fn kinds(&self) -> impl Iterator<Item = (&Kind, QueryKind)> {
        let bounces = self.bounces.iter().map(|kind| (kind, QueryKind::Nearest));
        [(&self.outside, QueryKind::Nearest), (&self.short, QueryKind::Any)].into_iter().chain(bounces)
    }

    /// Assigns the times of the runs to the kinds of rays and structures, in the order of
    /// [`SubjectCopy::runs`].
    fn times(&self, times: &[f64]) -> Times {
        let kinds: Vec<&Kind> = self.kinds().map(|(kind, _)| kind).collect();
        let timed = |row: usize| {
            let (first, kind) = (1 + 9 * row, kinds[row]);
            Timed {
                bvh: times[first],
                visits: kind.visits,
                tets: std::array::from_fn(|r| times[first + 1 + r]),
                single: std::array::from_fn(|r| times[first + 5 + r]),
                steps: kind.steps,
                hits: kind.hits,
            }
        };
        Times {
            nothing: times[0],
            outside: timed(0),
            short: timed(1),
            bounces: [2, 3, 4, 5].map(timed),
            wide: self.wide,
            bytes: self.bytes,
            tetrahedralize: self.tetrahedralize,
        }
    }
}

/// The scenes and rays of a subject while they are timed.
struct SubjectCopy {
    scenes: Vec<Scene>,
    nothing: Rays,
    kinds: Vec<(Rays, QueryKind)>,
}

impl SubjectCopy {
    /// The runs: rays that miss, then every kind through the BVH and through the tetrahedra in each
    /// record.
    fn runs(&self) -> Vec<TimedRun<'_>> {
        let (bvh, tets) = (&self.scenes[0], &self.scenes[1..]);
        let mut runs: Vec<TimedRun<'_>> = vec![(bvh, &self.nothing, QueryKind::Nearest)];
        for (rays, query) in &self.kinds {
            runs.push((bvh, rays, *query));
            runs.extend(tets.iter().map(|scene| (scene, rays, *query)));
            runs.extend(tets.iter().map(|scene| (scene, rays, QueryKind::Single)));
        }
        runs
    }
}

/// Times all kinds of rays through all structures of all models in turn, so that other work of the
/// machine does not distort the times of one model only; and the nanoseconds of a ray of the
/// additional run `beside`.
///
/// # Errors
/// If it was stopped.
pub(crate) fn measure(
    subjects: &[Subject],
    beside: TimedRun<'_>,
    rounds: usize,
    stop: impl Fn() -> bool,
) -> Result<(Vec<Times>, f64), Failure> {
    let mut least: Vec<f64> = Vec::new();
    let mut before = Vec::new();
    for _ in 0..COPIES {
        // The previous copies are kept until here, so that the new ones get other addresses.
        let copies = subjects.iter().map(Subject::copied).collect::<Result<Vec<_>, _>>()?;
        let mut runs = vec![beside];
        runs.extend(copies.iter().flat_map(SubjectCopy::runs));
        let times = nanoseconds(&runs, rounds.div_ceil(COPIES), &stop).ok_or(Error::Cancelled)?;
        least.resize(times.len(), f64::INFINITY);
        least.iter_mut().zip(times).for_each(|(least, time)| *least = least.min(time));
        drop(std::mem::replace(&mut before, copies));
    }
    let each = least[1..].chunks(least[1..].len() / subjects.len().max(1));
    let times = subjects.iter().zip(each).map(|(subject, times)| subject.times(times)).collect();
    Ok((times, least[0]))
}

/// Seconds of one tetrahedralization of a small model, as the mean of [`REPETITIONS`]: CPU seconds
/// of the worker where the system counts them, else wall clock.
fn repeated_seconds(
    mesh: &Mesh,
    tree: &bvh::BinaryBvh,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<f64, Failure> {
    let (before, start) = (worker_seconds(), Instant::now());
    for _ in 0..REPETITIONS {
        tets::build(mesh, tree, &[0], &options.tets, monitor)?;
    }
    let spent = before.and_then(|before| Some(worker_seconds()? - before));
    Ok(spent.unwrap_or(start.elapsed().as_secs_f64()) / REPETITIONS as f64)
}

/// CPU seconds of the child processes that this one has waited for, which exclude the time of other
/// processes. `None` where the system does not count them.
fn worker_seconds() -> Option<f64> {
    /// Clock ticks of the counters in this file, on all systems that have it.
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may hold anything: cutime and cstime are the 14th and 15th.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks = fields.split_whitespace().skip(13).take(2).map(|field| field.parse::<f64>().ok());
    Some(ticks.sum::<Option<f64>>()? / TICKS_A_SECOND)
}

/// Rays that miss, then rays that hit a triangle; each the third with the fewest steps and the
/// third with the most. Skips the rays between, which tell little about the cost of a step.
fn parts(walker: &TetWalker<'_>, rays: &[SampleRay]) -> [Vec<SampleRay>; 4] {
    let mut parts = [const { Vec::new() }; 4];
    for hit in [true, false] {
        let walked: Vec<(u32, SampleRay)> = rays
            .iter()
            .filter_map(|ray| Some((walker.walk(ray)?, *ray)))
            .filter_map(|(walk, ray)| (walk.hit == hit).then_some((walk.steps, ray)))
            .collect();
        let mut steps: Vec<u32> = walked.iter().map(|w| w.0).collect();
        steps.sort_unstable();
        let third = |k: usize| steps.get(k * steps.len() / 3).copied().unwrap_or(0);
        let (few, many) = (third(1), third(2));
        for (steps, ray) in walked {
            if steps <= few || steps > many {
                parts[2 * usize::from(hit) + usize::from(steps > many)].push(ray);
            }
        }
    }
    parts
}

/// Wide nodes and leaves that these rays enter, on average.
fn wide(scene: &Scene, samples: &[SampleRay]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for ray in Rays::new(samples).each() {
        let (_, steps) = scene.nearest_counted(ray);
        sums[0] += f64::from(steps.nodes);
        sums[1] += f64::from(steps.leaves);
    }
    sums.map(|sum| sum / samples.len().max(1) as f64)
}
