//! What rounding positions to f32 moves and drops, in C.

use bth_import::Rounding;
use serde::Deserialize;
use serde_json::Value;

/// `bth_rounding` of `bth_compile.h`.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct RoundingC {
    positions: u64,
    triangles: u64,
    farthest: f64,
}

/// Stores what the report of a mesh or a scene tells about rounding, and about rounding that was
/// avoided; zeros without a report.
///
/// # Safety
/// The pointers are null or valid for writes.
pub(crate) unsafe fn store(report: &Value, [rounding, avoided]: [*mut RoundingC; 2]) {
    let meshes = report["objects"].as_array().map_or(std::slice::from_ref(&report["mesh"]), Vec::as_slice);
    for (name, out) in [("rounding", rounding), ("avoided_rounding", avoided)] {
        let found = meshes.iter().filter_map(|mesh| Rounding::deserialize(&mesh[name]).ok());
        let sum = found.fold(RoundingC::default(), |sum, of| RoundingC {
            positions: sum.positions + of.positions,
            triangles: sum.triangles + of.triangles,
            farthest: sum.farthest.max(of.farthest),
        });
        // SAFETY: by contract it is null, and then skipped, or valid for writes.
        unsafe { out.as_mut() }.into_iter().for_each(|out| *out = sum);
    }
}
