//! The part of world space that a sequence of frames occupies.

use bth::Scene;
use glam::{DVec3, Vec3};

/// Frames of an animated scene whose bounds are united: enough to follow motion, few enough to be
/// quick.
const SAMPLED_FRAMES: i64 = 24;

/// World bounds of everything that some frame shows.
#[derive(Clone, Debug)]
pub(crate) struct SceneBounds {
    pub(crate) lower: DVec3,
    pub(crate) upper: DVec3,
    /// Points that a picture should show: the vertices of a model, or the corners of the bounds of
    /// instances.
    points: Vec<DVec3>,
}

impl SceneBounds {
    /// The bounds of an animated scene, from frames spread evenly over `(first, last)`. They depend
    /// on the range of the whole scene only, so that every part of it is rendered with the same
    /// camera.
    pub(super) fn of_scene(scene: &mut Scene, (first, last): (i32, i32)) -> Self {
        let count = (i64::from(last) - i64::from(first) + 1).min(SAMPLED_FRAMES);
        let mut bounds =
            SceneBounds { lower: DVec3::INFINITY, upper: DVec3::NEG_INFINITY, points: Vec::new() };
        for sample in 0..count {
            let step =
                if count > 1 { sample * (i64::from(last) - i64::from(first)) / (count - 1) } else { 0 };
            // A frame that cannot be set is skipped here. Rendering it reports the error.
            if scene.set_frame(first + step as i32).is_err() {
                continue;
            }
            for (lower, upper) in (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i)) {
                bounds.add(to_f64(lower), to_f64(upper));
            }
        }
        bounds.or_origin()
    }

    /// The bounds of a file with one object and no scene.
    pub(super) fn of_object(scene: &Scene) -> Self {
        let view = scene.object(0);
        let anchor = DVec3::from(view.anchor);
        let (lower, upper) = (anchor + to_f64(view.header.lower), anchor + to_f64(view.header.upper));
        if view.header.triangles == 0 {
            return SceneBounds { lower, upper, points: Vec::new() }.or_origin();
        }
        let points = view.positions.iter().map(|p| anchor + to_f64(*p)).collect();
        let mut bounds = SceneBounds { lower, upper, points };
        if bounds.points.is_empty() {
            bounds.add(lower, upper);
        }
        bounds
    }

    fn add(&mut self, lower: DVec3, upper: DVec3) {
        self.lower = self.lower.min(lower);
        self.upper = self.upper.max(upper);
        for corner in 0..8 {
            let pick = |axis: usize| [lower, upper][(corner >> axis) & 1][axis];
            self.points.push(DVec3::new(pick(0), pick(1), pick(2)));
        }
    }

    /// Returns true if no frame shows anything.
    pub(crate) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The origin instead of empty bounds, for a scene that shows nothing.
    fn or_origin(self) -> Self {
        if self.points.is_empty() {
            SceneBounds { lower: DVec3::ZERO, upper: DVec3::ZERO, ..self }
        } else {
            self
        }
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.lower + self.upper) / 2.0
    }

    /// Length of the diagonal of the bounds; 1 if they are a point, so that it can be divided by.
    pub(crate) fn diagonal(&self) -> f64 {
        let length = (self.upper - self.lower).length();
        if length > 0.0 { length } else { 1.0 }
    }

    /// The points that a picture should show.
    pub(super) fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Returns true if a point lies strictly inside the bounds.
    pub(super) fn contains(&self, point: DVec3) -> bool {
        (point.cmpgt(self.lower) & point.cmplt(self.upper)).all()
    }
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    Vec3::from_array(p).as_dvec3()
}
