//! Merges a source's normals and texture coordinates into rows that both share.

use std::collections::HashMap;

use crate::error::Result;
use crate::mesh::{Attributes, Keep};
use crate::raw::{Raw, RowKind};
use crate::source::input_error;
use bth_format::layout::NONE;

/// Shading attributes with one row for each used pair of normal and texture coordinate, in order of
/// first use. A corner without one gets zeros; a zero normal means that the geometric normal is to
/// be used. `None` when the source has nothing of what `keep` names. The second value has for each
/// row of normals its row in the source, or [`NONE`] for zeros.
///
/// # Errors
/// `BTH-I008` for a used value that is not finite.
pub(super) fn collect(raw: &Raw<'_>, keep: Keep) -> Result<Option<(Attributes, Vec<u32>)>> {
    let has_normals = keep != Keep::None && !raw.normal_rows.is_empty();
    let has_uvs = keep == Keep::All && !raw.uv_rows.is_empty();
    if !has_normals && !has_uvs {
        return Ok(None);
    }
    let (mut attributes, mut sources) = (Attributes::default(), Vec::new());
    let mut rows: HashMap<(u32, u32), u32> = HashMap::new();
    let none = [NONE; 3];
    attributes.corners.reserve_exact(raw.triangles.len());
    for triangle in 0..raw.triangles.len() {
        let normals = if has_normals { raw.normal_rows[triangle] } else { none };
        let uvs = if has_uvs { raw.uv_rows[triangle] } else { none };
        let mut corners = [0; 3];
        for (corner, pair) in corners.iter_mut().zip(normals.into_iter().zip(uvs)) {
            let next = rows.len() as u32;
            *corner = *rows.entry(pair).or_insert(next);
            if *corner == next {
                if has_normals {
                    sources.push(pair.0);
                    attributes.normals.push(value(raw, RowKind::Normal, &raw.normals, pair.0)?);
                }
                if has_uvs {
                    attributes.uvs.push(value(raw, RowKind::Uv, &raw.uvs, pair.1)?);
                }
            }
        }
        attributes.corners.push(corners);
    }
    Ok(Some((attributes, sources)))
}

fn value<const N: usize>(raw: &Raw<'_>, kind: RowKind, values: &[[f32; N]], row: u32) -> Result<[f32; N]> {
    if row == NONE {
        return Ok([0.0; N]);
    }
    let value = values[row as usize];
    if value.iter().all(|x| x.is_finite()) {
        return Ok(value);
    }
    let name = if kind == RowKind::Normal { "normal" } else { "texture coordinate" };
    Err(input_error(
        "BTH-I008",
        (raw.locate)(kind, row as usize),
        format!("expected a finite {name}, found {value:?}"),
        "correct it, or compile without attributes (--attributes none)",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, Place};

    fn raw() -> Raw<'static> {
        let mut raw = Raw::new("test", Box::new(|_, row| Place::Line("x".into(), row as u64)));
        raw.triangles = vec![[0, 1, 2], [2, 1, 0]];
        raw.normals = vec![[0.0, 0.0, 1.0], [f32::NAN; 3]];
        raw.normal_rows = vec![[0, 0, 0], [0, NONE, 0]];
        raw.uvs = vec![[0.0, 0.5], [1.0, 0.5]];
        raw.uv_rows = vec![[0, 1, 0], [1, 1, 0]];
        raw
    }

    #[test]
    fn one_row_for_each_used_pair_in_order_of_first_use() {
        let all = collect(&raw(), Keep::All).unwrap().unwrap().0;
        assert_eq!(all.corners, [[0, 1, 0], [1, 2, 0]]);
        assert_eq!(all.normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]]);
        assert_eq!(all.uvs, [[0.0, 0.5], [1.0, 0.5], [1.0, 0.5]]);
        let normals = collect(&raw(), Keep::Normals).unwrap().unwrap().0;
        assert_eq!(normals.corners, [[0, 0, 0], [0, 1, 0]]);
        assert!(normals.uvs.is_empty());
        assert_eq!(collect(&raw(), Keep::None).unwrap(), None);
    }

    #[test]
    fn a_used_normal_that_is_not_finite_is_an_error_with_its_place() {
        let mut raw = raw();
        raw.normal_rows[1] = [0, 1, 0];
        let error = collect(&raw, Keep::Normals).unwrap_err();
        assert!(matches!(error, Error::Input { code: "BTH-I008", place: Place::Line(_, 1), .. }));
    }
}
