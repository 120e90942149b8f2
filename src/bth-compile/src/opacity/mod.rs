//! Where cut-out triangles let rays pass: cut-outs → a state for each triangle, or for each micro-triangle of it.
//!
//! A part is opaque (transparent) only if alpha is at least (below) the cutoff at all of its points; the part includes its
//! boundary. What is both, or not decided by the texels around it, is unknown. So the states are right for every sampling
//! that interpolates the same texels; they cannot be right for mipmaps, which whether a ray hits must not depend on.
//! The states follow opacity micromaps (VK_EXT_opacity_micromap; Gruen, Benthin and Woop, "Sub-triangle opacity masks for
//! faster ray tracing of transparent objects", 2020).

mod footprint;
mod subdivide;
#[cfg(test)]
mod tests;
mod texture;

use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::vectors::{corners, double_area};
use bth_format::layout::{MAX_OPACITY_LEVEL, Opacity, TriangleOpacity, opacity_words};
use bth_import::{CutoutTriangle, Cutouts, Mesh, OpacityReport, TriangleOpacities};
use footprint::{Footprint, Surface};
use rayon::prelude::*;
use std::collections::HashMap;
use subdivide::{Pattern, Plan};
use texture::Pyramid;

/// Words of the micro-triangles of a mesh, before equal patterns are merged: 256 MiB. Beyond it levels are lowered.
const MAX_WORDS: usize = 1 << 26;

/// Triangles whose patterns are made at a time; at most 64 KiB each.
const BATCH: usize = 512;

/// Adds the opacity of its triangles to a mesh and its report.
///
/// # Errors
/// As [`compile`].
pub(crate) fn add(
    mesh: &mut Mesh,
    report: &mut bth_import::Report,
    cutouts: &Cutouts,
    monitor: &dyn Monitor,
) -> Result<()> {
    if let Some((opacities, opacity)) = compile(mesh, cutouts, monitor)? {
        mesh.opacity = Some(opacities);
        report.opacity = Some(opacity);
    }
    Ok(())
}

/// The opacity of a mesh's triangles; `None` where all are opaque.
///
/// # Errors
/// `BTH-X090` when the cut-outs are not of this mesh, cancellation.
pub fn compile(
    mesh: &Mesh,
    cutouts: &Cutouts,
    monitor: &dyn Monitor,
) -> Result<Option<(TriangleOpacities, OpacityReport)>> {
    if cutouts.triangles.is_empty() {
        return Ok(None);
    }
    if cutouts.mesh_triangles != mesh.triangles.len() {
        let message =
            format!("cut-outs of {} triangles, a mesh of {}", cutouts.mesh_triangles, mesh.triangles.len());
        return Err(Error::Internal { code: "BTH-X090", message });
    }
    monitor.stage("opacity", Some(cutouts.triangles.len() as u64));
    let pyramids: Vec<Pyramid> = cutouts.images.par_iter().map(Pyramid::new).collect();
    let surface = |material| Surface { material, pyramid: material.image.map(|row: usize| &pyramids[row]) };
    let surfaces: Vec<Surface<'_>> = cutouts.materials.iter().map(surface).collect();
    let footprint = |t: &CutoutTriangle| Footprint::new(&surfaces[t.material as usize], &t.corners);
    let plans: Vec<Plan> =
        cutouts.triangles.par_iter().map(|triangle| subdivide::plan(&footprint(triangle))).collect();
    monitor.check()?;
    let most = most_levels(&plans);
    let mut writer = OpacityWriter::new(mesh);
    for (triangles, plans) in cutouts.triangles.chunks(BATCH).zip(plans.chunks(BATCH)) {
        let patterns: Vec<Option<Pattern>> = triangles
            .par_iter()
            .zip(plans)
            .map(|(triangle, plan)| match plan {
                Plan::Whole(_) => None,
                Plan::Micro(level) => Some(subdivide::pattern(&footprint(triangle), (*level).min(most))),
            })
            .collect();
        for ((triangle, plan), pattern) in triangles.iter().zip(plans).zip(patterns) {
            match (plan, pattern) {
                (Plan::Whole(state), _) => writer.whole(triangle.triangle, *state),
                (Plan::Micro(_), Some(pattern)) => writer.micro(triangle.triangle, pattern),
                (Plan::Micro(_), None) => {}
            }
        }
        monitor.advance(triangles.len() as u64);
        monitor.check()?;
    }
    Ok(writer.finish())
}

/// The greatest level for which all patterns have room.
fn most_levels(plans: &[Plan]) -> u32 {
    let words = |most: u32| {
        let of = |plan: &Plan| match plan {
            Plan::Whole(_) => 0,
            Plan::Micro(level) => opacity_words((*level).min(most)),
        };
        plans.iter().map(of).sum::<usize>()
    };
    (1..=MAX_OPACITY_LEVEL).rev().find(|most| words(*most) <= MAX_WORDS).unwrap_or(0)
}

/// Collects rows and words in the order of the triangles.
struct OpacityWriter<'a> {
    mesh: &'a Mesh,
    opacities: TriangleOpacities,
    report: OpacityReport,
    /// Area of each state, by its number.
    area: [f64; 3],
    /// First words of the patterns so far.
    first: HashMap<Pattern, u32>,
}

impl<'a> OpacityWriter<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let rows = vec![TriangleOpacity::Whole(Opacity::Opaque).code(); mesh.triangles.len()];
        Self {
            mesh,
            opacities: TriangleOpacities { rows, micro: Vec::new() },
            report: OpacityReport::default(),
            area: [0.0; 3],
            first: HashMap::new(),
        }
    }

    fn whole(&mut self, triangle: u32, state: Opacity) {
        self.count(triangle, [0, 1, 2].map(|k| f64::from(u8::from(k == state as u32))));
        self.opacities.rows[triangle as usize] = TriangleOpacity::Whole(state).code();
    }

    fn micro(&mut self, triangle: u32, pattern: Pattern) {
        let Pattern { level, count, .. } = pattern;
        let micros = count.iter().sum::<u32>();
        self.count(triangle, count.map(|k| f64::from(k) / f64::from(micros)));
        let row = match level {
            0 => TriangleOpacity::Whole(Opacity::from_code(pattern.words[0]).unwrap_or(Opacity::Unknown)),
            _ => {
                self.report.subdivided += 1;
                let next = self.opacities.micro.len() as u32;
                if let Some(&word) = self.first.get(&pattern) {
                    TriangleOpacity::Micro { level, word }
                } else {
                    self.opacities.micro.extend_from_slice(&pattern.words);
                    self.first.insert(pattern, next);
                    TriangleOpacity::Micro { level, word: next }
                }
            }
        };
        self.opacities.rows[triangle as usize] = row.code();
    }

    fn count(&mut self, triangle: u32, shares: [f64; 3]) {
        let area = 0.5 * double_area(corners(self.mesh, triangle)).length();
        self.report.triangles += 1;
        (0..3).for_each(|k| self.area[k] += area * shares[k]);
    }

    fn finish(self) -> Option<(TriangleOpacities, OpacityReport)> {
        let opaque = TriangleOpacity::Whole(Opacity::Opaque).code();
        if self.opacities.rows.iter().all(|row| *row == opaque) {
            return None;
        }
        let all: f64 = self.area.iter().sum();
        let share = |k: usize| if all > 0.0 { self.area[k] / all } else { 0.0 };
        let report = OpacityReport {
            opaque: share(0),
            transparent: share(1),
            unknown: share(2),
            patterns: self.first.len() as u64,
            bytes: (size_of_val(&self.opacities.rows[..]) + size_of_val(&self.opacities.micro[..])) as u64,
            ..self.report
        };
        Some((self.opacities, report))
    }
}
