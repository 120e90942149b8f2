//! Instances that the caller moves (`bth-bench instances`): setting the transforms and committing, beside Embree with the same
//! instances.

mod motion;

use crate::args::Instances;
use crate::clock::Clock;
use crate::isa;
use crate::markdown::{count, table, two_decimals};
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rivals::embree::{self, EmbreeScene, Variant};
use crate::rounds::median;
use crate::tracer::{Batch, Tracer};
use anyhow::{Context, Result, ensure};
use bth::rays::{Hit, Ray};
use bth_random::Rng;
use motion::{Crowd, Motion, Moves};
use serde::Serialize;
use serde_json::json;

/// Triangles of the object.
const TRIANGLES: u32 = 80;
/// Rays with which answers are compared after each motion.
const RAYS: usize = 2000;
/// Answers of a tracer that rounds count as equal up to this relative difference of t.
const SAME: f32 = 1e-4;

/// What was measured of a contender.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Number of instances.
    pub instances: u32,
    /// Number of threads.
    pub threads: usize,
    /// How the instances move.
    pub motion: &'static str,
    /// The contender.
    pub tracer: &'static str,
    /// Milliseconds to set the transforms and commit: the median of the rounds.
    pub milliseconds: f64,
    /// Share of the rounds in which the top level was built anew.
    pub rebuilt: Option<f64>,
    /// Answers that differ from ours: whether, or by more than 1e-4 of t where, something is hit.
    pub differ: u64,
}

/// Scenes of instances that can be moved.
enum Contender {
    Ours(Box<bth::SceneBuilder>),
    Embree(EmbreeScene),
}

const EMBREES: [(&str, &Variant); 2] = [("embree", &embree::DEFAULT), ("embree dynamic", &embree::DYNAMIC)];

impl Contender {
    /// Sets transforms and commits; returns whether our top level was built anew.
    fn show(&mut self, moves: &Moves) -> Result<bool> {
        match self {
            Contender::Ours(builder) => {
                builder.set_transforms(&moves.ids, &moves.transforms)?;
                Ok(builder.commit()?.rebuilt)
            }
            Contender::Embree(scene) => {
                scene.place_some(&moves.ids, &moves.transforms);
                Ok(false)
            }
        }
    }

    fn nearest(&self, rays: &[Ray]) -> Vec<Hit> {
        let mut hits = vec![Hit::MISS; rays.len()];
        match self {
            Contender::Ours(builder) => builder.scene().batch(rays).nearest(&mut hits),
            Contender::Embree(scene) => {
                Tracer::nearest(scene, Batch { rays, starts: None, coherent: false }, &mut hits);
            }
        }
        hits
    }
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option cannot be used, Embree is missing, or the report cannot be written.
pub fn run(arguments: &Instances) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = if arguments.run.quick { 1 } else { arguments.rounds };
    let progress = Progress::new();
    let mut rows = Vec::new();
    for &instances in &arguments.counts {
        for &threads in &arguments.threads {
            progress.show(format!("{instances} instances, {threads} threads"));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            rows.extend(pool.install(|| measure(instances, threads, rounds))?);
        }
    }
    drop(progress);
    let options = json!({ "rounds": rounds, "triangles": TRIANGLES, "quick": arguments.run.quick });
    let head = Head::now("instances", isa, options);
    let json = json!({ "head": head, "rows": rows });
    Report {
        head: &head,
        title: "Instances placed by the caller",
        body: body(&rows),
        json,
        charts: Vec::new(),
    }
    .write(&arguments.run.output)
}

/// The contenders with the same object and instances, none of which is placed yet.
fn contenders(instances: u32, threads: usize) -> Result<Vec<(&'static str, Contender)>> {
    let model = bth_scenes::blob::blob(TRIANGLES);
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("object.ply");
    bth_scenes::write::file(&model, &path)?;
    let (compiled, _) = bth_compile::pipeline::compile(&path, &Default::default(), &bth_compile::Silent)?;
    let scene = bth::from_bytes(&compiled.bytes).context("a file that was just compiled")?;
    let mut builder = bth::SceneBuilder::new();
    let object = builder.add(&scene);
    for _ in 0..instances {
        builder.instance(object, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])?;
    }
    let mut contenders = vec![("bth", Contender::Ours(Box::new(builder)))];
    let view = scene.object(0);
    for (name, variant) in EMBREES {
        let mesh = (embree::padded(view.positions), view.triangles.to_vec());
        let built = embree::build_instances(vec![mesh], &vec![0; instances as usize], variant, threads)?;
        contenders.push((name, Contender::Embree(built)));
    }
    Ok(contenders)
}

fn measure(instances: u32, threads: usize, rounds: usize) -> Result<Vec<Row>> {
    let mut contenders = contenders(instances, threads)?;
    let mut crowd = Crowd::new(instances);
    let start = crowd.all();
    contenders.iter_mut().try_for_each(|(_, contender)| contender.show(&start).map(drop))?;
    let clock = Clock::for_threads(threads);
    let mut rows = Vec::new();
    for motion in Motion::ALL {
        let mut times = vec![Vec::new(); contenders.len()];
        let mut rebuilt = 0;
        for round in 0..=rounds {
            // All contenders in turn, so that other work of the machine affects all alike.
            let moves = crowd.advance(motion);
            for ((_, contender), times) in contenders.iter_mut().zip(&mut times) {
                let mut shown = Ok(false);
                let seconds = clock.time(|| shown = contender.show(&moves));
                if round > 0 {
                    times.push(seconds);
                    rebuilt += usize::from(shown?);
                }
            }
        }
        let rays = rays(&crowd.all());
        let expected = contenders[0].1.nearest(&rays);
        ensure!(expected.iter().any(Hit::is_hit), "no ray hits");
        for ((tracer, contender), times) in contenders.iter().zip(times) {
            let same = |a: &Hit, b: &Hit| {
                a.is_hit() == b.is_hit() && (!a.is_hit() || (a.t - b.t).abs() <= SAME * a.t.abs())
            };
            let hits = contender.nearest(&rays);
            let differ = expected.iter().zip(&hits).filter(|(a, b)| !same(a, b)).count() as u64;
            let ours = matches!(contender, Contender::Ours(_));
            rows.push(Row {
                instances,
                threads,
                motion: motion.name(),
                tracer,
                milliseconds: 1e3 * median(times).unwrap_or(f64::NAN),
                rebuilt: ours.then(|| rebuilt as f64 / rounds as f64),
                differ,
            });
        }
    }
    Ok(rows)
}

/// Rays from anywhere about to instances.
fn rays(placed: &Moves) -> Vec<Ray> {
    let mut rng = Rng::new(2);
    (0..RAYS)
        .map(|_| {
            let m = placed.transforms[rng.below(placed.transforms.len() as u64) as usize];
            let target = [m[3], m[7], m[11]];
            let origin = target.map(|x| x + (rng.unit_f32() - 0.5) * 40.0);
            Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
        })
        .collect()
}

fn body(rows: &[Row]) -> String {
    let head = ["instances", "threads", "motion", "tracer", "ms", "times embree", "rebuilt", "differ"]
        .map(str::to_owned);
    let of_embree = |row: &Row| {
        let same = |other: &&Row| {
            let key = |row: &Row| (row.instances, row.threads, row.motion);
            other.tracer == "embree" && key(other) == key(row)
        };
        rows.iter().find(same).map(|embree| row.milliseconds / embree.milliseconds)
    };
    let cells = |row: &Row| {
        vec![
            count(row.instances.into()),
            row.threads.to_string(),
            row.motion.to_owned(),
            row.tracer.to_owned(),
            format!("{:.3}", row.milliseconds),
            two_decimals(of_embree(row)),
            row.rebuilt.map_or_else(String::new, |share| format!("{:.0} %", 100.0 * share)),
            count(row.differ),
        ]
    };
    let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
    format!(
        "Time to set the transforms of the instances that move and to commit; medians of interleaved rounds, by the CPU clock of the \
         thread for one thread and by the wall clock for several. `drift`: all instances move on, by 1/16 of their size. `shuffle`: each \
         goes where another was. `few`: one in a hundred moves on. `embree` has the defaults, `embree dynamic` a scene that is dynamic \
         and of low quality. `rebuilt`: share of the rounds in which our top level was built anew, not refitted. `differ`: of {RAYS} rays, \
         those whose hit is not ours.\n\n{}",
        table(&head, &rows)
    )
}
