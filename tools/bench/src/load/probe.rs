//! One start: open or build, then trace the first rays. Runs in a process of its own and prints its times
//! as JSON.
#![allow(unsafe_code)]

use super::files;
use crate::args::{Probe, Start};
use crate::clock::process_cpu;
use crate::isa;
use crate::rivals::embree;
use crate::structures::BATCH;
use crate::tracer::{Batch, Tracer, spread};
use anyhow::Result;
use bth::rays::{Hit, Ray};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::time::Instant;

/// The times of a start: wall-clock seconds since the file was about to be opened or the build was about to begin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartTimes {
    /// Until rays could be traced.
    pub ready_s: f64,
    /// Until the first hit.
    pub first_hit_s: f64,
    /// Until all rays were traced.
    pub total_s: f64,
    /// CPU seconds of all threads until then.
    pub cpu_s: f64,
    /// Bytes that were read from storage until then, where the system counts them.
    pub storage_bytes: Option<u64>,
    /// Rays that hit.
    pub hits: usize,
    /// Seconds for all rays of the file, where only some of them were the first: the less of two rounds.
    pub frame_s: Option<f64>,
}

/// Starts once and prints the times as JSON.
///
/// # Errors
/// If the file or library cannot be used.
pub fn run(arguments: &Probe) -> Result<()> {
    isa::select(arguments.isa.as_deref())?;
    let rays = files::read_rays(&arguments.rays)?;
    let (file, threads) = (&arguments.file, arguments.threads);
    let first = arguments.first.unwrap_or(rays.len()).min(rays.len());
    let probed = match arguments.start {
        // SAFETY: `load` wrote the file into a folder of its own and does not touch it while we run.
        Start::Map => probe(&rays, first, threads, || Ok(OpenedFile(unsafe { bth::map(file)? })))?,
        Start::Read => probe(&rays, first, threads, || Ok(OpenedFile(bth::open(file)?)))?,
        Start::EmbreeScene | Start::EmbreeSceneRobust => {
            embree::available()?;
            let (objects, object_of, places) = files::read_scene(file)?;
            let objects = objects.into_iter().map(|(p, t)| (embree::padded(&p), t)).collect();
            let robust = arguments.start == Start::EmbreeSceneRobust;
            let variant = if robust { &embree::ROBUST } else { &embree::DEFAULT };
            probe(&rays, first, threads, || {
                let mut scene = embree::build_instances(objects, &object_of, variant, threads)?;
                scene.place(&places);
                Ok(scene)
            })?
        }
        Start::Embree | Start::EmbreeRobust => {
            // Neither the library nor the triangles are part of a build.
            embree::available()?;
            let (positions, triangles) = files::read_mesh(file)?;
            let positions = embree::padded(&positions);
            let robust = arguments.start == Start::EmbreeRobust;
            let variant = if robust { &embree::ROBUST } else { &embree::DEFAULT };
            probe(&rays, first, threads, || embree::build(positions, triangles, variant, threads))?
        }
    };
    writeln!(std::io::stdout().lock(), "{}", serde_json::to_string(&probed)?)?;
    Ok(())
}

/// An opened file.
struct OpenedFile(bth::Scene);

impl Tracer for OpenedFile {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (batch, hits) in batch.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.0.batch(batch.rays).nearest(hits);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        self.0.batch(batch.rays).any(found);
    }
}

fn probe<T: Tracer>(
    all: &[Ray],
    first: usize,
    threads: usize,
    start: impl FnOnce() -> Result<T>,
) -> Result<StartTimes> {
    let rays = &all[..first];
    let mut hits = vec![Hit::MISS; rays.len()];
    let batch = |rays| Batch { rays, starts: None, coherent: true };
    let (before, cpu, clock) = (storage_bytes(), process_cpu(), Instant::now());
    let tracer = start()?;
    let ready_s = clock.elapsed().as_secs_f64();
    tracer.nearest(batch(&rays[..1]), &mut hits[..1]);
    let first_hit_s = clock.elapsed().as_secs_f64();
    let share = rays.len().div_ceil(threads);
    spread(batch(rays), &mut hits, threads, share, |batch, hits| tracer.nearest(batch, hits));
    let total_s = clock.elapsed().as_secs_f64();
    let cpu_s = process_cpu() - cpu;
    anyhow::ensure!(hits[0].is_hit(), "the first ray hits nothing");
    let storage_bytes = storage_bytes().zip(before).map(|(after, before)| after - before);
    let mut frame = vec![Hit::MISS; all.len()];
    let mut frame_s = || {
        let clock = Instant::now();
        let share = all.len().div_ceil(threads);
        spread(batch(all), &mut frame, threads, share, |batch, hits| tracer.nearest(batch, hits));
        clock.elapsed().as_secs_f64()
    };
    let frame_s = (first < all.len()).then(|| frame_s().min(frame_s()));
    Ok(StartTimes {
        ready_s,
        first_hit_s,
        total_s,
        cpu_s,
        storage_bytes,
        hits: hits.iter().filter(|h| h.is_hit()).count(),
        frame_s,
    })
}

/// Bytes that this process has fetched from storage so far (Linux).
fn storage_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    text.lines().find_map(|line| line.strip_prefix("read_bytes:"))?.trim().parse().ok()
}
