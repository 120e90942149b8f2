//! BTH-F209: rays from some triangles meet nothing where their directions are called free.
//!
//! All pairs of triangles would take quadratic time. Of evenly spaced triangles rays from the corners to points of all other triangles
//! are decided, exactly: a wrong class of a bin is found as soon as one of the points lies in the bin.

use crate::error::{Code, Error, Result};
use crate::exact::side;
use crate::layout::{Child, FREE_SIDE, FreeClass, FreeDirections, FreePlace, free_bin, free_column, kind};
use crate::object::ObjectView;
use std::cmp::Ordering;

/// Greatest number of triangles from which rays are sent.
const STARTS: usize = 64;

type Corners = [[f32; 3]; 3];

/// Checks an object whose index check has passed.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let placed = |row: &FreeDirections| corners(view, row);
    let triangles: Vec<Option<Corners>> = view.free.iter().map(placed).collect();
    let reach = view.free_reach.first().map_or(0.0, |row| f64::from(row.reach));
    let step = triangles.len().div_ceil(STARTS).max(1);
    for start in (0..triangles.len()).step_by(step) {
        let Some(corners) = triangles[start] else { continue };
        let others = triangles.iter().enumerate().filter(|(other, _)| *other != start);
        for (other, target) in others.filter_map(|(other, target)| Some((other, (*target)?))) {
            let class = |bin| view.free[start].class(bin);
            if let Some(corner) = corners.iter().find(|corner| is_met(**corner, target, reach, class)) {
                let at = (start * size_of::<FreeDirections>()) as u64;
                let expected = "nothing in free directions".to_owned();
                let found = format!("triangle {other} from {corner:?}");
                return Err(Error::within(Code::FreeMet, kind::FREE_DIRECTIONS, at, expected, found));
            }
        }
    }
    Ok(())
}

/// The corners of the triangle of a row, if it has a place.
fn corners(view: &ObjectView, row: &FreeDirections) -> Option<Corners> {
    let FreePlace { leaf, slot } = FreePlace::from_code(row.place)?;
    let (mut indexed, mut raw) = (None, None);
    match leaf {
        Child::Indexed(index) => Some(view.indexed(index, &mut indexed).triangle(slot as usize)),
        Child::Raw(index) => Some(view.raw(index, &mut raw).triangle(slot as usize)),
        Child::Node(_) | Child::Packed(_) | Child::Tets(_) => None,
    }
}

/// Whether the ray from a point through the middle of a triangle meets it though its direction is called free.
fn is_met(from: [f32; 3], target: Corners, reach: f64, class: impl Fn(usize) -> FreeClass) -> bool {
    let middle: [f32; 3] = std::array::from_fn(|k| {
        let sum: f64 = target.iter().map(|p| f64::from(p[k])).sum();
        (sum / 3.0) as f32
    });
    let d: [f64; 3] = std::array::from_fn(|k| f64::from(middle[k]) - f64::from(from[k]));
    let Some(bin) = bin_of(d) else { return false };
    let class = class(bin);
    if class == FreeClass::Unknown || class == FreeClass::Near && beyond(from, target, reach) {
        return false;
    }
    // The triangle is met beyond the start if the line passes its edges on the same side, and the start lies on the side of the
    // triangle from which that direction comes.
    let [a, b, c] = target;
    let sides = [side(from, middle, a, b), side(from, middle, b, c), side(from, middle, c, a)];
    let before = side(a, b, c, from);
    before != Ordering::Equal
        && sides.iter().any(|s| *s != Ordering::Equal)
        && sides.iter().all(|s| *s != before)
}

/// The bin in which a direction certainly lies, without the margin.
fn bin_of(d: [f64; 3]) -> Option<usize> {
    let bin = free_bin(d.map(|x| x as f32));
    let (axis, depth) = (bin / 32, d[bin / 32].abs());
    let within = |k: usize, column: usize| {
        let [low, high] = free_column(column);
        low * depth < d[k % 3] && d[k % 3] < high * depth
    };
    (within(axis + 1, bin % FREE_SIDE) && within(axis + 2, bin / FREE_SIDE % FREE_SIDE)).then_some(bin)
}

/// Whether all of a triangle may be farther from a point than the reach.
fn beyond(from: [f32; 3], target: Corners, reach: f64) -> bool {
    let square = |p: &[f32; 3]| (0..3).map(|k| (f64::from(p[k]) - f64::from(from[k])).powi(2)).sum::<f64>();
    // Points of a triangle are no farther than its farthest corner.
    target.iter().map(square).fold(0.0, f64::max) >= reach * reach
}
