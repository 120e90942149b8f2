//! What all frames of a sequence share: the space that they take and how the camera stands.

use crate::args::{Args, View};
use crate::camera::{self, Camera};
use crate::failure::Failure;
use crate::inside;
use crate::sampling::sphere;
use crate::surface::wide;
use bth::Scene;
use bth::rays::Ray;
use bth_format::layout::NONE;
use glam::DVec3;
use std::path::Path;

/// Frames that are looked at to find the space that a sequence takes.
const LOOKS: i64 = 24;

/// The space that the frames take.
#[derive(Clone, Debug)]
pub(crate) struct Space {
    /// World bounds of all that can be seen in some frame.
    pub(crate) lower: DVec3,
    /// Upper end.
    pub(crate) upper: DVec3,
    /// Points that a picture should show: those of a model, or corners of the boxes of instances.
    points: Vec<DVec3>,
}

impl Space {
    /// Looks at some frames of a range, the same ones whatever part of it is rendered.
    fn of_scene(scene: &mut Scene, (first, last): (i32, i32)) -> Self {
        let count = (i64::from(last) - i64::from(first) + 1).min(LOOKS);
        let mut space = Space { lower: DVec3::INFINITY, upper: DVec3::NEG_INFINITY, points: Vec::new() };
        for look in 0..count {
            let step = if count > 1 { look * (i64::from(last) - i64::from(first)) / (count - 1) } else { 0 };
            // One that cannot be shown is for those to tell who render it.
            if scene.set_frame(first + step as i32).is_err() {
                continue;
            }
            for (lower, upper) in (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i)) {
                space.add(wide(lower), wide(upper));
            }
        }
        space.or_point()
    }

    /// Of a file with one object, as it is.
    fn of_object(scene: &Scene) -> Self {
        let view = scene.object(0);
        let (lower, upper) = (wide(view.header.lower), wide(view.header.upper));
        let points = view.positions.iter().map(|p| wide(*p)).collect();
        let mut space = Space { lower, upper, points };
        if space.points.is_empty() {
            space.add(lower, upper);
        }
        space
    }

    fn add(&mut self, lower: DVec3, upper: DVec3) {
        self.lower = self.lower.min(lower);
        self.upper = self.upper.max(upper);
        for corner in 0..8 {
            let pick = |axis: usize| [lower, upper][(corner >> axis) & 1][axis];
            self.points.push(DVec3::new(pick(0), pick(1), pick(2)));
        }
    }

    /// Nothing to be seen takes the space of a point.
    fn or_point(self) -> Self {
        if self.points.is_empty() { Space { lower: DVec3::ZERO, upper: DVec3::ZERO, ..self } } else { self }
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.lower + self.upper) / 2.0
    }

    /// Length of the diagonal of the bounds; 1 for a point, so that it can be divided by.
    pub(crate) fn diagonal(&self) -> f64 {
        let length = (self.upper - self.lower).length();
        if length > 0.0 { length } else { 1.0 }
    }

    /// Calls for all points that a picture should show.
    pub(crate) fn for_each_point(&self, f: impl FnMut(DVec3)) {
        self.points.iter().copied().for_each(f);
    }
}

/// How the camera stands.
#[derive(Clone, Copy, Debug)]
enum Stand {
    /// The same in all frames.
    Fixed(Camera),
    /// With a camera of the scene, by row.
    Carried(u32),
}

/// What all frames share.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    pub(crate) space: Space,
    stand: Stand,
    /// Whether the camera stands in a room.
    pub(crate) interior: bool,
}

impl Stage {
    /// Looks at the frames of a sequence; the scene is left at its first.
    pub(crate) fn new(
        scene: &mut Scene,
        file: &Path,
        args: &Args,
        range: (i32, i32),
    ) -> Result<Self, Failure> {
        let is_scene = scene.description().is_some();
        if scene.object_count() == 0 && !is_scene {
            let what = "the file has no objects";
            return Err(Failure::Lacks { file: file.into(), what, hint: "compile a model" });
        }
        let space = if is_scene { Space::of_scene(scene, range) } else { Space::of_object(scene) };
        scene.set_frame(range.0)?;
        let stand = match named(scene, file, args)? {
            Some(row) => Stand::Carried(row),
            None if args.inside => Stand::Fixed(inside::camera(scene, &space, args)),
            None => Stand::Fixed(Camera::outside(args, &space)),
        };
        let mut stage = Stage { space, stand, interior: false };
        let eye = stage.camera(scene, args).eye;
        let within = (eye.cmpgt(stage.space.lower) & eye.cmplt(stage.space.upper)).all();
        // A scene's floor reaches far: walls and ceiling are what makes a room of it.
        stage.interior = args.inside || within && (!is_scene || is_room(scene, eye));
        Ok(stage)
    }

    /// The camera of the scene that it stands with, if any.
    pub(crate) fn carrier(&self) -> Option<u32> {
        match self.stand {
            Stand::Fixed(_) => None,
            Stand::Carried(row) => Some(row),
        }
    }

    /// The camera at the scene's time.
    pub(crate) fn camera(&self, scene: &Scene, args: &Args) -> Camera {
        match self.stand {
            Stand::Fixed(camera) => camera,
            Stand::Carried(row) => camera::carried(scene, row, args),
        }
    }
}

/// The camera of the scene that is asked for or is its first choice.
fn named(scene: &Scene, file: &Path, args: &Args) -> Result<Option<u32>, Failure> {
    let view = scene.description();
    match (&args.camera, view) {
        (Some(View::Points(_)), _) => Ok(None),
        (Some(View::Named(name)), None) => Err(Failure::Usage(format!(
            "{} has no cameras; expected eye and target (six numbers), found {name:?}",
            file.display()
        ))),
        (Some(View::Named(name)), Some(view)) => {
            let rows = 0..view.cameras.len() as u32;
            let found = rows.clone().find(|row| view.camera_name(*row) == name);
            found.map(Some).ok_or_else(|| {
                let names: Vec<_> = rows.map(|row| format!("{:?}", view.camera_name(row))).collect();
                Failure::Usage(format!(
                    "{} has no camera {name:?}; its cameras are {}",
                    file.display(),
                    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
                ))
            })
        }
        (None, Some(view)) if !args.inside && args.yaw.is_none() && args.pitch.is_none() => {
            Ok(Some(view.scene[0].camera).filter(|row| *row != NONE))
        }
        (None, _) => Ok(None),
    }
}

/// Whether something stands in nearly all directions.
fn is_room(scene: &Scene, eye: DVec3) -> bool {
    const DIRECTIONS: u32 = 256;
    let ray = |d: DVec3| Ray {
        origin: eye.as_vec3().to_array(),
        tmin: 0.0,
        direction: d.as_vec3().to_array(),
        tmax: f32::INFINITY,
    };
    let rays: Vec<Ray> = sphere(DIRECTIONS).map(ray).collect();
    let mut blocked = vec![false; rays.len()];
    scene.any_batch(&rays, None, &mut blocked);
    blocked.iter().filter(|b| **b).count() as u32 > DIRECTIONS * 9 / 10
}
