//! Mode path: path tracing with the scene's lights, sun and sky, or surroundings. Each bounce of
//! all samples of a tile is one batch of rays, which start at the hits of the last one, and one of
//! rays that start on the ground.

use super::context::{Chance, Counters, FrameContext, Sample, Shaded};
use super::lights::{LightSample, Lights};
use super::surface::Surface;
use super::visibility::{self, OcclusionRays};
use crate::color::luminance;
use bth::rays::{Hit, Ray, Start, StartRay};
use glam::{DVec3, Vec3};

/// Dimension pairs of sample points for each bounce, after the one of the camera.
const DIMENSIONS: u64 = 4;
/// Numbers of rays for each bounce, for [`Sample::chance`].
const RAYS: u64 = 1 << 20;

/// Largest radiance that a path brings after its first bounce: rare brighter ones would be specks.
const BRIGHTEST: f32 = 3.0;

/// A path that has not ended.
struct PathState {
    /// Index of its sample.
    sample: usize,
    /// Product of the shares of light that are scattered along the path.
    throughput: Vec3,
    /// Where its next ray starts: the point, and the same as a point of a triangle, if it is one.
    origin: DVec3,
    start: Start,
    direction: DVec3,
    /// Density with which its direction was chosen, with regard to solid angle; `None` for rays of
    /// the camera.
    density: Option<f64>,
}

/// Shades a batch of samples.
pub(super) fn shade(
    frame: &FrameContext<'_>,
    lights: &Lights<'_>,
    samples: &[Sample],
    hits: &[Hit],
    counters: &mut Counters,
) -> Vec<Shaded> {
    let mut shaded = vec![Shaded::default(); samples.len()];
    let start = |(sample, s): (usize, &Sample)| PathState {
        sample,
        throughput: Vec3::ONE,
        origin: s.ray.origin,
        start: Start::NONE,
        direction: s.ray.direction,
        density: None,
    };
    let mut paths: Vec<PathState> = samples.iter().enumerate().map(start).collect();
    let mut hits = hits.to_vec();
    for number in 0..=frame.args.bounces() {
        let most = if number == 0 { f32::INFINITY } else { BRIGHTEST };
        let dimmed = |light: Vec3| light * (most / light.max_element().max(most));
        let mut bounce = Bounce::new(frame, lights, samples, number);
        for (path, hit) in paths.iter().zip(&hits) {
            let (light, surface) = bounce.meet(path, hit);
            let light = path.throughput * light;
            shaded[path.sample].color += if number == 0 { light } else { dimmed(light) };
            if number == 0 {
                shaded[path.sample].describe(surface.as_ref().and_then(|surface| surface.bsdf.as_ref()));
            }
        }
        let Bounce { from_surfaces, from_ground, next, .. } = bounce;
        counters.any_rays += (from_surfaces.rays.len() + from_ground.rays.len()) as u64;
        for (sample, light) in from_surfaces.unblocked(frame).chain(from_ground.unblocked(frame)) {
            shaded[sample].color += if number == 0 { light } else { dimmed(light) };
        }
        hits = trace(frame, &next, samples, number);
        counters.nearest_rays += hits.len() as u64;
        paths = next;
    }
    shaded.iter_mut().for_each(|shaded| shaded.square = (luminance(shaded.color) as f32).powi(2));
    shaded
}

/// Traces the paths of a batch after bounce `number`. Returns their hits.
fn trace(frame: &FrameContext<'_>, paths: &[PathState], samples: &[Sample], number: u32) -> Vec<Hit> {
    let chance = |path: &PathState| samples[path.sample].chance(RAYS * (u64::from(number) + 1));
    let is_on_ground = |path: &PathState| path.start == Start::NONE;
    let (ground, surfaces): (Vec<usize>, Vec<usize>) =
        (0..paths.len()).partition(|row| is_on_ground(&paths[*row]));
    let direction = |path: &PathState| path.direction.as_vec3().to_array();
    let mut all = vec![Hit::MISS; paths.len()];
    let from_surfaces: Vec<StartRay> =
        surfaces.iter().map(|row| paths[*row].start.ray(direction(&paths[*row]))).collect();
    let from_ground: Vec<Ray> = ground
        .iter()
        .map(|row| Ray::new(paths[*row].origin.as_vec3().to_array(), direction(&paths[*row])))
        .collect();
    let mut hits = vec![Hit::MISS; surfaces.len()];
    visibility::nearest(frame, &from_surfaces, None, |k| chance(&paths[surfaces[k]]), &mut hits);
    surfaces.iter().zip(hits).for_each(|(row, hit)| all[*row] = hit);
    let mut hits = vec![Hit::MISS; ground.len()];
    visibility::nearest(frame, &from_ground, None, |k| chance(&paths[ground[k]]), &mut hits);
    ground.iter().zip(hits).for_each(|(row, hit)| all[*row] = hit);
    all
}

/// Shadow rays.
struct ShadowRays<R> {
    rays: OcclusionRays<R>,
    /// For each ray its sample, and the light that it brings if it is not blocked.
    contributions: Vec<(usize, Vec3)>,
}

impl<R: bth::TraceRay> ShadowRays<R> {
    fn new() -> Self {
        Self { rays: OcclusionRays::new(), contributions: Vec::new() }
    }

    fn push(&mut self, ray: R, chance: Chance, contribution: (usize, Vec3)) {
        self.rays.push(ray, chance);
        self.contributions.push(contribution);
    }

    /// The contributions that are not blocked.
    fn unblocked(self, frame: &FrameContext<'_>) -> impl Iterator<Item = (usize, Vec3)> {
        let blocked = self.rays.trace(frame);
        self.contributions.into_iter().zip(blocked).filter_map(|(light, blocked)| (!blocked).then_some(light))
    }
}

/// The work of one bounce of a batch.
struct Bounce<'a> {
    frame: &'a FrameContext<'a>,
    lights: &'a Lights<'a>,
    samples: &'a [Sample],
    number: u32,
    from_surfaces: ShadowRays<StartRay>,
    from_ground: ShadowRays<Ray>,
    /// Paths that go on.
    next: Vec<PathState>,
}

impl<'a> Bounce<'a> {
    fn new(frame: &'a FrameContext<'a>, lights: &'a Lights<'a>, samples: &'a [Sample], number: u32) -> Self {
        let (from_surfaces, from_ground, next) = (ShadowRays::new(), ShadowRays::new(), Vec::new());
        Self { frame, lights, samples, number, from_surfaces, from_ground, next }
    }

    /// Adds the shadow rays and the next ray of a path that reaches a surface or the ground.
    /// Returns the radiance that it finds there, or in the surroundings, and the surface.
    fn meet(&mut self, path: &PathState, hit: &Hit) -> (Vec3, Option<Surface>) {
        let Self { frame, lights, .. } = *self;
        if hit.is_hit() {
            let point = path.origin + path.direction * f64::from(hit.t);
            let surface = Surface::of(frame, hit, path.direction);
            self.scatter(path, point, hit.start(), &surface);
            return (surface.emitted, Some(surface));
        }
        let sky = || lights.sky(path.direction) * share(path.density, lights.density(path.direction));
        // Paths from the ground never return to it.
        let is_on_ground = self.number > 0 && path.start == Start::NONE;
        let ground = frame.ground.filter(|_| !is_on_ground);
        let Some((point, normal, seen)) = ground.and_then(|ground| ground.hit(path.origin, path.direction))
        else {
            return (sky(), None);
        };
        let surface = Surface::ground(normal, path.direction, seen as f32, sky());
        self.scatter(path, point, Start::NONE, &surface);
        (surface.emitted, Some(surface))
    }

    /// Adds the shadow rays and the next ray of a path at a point of a surface.
    fn scatter(&mut self, path: &PathState, point: DVec3, start: Start, surface: &Surface) {
        let Self { frame, lights, number, .. } = *self;
        let Some(bsdf) = &surface.bsdf else { return };
        let Sample { sampler, index, .. } = self.samples[path.sample];
        let sample = |dimension: u64| sampler.point(DIMENSIONS * u64::from(number) + 1 + dimension, index);
        let last = number == frame.args.bounces();
        let surroundings = lights.surroundings(sample(3)).map(|(light, density)| {
            // A path that goes on may find the surroundings by itself.
            let other = if last { 0.0 } else { bsdf.scattered(light.direction).1 };
            LightSample { light: light.light * share(Some(density), other), ..light }
        });
        let of_scene = lights.samples(point, sample(0), sample(1));
        for (ray, light) in of_scene.chain(surroundings).enumerate() {
            let soft = Surface::softened(surface.geometric, bsdf.normal(), light.direction);
            if soft > 0.0 {
                let light_from = bsdf.scattered(light.direction).0 * light.light * soft as f32;
                let contribution = (path.sample, path.throughput * light_from);
                let chance = self.samples[path.sample].chance(RAYS * u64::from(number) + 1 + ray as u64);
                let (direction, tmax) = (light.direction.as_vec3().to_array(), light.distance as f32);
                if start == Start::NONE {
                    let origin = point.as_vec3().to_array();
                    self.from_ground.push(Ray { origin, tmin: 0.0, direction, tmax }, chance, contribution);
                } else {
                    self.from_surfaces.push(start.ray(direction).with_tmax(tmax), chance, contribution);
                }
            }
        }
        if last {
            return;
        }
        let Some((direction, weight)) = bsdf.sample(sample(2)) else { return };
        let throughput = path.throughput * weight * surface.occlusion;
        let density = Some(bsdf.scattered(direction).1);
        // A direction below the geometric surface is mirrored at it.
        let depth = direction.dot(surface.geometric).min(0.0);
        let direction = direction - surface.geometric * (2.0 * depth);
        self.next.push(PathState {
            sample: path.sample,
            throughput,
            origin: point,
            start,
            direction,
            density,
        });
    }
}

/// The share of light from the surroundings that is taken of a direction chosen with a density, if
/// another way to choose it has the density `other` (the balance heuristic; Veach and Guibas,
/// "Optimally combining sampling techniques for Monte Carlo rendering", 1995). All of it where
/// there is no choice.
fn share(chosen: Option<f64>, other: f64) -> f32 {
    match chosen {
        Some(chosen) if other > 0.0 => (chosen / (chosen + other)) as f32,
        _ => 1.0,
    }
}
