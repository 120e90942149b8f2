//! What all frames of a sequence share: the bounds of the scene and the choice of the camera.

use super::bounds::SceneBounds;
use super::interior::interior_camera;
use super::placement::exterior_camera;
use super::placement::scene_camera;
use super::projection::{Camera, front_and_up};
use crate::args::{Args, Mode, View};
use crate::environment::Environment;
use crate::failure::Failure;
use crate::materials::SceneMaterials;
use crate::sampling::fibonacci_sphere;
use bth::Scene;
use bth::rays::Ray;
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
    /// Materials, for modes that show them.
    pub(crate) materials: Arc<SceneMaterials>,
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
        let bounds =
            if is_scene { SceneBounds::of_scene(scene, range) } else { SceneBounds::of_object(scene) };
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
        let (materials, environment) = (Arc::new(materials), environment.map(Arc::new));
        let mut setup = SceneSetup { bounds, source, interior: false, materials, environment };
        let eye = setup.camera(scene, args).eye;
        // The floor of a scene may extend far beyond its objects, so being within the bounds does
        // not make a room.
        setup.interior = args.inside || setup.bounds.contains(eye) && (!is_scene || is_enclosed(scene, eye));
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
    let [front, vertical] = front_and_up(args.up);
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

/// Returns true if rays in more than nine tenths of all directions hit something, as between walls
/// and a ceiling.
fn is_enclosed(scene: &Scene, eye: DVec3) -> bool {
    const DIRECTIONS: u32 = 256;
    let ray = |d: DVec3| Ray::new(eye.as_vec3().to_array(), d.as_vec3().to_array());
    let rays: Vec<Ray> = fibonacci_sphere(DIRECTIONS).map(ray).collect();
    let mut blocked = vec![false; rays.len()];
    scene.batch(&rays).any(&mut blocked);
    blocked.iter().filter(|b| **b).count() as u32 > DIRECTIONS * 9 / 10
}
