//! What all samples of a frame share, and what is counted while they are shaded.

use super::bsdf::Bsdf;
use super::geometry::ShadingGeometry;
use super::ground::Ground;
use crate::args::{Args, Mode};
use crate::camera::{Camera, CameraRay, SceneBounds, SceneSetup};
use crate::environment::Environment;
use crate::failure::Failure;
use crate::materials::{Look, SceneMaterials};
use crate::sampling::Sampler;
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef};
use bth_random::mix;
use glam::{DVec2, DVec3, DVec4, Vec3};
use std::path::Path;
use std::sync::OnceLock;

/// The materials of modes that show none.
static NO_MATERIALS: OnceLock<SceneMaterials> = OnceLock::new();

/// A scene at one time, seen by a camera.
pub(crate) struct FrameContext<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) geometry: ShadingGeometry<'a>,
    /// Empty in modes that show none.
    pub(crate) materials: &'a SceneMaterials,
    /// The surroundings in mode path.
    pub(crate) environment: Option<&'a Environment>,
    /// Bounds of all frames of the sequence.
    pub(crate) bounds: &'a SceneBounds,
    pub(crate) camera: Camera,
    /// True if the camera is inside a room.
    pub(crate) interior: bool,
    /// Length of ambient-occlusion rays, in world units.
    pub(crate) occlusion_distance: f64,
    pub(crate) ground: Option<Ground>,
    pub(crate) args: &'a Args,
}

/// One sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) sampler: Sampler,
    /// Number of the sample within its pixel, from 0.
    pub(crate) index: u32,
    /// Point of the picture, from (-1, -1) lower left to (1, 1) upper right.
    pub(crate) at: DVec2,
    pub(crate) ray: CameraRay,
}

/// Decides by chance if a ray passes a surface of alpha mode BLEND: a sample of a pixel, and a
/// number for each ray of the sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub(crate) sampler: Sampler,
    /// Number of the sample within its pixel.
    pub(crate) index: u32,
    /// Number of the ray within its sample.
    pub(crate) ray: u64,
}

impl Chance {
    /// A number from 0 to below 1 for a surface: low-discrepancy over the samples of a pixel.
    pub(crate) fn at(&self, primitive: PrimitiveRef) -> f32 {
        let surface = mix(u64::from(primitive.instance) << 32 | u64::from(primitive.triangle));
        self.sampler.point(surface ^ mix(self.ray), self.index).x as f32
    }
}

/// A shaded sample.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shaded {
    /// Linear.
    pub(crate) color: Vec3,
    /// The albedo and the normal of what the ray of the camera hits, in mode path: what tells edges
    /// from noise.
    pub(crate) albedo: Vec3,
    pub(crate) normal: Vec3,
    /// The square of the luminance of the colour, in mode path.
    pub(crate) square: f32,
}

impl Shaded {
    /// A colour alone.
    pub(super) fn plain(color: Vec3) -> Self {
        Self { color, ..Self::default() }
    }

    /// Notes what the ray of the camera hits; `None` for the surroundings.
    pub(super) fn describe(&mut self, bsdf: Option<&Bsdf>) {
        self.albedo = bsdf.map_or(Vec3::ONE, Bsdf::albedo);
        self.normal = bsdf.map_or(Vec3::ZERO, |bsdf| bsdf.normal().as_vec3());
    }
}

impl std::ops::AddAssign for Shaded {
    fn add_assign(&mut self, other: Self) {
        self.color += other.color;
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.square += other.square;
    }
}

impl std::ops::Div<f32> for Shaded {
    type Output = Self;

    fn div(self, by: f32) -> Self {
        let Self { color, albedo, normal, square } = self;
        Self { color: color / by, albedo: albedo / by, normal: normal / by, square: square / by }
    }
}

/// Rays and traversal steps, summed over the samples of a tile or frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counters {
    /// Nearest-hit rays of bounces.
    pub(crate) nearest_rays: u64,
    /// Any-hit rays: shadow and occlusion rays.
    pub(crate) any_rays: u64,
    /// Nodes, leaves, triangles and tetrahedra of camera rays, in mode steps only.
    pub(crate) steps: DVec4,
}

impl<'a> FrameContext<'a> {
    /// A scene at the time to which it is set, seen by a camera.
    ///
    /// # Errors
    /// If the file lacks what the mode needs.
    pub(crate) fn new(
        scene: &'a Scene,
        file: &Path,
        setup: &'a SceneSetup,
        camera: Camera,
        args: &'a Args,
    ) -> Result<Self, Failure> {
        let geometry = ShadingGeometry::new(scene, &setup.smooth);
        if !matches!(args.mode, Mode::Steps) {
            geometry.require_triangles(file)?;
        }
        let interior = setup.interior;
        let occlusion_distance = setup.bounds.diagonal() * if interior { 0.08 } else { 0.5 };
        let materials = match args.mode {
            Mode::Shaded | Mode::Path => &setup.materials,
            _ => NO_MATERIALS.get_or_init(SceneMaterials::default),
        };
        let (environment, bounds) = (setup.environment.as_deref(), &setup.bounds);
        let ground = Ground::new(bounds, args).filter(|_| !interior);
        Ok(Self {
            scene,
            geometry,
            materials,
            environment,
            bounds,
            camera,
            interior,
            occlusion_distance,
            ground,
            args,
        })
    }

    /// The sample of a pixel; the ray goes through the middle of the pixel, or through a random
    /// point of it.
    pub(crate) fn sample(&self, (x, y): (u32, u32), index: u32, centered: bool) -> Sample {
        let sampler = Sampler::new(x, y);
        let within = if centered { DVec2::splat(0.5) } else { sampler.point(0, index) };
        let (width, height) = self.args.size;
        let part = (DVec2::new(f64::from(x), f64::from(y)) + within)
            / DVec2::new(f64::from(width), f64::from(height));
        let at = DVec2::new(2.0 * part.x - 1.0, 1.0 - 2.0 * part.y);
        Sample { sampler, index, at, ray: self.camera.ray(at) }
    }

    /// The shading normal at a hit, on the side of the geometric one.
    pub(crate) fn shading_normal(&self, hit: &Hit, geometric: DVec3, look: &Look) -> DVec3 {
        let smooth = self.geometry.shading_normal(hit, geometric);
        if look.normal.is_none() {
            return smooth;
        }
        // Textures are about the front.
        let side = if self.geometry.is_front_normal(hit.primitive, geometric) { 1.0 } else { -1.0 };
        let view = self.geometry.object(hit.primitive);
        let mapped = self.materials.mapped_normal(self.scene, view, hit, look, smooth * side);
        mapped.map_or(smooth, |normal| normal * side)
    }

    /// The point of a camera ray's hit and the geometric normal there, on the side of the camera.
    pub(crate) fn point_and_normal(&self, sample: &Sample, hit: &Hit) -> (DVec3, DVec3) {
        let point = sample.ray.origin + sample.ray.direction * f64::from(hit.t);
        (point, self.geometry.geometric_normal(hit.primitive, -sample.ray.direction))
    }
}

impl Sample {
    /// What decides by chance for a ray of the sample; the ray of the camera has the number 0.
    pub(crate) fn chance(&self, ray: u64) -> Chance {
        Chance { sampler: self.sampler, index: self.index, ray }
    }
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.nearest_rays += other.nearest_rays;
        self.any_rays += other.any_rays;
        self.steps += other.steps;
    }
}
