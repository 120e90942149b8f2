//! One start: open or build, then trace the first rays. Runs in a separate process and prints its
//! times as JSON.
#![allow(unsafe_code)]

use crate::clock::process_cpu;
use crate::isa;
use crate::rivals::embree;
use crate::scenes::Placed;
use crate::structures::SceneTracer;
use crate::tracer::{Batch, Tracer, spread};
use anyhow::{Context, Result, ensure};
use bth::rays::{Hit, Ray};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;
use zerocopy::FromBytes;

/// `probe`.
#[derive(Debug, Args)]
pub(crate) struct Probe {
    /// How to start.
    #[arg(long, value_enum)]
    pub(crate) start: Start,
    /// Number of threads to build and trace on.
    #[arg(long)]
    pub(crate) threads: usize,
    /// Vector instructions of our kernels.
    #[arg(long)]
    pub(crate) isa: Option<String>,
    /// Compiled file; Embree builds from its triangles.
    pub(crate) file: PathBuf,
    /// The rays; the first hits.
    pub(crate) rays: PathBuf,
}

/// How a program gets a structure that it can trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Start {
    /// `bth::map`.
    Map,
    /// `bth::open`: reads and checks.
    Read,
    /// Embree builds from triangles in memory, with its defaults.
    Embree,
    /// The same, in Embree's robust mode.
    EmbreeRobust,
}

impl Start {
    /// The name on the command line and in tables.
    pub(crate) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// The times of a start: wall-clock seconds since just before the file was opened or the build
/// began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StartTimes {
    /// Until rays could be traced.
    pub(crate) ready_s: f64,
    /// Until the first hit.
    pub(crate) first_hit_s: f64,
    /// Until the first rays were traced.
    pub(crate) total_s: f64,
    /// CPU seconds of all threads until then.
    pub(crate) cpu_s: f64,
    /// Bytes that were read from storage until then, if the system counts them.
    pub(crate) storage_bytes: Option<u64>,
    /// Rays that hit.
    pub(crate) hits: usize,
}

/// Starts once and prints the times as JSON.
pub(crate) fn run(arguments: &Probe) -> Result<()> {
    isa::select(arguments.isa.as_deref())?;
    let bytes = std::fs::read(&arguments.rays)?;
    let rays = bytes.chunks(size_of::<Ray>()).map(|b| Ray::read_from_bytes(b).ok());
    let rays = rays.collect::<Option<Vec<Ray>>>().context("not a file of rays")?;
    let Probe { file, threads, .. } = arguments;
    let probed = match arguments.start {
        // SAFETY: `load` wrote the file into a temporary folder and does not touch it while we run.
        Start::Map => probe(&rays, *threads, || Ok(SceneTracer(unsafe { bth::map(file)? })))?,
        Start::Read => probe(&rays, *threads, || Ok(SceneTracer(bth::open(file)?)))?,
        Start::Embree | Start::EmbreeRobust => {
            // Neither the library nor the triangles are part of a build.
            embree::available()?;
            let scene = bth::open(file)?;
            let robust = arguments.start == Start::EmbreeRobust;
            let variant = if robust { &embree::ROBUST } else { &embree::DEFAULT };
            let mut placed = Placed::of(&scene);
            if scene.description().is_some() {
                probe(&rays, *threads, || placed.build(variant, *threads))?
            } else {
                let (positions, triangles) = placed.objects.pop().context("an object")?;
                probe(&rays, *threads, || embree::build(positions, triangles, variant, *threads))?
            }
        }
    };
    writeln!(std::io::stdout().lock(), "{}", serde_json::to_string(&probed)?)?;
    Ok(())
}

fn batch(rays: &[Ray]) -> Batch<'_> {
    Batch { rays, starts: None, coherent: true }
}

fn probe<T: Tracer>(rays: &[Ray], threads: usize, start: impl FnOnce() -> Result<T>) -> Result<StartTimes> {
    let mut hits = vec![Hit::MISS; rays.len()];
    let (before, cpu, clock) = (storage_bytes(), process_cpu(), Instant::now());
    let tracer = start()?;
    let ready_s = clock.elapsed().as_secs_f64();
    tracer.nearest(batch(&rays[..1]), &mut hits[..1]);
    let first_hit_s = clock.elapsed().as_secs_f64();
    let share = rays.len().div_ceil(threads);
    spread(batch(rays), &mut hits, (threads, 1), share, |batch, hits| tracer.nearest(batch, hits));
    let total_s = clock.elapsed().as_secs_f64();
    let cpu_s = process_cpu() - cpu;
    ensure!(hits[0].is_hit(), "the first ray hits nothing");
    let storage_bytes = storage_bytes().zip(before).map(|(after, before)| after - before);
    let hits = hits.iter().filter(|h| h.is_hit()).count();
    Ok(StartTimes { ready_s, first_hit_s, total_s, cpu_s, storage_bytes, hits })
}

/// Bytes that this process has read from storage so far (Linux).
fn storage_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    text.lines().find_map(|line| line.strip_prefix("read_bytes:"))?.trim().parse().ok()
}
