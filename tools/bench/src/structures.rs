//! The structures of bth: each kind of compiled file, and the ways to trace it.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::{Context, Result};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Accept, Scene};
use bth_compile::coordinates::{self, Boxes};
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
    boxes: Boxes,
    free: KeepFree,
}

const LINK32: Kind = Kind {
    name: "",
    structure: Structure::Tets,
    record: RecordKind::Link32,
    bits: None,
    boxes: Boxes::F32,
    free: KeepFree::None,
};

/// The structures. The default file comes first, then the plain BVH, which also finds the hits that secondary rays start
/// from.
pub const KINDS: [Kind; 9] = [
    Kind { name: "bth", structure: Structure::Bth, ..LINK32 },
    Kind { name: "bvh", structure: Structure::Bvh, ..LINK32 },
    Kind { name: "tets link32", ..LINK32 },
    Kind { name: "tets tet32", record: RecordKind::Tet32, ..LINK32 },
    Kind { name: "tets tet20", record: RecordKind::Tet20, ..LINK32 },
    Kind { name: "tets tet16", record: RecordKind::Tet16, ..LINK32 },
    Kind { name: "bvh 8-bit boxes", structure: Structure::Bvh, boxes: Boxes::Bytes, ..LINK32 },
    Kind { name: "bvh free", structure: Structure::Bvh, free: KeepFree::All, ..LINK32 },
    Kind { name: "bvh distances", structure: Structure::Bvh, free: KeepFree::Distances, ..LINK32 },
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

    /// Whether it can hold tetrahedra or free directions, to which hints matter.
    fn takes_hints(&self) -> bool {
        self.structure != Structure::Bvh || self.free != KeepFree::None
    }

    /// Names of the ways to trace it.
    pub fn uses(&self) -> impl Iterator<Item = (String, Use)> {
        let own = (self.name == KINDS[0].name).then(|| (format!("{} single own", self.name), Use::Own));
        let hinted = self.takes_hints().then(|| (format!("{} from", self.name), Use::Hinted));
        let plain = [(self.name.to_owned(), Use::Batch), (format!("{} single", self.name), Use::Single)];
        let [batch, single] = plain;
        [Some(batch), hinted, Some(single), own].into_iter().flatten()
    }

    /// Compiler options. Whole-model tetrahedra come without a BVH below them, which would be traced instead of them where
    /// there are no hints; all else is the default.
    fn options(&self) -> CompileOptions {
        CompileOptions {
            structure: self.structure,
            record: self.record,
            coordinates: coordinates::CoordinateOptions {
                bits: self.bits,
                max_error: None,
                boxes: self.boxes,
            },
            keep_subtrees: !self.is_tets(),
            free: FreeOptions { keep: self.free, ..FreeOptions::default() },
            ..CompileOptions::default()
        }
    }
}

/// How a file is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// In batches, without hints.
    Batch,
    /// In batches, with the surface that each ray starts on.
    Hinted,
    /// One ray a call, without hints.
    Single,
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
        if let (Use::Own, Some(from)) = (self.usage, batch.from) {
            for ((ray, own), hit) in batch.rays.iter().zip(from).zip(hits) {
                let is_other = |_: &Ray, hit: &Hit| hit.primitive != *own;
                let accept = Accept { filter: Some(&is_other), ..Accept::default() };
                *hit = self.scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS);
            }
            return;
        }
        if self.usage == Use::Single {
            for (ray, hit) in batch.rays.iter().zip(hits) {
                *hit = self.scene.nearest(ray).unwrap_or(Hit::MISS);
            }
            return;
        }
        for (batch, hits) in batch.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.scene.batch(batch.rays).from(self.hints(&batch)).nearest(hits);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        if let (Use::Own, Some(from)) = (self.usage, batch.from) {
            for ((ray, own), found) in batch.rays.iter().zip(from).zip(found) {
                let is_other = |_: &Ray, hit: &Hit| hit.primitive != *own;
                let accept = Accept { filter: Some(&is_other), ..Accept::default() };
                *found = self.scene.any_accepted(ray, &accept);
            }
            return;
        }
        if self.usage == Use::Single {
            for (ray, found) in batch.rays.iter().zip(found) {
                *found = self.scene.any(ray);
            }
            return;
        }
        for (batch, found) in batch.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
            self.scene.batch(batch.rays).from(self.hints(&batch)).any(found);
        }
    }

    fn needs_hints(&self) -> bool {
        matches!(self.usage, Use::Hinted | Use::Own)
    }

    fn skips_own(&self) -> bool {
        self.usage == Use::Own
    }
}

impl OurTracer {
    fn hints<'a>(&self, batch: &Batch<'a>) -> Option<&'a [PrimitiveRef]> {
        if self.usage == Use::Hinted { batch.from } else { None }
    }
}
