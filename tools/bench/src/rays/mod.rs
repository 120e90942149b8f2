//! The ray sets. All are seeded, and the same for every tracer.
//!
//! | set | query | rays |
//! |---|---|---|
//! | `primary` | nearest | a camera that sees the whole model, or stands in it; tiles of 4×4 pixels |
//! | `closeup` | nearest | a camera just above the surface in the middle of that picture |
//! | `diffuse` | nearest | from each primary hit, cosine-weighted |
//! | `ao` | any | four from each primary hit, cosine-weighted, 5 % of the diagonal long |
//! | `shadow` | any | from each primary hit that faces it to a point light |
//! | `random` | nearest | chords between random points of a sphere around the model |
//! | `miss` | nearest | such chords that cross the bounding box and hit nothing |

mod camera;
mod finder;
mod random;
mod view;

pub use camera::Camera;
pub use finder::Finder;
pub use random::{Random, across};
pub use view::View;

use crate::model::Bounds;
use crate::tracer::Batch;
use bth::rays::{Ray, Surface};
use glam::DVec3;
use view::Shot;

/// Names of the sets, in order.
pub const NAMES: [&str; 7] = ["primary", "closeup", "diffuse", "ao", "shadow", "random", "miss"];

/// By how much secondary rays are lifted off the surface that they start on, relative to the diagonal of
/// the model: what renderers do. On models far from the origin it is less than the resolution of f32.
pub const LIFT: f64 = 2e-5;
/// Length of the ambient occlusion rays, relative to the diagonal.
const AO_REACH: f64 = 0.05;
/// Ambient occlusion rays from each point.
const AO_RAYS: usize = 4;

/// Rays of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// One of [`NAMES`].
    pub name: &'static str,
    /// Any hit is asked for, not the nearest.
    pub any: bool,
    /// Neighbours are alike.
    pub coherent: bool,
    /// The rays, model space.
    pub rays: Vec<Ray>,
    /// The surface that each starts on, if they start on surfaces.
    pub from: Option<Vec<Surface>>,
}

impl RaySet {
    /// All rays as a batch.
    pub fn batch(&self) -> Batch<'_> {
        Batch { rays: &self.rays, from: self.from.as_deref(), coherent: self.coherent }
    }

    /// At most about so many of the rays: whole runs of neighbours, evenly spread over the set.
    fn thinned(mut self, most: usize) -> RaySet {
        const RUN: usize = 64;
        let step = self.rays.len().div_ceil(most.max(1)).max(1);
        let kept = |i: usize| (i / RUN).is_multiple_of(step);
        let keep = |index: &mut usize| {
            *index += 1;
            kept(*index - 1)
        };
        let mut index = 0;
        self.rays.retain(|_| keep(&mut index));
        if let Some(from) = &mut self.from {
            index = 0;
            from.retain(|_| keep(&mut index));
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
    /// Where to look from; decided by the model when absent.
    pub view: Option<View>,
}

/// Makes all sets of a model, and says from where it is seen.
pub fn sets(finder: &Finder<'_>, options: &Options) -> (View, Vec<RaySet>) {
    let bounds = finder.model.bounds();
    let diagonal = bounds.diagonal();
    let (view, shot) = shoot(finder, options);
    let light = match view {
        View::Outside => bounds.center() + DVec3::new(0.4, 1.1, 0.9) * diagonal,
        View::Inside => shot.camera.eye,
    };
    let count = shot.rays.len();
    let closeup = view::close_up(finder, diagonal, &shot).rays();
    let [diffuse, ao, shadow] = secondary(finder, &shot, diagonal, light);
    let chords = chords(&bounds, count, &mut Rng::new(3));
    let miss = misses(finder, &bounds, count, &mut Rng::new(4));

    let set = |name, any, coherent, rays, from| RaySet { name, any, coherent, rays, from };
    let sets = vec![
        set("primary", false, true, shot.rays, None),
        set("closeup", false, true, closeup, None),
        set("diffuse", false, false, diffuse.0, Some(diffuse.1)),
        set("ao", true, false, ao.0, Some(ao.1)),
        set("shadow", true, true, shadow.0, Some(shadow.1)),
        set("random", false, false, chords, None),
        set("miss", false, false, miss, None),
    ];
    (view, sets.into_iter().map(|s| s.thinned(options.most)).collect())
}

/// The rays of the cameras that see the whole model (or stand in it) and the surface close by, in tiles of 4×4 pixels, and
/// from where the model is seen.
pub fn cameras(finder: &Finder<'_>, options: &Options) -> (View, [Vec<Ray>; 2]) {
    let (view, shot) = shoot(finder, options);
    let close = view::close_up(finder, finder.model.bounds().diagonal(), &shot).rays();
    (view, [shot.rays, close])
}

/// What the camera sees.
fn shoot(finder: &Finder<'_>, options: &Options) -> (View, Shot) {
    let bounds = finder.model.bounds();
    let view = options.view.unwrap_or_else(|| view::automatic(finder, bounds.diagonal()));
    let shot = match view {
        View::Outside => view::outside(finder, &bounds, options.size),
        View::Inside => view::inside(finder, &bounds, options.size),
    };
    (view, shot)
}

/// A ray in single precision; the direction is a unit vector.
pub(crate) fn ray(origin: DVec3, direction: DVec3, tmax: f64) -> Ray {
    Ray {
        origin: origin.to_array().map(|x| x as f32),
        tmin: 0.0,
        direction: direction.to_array().map(|x| x as f32),
        tmax: tmax as f32,
    }
}

type Started = (Vec<Ray>, Vec<Surface>);

/// Bounces, ambient occlusion and shadow rays from what the camera sees.
fn secondary(finder: &Finder<'_>, shot: &Shot, diagonal: f64, light: DVec3) -> [Started; 3] {
    let (mut bounces, mut occlusion) = (Rng::new(1), Rng::new(2));
    let mut sets = [const { (Vec::new(), Vec::new()) }; 3];
    let mut push = |set: usize, surface: Surface, ray: Ray| {
        sets[set].0.push(ray);
        sets[set].1.push(surface);
    };
    for (ray_in, hit) in shot.rays.iter().zip(&shot.hits).filter(|(_, h)| h.is_hit()) {
        let (point, normal) = finder.start(ray_in, hit);
        push(0, hit.surface, ray(point, cosine_weighted(&mut bounces, normal), f64::INFINITY));
        for _ in 0..AO_RAYS {
            push(1, hit.surface, ray(point, cosine_weighted(&mut occlusion, normal), AO_REACH * diagonal));
        }
        let to_light = light - point;
        if to_light.dot(normal) > 0.0 {
            // Short of the light, which stands on no surface.
            push(2, hit.surface, ray(point, to_light.normalize(), to_light.length() * (1.0 - 1e-4)));
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

/// Chords that cross the bounding box and hit nothing. A closed room has hardly any, and the set is
/// small then.
fn misses(finder: &Finder<'_>, bounds: &Bounds, count: usize, rng: &mut Rng) -> Vec<Ray> {
    const TRIES: usize = 64;
    let mut found = Vec::new();
    for _ in 0..TRIES {
        let rays = chords(bounds, count, rng);
        let hits = finder.nearest(&rays);
        let crosses =
            |r: &Ray| bounds.meets(crate::model::position(r.origin), crate::model::position(r.direction));
        let before = found.len();
        found.extend(rays.iter().zip(&hits).filter(|(r, h)| !h.is_hit() && crosses(r)).map(|(r, _)| *r));
        // Where a whole round finds next to none, 64 rounds find too few to time.
        if found.len() >= count || found.len() - before < count / 10_000 + 1 {
            break;
        }
    }
    found.truncate(count);
    found
}
