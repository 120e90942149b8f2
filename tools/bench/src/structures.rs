//! The structures of bth: each kind of compiled file, and the ways to trace it.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Starting, Tracer};
use anyhow::{Context, Result};
use bth::rays::{Hit, Ray, Ray64, Start, StartRay};
use bth::{Accept, Scene};
use bth_compile::free::{FreeOptions, KeepFree};
use bth_compile::pipeline::{self, CompileOptions, Structure};
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
    free: KeepFree,
}

const TETS: Kind = Kind { name: "tets", structure: Structure::Tets, free: KeepFree::None };

/// The structures. The default file comes first, then the plain BVH, which also finds the hits that
/// secondary rays start from.
pub const KINDS: [Kind; 5] = [
    Kind { name: "bth", structure: Structure::Bth, ..TETS },
    Kind { name: "bvh", structure: Structure::Bvh, ..TETS },
    TETS,
    Kind { name: "bvh free", structure: Structure::Bvh, free: KeepFree::All },
    Kind { name: "bvh distances", structure: Structure::Bvh, free: KeepFree::Distances },
];

/// The ways to trace a structure, and the suffixes of their names.
const USES: [(&str, Use); 7] = [
    ("", Use::Batch),
    (" start", Use::Start),
    (" single", Use::Single),
    (" start single", Use::StartSingle),
    (" single own", Use::Own),
    (" f64", Use::Wide),
    (" f64 single", Use::WideSingle),
];

/// The default file.
pub const BTH: Kind = KINDS[0];
/// The plain BVH.
pub const BVH: Kind = KINDS[1];

impl Kind {
    /// Returns true if it is a tetrahedralization of the whole model, which not every model has.
    pub fn is_tets(&self) -> bool {
        self.structure == Structure::Tets
    }

    /// Returns true if it has free directions or distances, which only rays from starts use.
    pub fn is_free(&self) -> bool {
        self.free != KeepFree::None
    }

    /// Names of the ways to trace it.
    pub fn uses(&self) -> impl Iterator<Item = (String, Use)> {
        // The last four are measured in the default file alone.
        let count = if self.name == KINDS[0].name { USES.len() } else { 3 };
        USES[..count].iter().map(|(of, usage)| (format!("{}{of}", self.name), *usage))
    }

    /// Compiler options.
    pub(crate) fn options(&self) -> CompileOptions {
        CompileOptions {
            structure: self.structure,
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
    /// In batches of rays in f64.
    Wide,
    /// One ray in f64 a call.
    WideSingle,
}

/// A compiled file.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Wall-clock seconds that the compiler took, all cores.
    pub seconds: f64,
}

/// Compiles a model.
///
/// # Errors
/// As the compiler: a whole tetrahedralization needs the worker and a model without bad contacts.
pub fn compile(model: &Model, kind: &Kind) -> Result<Compiled> {
    let start = Instant::now();
    let (compiled, _) = pipeline::compile(&model.path, &kind.options(), &bth_compile::Silent)
        .map_err(|e| anyhow::anyhow!("{}", reason(&e)))?;
    Ok(Compiled { bytes: compiled.bytes, seconds: start.elapsed().as_secs_f64() })
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
    let scene = bth::from_bytes(&compiled.bytes).context("a file that was just compiled")?;
    let (bytes, scene) = (Some(scene.resident_bytes()), Arc::new(SceneTracer(scene)));
    let contender = |(name, usage)| {
        let tracer = Box::new(OurTracer { scene: scene.clone(), usage });
        Contender { name, ours: true, tracer, build_s: compiled.seconds, bytes }
    };
    Ok(kind.uses().map(contender).collect())
}

/// Opens a compiled file for one way to trace it.
///
/// # Errors
/// If the runtime refuses the file, which would be a fault of ours.
pub fn tracer(bytes: &[u8], usage: Use) -> Result<Box<dyn Tracer>> {
    let scene = bth::from_bytes(bytes).context("a file that was just compiled")?;
    Ok(Box::new(OurTracer { scene: Arc::new(SceneTracer(scene)), usage }))
}

/// An opened scene, traced in batches from origins.
pub struct SceneTracer(pub Scene);

impl Tracer for SceneTracer {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (rays, hits) in batch.rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.0.batch(rays).nearest(hits);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        for (rays, found) in batch.rays.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
            self.0.batch(rays).any(found);
        }
    }
}

/// A scene and how it is traced.
struct OurTracer {
    scene: Arc<SceneTracer>,
    usage: Use,
}

impl Tracer for OurTracer {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let (scene, rays) = (&self.scene.0, batch.rays.iter());
        let found = |hit: Option<Hit>| hit.unwrap_or(Hit::MISS);
        match (self.usage, batch.starts) {
            (Use::Own, Some(starts)) => rays.zip(starts).zip(hits).for_each(|((ray, own), hit)| {
                *hit = with_others(own, |accept| found(scene.nearest_accepted(ray, accept)));
            }),
            (Use::StartSingle, Some(starts)) => {
                rays.zip(starts)
                    .zip(hits)
                    .for_each(|((r, start), hit)| *hit = found(scene.nearest(&start_ray(r, start))));
            }
            (Use::Start, Some(_)) => {
                in_start_batches(batch, hits, |rays, hits| scene.batch(rays).nearest(hits))
            }
            (Use::Single, _) => rays.zip(hits).for_each(|(ray, hit)| *hit = found(scene.nearest(ray))),
            (Use::WideSingle, _) => {
                rays.zip(hits).for_each(|(ray, hit)| *hit = found(scene.nearest(&Ray64::from(*ray))));
            }
            (Use::Wide, _) => in_wide_batches(batch, hits, |rays, hits| scene.batch(rays).nearest(hits)),
            _ => self.scene.nearest(batch, hits),
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        let (scene, rays) = (&self.scene.0, batch.rays.iter());
        match (self.usage, batch.starts) {
            (Use::Own, Some(starts)) => rays.zip(starts).zip(found).for_each(|((ray, own), found)| {
                *found = with_others(own, |accept| scene.any_accepted(ray, accept));
            }),
            (Use::StartSingle, Some(starts)) => {
                rays.zip(starts)
                    .zip(found)
                    .for_each(|((r, start), found)| *found = scene.any(&start_ray(r, start)));
            }
            (Use::Start, Some(_)) => {
                in_start_batches(batch, found, |rays, found| scene.batch(rays).any(found))
            }
            (Use::Single, _) => rays.zip(found).for_each(|(ray, found)| *found = scene.any(ray)),
            (Use::WideSingle, _) => {
                rays.zip(found).for_each(|(ray, found)| *found = scene.any(&Ray64::from(*ray)));
            }
            (Use::Wide, _) => in_wide_batches(batch, found, |rays, found| scene.batch(rays).any(found)),
            _ => self.scene.any(batch, found),
        }
    }

    fn starting(&self) -> Starting {
        match self.usage {
            Use::Batch | Use::Single => Starting::AtOrigin,
            Use::Wide | Use::WideSingle => Starting::InF64,
            Use::Own => Starting::RejectOwn,
            Use::Start | Use::StartSingle => Starting::OnSurface,
        }
    }
}

/// Traces with a filter that rejects the triangle on which the ray starts.
fn with_others<A>(own: &Start, trace: impl FnOnce(&Accept<'_>) -> A) -> A {
    let is_other = |_: &Ray, hit: &Hit| hit.primitive != own.primitive;
    trace(&Accept { filter: Some(&is_other), ..Accept::default() })
}

/// The ray from the exact point.
fn start_ray(ray: &Ray, start: &Start) -> StartRay {
    start.ray(ray.direction).with_tmax(ray.tmax)
}

/// Calls `trace` with the rays of each batch and its answers. The time to make the rays counts, as
/// for rivals.
fn in_start_batches<T>(batch: Batch<'_>, answers: &mut [T], trace: impl Fn(&[StartRay], &mut [T])) {
    let mut rays = Vec::with_capacity(BATCH);
    for (batch, answers) in batch.chunks(BATCH).zip(answers.chunks_mut(BATCH)) {
        rays.clear();
        let starts = batch.starts.unwrap_or_default();
        rays.extend(batch.rays.iter().zip(starts).map(|(ray, start)| start_ray(ray, start)));
        trace(&rays, answers);
    }
}

/// The same for rays in f64.
fn in_wide_batches<T>(batch: Batch<'_>, answers: &mut [T], trace: impl Fn(&[Ray64], &mut [T])) {
    let mut rays = Vec::with_capacity(BATCH);
    for (batch, answers) in batch.rays.chunks(BATCH).zip(answers.chunks_mut(BATCH)) {
        rays.clear();
        rays.extend(batch.iter().map(|ray| Ray64::from(*ray)));
        trace(&rays, answers);
    }
}
