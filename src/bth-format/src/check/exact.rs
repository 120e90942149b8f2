//! Exact positions: BTH-F193 and BTH-F194.

use super::rows::check_all;
use crate::error::{Code, Error, Result};
use crate::layout::kind;
use crate::object::{EXACT_RANGE, ObjectView};

/// Checks the numbers of rows, what such an object cannot have, and the numbers. `anchors` are the
/// rows of ANCHOR, at most one.
pub(crate) fn check(view: &ObjectView, anchors: &[[f64; 3]]) -> Result<()> {
    let exact = view.exact.positions();
    let wrong = |kind, expected: &'static str, found: String| {
        Err(Error::within(Code::ExactRows, kind, 0, expected, found))
    };
    if anchors.is_empty() != exact.is_empty() {
        let found = format!("{} rows of EXACT_POSITIONS", exact.len());
        return wrong(kind::EXACT_POSITIONS, "an anchor if and only if there are exact positions", found);
    }
    if exact.is_empty() {
        return Ok(());
    }
    if exact.len() != view.positions.len() || view.triangles.len() != view.header.triangles as usize {
        let found = format!("{} rows for {}", exact.len(), view.positions.len());
        return wrong(kind::EXACT_POSITIONS, "a row for each of POSITIONS, and TRIANGLES", found);
    }
    let is_plain = view.grid.is_none() && !view.is_deformable() && view.tet_leaves.is_empty();
    if !is_plain || view.has_free_directions() {
        let expected = "neither a grid, LEAF_VERTICES, tet leaves nor free directions";
        return wrong(kind::EXACT_POSITIONS, expected, "one of these".into());
    }
    let holds = |p: &[f64; 3]| p.iter().all(|x| *x == 0.0 || EXACT_RANGE.contains(&x.abs()));
    let expected = "numbers that f32 neither rounds to 0 nor to an infinity";
    check_all(Code::ExactNumbers, kind::ANCHOR, anchors, holds, expected)?;
    check_all(Code::ExactNumbers, kind::EXACT_POSITIONS, exact, holds, expected)
}
