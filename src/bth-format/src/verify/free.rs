//! BTH-F210: triangles with free bins have axes. BTH-F209: rays from some triangles hit nothing
//! where their directions are called free.
//!
//! All pairs of triangles would take quadratic time. Of evenly spaced triangles rays from the
//! corners to the middles of all other triangles are decided: a wrong bin is found as soon as one
//! of the middles lies in the bin.

use crate::error::{Code, Error, Result};
use crate::exact::side;
use crate::layout::{Child, FreeLevels, KnownFree, TrianglePlace, free_axes, free_bin};
use crate::object::ObjectView;
use std::cmp::Ordering;

/// Max number of triangles from which rays are sent.
const STARTS: usize = 64;

type Corners = [[f32; 3]; 3];

/// Checks an object whose index check has passed.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    if !view.has_free_directions() {
        return Ok(());
    }
    let known: Vec<KnownFree> =
        (0..view.header.triangles as usize).map_while(|triangle| view.known_free(triangle)).collect();
    let triangles: Vec<Option<Corners>> = (0..)
        .zip(&known)
        .map(|(triangle, known)| {
            let TrianglePlace { leaf, slot } = view.place(triangle).filter(|_| !known.is_nothing())?;
            view.corners_in(leaf.code(), slot)
        })
        .collect();
    let levels = view.free_levels.first().copied().unwrap_or_default();
    let (kind, stride) = view.free_kind();
    let step = triangles.len().div_ceil(STARTS).max(1);
    let at = |triangle: usize| (triangle * stride) as u64;
    for (triangle, corners) in triangles.iter().enumerate() {
        let Some(corners) = corners else { continue };
        if free_axes(*corners).is_none() {
            let expected = "nothing known of a triangle without axes";
            let found = format!("{corners:?}");
            return Err(Error::within(Code::FreeAxes, kind, at(triangle), expected, found));
        }
    }
    let all = all_corners(view);
    for start in (0..triangles.len()).step_by(step) {
        let Some(start_corners) = triangles[start] else { continue };
        let Some(axes) = free_axes(start_corners) else { continue };
        let of_start = Start { axes, known: known[start], levels };
        for &(other, target) in all.iter().filter(|(other, _)| *other != start as u32) {
            if let Some(corner) = start_corners.iter().find(|corner| of_start.meets(**corner, target)) {
                let expected = String::from("nothing in free directions, nor within the distances of levels");
                let found = format!("triangle {other} from {corner:?}");
                return Err(Error::within(Code::FreeMet, kind, at(start), expected, found));
            }
        }
    }
    Ok(())
}

/// The triangles of all triangle leaves, with their ids.
fn all_corners(view: &ObjectView) -> Vec<(u32, Corners)> {
    let mut stack = vec![view.header.root];
    let mut found = Vec::new();
    while let Some(code) = stack.pop() {
        let (mut indexed, mut raw) = (None, None);
        let id = |row: u32| view.triangle_ids[row as usize];
        match Child::from_code(code) {
            Some(Child::Indexed(index)) => {
                let leaf = view.indexed(index, &mut indexed);
                let slots = 0..leaf.triangles;
                found.extend(slots.map(|slot| (id(leaf.first + slot), leaf.triangle(slot as usize))));
            }
            Some(Child::Raw(index)) => {
                let leaf = view.raw(index, &mut raw);
                let slots = 0..leaf.triangles;
                found.extend(slots.map(|slot| (id(leaf.first + slot), leaf.triangle(slot as usize))));
            }
            Some(Child::Node(index)) => stack.extend(view.node(index).child),
            Some(Child::Tets(_)) | None => {}
        }
    }
    found
}

/// A triangle from which rays are sent.
struct Start {
    axes: [[f64; 3]; 3],
    known: KnownFree,
    levels: FreeLevels,
}

impl Start {
    /// Returns true if the ray from a corner through the middle of another triangle hits it though
    /// its direction is called free, or free as far as that. It hits the middle itself, unless it
    /// lies in the plane of the triangle.
    fn meets(&self, from: [f32; 3], target: Corners) -> bool {
        /// Bounds the rounding errors of the direction, a sum of six numbers, and of its length,
        /// relative to the max coordinate.
        const ERROR: f64 = 1.0 / (1u64 << 48) as f64;
        // Three times the direction to the middle.
        let direction: [f64; 3] = std::array::from_fn(|k| {
            target.iter().map(|p| f64::from(p[k])).sum::<f64>() - 3.0 * f64::from(from[k])
        });
        let greatest = |m: f64, x: &f32| m.max(f64::from(x.abs()));
        let error = target.iter().flatten().chain(&from).fold(0.0, greatest) * ERROR;
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Such errors of a direction are far below the margin of its bin.
        if length <= error * (1 << 16) as f64 {
            return false;
        }
        let Some((bin, is_back)) = free_bin(&self.axes, direction) else { return false };
        let KnownFree { bins, sectors, .. } = self.known;
        let is_free = bins.is_free(bin) && bins.is_back() == is_back;
        let level = sectors[usize::from(is_back)].level_of_bin(bin);
        let within = 3.0 * f64::from(self.levels.within(level));
        let [a, b, c] = target;
        (is_free || length * (1.0 + ERROR) + error < within) && side(a, b, c, from) != Ordering::Equal
    }
}
