//! The free directions and distances of triangles: BTH-F168 to BTH-F171.

use super::bit_set::BitSet;
use crate::error::{Code, Error, Result};
use crate::layout::{Child, FREE_DISTANCE_RANGE, FreeBins, FreeDirections, FreePlace, NONE, kind};
use crate::object::ObjectView;
use std::mem::offset_of;

/// Checks everything but the places of triangles.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let triangles = if view.is_deformable() { 0 } else { view.header.triangles as usize };
    let (directions, distances) = (view.free.len(), view.free_distances.len());
    let is_right = |rows: usize| rows == 0 || rows == triangles;
    // Where both are not 0, the sum is too great.
    if !is_right(directions) || !is_right(directions + distances) {
        let expected = text!("{triangles} rows in one section, or none");
        let (kind, found) = (view.free_kind().0, text!("{}", directions + distances));
        return Err(Error::within(Code::FreeRows, kind, 0, expected, found));
    }
    let levels = view.free_levels;
    if levels.is_empty() == view.has_free_directions() {
        // There is at most one row.
        let (expected, found) = ("one row beside such rows, else none", text!("{}", levels.len()));
        return Err(Error::within(Code::FreeRows, kind::FREE_LEVELS, 0, expected, found));
    }
    if let Some(row) = levels.first() {
        let [least, most] = FREE_DISTANCE_RANGE;
        let [a, b, c] = row.distance;
        let is_ascending = least <= a && a < b && b < c && c <= most;
        if row.distance != [0.0; 3] && !is_ascending || row.reserved != 0 {
            let expected = text!("zeros, or ascending distances from {least:e} to {most:e}");
            let found = text!("{a}, {b}, {c}");
            return Err(Error::within(Code::FreeLevels, kind::FREE_LEVELS, 0, expected, found));
        }
    }
    for (triangle, row) in view.free.iter().enumerate() {
        let last = row.bins[3];
        if last & !((FreeBins::ALL | FreeBins::BACK) >> 96) as u32 != 0 {
            let at = (size_of::<FreeDirections>() * triangle + offset_of!(FreeDirections, bins)) as u64;
            let (expected, found) = ("zero in bits 121 to 125 and 127", text!("{last:#010x} from bit 96 on"));
            return Err(Error::within(Code::FreeBins, kind::FREE_DIRECTIONS, at, expected, found));
        }
    }
    Ok(())
}

/// Marks the triangles of a leaf, which has been checked, that lie where their rows say.
pub(super) fn mark_placed(view: &ObjectView, leaf: Child, placed: &mut BitSet) {
    if !view.has_free_directions() {
        return;
    }
    let (first, triangles) = match leaf {
        Child::Indexed(index) => {
            let mut unpacked = None;
            let leaf = view.indexed(index, &mut unpacked);
            (leaf.first, leaf.triangles)
        }
        Child::Raw(index) => {
            let mut unpacked = None;
            let leaf = view.raw(index, &mut unpacked);
            (leaf.first, leaf.triangles)
        }
        Child::Node(_) | Child::Packed(_) | Child::Tets(_) => return,
    };
    for slot in 0..triangles {
        let triangle = view.triangle_ids[(first + slot) as usize] as usize;
        let place = FreePlace { leaf, slot }.code();
        if place != NONE && view.free_place(triangle).is_some_and(|(found, _)| found == place) {
            placed.insert(triangle);
        }
    }
}

/// BTH-F169: rows have no place and nothing known, or the place of their triangle.
pub(super) fn check_places(view: &ObjectView, placed: &BitSet) -> Result<()> {
    for triangle in 0..view.header.triangles as usize {
        let Some((place, is_told)) = view.free_place(triangle) else { break };
        let is_right = if place == NONE { !is_told } else { placed.contains(triangle) };
        if !is_right {
            let (kind, stride) = view.free_kind();
            let (at, expected) = ((stride * triangle) as u64, "the place of the triangle, or NONE and zeros");
            return Err(Error::within(Code::FreePlace, kind, at, expected, text!("{place:#010x}")));
        }
    }
    Ok(())
}
