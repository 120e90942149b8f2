//! The free directions of triangles: BTH-F168 to BTH-F171.

use super::bit_set::BitSet;
use crate::error::{Code, Error, Result, Text};
use crate::layout::{Child, FREE_REACH_RANGE, FreeBins, FreeDirections, FreePlace, NONE, kind};
use crate::object::ObjectView;
use std::mem::offset_of;

/// Bytes of a row.
const ROW: usize = size_of::<FreeDirections>();

/// Checks everything but the places of triangles.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let (rows, reach) = (view.free.len(), view.free_reach);
    let triangles = if view.is_deformable() { 0 } else { view.header.triangles as usize };
    if rows != 0 && rows != triangles {
        let expected =
            if view.is_deformable() { Text::from("none") } else { text!("{triangles} rows or none") };
        return Err(Error::within(Code::FreeRows, kind::FREE_DIRECTIONS, 0, expected, text!("{rows}")));
    }
    if reach.len() != usize::from(rows != 0) {
        let expected = "one row beside FREE_DIRECTIONS, else none";
        return Err(Error::within(Code::FreeRows, kind::FREE_REACH, 0, expected, text!("{}", reach.len())));
    }
    for row in reach {
        let [least, most] = FREE_REACH_RANGE;
        if row.reach != 0.0 && !(least <= row.reach && row.reach <= most) || row.reserved != [0; 3] {
            let expected = text!("0 or a reach from {least:e} to {most:e}, and zeros");
            return Err(Error::within(Code::FreeReach, kind::FREE_REACH, 0, expected, text!("{row:?}")));
        }
    }
    for (triangle, row) in view.free.iter().enumerate() {
        let bits = row.bins().0;
        if bits & !(FreeBins::ALL | FreeBins::BACK | FreeBins::NEARBY) != 0 {
            let at = (ROW * triangle + offset_of!(FreeDirections, bins)) as u64;
            let (expected, found) = ("zero in bits 121 to 125", text!("{bits:#034x}"));
            return Err(Error::within(Code::FreeBins, kind::FREE_DIRECTIONS, at, expected, found));
        }
    }
    Ok(())
}

/// Marks the triangles of a leaf, which has been checked, that lie where their rows say.
pub(super) fn mark_placed(view: &ObjectView, leaf: Child, placed: &mut BitSet) {
    if view.free.is_empty() {
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
        if place != NONE && view.free.get(triangle).is_some_and(|row| row.place == place) {
            placed.insert(triangle);
        }
    }
}

/// BTH-F169: rows have no place and no bins, or the place of their triangle.
pub(super) fn check_places(view: &ObjectView, placed: &BitSet) -> Result<()> {
    let wrong = |(triangle, row): (usize, &FreeDirections)| {
        if row.place == NONE { row.bins != [0; 4] } else { !placed.contains(triangle) }
    };
    match view.free.iter().enumerate().position(wrong) {
        None => Ok(()),
        Some(triangle) => {
            let (at, expected) = ((ROW * triangle) as u64, "the place of the triangle, or NONE and zeros");
            let found = text!("{:#010x}", view.free[triangle].place);
            Err(Error::within(Code::FreePlace, kind::FREE_DIRECTIONS, at, expected, found))
        }
    }
}
