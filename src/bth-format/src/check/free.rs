//! The free directions and distances of triangles: BTH-F168 and BTH-F170 to BTH-F172.

use crate::error::{Code, Error, Result};
use crate::layout::{FREE_DISTANCE_RANGE, FreeBins, FreeDirections, NONE, kind};
use crate::object::ObjectView;
use std::mem::offset_of;

/// Checks the rows and the levels.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let triangles = if view.is_deformable() { 0 } else { view.header.triangles as usize };
    let (directions, distances) = (view.free.len(), view.free_distances.len());
    let is_right = |rows: usize| rows == 0 || rows == triangles;
    // Where both are not 0, the sum is too great.
    if !is_right(directions) || !is_right(directions + distances) {
        let expected = format!("{triangles} rows in one section, or none");
        let (kind, found) = (view.free_kind().0, format!("{}", directions + distances));
        return Err(Error::within(Code::FreeRows, kind, 0, expected, found));
    }
    let levels = view.free_levels;
    if levels.is_empty() == view.has_free_directions() {
        // There is at most one row.
        let (expected, found) = ("one row beside such rows, else none", format!("{}", levels.len()));
        return Err(Error::within(Code::FreeRows, kind::FREE_LEVELS, 0, expected, found));
    }
    if let Some(row) = levels.first() {
        let [least, most] = FREE_DISTANCE_RANGE;
        let [a, b, c] = row.distance;
        let is_ascending = least <= a && a < b && b < c && c <= most;
        if row.distance != [0.0; 3] && !is_ascending || row.reserved != 0 {
            let expected = format!("zeros, or ascending distances from {least:e} to {most:e}");
            let found = format!("{a}, {b}, {c}");
            return Err(Error::within(Code::FreeLevels, kind::FREE_LEVELS, 0, expected, found));
        }
    }
    for (triangle, row) in view.free.iter().enumerate() {
        let last = row.bins[3];
        if last & !((FreeBins::ALL | FreeBins::BACK) >> 96) as u32 != 0 {
            let at = (size_of::<FreeDirections>() * triangle + offset_of!(FreeDirections, bins)) as u64;
            let (expected, found) =
                ("zero in bits 121 to 125 and 127", format!("{last:#010x} from bit 96 on"));
            return Err(Error::within(Code::FreeBins, kind::FREE_DIRECTIONS, at, expected, found));
        }
    }
    check_unplaced(view)
}

/// BTH-F172: a row of a triangle without a place is zero.
fn check_unplaced(view: &ObjectView) -> Result<()> {
    let (kind, stride) = view.free_kind();
    for triangle in 0.. {
        let Some(known) = view.known_free(triangle) else { break };
        let place = view.places.get(triangle).copied().unwrap_or(NONE);
        if place == NONE && !known.is_nothing() {
            let (at, expected) = ((stride * triangle) as u64, "zeros, since the triangle has no place");
            return Err(Error::within(Code::FreeUnplaced, kind, at, expected, format!("{known:?}")));
        }
    }
    Ok(())
}
