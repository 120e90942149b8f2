//! Polygons whose fans are not the polygons themselves: concave ones, from whose first corner not all of the polygon is seen.

use glam::DVec3;

use crate::monitor::Monitor;

/// A fan covers something twice or reaches beyond its polygon where more than one part in so many of the polygon's area is turned
/// over. Less is what coordinates with few digits do to corners on a straight line.
const PARTS: f64 = 1000.0;

/// The polygons so far whose fans fold.
#[derive(Default)]
pub(super) struct Folds {
    count: u64,
    /// Number of the first triangle of the first of them.
    first: usize,
}

impl Folds {
    /// Notes a polygon whose fan begins with the triangle `first`.
    #[inline]
    pub(super) fn note(&mut self, positions: &[[f32; 3]], face: &[u32], first: usize) {
        if face.len() > 3 && folds(positions, face) {
            self.first = if self.count == 0 { first } else { self.first };
            self.count += 1;
        }
    }

    /// Warns of them.
    pub(super) fn warn(&self, monitor: &dyn Monitor) {
        if self.count > 0 {
            let polygons = if self.count == 1 { "polygon is" } else { "polygons are" };
            monitor.warn(&format!(
                "{} {polygons} concave: the fan of triangles from the first corner covers more than the polygon; the first is triangle {}. \
                 Triangulate the model in the program that made it",
                self.count, self.first
            ));
        }
    }
}

/// Whether triangles of a polygon's fan are turned over relative to the polygon. Corners whose positions the file
/// defines later, which are few, are left out.
fn folds(positions: &[[f32; 3]], face: &[u32]) -> bool {
    let position = |row: &u32| positions.get(*row as usize).map(|p| DVec3::from_array(p.map(f64::from)));
    let [first, rest @ ..] = face else { return false };
    let Some(first) = position(first) else { return false };
    // The vectors of the triangles' areas; their sum is that of the polygon's.
    let areas = || {
        let pairs = rest.array_windows::<2>();
        pairs.filter_map(|[a, b]| Some((position(a)? - first).cross(position(b)? - first)))
    };
    let whole: DVec3 = areas().sum();
    let turned: f64 = areas().map(|area| -area.dot(whole)).filter(|turned| *turned > 0.0).sum();
    turned * PARTS > whole.length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_folds(corners: &[[f32; 3]], expected: &[bool]) {
        for scale in [1.0, 1e-15, 1e15] {
            let positions: Vec<_> = corners.iter().map(|p| p.map(|x| x * scale)).collect();
            let count = corners.len() as u32;
            let from = |start: u32| (0..count).map(|k| (start + k) % count).collect::<Vec<_>>();
            let found: Vec<bool> = (0..count).map(|start| folds(&positions, &from(start))).collect();
            assert_eq!(found, expected, "{scale}");
        }
    }

    #[test]
    fn fans_of_concave_polygons_fold_but_from_some_corners() {
        // An arrow head, of which the notch and its opposite corner see everything.
        let arrow = [[0.0, 0.0, 1.0], [2.0, -1.0, 1.0], [1.0, 0.0, 1.0], [2.0, 1.0, 1.0]];
        assert_folds(&arrow, &[false, true, false, true]);
        // The letter C is seen from no corner.
        let c =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [3.0, 2.0], [3.0, 3.0], [0.0, 3.0]];
        assert_folds(&c.map(|[x, y]| [x, 0.5 * y, y]), &[true; 8]);
    }

    #[test]
    fn fans_of_convex_polygons_do_not_fold() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_folds(&square, &[false; 4]);
        assert_folds(&square.map(|[x, y, z]| [x, y, z + x * y]), &[false; 4]);
        // Corners on a straight line, one of which rounding has moved into the polygon, and one that comes twice.
        let rounded = [
            [0.0, 0.0, 0.0],
            [0.3, 1e-6, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        assert_folds(&rounded, &[false; 6]);
        // Without an area there is nothing that a fan could cover twice.
        assert_folds(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]], &[false; 4]);
    }
}
