//! `bthc trace`: traces the rays of a file, or with `--exact` tests them against every triangle.

use super::threads::with_threads;
use crate::args::Trace;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::table::count;
use crate::{output, overwrite, ray_files};
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::{Error, Monitor};
use bth_oracle::World;
use rayon::prelude::*;
use serde_json::json;
use std::time::{Duration, Instant};

/// Rays per task: enough to make the cost of starting a task negligible.
const CHUNK: usize = 4096;

pub(crate) fn run(args: &Trace) -> Result<(), Failure> {
    overwrite::check(&args.output, [&args.file, &args.rays])?;
    let rays = ray_files::read_rays(&args.rays)?;
    let scene = bth::open(&args.file)?;

    let (hits, seconds) = with_threads(args.threads, || {
        let start = Instant::now();
        let hits = if args.exact {
            exact(&scene, &rays, args)?
        } else if args.any {
            let mut found = vec![false; rays.len()];
            let tasks = rays.par_chunks(CHUNK).zip(found.par_chunks_mut(CHUNK));
            tasks.for_each(|(rays, found)| scene.batch(rays).any(found));
            found.into_iter().map(ray_files::answer).collect()
        } else {
            let mut hits = vec![Hit::MISS; rays.len()];
            let tasks = rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK));
            tasks.for_each(|(rays, hits)| scene.batch(rays).nearest(hits));
            hits
        };
        Ok::<_, Failure>((hits, start.elapsed().as_secs_f64()))
    })??;

    bth_compile::write::write_atomically(&args.output, &ray_files::hits(&hits))?;
    let found = hits.iter().filter(|h| h.is_hit()).count();
    if args.json {
        let report = json!({"rays": rays.len(), "hits": found, "seconds": seconds, "any": args.any, "exact": args.exact});
        output::json(&report)?;
    } else {
        let rate = rays.len() as f64 / seconds.max(Duration::from_nanos(1).as_secs_f64()) / 1e6;
        output::text(&format!(
            "{} rays, {} hits, {seconds:.3} s, {rate:.2} million rays/s\n",
            count(rays.len() as u64),
            count(found as u64)
        ))?;
    }
    Ok(())
}

/// Every ray against every triangle.
fn exact(scene: &Scene, rays: &[Ray], args: &Trace) -> Result<Vec<Hit>, Failure> {
    let progress = Progress::new(args.json);
    let world = World::new(scene);
    progress.stage("trace exactly", Some(rays.len() as u64));
    let one = |ray: &Ray| {
        if progress.cancelled() {
            return Err(Error::Cancelled.into());
        }
        let hit = if args.any { ray_files::answer(world.any(ray)) } else { world.hit(ray) };
        progress.advance(1);
        Ok(hit)
    };
    rays.par_iter().map(one).collect()
}
