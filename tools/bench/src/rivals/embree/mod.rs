//! Embree 4.

mod api;
mod scene;

pub(crate) use self::scene::{EmbreeMesh, EmbreeScene, InstancePlace, build, build_instances};

use self::api::EmbreeApi;
use crate::model::Model;
use crate::tracer::Contender;
use anyhow::Result;
use std::ffi::c_int;
use std::time::Instant;

/// Name of Embree's single rays in tables: ratios are relative to these.
pub(crate) const NAME: &str = "embree";

/// How a scene is built and traced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variant {
    quality: c_int,
    flags: c_int,
    packets: bool,
    /// Passes a filter with every ray that rejects the triangle on which it starts, as renderers
    /// do.
    own: bool,
    /// The instruction set that the library may use; the best of the machine if absent.
    isa: Option<&'static str>,
}

const QUALITY_MEDIUM: c_int = 1;
const QUALITY_HIGH: c_int = 2;
const FLAG_COMPACT: c_int = 2;
const FLAG_ROBUST: c_int = 4;
const FLAG_FILTER: c_int = 8;

/// The library's defaults; one ray a call.
pub(crate) const DEFAULT: Variant =
    Variant { quality: QUALITY_MEDIUM, flags: 0, packets: false, own: false, isa: None };
/// The robust mode, which has no high quality; one ray a call.
pub(crate) const ROBUST: Variant = Variant { flags: FLAG_ROBUST, ..DEFAULT };
/// The defaults, with a filter that rejects the triangle on which a ray starts; one ray a call.
pub(crate) const OWN: Variant = Variant { flags: FLAG_FILTER, own: true, ..DEFAULT };
/// The same in the robust mode, as Cycles traces; one ray a call.
pub(crate) const ROBUST_OWN: Variant = Variant { flags: FLAG_ROBUST | FLAG_FILTER, own: true, ..DEFAULT };
/// The mode that saves memory; one ray a call.
pub(crate) const COMPACT: Variant = Variant { flags: FLAG_COMPACT, ..DEFAULT };
/// High quality (spatial splits); 16 rays a call.
pub(crate) const PACKETS: Variant = Variant { quality: QUALITY_HIGH, packets: true, ..DEFAULT };
/// The defaults on a machine without AVX; one ray a call.
pub(crate) const SSE4: Variant = Variant { isa: Some("sse4.2"), ..DEFAULT };

/// Loads the library, so that the time of a build does not include loading it.
pub(crate) fn available() -> Result<()> {
    EmbreeApi::get().map(|_| ())
}

/// Builds a scene of a model.
pub(crate) fn contender(model: &Model, name: &str, variant: &Variant, threads: usize) -> Result<Contender> {
    available()?;
    let (positions, triangles) = (padded(&model.mesh.positions), model.mesh.triangles.clone());
    let start = Instant::now();
    let scene = build(positions, triangles, variant, threads)?;
    let build_s = start.elapsed().as_secs_f64();
    let bytes = scene.bytes();
    Ok(Contender::rival(name, scene, build_s, bytes))
}

/// Positions with the padding that [`EmbreeMesh`] needs.
pub(crate) fn padded(positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    positions.iter().copied().chain([[0.0; 3]]).collect()
}
