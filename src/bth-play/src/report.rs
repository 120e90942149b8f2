//! The report on standard output: time, rays and memory of the frames, or what a window showed.

use crate::args::Args;
use crate::failure::Failure;
use crate::messages::{note, print};
use crate::render::{FrameReport, Report};
#[cfg(feature = "window")]
use crate::window::WindowSummary;
use bth::Scene;
use serde::Serialize;
use serde_json::json;
use std::path::Path;
use std::time::Duration;

/// Prints a summary of what a window showed, for people or as JSON.
#[cfg(feature = "window")]
pub(crate) fn window(args: &Args, shown: &WindowSummary) -> Result<(), Failure> {
    if args.json {
        return print(&format!("{:#}\n", json!({ "window": shown })));
    }
    print(&format!(
        "{}x{}: {} pictures in {:.1} s; last frame {}, mode {}\n",
        shown.width, shown.height, shown.pictures, shown.seconds, shown.frame, shown.mode
    ))
}

/// Memory, and how much of the file was used.
#[derive(Clone, Copy, Debug, Serialize)]
struct Stats {
    file_bytes: u64,
    /// 0 when the file was read instead of mapped.
    mapped_bytes: u64,
    /// Bytes of the file in memory of this process; null where the system does not tell.
    resident_bytes: Option<u64>,
    /// True if the file did not fit in memory when it was mapped.
    paged: bool,
    /// Pages for which the program waited, and bytes that it read from storage; null where the
    /// system does not tell.
    page_faults: Option<u64>,
    read_bytes: Option<u64>,
    objects: u32,
    objects_touched: usize,
    instances: u32,
    instance_bytes: usize,
    hierarchy_bytes: usize,
}

impl Stats {
    /// `mapped` is the path of the file, if it is mapped.
    fn new(scene: &Scene, mapped: Option<&Path>) -> Self {
        let file_bytes = scene.file().bytes().len() as u64;
        let (instance_bytes, hierarchy_bytes) = scene.heap_bytes();
        Stats {
            file_bytes,
            mapped_bytes: if mapped.is_some() { file_bytes } else { 0 },
            resident_bytes: mapped.map_or(Some(file_bytes), resident),
            paged: scene.file().is_paged(),
            page_faults: page_faults(),
            read_bytes: read_bytes(),
            objects: scene.object_count(),
            objects_touched: scene.touched_objects(),
            instances: scene.instance_count(),
            instance_bytes,
            hierarchy_bytes,
        }
    }
}

/// Bytes of a mapped file that are in memory, on Linux.
fn resident(file: &Path) -> Option<u64> {
    let path = std::fs::canonicalize(file).ok()?;
    let maps = std::fs::read_to_string("/proc/self/smaps").ok()?;
    let mut lines = maps.lines().skip_while(|line| !line.ends_with(path.to_str().unwrap_or("\0")));
    let line = lines.find(|line| line.starts_with("Rss:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
}

/// Major page faults of this process, on Linux.
fn page_faults() -> Option<u64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, which may have spaces, ends with the last parenthesis.
    stat.rsplit_once(')')?.1.split_whitespace().nth(9)?.parse().ok()
}

/// Bytes that this process has made the system read from storage, on Linux.
fn read_bytes() -> Option<u64> {
    let io = std::fs::read_to_string("/proc/self/io").ok()?;
    io.lines().find_map(|line| line.strip_prefix("read_bytes:"))?.trim().parse().ok()
}

/// Prints time and rays of the frames, for people or as JSON; on standard error when the pictures
/// went to standard output. `mapped` is the path of the file, if it is mapped.
pub(crate) fn show(
    args: &Args,
    scene: &Scene,
    mapped: Option<&Path>,
    report: &Report,
    threads: usize,
    quiet: bool,
) -> Result<(), Failure> {
    let stats = args.stats.then(|| Stats::new(scene, mapped));
    let text = match args.json {
        true => format!("{:#}\n", json(args, scene, report, threads, stats)),
        false => text(args, report, threads, stats),
    };
    if quiet {
        note(text.trim_end());
        return Ok(());
    }
    print(&text)
}

/// Seconds and rays of all frames.
fn totals(report: &Report) -> (f64, f64) {
    let sum =
        |field: fn(&FrameReport) -> f64| report.frames.iter().map(field).fold(0.0, |sum, value| sum + value);
    (sum(|f| f.seconds), sum(|f| (f.nearest_rays + f.any_rays) as f64))
}

fn rate(rays: f64, seconds: f64) -> f64 {
    rays / seconds.max(Duration::from_nanos(1).as_secs_f64())
}

fn json(
    args: &Args,
    scene: &Scene,
    report: &Report,
    threads: usize,
    stats: Option<Stats>,
) -> serde_json::Value {
    let (seconds, rays) = totals(report);
    json!({
        "width": args.size.0,
        "height": args.size.1,
        "mode": args.mode.name(),
        "samples_per_pixel": args.spp,
        "exposure": report.exposure,
        "shutter": args.shutter,
        "threads": threads,
        "resident_bytes": scene.resident_bytes(),
        "rays_per_second": rate(rays, seconds),
        "frame": if report.frames.len() == 1 { json!(report.frames[0]) } else { json!(null) },
        "frames": report.frames,
        "frames_skipped": report.skipped,
        "stats": stats,
    })
}

fn text(args: &Args, report: &Report, threads: usize, stats: Option<Stats>) -> String {
    let (width, height) = args.size;
    let (seconds, rays) = totals(report);
    let mut text = format!(
        "{width}x{height}, {} samples a pixel: {seconds:.3} s, {:.1} million rays at {:.2} million rays/s on {threads} threads\n",
        args.spp,
        rays / 1e6,
        rate(rays, seconds) / 1e6,
    );
    if report.frames.len() != 1 || report.skipped > 0 {
        text = format!("{} frames ({} were there already), {text}", report.frames.len(), report.skipped);
    }
    if let [frame] = report.frames.as_slice()
        && let Some(steps) = &frame.steps
    {
        text.push_str(&format!(
            "per camera ray: {:.1} nodes, {:.1} leaves, {:.1} triangles, {:.1} tetrahedra\n",
            steps.nodes, steps.leaves, steps.triangles, steps.tets
        ));
    }
    if let Some(stats) = stats {
        text.push_str(&table(report, &stats));
    }
    text
}

/// A row of times for each frame, then memory.
fn table(report: &Report, stats: &Stats) -> String {
    let mut text = String::from("frame    update  top level     trace   rays/s  placed\n");
    for f in &report.frames {
        let rays = (f.nearest_rays + f.any_rays) as f64;
        text.push_str(&format!(
            "{:>5}  {:>5.2} ms  {:>6.2} ms  {:>5.1} ms  {:>5.2} M  {:>6}\n",
            f.frame,
            1e3 * f.update_seconds,
            1e3 * f.top_level_seconds,
            1e3 * f.seconds,
            rate(rays, f.seconds) / 1e6,
            f.instances_placed,
        ));
    }
    let known = |number: Option<u64>| number.map_or_else(|| "?".to_owned(), |number| number.to_string());
    let [resident, faults, read] = [stats.resident_bytes, stats.page_faults, stats.read_bytes].map(known);
    let paged = if stats.paged { ", larger than the memory" } else { "" };
    text.push_str(&format!(
        "file {} bytes{paged}, mapped {}, resident {resident}; read {read} bytes, waited for {faults} pages\n\
         {} of {} objects touched; {} instances: {} bytes, hierarchy {} bytes\n",
        stats.file_bytes,
        stats.mapped_bytes,
        stats.objects_touched,
        stats.objects,
        stats.instances,
        stats.instance_bytes,
        stats.hierarchy_bytes,
    ));
    text
}
