//! The part of world space that a sequence of frames occupies.

use bth::Scene;
use bth_format::object::ObjectView;
use glam::{DVec3, Vec3};

/// Frames of an animated scene whose bounds are united: enough to follow motion, few enough to be
/// quick.
const SAMPLED_FRAMES: i64 = 24;

/// Share of the vertices of a model, on each side of each axis, without which it is framed where
/// they make it [`DWARFED`].
const OUTLIERS: f64 = 0.01;
/// Vertices of a model that are looked at for that.
const SAMPLES: usize = 65_536;
/// How many times larger all is than what a picture should show, where the two differ.
const DWARFED: f64 = 4.0;
/// A floor is at most this thick relative to its length and width, and reaches at most as high.
const FLAT: f64 = 0.1;
/// Share of the height of a model within which a triangle belongs to its base.
const BASE: f64 = 0.01;

/// World bounds of everything that some frame shows.
#[derive(Clone, Debug)]
pub(crate) struct SceneBounds {
    pub(crate) lower: DVec3,
    pub(crate) upper: DVec3,
    /// Bounds of `points`.
    focus: (DVec3, DVec3),
    /// Points that a picture should show: the vertices of a model, or the corners of the bounds of
    /// instances; but not a plate, or far vertices, that would make a dot of all else.
    points: Vec<DVec3>,
    /// True if an instance below the others carries them.
    pub(crate) has_floor: bool,
    /// True for a model with a flat base across its z axis and none across y, which is upright
    /// if z points up.
    pub(crate) seems_to_lie: bool,
}

impl SceneBounds {
    /// The bounds of an animated scene, from frames spread evenly over `(first, last)`. They depend
    /// on the range of the whole scene only, so that every part of it is rendered with the same
    /// camera.
    pub(super) fn of_scene(scene: &mut Scene, (first, last): (i32, i32), vertical: DVec3) -> Self {
        let count = (i64::from(last) - i64::from(first) + 1).min(SAMPLED_FRAMES);
        let mut boxes = Vec::new();
        for sample in 0..count {
            let step =
                if count > 1 { sample * (i64::from(last) - i64::from(first)) / (count - 1) } else { 0 };
            // A frame that cannot be set is skipped here. Rendering it reports the error.
            if scene.set_frame(first + step as i32).is_err() {
                continue;
            }
            let visible = scene.visible_bounds().into_iter();
            boxes.extend(visible.map(|(lower, upper)| (to_f64(lower), to_f64(upper))));
        }
        let (lower, upper) = united(&boxes);
        let is_floor = |&(low, high): &(DVec3, DVec3)| {
            let size = high - low;
            let level = size.reject_from(vertical).to_array().into_iter().filter(|x| *x > 0.0);
            let top =
                (high - lower).dot(vertical) <= FLAT * (upper - lower).dot(vertical).max(size.dot(vertical));
            level.clone().count() == 2
                && level.fold(f64::INFINITY, f64::min) * FLAT >= size.dot(vertical)
                && top
        };
        let (floors, others): (Vec<_>, Vec<_>) = boxes.iter().copied().partition(is_floor);
        let area = |&(low, high): &(DVec3, DVec3)| {
            (high - low).reject_from(vertical).to_array().into_iter().filter(|x| *x > 0.0).product::<f64>()
        };
        let carries = |floor: &(DVec3, DVec3)| area(floor) >= 0.8 * area(&united(&others));
        let has_floor = !others.is_empty() && floors.iter().any(carries);
        let (low, high) = united(&others);
        let is_dwarfed = has_floor && (upper - lower).length() > DWARFED * (high - low).length();
        let (focus, shown) = if is_dwarfed { ((low, high), &others) } else { ((lower, upper), &boxes) };
        let points = shown.iter().flat_map(|(lower, upper)| corners(*lower, *upper)).collect();
        Self { lower, upper, focus, points, has_floor, seems_to_lie: false }.or_origin()
    }

    /// The bounds of a file with one object and no scene.
    pub(super) fn of_object(scene: &Scene) -> Self {
        let view = scene.object(0);
        let anchor = DVec3::from(view.anchor);
        let (lower, upper) = (anchor + to_f64(view.header.lower), anchor + to_f64(view.header.upper));
        let mut bounds = SceneBounds {
            lower,
            upper,
            focus: (lower, upper),
            points: Vec::new(),
            has_floor: false,
            seems_to_lie: lies_on_side(&view),
        };
        if view.header.triangles == 0 {
            return bounds.or_origin();
        }
        bounds.points = view.positions.iter().map(|p| anchor + to_f64(*p)).collect();
        if bounds.points.is_empty() {
            bounds.points = corners(lower, upper).collect();
        }
        let (low, high) = middle(&bounds.points);
        if (upper - lower).length() > DWARFED * (high - low).length() && low != high {
            let (low, high) = (low - (high - low) * 0.25, high + (high - low) * 0.25);
            bounds.points.retain(|p| (p.cmpge(low) & p.cmple(high)).all());
            bounds.focus = (low.max(lower), high.min(upper));
        }
        bounds
    }

    /// Returns true if no frame shows anything.
    pub(crate) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The origin instead of empty bounds, for a scene that shows nothing.
    fn or_origin(self) -> Self {
        if self.points.is_empty() {
            let origin = DVec3::ZERO;
            SceneBounds { lower: origin, upper: origin, focus: (origin, origin), ..self }
        } else {
            self
        }
    }

    /// The middle of what a picture should show.
    pub(crate) fn center(&self) -> DVec3 {
        (self.focus.0 + self.focus.1) / 2.0
    }

    /// Length of the diagonal of the bounds of what a picture should show; 1 if they are a point,
    /// so that it can be divided by.
    pub(crate) fn diagonal(&self) -> f64 {
        let length = (self.focus.1 - self.focus.0).length();
        if length > 0.0 { length } else { 1.0 }
    }

    /// Length of rays that leave the bounds of everything.
    pub(crate) fn reach(&self) -> f64 {
        4.0 * (self.upper - self.lower).length().max(self.diagonal())
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

/// Returns true if triangles fill a good part of the lower end of the bounds across z, and hardly
/// any of the one across y.
fn lies_on_side(view: &ObjectView<'_>) -> bool {
    let (lower, size) = (to_f64(view.header.lower), to_f64(view.header.upper) - to_f64(view.header.lower));
    let base = |axis: usize| -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| to_f64(view.positions[v as usize]));
            let is_low = a[axis].max(b[axis]).max(c[axis]) - lower[axis] <= BASE * size[axis];
            if is_low { -(b - a).cross(c - a)[axis] / 2.0 } else { 0.0 }
        };
        view.triangles.iter().map(area).filter(|area| *area > 0.0).sum()
    };
    base(2) > 0.3 * size.x * size.y && base(1) < 0.05 * size.x * size.z
}

/// The bounds of boxes; empty ones for none.
fn united(boxes: &[(DVec3, DVec3)]) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    boxes.iter().fold(empty, |(lower, upper), (low, high)| (lower.min(*low), upper.max(*high)))
}

fn corners(lower: DVec3, upper: DVec3) -> impl Iterator<Item = DVec3> {
    let pick = move |corner: usize, axis: usize| [lower, upper][(corner >> axis) & 1][axis];
    (0..8).map(move |corner| DVec3::new(pick(corner, 0), pick(corner, 1), pick(corner, 2)))
}

/// Bounds of points without [`OUTLIERS`]; all of them where there are few.
fn middle(points: &[DVec3]) -> (DVec3, DVec3) {
    let sample = |axis: usize| -> Vec<f64> {
        points.iter().step_by(points.len().div_ceil(SAMPLES)).map(|p| p[axis]).collect()
    };
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let mut values = sample(axis);
        values.sort_unstable_by(f64::total_cmp);
        let skipped = (values.len() as f64 * OUTLIERS) as usize;
        (low[axis], high[axis]) = (values[skipped], values[values.len() - 1 - skipped]);
    }
    (low, high)
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    Vec3::from_array(p).as_dvec3()
}
