//! A file with positions in f64, and its faults.

use super::invalid::{broken, field, shortened};
use super::valid::{bounds, indexed, lines};
use super::{Case, Seal};
use bth_compile::write::{FileBuilder, ObjectParts, Source, object};
use bth_format::layout::*;
use bth_format::object::relative_to_anchor;
use bth_import::Exact;
use zerocopy::IntoBytes;

/// National coordinates.
const ANCHOR: [f64; 3] = [5.5e6, 4.2e5, 300.0];

/// A triangle, one that has an area in f64 only, and one without.
pub(super) fn exact_positions() -> Vec<u8> {
    with_free_directions(&[])
}

fn with_free_directions(free: &[FreeDirections]) -> Vec<u8> {
    let bent = 2.0 + 1.0 / (1u64 << 30) as f64;
    let at = [[0.0; 3], [1.1, 0.0, 0.1], [0.0, 1.3, 0.2], [1.0, 1.0, 0.0], [2.0, bent, 0.0], [1.0, 2.0, 0.0]];
    let exact = Exact { anchor: ANCHOR, positions: at.map(|p| [0, 1, 2].map(|k| ANCHOR[k] + p[k])).to_vec() };
    let positions: Vec<[f32; 3]> =
        exact.positions.iter().map(|p| [0, 1, 2].map(|k| relative_to_anchor(p[k], ANCHOR[k]))).collect();
    let triangles = [[0, 1, 2], [0, 3, 4], [0, 5, 5]];
    let corners = [0, 1].map(|t: usize| triangles[t].map(|v: u32| positions[v as usize]));
    let lines = lines(indexed(&corners, 0).as_bytes());
    let source =
        Source { positions: &positions, exact: Some(&exact), triangles: &triangles, ..Source::default() };
    let parts = ObjectParts {
        bounds: Some(bounds(corners.as_flattened())),
        root: Child::Indexed(0).code(),
        triangles: 3,
        dropped: 1,
        lines: &lines,
        triangle_ids: &[0, 1],
        free,
        free_levels: &[FreeLevels::default()],
        source: Some(source),
        ..ObjectParts::default()
    };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    builder.provenance("{}".into()).unwrap();
    builder.finish()
}

/// Faults of exact positions.
pub(super) fn invalid() -> Vec<Case> {
    let base = "exact-positions";
    let rows = |name: &str, kind, rows: [usize; 3]| shortened((name, base), kind, rows);
    let number = |name: &str, kind, at: usize, x: f64| {
        broken(name, base, Seal::Sections, |e| {
            let start = e.section_at(kind);
            e.put(start + at, &x.to_le_bytes());
        })
    };
    let (anchor, exact) = (kind::ANCHOR, kind::EXACT_POSITIONS);
    vec![
        rows("F193-no-anchor", anchor, [24, 1, 0]),
        rows("F193-anchor-alone", exact, [24, 6, 0]),
        rows("F193-rows", exact, [24, 6, 5]),
        rows("F193-no-triangles", kind::TRIANGLES, [12, 3, 0]),
        Case::new("F193-free-directions", with_free_directions(&[FreeDirections::UNKNOWN; 3])),
        number("F194-nan", exact, 8, f64::NAN),
        number("F194-too-small", exact, 24, 1e-50),
        number("F194-too-great", exact, 0, 1e39),
        number("F194-anchor-infinite", anchor, 16, f64::INFINITY),
        // The sliver becomes straight.
        number("F207-straight-in-f64", exact, 4 * 24 + 8, ANCHOR[1] + 2.0),
        number("F211-moved", exact, 24, ANCHOR[0] + 1.2),
        field("F211-negative-zero", base, kind::POSITIONS, 5 * 12 + 8, (-0f32).to_bits()),
    ]
}
