//! The OBJECT row: BTH-F101 to BTH-F103, and the limits of counts and depth (BTH-F022, BTH-F110).

use super::nodes::is_box;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::limits::{MAX_DEPTH, MAX_TRIANGLES};
use crate::object::ObjectView;
use std::mem::offset_of;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    record(view)?;
    counts(view)?;
    bounds(view.header)
}

fn fail(code: Code, offset: usize, expected: String, found: String) -> Result<()> {
    Err(Error::within(code, kind::OBJECT, offset as u64, expected, found))
}

/// BTH-F101: the record kind matches the TETS section.
fn record(view: &ObjectView) -> Result<()> {
    let record = view.header.record;
    if record != LINK32 && !(record == 0 && view.tet_leaves.is_empty()) {
        let found = format!("{record} with {} tet leaves", view.tet_leaves.len());
        return fail(Code::Record, offset_of!(Object, record), "the kind of the records".into(), found);
    }
    Ok(())
}

/// BTH-F102, BTH-F022 and BTH-F110: rows per triangle, dropped triangles, and depth.
fn counts(view: &ObjectView) -> Result<()> {
    let h = view.header;
    let rows = [
        ("TRIANGLE_PLACES", view.places.len()),
        ("TRIANGLE_FACES", view.triangle_faces.len()),
        ("TRIANGLES", view.triangles.len()),
        ("CORNERS", view.corners.len()),
    ];
    let triangles = h.triangles as usize;
    for (name, rows) in rows {
        if rows != 0 && rows != triangles {
            let expected = format!("{triangles} rows of {name}, or none");
            return fail(Code::Counts, offset_of!(Object, triangles), expected, format!("{rows}"));
        }
    }
    if h.triangles > MAX_TRIANGLES {
        let expected = format!("at most {MAX_TRIANGLES} triangles");
        return fail(Code::Limit, offset_of!(Object, triangles), expected, format!("{triangles}"));
    }
    if h.dropped > h.triangles {
        let expected = format!("at most {triangles} dropped triangles");
        return fail(Code::Counts, offset_of!(Object, dropped), expected, format!("{}", h.dropped));
    }
    if h.depth > MAX_DEPTH as u32 {
        let expected = format!("at most {MAX_DEPTH}");
        return fail(Code::Depth, offset_of!(Object, depth), expected, format!("{}", h.depth));
    }
    Ok(())
}

/// BTH-F103: the bounds are a box, or zeros where nothing can be hit.
fn bounds(header: &Object) -> Result<()> {
    let (lower, upper) = (header.lower, header.upper);
    let (good, expected) = if header.root == NONE {
        (lower.iter().chain(&upper).all(|x| x.to_bits() == 0), "zeros, without a root")
    } else {
        (is_box(lower, upper), "finite bounds, lower <= upper")
    };
    if !good {
        return fail(Code::ObjectBounds, 0, expected.into(), format!("{lower:?} to {upper:?}"));
    }
    Ok(())
}
