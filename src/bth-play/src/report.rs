//! What the program says when the pictures are written.

use crate::args::Args;
use crate::failure::Failure;
use crate::sequence::Report;
use crate::window::Shown;
use bth::Scene;
use serde::Serialize;
use serde_json::json;
use std::io::Write;
use std::path::Path;

/// Prints a warning.
pub(crate) fn warn(text: &str) {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr().lock(), "warning: {text}");
}

/// Says something on standard error.
pub(crate) fn note(text: &str) {
    // As above.
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints text on standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()?;
    Ok(())
}

/// Prints what a window showed until it was closed, for people or as JSON.
pub(crate) fn window(args: &Args, shown: &Shown) -> Result<(), Failure> {
    if args.json {
        return print(&format!("{:#}\n", json!({ "window": shown })));
    }
    print(&format!(
        "{}x{}: {} pictures in {:.1} s; last frame {}, mode {}\n",
        shown.width, shown.height, shown.pictures, shown.seconds, shown.frame, shown.mode
    ))
}

/// Memory and what of the file was used.
#[derive(Clone, Copy, Debug, Serialize)]
struct Stats {
    file_bytes: u64,
    /// 0 when the file was read.
    mapped_bytes: u64,
    /// Bytes of the file in memory of this process; null where the system does not tell.
    resident_bytes: Option<u64>,
    objects: u32,
    objects_touched: usize,
    instances: u32,
    instance_bytes: usize,
    hierarchy_bytes: usize,
}

impl Stats {
    fn new(scene: &Scene, file: &Path, mapped: bool) -> Self {
        let file_bytes = scene.file().bytes().len() as u64;
        let (instance_bytes, hierarchy_bytes) = scene.heap_bytes();
        Stats {
            file_bytes,
            mapped_bytes: if mapped { file_bytes } else { 0 },
            resident_bytes: if mapped { resident(file) } else { Some(file_bytes) },
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

/// Prints what the frames took, for people or as JSON; on standard error when pictures went to standard output.
pub(crate) fn show(
    args: &Args,
    scene: &Scene,
    file: &Path,
    report: &Report,
    threads: usize,
    quiet: bool,
) -> Result<(), Failure> {
    let sum = |field: fn(&crate::sequence::FrameReport) -> f64| report.frames.iter().map(field).sum::<f64>();
    let seconds = sum(|f| f.summary.seconds);
    let rays = sum(|f| (f.summary.nearest_rays + f.summary.any_rays) as f64);
    let rate = rays / seconds.max(1e-9);
    let (width, height) = args.size;
    let stats = args.stats.then(|| Stats::new(scene, file, args.map));
    let text = if args.json {
        let json = json!({
            "width": width,
            "height": height,
            "mode": args.mode.name(),
            "samples_per_pixel": args.spp,
            "threads": threads,
            "resident_bytes": scene.resident_bytes(),
            "rays_per_second": rate,
            "frame": if report.frames.len() == 1 { json!(report.frames[0]) } else { json!(null) },
            "frames": report.frames,
            "frames_skipped": report.skipped,
            "stats": stats,
        });
        format!("{json:#}\n")
    } else {
        let mut text = format!(
            "{width}x{height}, {} samples a pixel: {seconds:.3} s, {:.1} million rays at {:.2} million rays/s on {threads} threads\n",
            args.spp,
            rays / 1e6,
            rate / 1e6,
        );
        if report.frames.len() != 1 || report.skipped > 0 {
            text = format!("{} frames ({} were there already), {text}", report.frames.len(), report.skipped);
        }
        if let [frame] = report.frames.as_slice()
            && let Some(steps) = &frame.summary.steps
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
    };
    if !quiet {
        return print(&text);
    }
    // Nothing can be done when standard error is closed.
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
    Ok(())
}

fn table(report: &Report, stats: &Stats) -> String {
    let mut text = String::from("frame    update  top level     trace   rays/s  placed\n");
    for f in &report.frames {
        let rays = (f.summary.nearest_rays + f.summary.any_rays) as f64 / f.summary.seconds.max(1e-9);
        text.push_str(&format!(
            "{:>5}  {:>5.2} ms  {:>6.2} ms  {:>5.1} ms  {:>5.2} M  {:>6}\n",
            f.frame,
            1e3 * f.update_seconds,
            1e3 * f.top_level_seconds,
            1e3 * f.summary.seconds,
            rays / 1e6,
            f.instances_placed,
        ));
    }
    let resident = stats.resident_bytes.map_or_else(|| "?".to_owned(), |b| b.to_string());
    text.push_str(&format!(
        "file {} bytes, mapped {}, resident {resident}; {} of {} objects touched; {} instances: {} bytes, hierarchy {} bytes\n",
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
