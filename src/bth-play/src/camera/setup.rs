//! What all frames of a sequence share: the bounds of the scene and the choice of the camera.

use super::bounds::SceneBounds;
use super::interior::interior_camera;
use super::placement::exterior_camera;
use super::placement::scene_camera;
use super::projection::{Camera, front_and_up, up_vector};
use crate::args::{Args, Mode, View};
use crate::environment::Environment;
use crate::failure::Failure;
use crate::materials::SceneMaterials;
use crate::sampling::fibonacci_sphere;
use crate::smooth::SmoothNormals;
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_format::layout::NONE;
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

/// Where the camera of a frame comes from.
#[derive(Clone, Copy, Debug)]
enum CameraSource {
    /// The same camera in all frames.
    Fixed(Camera),
    /// The camera in this row of the scene's table, which may move.
    Scene(u32),
}

/// Bounds and camera, the same for all frames of a sequence.
#[derive(Clone, Debug)]
pub(crate) struct SceneSetup {
    pub(crate) bounds: SceneBounds,
    source: CameraSource,
    /// True if the camera is inside a room.
    pub(crate) interior: bool,
    /// True if the camera is inside something solid, and nobody asked for that.
    pub(crate) is_within_solid: bool,
    /// Materials, for modes that show them.
    pub(crate) materials: Arc<SceneMaterials>,
    /// Smooth normals of each object, for modes that show them.
    pub(crate) smooth: Arc<Vec<SmoothNormals>>,
    /// The surroundings that the options name.
    pub(crate) environment: Option<Arc<Environment>>,
}

impl SceneSetup {
    /// Chooses bounds and camera for the frames of `range`; the scene is left at the first of them.
    ///
    /// # Errors
    /// If the file has nothing to show, has no camera of the wanted name, or its first frame cannot
    /// be set.
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
        let bounds = match is_scene {
            true => SceneBounds::of_scene(scene, range, up_vector(args.up())),
            false => SceneBounds::of_object(scene),
        };
        scene.set_frame(range.0)?;
        let source = match chosen_scene_camera(scene, file, args)? {
            Some(row) => CameraSource::Scene(row),
            None if args.inside => CameraSource::Fixed(interior_camera(scene, &bounds, args)),
            None => CameraSource::Fixed(exterior_camera(args, &bounds)),
        };
        let shows_materials = args.window || args.mode.shows_materials();
        let materials =
            if shows_materials { SceneMaterials::load(scene, file) } else { SceneMaterials::default() };
        let environment = args.env.as_deref().map(|path| read_environment(path, args)).transpose()?;
        let smooth = |object: u32| match scene.vertex_count(object) {
            // Where vertices move, normals at rest would be wrong.
            Some(_) => SmoothNormals::default(),
            None => SmoothNormals::new(&scene.object(object), args.smooth),
        };
        let is_smooth = args.window || !matches!(args.mode, Mode::Ao | Mode::Steps | Mode::Instances);
        let smooth = match is_smooth && args.smooth > 0.0 {
            true => (0..scene.object_count()).map(smooth).collect(),
            false => Vec::new(),
        };
        let smooth = Arc::new(smooth);
        let (materials, environment) = (Arc::new(materials), environment.map(Arc::new));
        let mut setup = SceneSetup {
            bounds,
            source,
            interior: false,
            is_within_solid: false,
            materials,
            smooth,
            environment,
        };
        let eye = setup.camera(scene, args).eye;
        let (blocked, backs) = if setup.bounds.contains(eye) { seen_around(scene, eye) } else { (0.0, 0.0) };
        setup.interior = args.inside || blocked > ENCLOSED;
        setup.is_within_solid = !args.inside && backs > ENCLOSED;
        Ok(setup)
    }

    /// The row of the scene's camera that is used, if one is.
    pub(crate) fn scene_camera_row(&self) -> Option<u32> {
        match self.source {
            CameraSource::Fixed(_) => None,
            CameraSource::Scene(row) => Some(row),
        }
    }

    /// Returns true if the camera of the scene that is used has no field of view.
    pub(crate) fn is_orthographic(&self, scene: &Scene) -> bool {
        let lens = |row: u32| scene.description().map(|view| view.cameras[row as usize].projection == 1);
        self.scene_camera_row().and_then(lens).unwrap_or(false)
    }

    /// The camera at the time to which the scene is set.
    pub(crate) fn camera(&self, scene: &Scene, args: &Args) -> Camera {
        match self.source {
            CameraSource::Fixed(camera) => camera,
            CameraSource::Scene(row) => scene_camera(scene, row, args),
        }
    }
}

/// The surroundings of the option --env.
fn read_environment(path: &Path, args: &Args) -> Result<Environment, Failure> {
    if !args.window && args.mode != Mode::Path {
        return Err(Failure::Usage(format!("--env is for --mode path, found --mode {}", args.mode.name())));
    }
    let [front, vertical] = front_and_up(args.up());
    Environment::read(path, front, vertical)
}

/// The row of the scene's camera that the options name, or else of the scene's default camera.
fn chosen_scene_camera(scene: &Scene, file: &Path, args: &Args) -> Result<Option<u32>, Failure> {
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

/// The share of directions in which a camera must see surfaces, or the backs of surfaces, to be in
/// a room, or inside something solid.
const ENCLOSED: f64 = 0.8;

/// The shares of all directions around an eye in which there are surfaces, and backs of surfaces.
fn seen_around(scene: &Scene, eye: DVec3) -> (f64, f64) {
    const DIRECTIONS: u32 = 256;
    let directions: Vec<DVec3> = fibonacci_sphere(DIRECTIONS).collect();
    let ray = |d: &DVec3| Ray::new(eye.as_vec3().to_array(), d.as_vec3().to_array());
    let rays: Vec<Ray> = directions.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(&rays).nearest(&mut hits);
    let is_back = |(hit, direction): (&Hit, &DVec3)| {
        let normal = scene.surface(hit).map(|surface| DVec3::from_array(surface.geometric_normal));
        normal.is_some_and(|normal| normal.dot(*direction) > 0.0)
    };
    let share = |count: usize| count as f64 / f64::from(DIRECTIONS);
    let backs = hits.iter().zip(&directions).filter(|seen| is_back(*seen)).count();
    (share(hits.iter().filter(|hit| hit.is_hit()).count()), share(backs))
}
