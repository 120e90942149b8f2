//! Where cut-out triangles let rays pass: cut-outs → a state for each triangle, or for each
//! micro-triangle of it.
//!
//! A part is opaque (transparent) only if alpha is at least (below) the cutoff at all of its
//! points; the part includes its boundary. What is both, or not decided by the texels around it, is
//! unknown. So the states are right for every sampling that interpolates the same texels; they
//! cannot be right for mipmaps, and hits of rays must not depend on mipmaps. The states follow
//! opacity micromaps (VK_EXT_opacity_micromap; Gruen, Benthin and Woop, "Sub-triangle opacity masks
//! for faster ray tracing of transparent objects", 2020).

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

/// Words of the micro-triangles of a mesh, before equal patterns are merged: 256 MiB. Beyond it
/// levels are lowered.
const MAX_WORDS: usize = 1 << 26;

/// Triangles whose patterns are made between two checks for cancellation.
const BATCH: usize = 512;

/// Adds the opacity of its triangles to a mesh and its report.
///
/// # Errors
/// The errors of [`compile`].
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
    let (distinct, kinds) = distinct(&cutouts.triangles);
    let plans: Vec<Plan> = distinct.par_iter().map(|t| subdivide::plan(&footprint(t))).collect();
    monitor.check()?;
    let most = most_levels(&plans);
    let mut patterns = Vec::with_capacity(distinct.len());
    for (triangles, plans) in distinct.chunks(BATCH).zip(plans.chunks(BATCH)) {
        let pattern = |(triangle, plan): (&CutoutTriangle, &Plan)| match plan {
            Plan::Whole(state) => Pattern::whole(*state),
            Plan::Micro(level) => subdivide::pattern(&footprint(triangle), (*level).min(most)),
        };
        patterns.par_extend(triangles.par_iter().zip(plans).map(pattern));
        monitor.check()?;
    }
    let mut writer = OpacityWriter::new(mesh);
    let rows: Vec<TriangleOpacity> = patterns.iter().map(|pattern| writer.row(pattern)).collect();
    for (triangle, kind) in cutouts.triangles.iter().zip(kinds) {
        writer.add(triangle.triangle, rows[kind], &patterns[kind]);
    }
    monitor.advance(cutouts.triangles.len() as u64);
    Ok(writer.finish())
}

/// The triangles that differ in more than their number, and for each triangle which of them it is
/// like.
fn distinct(triangles: &[CutoutTriangle]) -> (Vec<CutoutTriangle>, Vec<usize>) {
    let mut known = HashMap::new();
    let mut distinct = Vec::new();
    let mut like = |triangle: &CutoutTriangle| {
        let corners = triangle.corners.map(|c| [c.uv[0], c.uv[1], c.alpha].map(f32::to_bits));
        *known.entry((triangle.material, corners)).or_insert_with(|| {
            distinct.push(*triangle);
            distinct.len() - 1
        })
    };
    let kinds = triangles.iter().map(&mut like).collect();
    (distinct, kinds)
}

/// The largest level for which all patterns have room.
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

    /// The row for a pattern, whose words are added unless an equal one was there before.
    fn row(&mut self, pattern: &Pattern) -> TriangleOpacity {
        if pattern.level == 0 {
            return TriangleOpacity::Whole(Opacity::from_code(pattern.words[0]).unwrap_or(Opacity::Unknown));
        }
        let next = self.opacities.micro.len() as u32;
        let word = *self.first.entry(pattern.clone()).or_insert(next);
        if word == next {
            self.opacities.micro.extend_from_slice(&pattern.words);
        }
        TriangleOpacity::Micro { level: pattern.level, word }
    }

    /// Stores the row of a triangle, and counts its area.
    fn add(&mut self, triangle: u32, row: TriangleOpacity, pattern: &Pattern) {
        let micros = f64::from(pattern.count.iter().sum::<u32>());
        let area = 0.5 * double_area(corners(self.mesh, triangle)).length();
        (0..3).for_each(|k| self.area[k] += area * (f64::from(pattern.count[k]) / micros));
        self.report.triangles += 1;
        self.report.subdivided += u64::from(pattern.level > 0);
        self.opacities.rows[triangle as usize] = row.code();
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
