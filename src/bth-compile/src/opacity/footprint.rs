//! The state of a part of a triangle, decided conservatively from all texels that its texture
//! coordinates can touch.

use super::texture::{Pyramid, Range, wrapped};
use bth_format::layout::Opacity;
use bth_import::{CutoutCorner, CutoutMaterial};

/// Relative bound on the difference between the coordinates of texels here and those that a
/// renderer computes in `f32` from the weights of the corners: eight roundings.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// Relative bound on what rounding changes in a product of interpolated alpha.
const PRODUCT_ROUNDING: f64 = 1.0 / (1u64 << 40) as f64;

/// Rows of texels up to which a part is followed row by row; of larger ones the bounding box is
/// taken.
const MAX_ROWS: f64 = 64.0;

/// Cells beyond this are not told apart well enough to be followed one by one.
const GREATEST_CELL: f64 = (1u64 << 50) as f64;

/// A material with the ranges of its texture.
pub(super) struct Surface<'a> {
    pub(super) material: &'a CutoutMaterial,
    pub(super) pyramid: Option<&'a Pyramid>,
}

/// A triangle in the texels of its material.
pub(super) struct Footprint<'a> {
    surface: &'a Surface<'a>,
    /// Coordinates of the corners: the cell of texels between centers k and k + 1 (of the nearest
    /// texel: from edge k to edge k + 1) goes from k to k + 1.
    corners: [[f64; 2]; 3],
    /// Bound on rounding, in texels.
    margin: [f64; 2],
    /// Vertex alpha of the corners.
    alpha: [f64; 3],
}

impl<'a> Footprint<'a> {
    pub(super) fn new(surface: &'a Surface<'a>, corners: &[CutoutCorner; 3]) -> Self {
        let size = surface.pyramid.map_or([1; 2], Pyramid::size).map(|n| n as f64);
        let shift = if surface.material.nearest { 0.0 } else { 0.5 };
        let greatest = |k: usize| corners.iter().map(|c| f64::from(c.uv[k]).abs()).fold(0.0, f64::max);
        Self {
            surface,
            corners: corners.map(|c| [0, 1].map(|k| f64::from(c.uv[k]) * size[k] - shift)),
            margin: [0, 1].map(|k| (greatest(k) * size[k] + shift) * ROUNDING),
            alpha: corners.map(|c| f64::from(c.alpha)),
        }
    }

    /// Returns true if all coordinates are numbers.
    pub(super) fn is_finite(&self) -> bool {
        self.corners.as_flattened().iter().all(|x| x.is_finite())
    }

    /// Texels that the triangle covers, and as many again as its longest side crosses.
    pub(super) fn texels(&self) -> f64 {
        let [a, b, c] = self.corners;
        let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        0.5 * cross.abs() + side(a, b).max(side(b, c)).max(side(c, a))
    }

    /// State of a part of the triangle, whose corners are given by the weights of the triangle's
    /// second and third corner. `thorough` follows it row by row where the bounding box does not
    /// decide.
    pub(super) fn state(&self, part: [[f64; 2]; 3], thorough: bool) -> Opacity {
        let [a, b, c] = self.corners;
        let corners = part.map(|[u, v]| [0, 1].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])));
        let [p, q, r] = self.alpha;
        let alpha = part.map(|[u, v]| p + u * (q - p) + v * (r - p));
        let (least, greatest) =
            (alpha.into_iter().fold(f64::INFINITY, f64::min), alpha.into_iter().fold(0.0, f64::max));
        let decide = |range: Range| self.decide(range, least, greatest);
        let Some(pyramid) = self.surface.pyramid else { return decide(Range::FULL) };
        let unknown = |range: Range| decide(range) == Opacity::Unknown;
        let state =
            decide(self.range(pyramid, [bounds(&corners, 0), bounds(&corners, 1)], Range::EMPTY, &unknown));
        let [top, bottom] = self.cells(1, bounds(&corners, 1));
        let few = bottom - top < MAX_ROWS && top.abs() < GREATEST_CELL;
        if state != Opacity::Unknown || !thorough || !few {
            return state;
        }
        let mut found = Range::EMPTY;
        let mut row = top;
        while row <= bottom {
            let band = [row - self.margin[1], row + 1.0 + self.margin[1]];
            if let Some(columns) = across(&corners, band) {
                // The middle of the row, so that no margin reaches into another one.
                found = self.range(pyramid, [columns, [row + 0.5; 2]], found, &unknown);
            }
            row += 1.0;
        }
        decide(found)
    }

    /// The first and last cell of an interval, widened by the margin.
    fn cells(&self, axis: usize, [first, last]: [f64; 2]) -> [f64; 2] {
        [(first - self.margin[axis]).floor(), (last + self.margin[axis]).floor()]
    }

    /// The range of the texels around a rectangle of coordinates, joined to `found`.
    fn range(
        &self,
        pyramid: &Pyramid,
        [columns, rows]: [[f64; 2]; 2],
        found: Range,
        unknown: &dyn Fn(Range) -> bool,
    ) -> Range {
        let material = self.surface.material;
        let beyond = if material.nearest { 0.0 } else { 1.0 };
        let texels = |axis: usize, interval: [f64; 2]| {
            let [first, last] = self.cells(axis, interval);
            wrapped(material.wrap[axis], first, last + beyond, pyramid.size()[axis])
        };
        let mut found = found;
        for rows in texels(1, rows) {
            for columns in texels(0, columns) {
                found = pyramid.range([columns, rows], found, unknown);
            }
        }
        found
    }

    /// State of what has texels of a range and vertex alpha from `least` to `greatest`.
    fn decide(&self, range: Range, least: f64, greatest: f64) -> Opacity {
        let CutoutMaterial { factor, cutoff, .. } = *self.surface.material;
        let constant = self.alpha == [1.0; 3];
        let rounding = if constant { 0.0 } else { PRODUCT_ROUNDING };
        let value = |texel: u8, alpha: f64| factor * (f64::from(texel) / 255.0) * alpha;
        if value(range.least, least) * (1.0 - rounding) >= cutoff {
            Opacity::Opaque
        } else if value(range.greatest, greatest) * (1.0 + rounding) < cutoff {
            Opacity::Transparent
        } else {
            Opacity::Unknown
        }
    }
}

fn bounds(corners: &[[f64; 2]; 3], axis: usize) -> [f64; 2] {
    let of = |pick: fn(f64, f64) -> f64| corners.iter().map(|p| p[axis]).reduce(pick).unwrap_or(f64::NAN);
    [of(f64::min), of(f64::max)]
}

/// The smallest and largest x of a triangle between two values of y; `None` where it has no point
/// there.
fn across(corners: &[[f64; 2]; 3], [top, bottom]: [f64; 2]) -> Option<[f64; 2]> {
    let mut found: Option<[f64; 2]> = None;
    let mut add = |x: f64| {
        let [least, greatest] = found.unwrap_or([x; 2]);
        found = Some([least.min(x), greatest.max(x)]);
    };
    for k in 0..3 {
        let ([ax, ay], [bx, by]) = (corners[k], corners[(k + 1) % 3]);
        if (top..=bottom).contains(&ay) {
            add(ax);
        }
        for y in [top, bottom] {
            if (ay < y) != (by < y) {
                add((ax + (y - ay) / (by - ay) * (bx - ax)).clamp(ax.min(bx), ax.max(bx)));
            }
        }
    }
    found
}
