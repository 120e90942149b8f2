//! The ground below what is shown: an endless plane that fades away from it.

use crate::args::Args;
use crate::camera::{SceneBounds, up_vector};
use glam::DVec3;

/// Rays that descend less, relative to their length, end at the horizon and reach no ground.
const HORIZON: f64 = 1e-6;
/// Diagonals from the middle beyond which the ground is too faint to be seen, and at which e times
/// less of it is seen than in the middle.
const FARTHEST: f64 = 3.0;
const FADED: f64 = 1.1;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Ground {
    vertical: DVec3,
    /// Height along the vertical.
    height: f64,
    center: DVec3,
    diagonal: f64,
}

impl Ground {
    /// The ground of a scene; `None` for scenes with a floor, and where nobody wants any.
    pub(super) fn new(bounds: &SceneBounds, args: &Args) -> Option<Self> {
        let vertical = up_vector(args.up());
        let is_wanted = !args.no_ground && !bounds.has_floor && !bounds.is_empty();
        is_wanted.then(|| Self {
            vertical,
            height: bounds.lower.dot(vertical),
            center: bounds.center(),
            diagonal: bounds.diagonal(),
        })
    }

    /// Where a ray reaches the ground, its normal there, and how much of the ground is seen, up to
    /// 1.
    pub(super) fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(DVec3, DVec3, f64)> {
        let (above, descent) = (origin.dot(self.vertical) - self.height, -direction.dot(self.vertical));
        if above <= 0.0 || descent <= HORIZON {
            return None;
        }
        let point = origin + direction * (above / descent);
        let away = (point - self.center).reject_from_normalized(self.vertical).length() / self.diagonal;
        (away < FARTHEST).then(|| (point, self.vertical, (-(away / FADED).powi(2)).exp()))
    }
}
