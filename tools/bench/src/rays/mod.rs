//! The ray sets that `README.md` lists. All are seeded, and the same for every tracer. Rays of
//! `diffuse`, `ao` and `shadow` start at the hit, rounded to f32, with a tmin of 0: they may hit
//! the triangle that they leave. The sets have the exact starts, too.

mod camera;
mod directions;
mod finder;
pub(crate) mod recorded;
mod viewpoint;

pub use camera::Camera;
pub(crate) use camera::ray;
pub use directions::{cosine_weighted, on_sphere, perpendicular};
pub use finder::{Finder, LIFT};
pub use viewpoint::View;

use crate::model::Bounds;
use crate::tracer::Batch;
use bth::rays::{Ray, Start};
use bth_random::Rng;
use glam::DVec3;
use viewpoint::CameraHits;

/// Names of the sets, in order.
pub const NAMES: [&str; 9] = [
    "primary",
    "closeup",
    "diffuse",
    "diffuse-beside",
    "ao",
    "ao-beside",
    "shadow",
    "shadow-beside",
    "random",
];

/// Pixels of the cameras that rays are taken from.
pub const PICTURE_SIZE: (u32, u32) = (1024, 576);
/// The same in a quick run.
pub const QUICK_PICTURE_SIZE: (u32, u32) = (128, 72);
/// Smaller sets are not timed, as the clock is too coarse for them.
pub const FEWEST_TIMED: usize = 1024;

/// Length of the ambient occlusion rays, relative to the diagonal.
pub(crate) const AO_REACH: f64 = 0.05;
/// Ambient occlusion rays from each point.
pub(crate) const AO_RAYS: usize = 4;

/// Rays of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// One of [`NAMES`].
    pub name: &'static str,
    /// True for any hit, false for the nearest one.
    pub any: bool,
    /// True if neighbouring rays have similar origins and directions.
    pub coherent: bool,
    /// The rays, model space.
    pub rays: Vec<Ray>,
    /// The point of the surface at which each ray starts, if the rays start at hits.
    pub starts: Option<Vec<Start>>,
}

impl RaySet {
    /// All rays as a batch.
    pub fn batch(&self) -> Batch<'_> {
        Batch { rays: &self.rays, starts: self.starts.as_deref(), coherent: self.coherent }
    }

    /// Keeps at most about `most` of the rays: whole runs of neighbours, evenly spread over the
    /// set.
    fn thinned(mut self, most: usize) -> RaySet {
        const RUN: usize = 64;
        // An even step would take the same columns of a picture whose rows have a power of two of
        // runs.
        let step = self.rays.len().div_ceil(most.max(1)) | 1;
        let kept = |i: usize| (i / RUN).is_multiple_of(step);
        let keep = |index: &mut usize| {
            *index += 1;
            kept(*index - 1)
        };
        let mut index = 0;
        self.rays.retain(|_| keep(&mut index));
        if let Some(starts) = &mut self.starts {
            index = 0;
            starts.retain(|_| keep(&mut index));
        }
        self
    }
}

/// How to make the sets.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Pixels of the cameras, multiples of 4; other sets have numbers of rays to match.
    pub size: (u32, u32),
    /// Rays in a set, at most, about.
    pub most: usize,
    /// The place of the cameras; by default the model decides.
    pub view: Option<View>,
}

/// Makes all sets of a model, and returns the place of their camera.
pub fn sets(finder: &Finder<'_>, options: &Options) -> (View, Vec<RaySet>) {
    let bounds = finder.model.bounds();
    let diagonal = bounds.diagonal();
    let (view, seen) = trace_camera(finder, options);
    let light = match view {
        View::Outside => bounds.center() + DVec3::new(0.4, 1.1, 0.9) * diagonal,
        View::Inside => seen.camera.eye,
    };
    let count = seen.rays.len();
    let closeup = viewpoint::close_up(finder, diagonal, &seen).rays();
    let secondary = secondary(finder, &seen, diagonal, light);
    let chords = chords(&bounds, count, &mut Rng::new(3));

    let set = |name, any, coherent, rays, starts| RaySet { name, any, coherent, rays, starts };
    let mut sets =
        vec![set("primary", false, true, seen.rays, None), set("closeup", false, true, closeup, None)];
    let kinds = [
        (["diffuse", "diffuse-beside"], false, false),
        (["ao", "ao-beside"], true, false),
        (["shadow", "shadow-beside"], true, true),
    ];
    for (([name, beside], any, coherent), Secondary { rays: [at_hit, off], starts }) in
        kinds.into_iter().zip(secondary)
    {
        sets.push(set(name, any, coherent, at_hit, Some(starts)));
        sets.push(set(beside, any, coherent, off, None));
    }
    sets.push(set("random", false, false, chords, None));
    (view, sets.into_iter().map(|s| s.thinned(options.most)).collect())
}

/// The place of the cameras, and the rays of two of them in tiles of 4×4 pixels: the first sees the
/// whole model or is in it, the second is close to the surface.
pub fn cameras(finder: &Finder<'_>, options: &Options) -> (View, [Vec<Ray>; 2]) {
    let (view, seen) = trace_camera(finder, options);
    let close = viewpoint::close_up(finder, finder.model.bounds().diagonal(), &seen).rays();
    (view, [seen.rays, close])
}

/// Places the camera, and traces its rays.
fn trace_camera(finder: &Finder<'_>, options: &Options) -> (View, CameraHits) {
    let bounds = finder.model.bounds();
    let view = options.view.unwrap_or_else(|| viewpoint::automatic(finder, bounds.diagonal()));
    let seen = match view {
        View::Outside => viewpoint::outside(finder, &bounds, options.size),
        View::Inside => viewpoint::inside(finder, &bounds, options.size),
    };
    (view, seen)
}

/// Secondary rays of one kind.
#[derive(Default)]
struct Secondary {
    /// The rays from the hits, and the same from a little off the surface.
    rays: [Vec<Ray>; 2],
    starts: Vec<Start>,
}

/// Bounces, ambient occlusion and shadow rays from what the camera sees.
fn secondary(finder: &Finder<'_>, seen: &CameraHits, diagonal: f64, light: DVec3) -> [Secondary; 3] {
    let (mut bounces, mut occlusion) = (Rng::new(1), Rng::new(2));
    let mut sets: [Secondary; 3] = Default::default();
    for (ray_in, hit) in seen.rays.iter().zip(&seen.hits).filter(|(_, h)| h.is_hit()) {
        let (points, normal) = finder.points(ray_in, hit);
        let mut push = |set: usize, to: &dyn Fn(DVec3) -> (DVec3, f64)| {
            for (rays, point) in sets[set].rays.iter_mut().zip(points) {
                let (direction, tmax) = to(point);
                rays.push(ray(point, direction, tmax));
            }
            sets[set].starts.push(hit.start());
        };
        let direction = cosine_weighted(&mut bounces, normal);
        push(0, &|_| (direction, f64::INFINITY));
        for _ in 0..AO_RAYS {
            let direction = cosine_weighted(&mut occlusion, normal);
            push(1, &|_| (direction, AO_REACH * diagonal));
        }
        if (light - points[1]).dot(normal) > 0.0 {
            // The ray ends just before the light.
            push(2, &|point| ((light - point).normalize(), (light - point).length() * (1.0 - 1e-4)));
        }
    }
    sets
}

/// Chords between random points of a sphere around the model.
fn chords(bounds: &Bounds, count: usize, rng: &mut Rng) -> Vec<Ray> {
    let (middle, radius) = (bounds.center(), 0.55 * bounds.diagonal());
    let mut chord = || {
        let (p, q) = (middle + on_sphere(rng) * radius, middle + on_sphere(rng) * radius);
        ray(p, (q - p).normalize(), f64::INFINITY)
    };
    (0..count).map(|_| chord()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_rays_of_a_picture_come_from_all_columns() {
        // The origin tells the number of the ray in a picture whose rows of tiles are 64 runs long.
        let rays = (0..1 << 19).map(|i| Ray::new([i as f32, 0.0, 0.0], [0.0, 0.0, 1.0])).collect();
        let set = RaySet { name: NAMES[0], any: false, coherent: true, rays, starts: None };
        for most in [64 << 7, 64 << 6, 64 << 5] {
            let thinned = set.clone().thinned(most);
            let mut columns: Vec<u32> =
                thinned.rays.iter().map(|ray| ray.origin[0] as u32 / 64 % 64).collect();
            assert!(columns.len() <= most + 64, "{}", columns.len());
            columns.sort_unstable();
            columns.dedup();
            assert!(columns.len() >= most / 64 / 2, "{} columns of {most} rays", columns.len());
        }
    }
}
