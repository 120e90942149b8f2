//! Corners of a polygon by where they are.

/// Corners by the cells of a grid over the polygon's box.
pub(super) struct CornerGrid {
    lower: [f64; 2],
    /// Cells for each unit of length.
    density: [f64; 2],
    /// Columns and rows.
    size: [usize; 2],
    corners: Vec<Vec<u32>>,
}

impl CornerGrid {
    /// Makes an empty grid of square cells, with about one cell per point.
    pub(super) fn new(points: &[[f64; 2]]) -> Self {
        let [lower, upper] = bounds(points);
        let extent = [upper[0] - lower[0], upper[1] - lower[1]];
        let side = (extent[0] * extent[1] / points.len() as f64).sqrt();
        let size = extent.map(|extent| ((extent / side) as usize).clamp(1, points.len()));
        // Without extent there is one column or row of cells.
        let density = [0, 1].map(|k| size[k] as f64 / extent[k]).map(|x| if x.is_finite() { x } else { 0.0 });
        Self { lower, density, size, corners: vec![Vec::new(); size[0] * size[1]] }
    }

    /// The column and the row of a point. They ascend with the coordinates, whatever is rounded.
    fn cell(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| (((point[k] - self.lower[k]) * self.density[k]) as usize).min(self.size[k] - 1))
    }

    /// Adds a corner, or takes it away.
    pub(super) fn set(&mut self, corner: u32, point: [f64; 2], present: bool) {
        let [x, y] = self.cell(point);
        let cell = &mut self.corners[y * self.size[0] + x];
        match cell.iter().position(|other| *other == corner) {
            Some(at) if !present => _ = cell.swap_remove(at),
            None if present => cell.push(corner),
            _ => {}
        }
    }

    /// The corners in the cells that the box of some points touches.
    pub(super) fn near(&self, points: &[[f64; 2]]) -> impl Iterator<Item = u32> + '_ {
        let [lower, upper] = bounds(points).map(|point| self.cell(point));
        let row = move |y: usize| &self.corners[y * self.size[0]..][lower[0]..=upper[0]];
        (lower[1]..=upper[1]).flat_map(row).flatten().copied()
    }
}

/// The smallest and the largest coordinates of points.
fn bounds(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let of = |pick: fn(f64, f64) -> f64, start| {
        [0, 1].map(|k| points.iter().map(|point| point[k]).fold(start, pick))
    };
    [of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY)]
}
