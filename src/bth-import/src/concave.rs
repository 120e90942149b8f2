//! Polygons whose fans are not the polygons themselves: concave ones, from whose first corner not
//! all of the polygon is seen.

use glam::DVec3;

use crate::ears::clip_ears;
use crate::error::Result;
use crate::mesh::Polygons;
use crate::monitor::Monitor;
use crate::polygon::{fan as fan_of, fan_areas};

/// A fan covers something twice or reaches beyond its polygon if it turns over more than the
/// polygon's area divided by this number. Coordinates with few digits turn over less than that at
/// corners on a straight line.
const PARTS: f64 = 1000.0;

/// Half a unit in the last place of f32, relative.
const U: f64 = 1.0 / (1u64 << 24) as f64;

/// 2√3, rounded up: two corners that move by 1 along each axis part by at most this length.
const TWICE_ROOT_3: f64 = 3.47;

/// The concave polygons of a mesh.
#[derive(Clone, Default)]
pub(crate) struct ConcavePolygons {
    /// Fans some of whose triangles are turned over, or may be before positions are rounded to f32,
    /// or that have corners whose positions were not known yet.
    suspects: Vec<Fan>,
    /// Number of concave polygons.
    count: u64,
    /// What replaces fans: triangles of numbers of corners.
    replaced: Vec<(Fan, Vec<[u32; 3]>)>,
    /// Number of concave polygons that remain fans.
    left: u64,
    /// Number of the first triangle of the first of them.
    first: usize,
}

/// Where a mesh has the fan of a polygon.
#[derive(Clone, Copy)]
struct Fan {
    /// Number of the first triangle.
    first: u32,
    triangles: u32,
}

impl Fan {
    /// The rows of the corners, of a list of triangles of positions or of attributes.
    fn corners(self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let (first, count) = (self.first as usize, self.triangles as usize);
        let fan = &triangles[first..first + count];
        fan[..1].iter().flat_map(|[a, b, _]| [*a, *b]).chain(fan.iter().map(|[_, _, c]| *c)).collect()
    }
}

impl ConcavePolygons {
    /// Notes a polygon whose fan begins with the triangle `first`.
    #[inline]
    pub(super) fn note(&mut self, positions: &[[f32; 3]], face: &[u32], first: usize) {
        if face.len() > 3 && may_turn(positions, face) {
            self.suspects.push(Fan { first: first as u32, triangles: face.len() as u32 - 2 });
        }
    }

    /// Finds which polygons are concave, and triangles for them if they are wanted, once all
    /// positions are known. `triangles` are fans.
    ///
    /// # Errors
    /// Cancellation.
    pub(super) fn find<T: Into<f64> + Copy>(
        &mut self,
        positions: &[[T; 3]],
        triangles: &[[u32; 3]],
        polygons: Polygons,
        monitor: &dyn Monitor,
    ) -> Result<()> {
        if self.suspects.is_empty() {
            return Ok(());
        }
        (self.count, self.left, self.first, self.replaced) = (0, 0, 0, Vec::new());
        for &fan in &self.suspects {
            let face = fan.corners(triangles);
            let part = turned_part(positions, &face).unwrap_or(0.0);
            if part == 0.0 {
                continue;
            }
            let found = match polygons {
                Polygons::Fans => None,
                Polygons::Ears => {
                    let corners: Vec<_> = face.iter().map(|row| positions[*row as usize]).collect();
                    clip_ears(&corners, monitor)?
                }
            };
            let concave = part * PARTS > 1.0;
            self.count += u64::from(concave);
            if let Some(found) = found {
                self.replaced.push((fan, found));
            } else if concave {
                self.first = if self.left == 0 { fan.first as usize } else { self.first };
                self.left += 1;
            }
        }
        Ok(())
    }

    /// Replaces the fans for which triangles were found in a list of triangles of positions or of
    /// attributes; an empty one stays empty.
    pub(super) fn replace(&self, triangles: &mut [[u32; 3]]) {
        if triangles.is_empty() {
            return;
        }
        for (fan, found) in &self.replaced {
            let corners = fan.corners(triangles);
            let found = found.iter().map(|triangle| triangle.map(|corner| corners[corner as usize]));
            triangles[fan.first as usize..].iter_mut().zip(found).for_each(|(old, new)| *old = new);
        }
    }

    /// Puts fans back where they have been replaced.
    pub(super) fn restore(&self, triangles: &mut [[u32; 3]]) {
        if triangles.is_empty() {
            return;
        }
        for (fan, found) in &self.replaced {
            let of_fan = &mut triangles[fan.first as usize..][..found.len()];
            let mut corners = vec![0; found.len() + 2];
            let pairs = found.as_flattened().iter().zip(of_fan.as_flattened());
            pairs.for_each(|(corner, row)| corners[*corner as usize] = *row);
            let mut again = Vec::with_capacity(found.len());
            fan_of(&mut again, &corners);
            of_fan.copy_from_slice(&again);
        }
    }

    /// Adds concave polygons that were split before, and whose mesh begins with the triangle
    /// `first`.
    pub(super) fn add(&mut self, others: &ConcavePolygons, first: usize) {
        if self.left == 0 {
            self.first = first + others.first;
        }
        (self.count, self.left) = (self.count + others.count, self.left + others.left);
    }

    /// Number of concave polygons, whatever has become of them.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Warns of those that remain fans.
    pub(super) fn warn(&self, polygons: Polygons, monitor: &dyn Monitor) {
        if self.left == 0 {
            return;
        }
        let are = if self.left == 1 { "polygon is" } else { "polygons are" };
        let (why, hint) = match polygons {
            Polygons::Fans => ("", "Compile with --polygons ears, or triangulate"),
            Polygons::Ears => {
                (" and cannot be split, since the outline crosses itself or is far from flat", "Triangulate")
            }
        };
        monitor.warn(&format!(
            "{} {are} concave{why}: the fan of triangles from the first corner covers more than the polygon; the first is triangle {}. \
             {hint} the model in the program that made it",
            self.left, self.first
        ));
    }
}

/// The part of a polygon's area that triangles of its fan cover which are turned over relative to
/// the polygon; `None` if not all positions of its corners are known. What has no area has no such
/// part.
fn turned_part<T: Into<f64> + Copy>(positions: &[[T; 3]], face: &[u32]) -> Option<f64> {
    let known = |row: &u32| positions.get(*row as usize).map(|p| DVec3::from_array(p.map(T::into)));
    if face.iter().any(|row| known(row).is_none()) {
        return None;
    }
    let position = |row: &u32| known(row).unwrap_or_default();
    let areas = || fan_areas(face.iter().map(position));
    let whole: DVec3 = areas().sum();
    let turned: f64 = areas().map(|area| -area.dot(whole)).filter(|turned| *turned > 0.0).sum();
    Some(if turned > 0.0 { turned / whole.length_squared() } else { 0.0 })
}

/// Returns true if triangles of a polygon's fan may be turned over relative to the polygon, where
/// its corners lie before they are rounded to f32. Also if not all positions are known.
///
/// Rounding moves a corner along each axis by at most m, 2^-24 times the largest coordinate (or
/// 2^-150), and so sides of triangles, of length s at most, by d = 2√3 m. Area vectors of triangles
/// change by at most e = 2sd + d². So the scalar product of one of them, A, and the sum W of all n
/// changes by at most e |W| + n e (|A| + e).
fn may_turn(positions: &[[f32; 3]], face: &[u32]) -> bool {
    let known = |row: &u32| positions.get(*row as usize).map(|p| DVec3::from_array(p.map(f64::from)));
    if face.iter().any(|row| known(row).is_none()) {
        return true;
    }
    let corners = || face.iter().map(|row| known(row).unwrap_or_default());
    let first = corners().next().unwrap_or_default();
    let largest = corners().fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
    let moved = TWICE_ROOT_3 * (largest * U + f64::from(f32::from_bits(1)));
    let side = corners().fold(0.0, |most: f64, p| most.max(p.distance(first)));
    let change = moved * (2.0 * side + moved);
    let areas = || fan_areas(corners());
    let whole: DVec3 = areas().sum();
    let (length, count) = (whole.length(), face.len() as f64);
    areas().any(|area| area.dot(whole) <= change * (length + count * (area.length() + change)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_concave(corners: &[[f32; 3]], expected: &[bool]) {
        for scale in [1.0, 1e-15, 1e15] {
            let positions: Vec<_> = corners.iter().map(|p| p.map(|x| x * scale)).collect();
            let count = corners.len() as u32;
            let concave = |start: u32| {
                let face: Vec<_> = (0..count).map(|k| (start + k) % count).collect();
                turned_part(&positions, &face).unwrap() * PARTS > 1.0
            };
            assert_eq!((0..count).map(concave).collect::<Vec<_>>(), expected, "{scale}");
        }
    }

    #[test]
    fn fans_of_concave_polygons_turn_over_but_from_some_corners() {
        // An arrow head, whose notch and opposite corner see everything.
        let arrow = [[0.0, 0.0, 1.0], [2.0, -1.0, 1.0], [1.0, 0.0, 1.0], [2.0, 1.0, 1.0]];
        assert_concave(&arrow, &[false, true, false, true]);
        // The letter C is seen from no corner.
        let c =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [3.0, 2.0], [3.0, 3.0], [0.0, 3.0]];
        assert_concave(&c.map(|[x, y]| [x, 0.5 * y, y]), &[true; 8]);
    }

    #[test]
    fn fans_of_convex_polygons_do_not() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_concave(&square, &[false; 4]);
        assert_concave(&square.map(|[x, y, z]| [x, y, z + x * y]), &[false; 4]);
        // Corners on a straight line, one moved into the polygon by rounding, and one that comes
        // twice.
        let rounded = [
            [0.0, 0.0, 0.0],
            [0.3, 1e-6, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        assert_concave(&rounded, &[false; 6]);
        // Without an area there is nothing that a fan could cover twice.
        assert_concave(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]], &[false; 4]);
    }
}
