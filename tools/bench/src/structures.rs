//! The structures of bth: each kind of compiled file, and the ways to trace it.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Starting, Tracer};
use anyhow::{Context, Result};
use bth::rays::{Hit, Ray, Start, StartRay};
use bth::{Accept, Scene};
use bth_compile::coordinates;
use bth_compile::free::{FreeOptions, KeepFree};
use bth_compile::pipeline::{self, CompileOptions, Structure};
use bth_format::layout::{GridBits, RecordKind};
use std::sync::Arc;
use std::time::Instant;

/// Rays in one call of a batch.
pub const BATCH: usize = 1024;

/// A structure that can be compiled.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its name in tables.
    pub name: &'static str,
    structure: Structure,
    record: RecordKind,
    bits: Option<GridBits>,
    free: KeepFree,
}

const LINK32: Kind = Kind {
    name: "",
    structure: Structure::Tets,
    record: RecordKind::Link32,
    bits: None,
    free: KeepFree::None,
};

/// The structures. The default file comes first, then the plain BVH, which also finds the hits that secondary rays start
/// from.
pub const KINDS: [Kind; 8] = [
    Kind { name: "bth", structure: Structure::Bth, ..LINK32 },
    Kind { name: "bvh", structure: Structure::Bvh, ..LINK32 },
    Kind { name: "tets link32", ..LINK32 },
    Kind { name: "tets tet32", record: RecordKind::Tet32, ..LINK32 },
    Kind { name: "tets tet20", record: RecordKind::Tet20, ..LINK32 },
    Kind { name: "tets tet16", record: RecordKind::Tet16, ..LINK32 },
    Kind { name: "bvh free", structure: Structure::Bvh, free: KeepFree::All, ..LINK32 },
    Kind { name: "bvh distances", structure: Structure::Bvh, free: KeepFree::Distances, ..LINK32 },
];

/// The ways to trace a structure, and what they add to its name.
const USES: [(&str, Use); 5] = [
    ("", Use::Batch),
    (" start", Use::Start),
    (" single", Use::Single),
    (" start single", Use::StartSingle),
    (" single own", Use::Own),
];

/// The default file.
pub const BTH: Kind = KINDS[0];
/// The plain BVH.
pub const BVH: Kind = KINDS[1];

/// The plain BVH with coordinates of fewer bits: other triangles, so other answers.
pub const ON_GRID: [Kind; 2] = [
    Kind { name: "bvh 21 bits", bits: Some(GridBits::B21), ..BVH },
    Kind { name: "bvh 16 bits", bits: Some(GridBits::B16), ..BVH },
];

impl Kind {
    /// Whether its triangles are not those of the source.
    pub fn is_on_grid(&self) -> bool {
        self.bits.is_some()
    }

    /// Whether it is a tetrahedralization of the whole model, which not every model has.
    pub fn is_tets(&self) -> bool {
        self.structure == Structure::Tets
    }

    /// Names of the ways to trace it.
    pub fn uses(&self) -> impl Iterator<Item = (String, Use)> {
        // The last two differ from others in the default file alone.
        let count = if self.name == KINDS[0].name { USES.len() } else { 3 };
        USES[..count].iter().map(|(of, usage)| (format!("{}{of}", self.name), *usage))
    }

    /// Compiler options. Whole-model tetrahedra come without a BVH below them, which would be traced instead of them; all else is
    /// the default.
    fn options(&self) -> CompileOptions {
        CompileOptions {
            structure: self.structure,
            record: self.record,
            coordinates: coordinates::CoordinateOptions { bits: self.bits, max_error: None },
            keep_subtrees: !self.is_tets(),
            free: FreeOptions { keep: self.free, ..FreeOptions::default() },
            ..CompileOptions::default()
        }
    }
}

/// How a file is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// In batches.
    Batch,
    /// In batches, from exact points of the surface.
    Start,
    /// One ray a call.
    Single,
    /// One ray a call, from exact points of the surface.
    StartSingle,
    /// One ray a call, with a filter that rejects the triangle on which the ray starts.
    Own,
}

/// A compiled file.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Wall-clock seconds that the compiler took, all cores.
    pub seconds: f64,
    /// Share of the model's triangles that are in tetrahedralizations.
    pub in_tets: f64,
}

/// Compiles a model.
///
/// # Errors
/// As the compiler: a whole tetrahedralization needs the worker and a model without bad contacts.
pub fn compile(model: &Model, kind: &Kind) -> Result<Compiled> {
    let start = Instant::now();
    let (compiled, report) = pipeline::compile(&model.path, &kind.options(), &bth_compile::Silent)
        .map_err(|e| anyhow::anyhow!("{}", reason(&e)))?;
    let seconds = start.elapsed().as_secs_f64();
    let in_tets = report.file.tet_triangles as f64 / model.triangles() as f64;
    Ok(Compiled { bytes: compiled.bytes, seconds, in_tets })
}

/// The message of an error without its path, as reports hold no paths.
fn reason(error: &bth_compile::Error) -> String {
    match error {
        bth_compile::Error::Input { message, hint, .. } => format!("{message} (hint: {hint})"),
        other => other.to_string(),
    }
}

/// Opens a compiled file and makes a contender of each way to trace it.
///
/// # Errors
/// If the runtime refuses the file, which would be a fault of ours.
pub fn contenders(kind: &Kind, compiled: &Compiled) -> Result<Vec<Contender>> {
    let scene = Arc::new(bth::from_bytes(&compiled.bytes).context("a file that was just compiled")?);
    let contender = |(name, usage)| Contender {
        name,
        ours: true,
        build_s: compiled.seconds,
        bytes: Some(scene.resident_bytes()),
        tracer: Box::new(OurTracer { scene: scene.clone(), usage }),
    };
    Ok(kind.uses().map(contender).collect())
}

/// A tracer of a compiled file.
///
/// # Errors
/// If the runtime refuses the file, which would be a fault of ours.
pub fn tracer(bytes: &[u8], usage: Use) -> Result<Box<dyn Tracer>> {
    let scene = Arc::new(bth::from_bytes(bytes).context("a file that was just compiled")?);
    Ok(Box::new(OurTracer { scene, usage }))
}

/// A scene and how it is traced.
struct OurTracer {
    scene: Arc<Scene>,
    usage: Use,
}

impl Tracer for OurTracer {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let (scene, rays) = (&self.scene, batch.rays.iter());
        match (self.usage, batch.starts) {
            (Use::Own, Some(starts)) => {
                for ((ray, own), hit) in rays.zip(starts).zip(hits) {
                    let is_other = |_: &Ray, hit: &Hit| hit.primitive != own.primitive;
                    let accept = Accept { filter: Some(&is_other), ..Accept::default() };
                    *hit = scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS);
                }
            }
            (Use::StartSingle, Some(starts)) => {
                for ((ray, start), hit) in rays.zip(starts).zip(hits) {
                    *hit = scene.nearest(&start_ray(ray, start)).unwrap_or(Hit::MISS);
                }
            }
            (Use::Start, Some(_)) => {
                in_start_batches(batch, hits, |rays, hits| scene.batch(rays).nearest(hits));
            }
            (Use::Single, _) => {
                rays.zip(hits).for_each(|(ray, hit)| *hit = scene.nearest(ray).unwrap_or(Hit::MISS));
            }
            _ => {
                for (rays, hits) in batch.rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
                    scene.batch(rays).nearest(hits);
                }
            }
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        let (scene, rays) = (&self.scene, batch.rays.iter());
        match (self.usage, batch.starts) {
            (Use::Own, Some(starts)) => {
                for ((ray, own), found) in rays.zip(starts).zip(found) {
                    let is_other = |_: &Ray, hit: &Hit| hit.primitive != own.primitive;
                    let accept = Accept { filter: Some(&is_other), ..Accept::default() };
                    *found = scene.any_accepted(ray, &accept);
                }
            }
            (Use::StartSingle, Some(starts)) => {
                for ((ray, start), found) in rays.zip(starts).zip(found) {
                    *found = scene.any(&start_ray(ray, start));
                }
            }
            (Use::Start, Some(_)) => {
                in_start_batches(batch, found, |rays, found| scene.batch(rays).any(found));
            }
            (Use::Single, _) => rays.zip(found).for_each(|(ray, found)| *found = scene.any(ray)),
            _ => {
                for (rays, found) in batch.rays.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
                    scene.batch(rays).any(found);
                }
            }
        }
    }

    fn starting(&self) -> Starting {
        match self.usage {
            Use::Batch | Use::Single => Starting::AtOrigin,
            Use::Own => Starting::RejectOwn,
            Use::Start | Use::StartSingle => Starting::OnSurface,
        }
    }
}

/// The ray from the exact point.
fn start_ray(ray: &Ray, start: &Start) -> StartRay {
    start.ray(ray.direction).with_tmax(ray.tmax)
}

/// Calls `trace` with the rays of each batch and its answers. The time to make them counts, as for rivals.
fn in_start_batches<T>(batch: Batch<'_>, answers: &mut [T], trace: impl Fn(&[StartRay], &mut [T])) {
    let mut rays = Vec::with_capacity(BATCH);
    for (batch, answers) in batch.chunks(BATCH).zip(answers.chunks_mut(BATCH)) {
        rays.clear();
        let starts = batch.starts.unwrap_or_default();
        rays.extend(batch.rays.iter().zip(starts).map(|(ray, start)| start_ray(ray, start)));
        trace(&rays, answers);
    }
}
