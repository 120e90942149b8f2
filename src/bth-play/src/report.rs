//! What the program says when the picture is written.

use crate::args::Args;
use crate::failure::Failure;
use crate::frame::Summary;
use bth::Scene;
use serde_json::json;
use std::io::Write;

/// Prints text on standard output.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()?;
    Ok(())
}

/// Prints the summary of a frame, for people or as JSON.
pub(crate) fn show(args: &Args, scene: &Scene, summary: &Summary, threads: usize) -> Result<(), Failure> {
    let rays = summary.nearest_rays + summary.any_rays;
    let rate = rays as f64 / summary.seconds.max(1e-9);
    let (width, height) = args.size;
    if args.json {
        let report = json!({
            "width": width,
            "height": height,
            "mode": args.mode.name(),
            "samples_per_pixel": args.spp,
            "threads": threads,
            "resident_bytes": scene.resident_bytes(),
            "rays_per_second": rate,
            "frame": summary,
        });
        return print(&format!("{report:#}\n"));
    }
    let mut text = format!(
        "{width}x{height}, {} samples a pixel: {:.3} s, {:.1} million rays at {:.2} million rays/s on {threads} threads\n",
        args.spp,
        summary.seconds,
        rays as f64 / 1e6,
        rate / 1e6,
    );
    if let Some(steps) = &summary.steps {
        text.push_str(&format!(
            "per camera ray: {:.1} nodes, {:.1} leaves, {:.1} triangles, {:.1} tetrahedra\n",
            steps.nodes, steps.leaves, steps.triangles, steps.tets
        ));
    }
    print(&text)
}
