//! The source's geometry, as kept in the file: points and normals.

use crate::failure::Failure;
use bth::object::ObjectView;
use bth::rays::Hit;
use glam::DVec3;
use std::path::Path;

/// The shape of a model. Computed in f64, so that no product of two f32 lengths overflows or underflows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape<'a> {
    view: ObjectView<'a>,
    /// Bounds of what can be hit.
    pub(crate) lower: DVec3,
    pub(crate) upper: DVec3,
}

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

impl<'a> Shape<'a> {
    pub(crate) fn new(view: ObjectView<'a>) -> Self {
        Self { view, lower: wide(view.header.lower), upper: wide(view.header.upper) }
    }

    /// Fails when the file was compiled without the source's geometry, which normals need.
    pub(crate) fn require_geometry(&self, file: &Path) -> Result<(), Failure> {
        if self.view.triangles.len() == self.view.header.triangles as usize {
            return Ok(());
        }
        Err(Failure::Lacks {
            file: file.into(),
            what: "the file has no positions and triangles, which this mode needs for normals",
            hint: "compile the model without --no-geometry, or use --mode steps",
        })
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.lower + self.upper) / 2.0
    }

    /// Length of the diagonal of the bounds; 1 for a point, so that it can be divided by.
    pub(crate) fn diagonal(&self) -> f64 {
        let length = (self.upper - self.lower).length();
        if length > 0.0 { length } else { 1.0 }
    }

    /// Calls for all positions, or for the corners of the bounds when the file has none.
    pub(crate) fn for_each_point(&self, mut f: impl FnMut(DVec3)) {
        if self.view.positions.is_empty() {
            for corner in 0..8 {
                let pick = |axis: usize| [self.lower, self.upper][(corner >> axis) & 1][axis];
                f(DVec3::new(pick(0), pick(1), pick(2)));
            }
        }
        self.view.positions.iter().for_each(|p| f(wide(*p)));
    }

    /// The geometric normal of a hit triangle: unit, on the side that `towards` points to.
    pub(crate) fn geometric_normal(&self, triangle: u32, towards: DVec3) -> DVec3 {
        let [a, b, c] = self.view.triangles[triangle as usize].map(|v| wide(self.view.positions[v as usize]));
        // Scaled first: the cross product of edges of 1e-20 is still far from underflow in f64,
        // but the square of its length is not.
        let (e, f) = ((b - a) / self.diagonal(), (c - a) / self.diagonal());
        let normal = e.cross(f).try_normalize().unwrap_or(towards);
        if normal.dot(towards) < 0.0 { -normal } else { normal }
    }

    /// The interpolated normal of the source on the side of the geometric one, or the geometric
    /// one when the source has none.
    pub(crate) fn shading_normal(&self, hit: &Hit, geometric: DVec3) -> DVec3 {
        let Some(corners) = self.view.corners.get(hit.surface.triangle as usize) else { return geometric };
        if self.view.normals.is_empty() {
            return geometric;
        }
        let [a, b, c] = corners.map(|row| wide(self.view.normals[row as usize]));
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        match (a * (1.0 - u - v) + b * u + c * v).try_normalize() {
            Some(normal) if normal.dot(geometric) < 0.0 => -normal,
            Some(normal) => normal,
            None => geometric,
        }
    }
}
