//! The free directions and distances of triangles: BTH-F168 to BTH-F171.

use super::bit_set::BitSet;
use crate::error::{Code, Error, Result, Text};
use crate::layout::{Child, FREE_DISTANCE_RANGE, FreeBins, FreeDirections, FreePlace, NONE, kind};
use crate::object::ObjectView;
use std::mem::offset_of;

/// Checks everything but the places of triangles.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let triangles = if view.is_deformable() { 0 } else { view.header.triangles as usize };
    let tables =
        [(kind::FREE_DIRECTIONS, view.free.len()), (kind::FREE_DISTANCES, view.free_distances.len())];
    for (i, (kind, rows)) in tables.into_iter().enumerate() {
        // At most one of the sections has rows.
        let expected_rows = if i == 1 && !view.free.is_empty() { 0 } else { triangles };
        if rows != 0 && rows != expected_rows {
            let expected = match expected_rows {
                0 => Text::from("none"),
                triangles => text!("{triangles} rows or none"),
            };
            return Err(Error::within(Code::FreeRows, kind, 0, expected, text!("{rows}")));
        }
    }
    let levels = view.free_levels;
    if levels.len() != usize::from(view.has_free_directions()) {
        let expected = "one row beside FREE_DIRECTIONS or FREE_DISTANCES, else none";
        return Err(Error::within(Code::FreeRows, kind::FREE_LEVELS, 0, expected, text!("{}", levels.len())));
    }
    for row in levels {
        let [least, most] = FREE_DISTANCE_RANGE;
        let [a, b, c] = row.distance;
        let is_ascending = least <= a && a < b && b < c && c <= most;
        if row.distance != [0.0; 3] && !is_ascending || row.reserved != 0 {
            let expected = text!("zeros, or ascending distances from {least:e} to {most:e}");
            return Err(Error::within(Code::FreeLevels, kind::FREE_LEVELS, 0, expected, text!("{row:?}")));
        }
    }
    for (triangle, row) in view.free.iter().enumerate() {
        let bits = row.bins().0;
        if bits & !(FreeBins::ALL | FreeBins::BACK) != 0 {
            let at = (size_of::<FreeDirections>() * triangle + offset_of!(FreeDirections, bins)) as u64;
            let (expected, found) = ("zero in bits 121 to 125 and 127", text!("{bits:#034x}"));
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
        if place != NONE && view.known_free(triangle).is_some_and(|known| known.place == place) {
            placed.insert(triangle);
        }
    }
}

/// BTH-F169: rows have no place and nothing known, or the place of their triangle.
pub(super) fn check_places(view: &ObjectView, placed: &BitSet) -> Result<()> {
    for triangle in 0..view.header.triangles as usize {
        let Some(known) = view.known_free(triangle) else { break };
        let is_right = if known.place == NONE { known.is_nothing() } else { placed.contains(triangle) };
        if !is_right {
            let (kind, stride) = view.free_kind();
            let (at, expected) = ((stride * triangle) as u64, "the place of the triangle, or NONE and zeros");
            return Err(Error::within(Code::FreePlace, kind, at, expected, text!("{:#010x}", known.place)));
        }
    }
    Ok(())
}
