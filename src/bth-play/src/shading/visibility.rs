//! What rays hit: surfaces, but not the holes that alpha makes in them, and for rays of the camera
//! not the backs of surfaces that are seen from the front only.
//!
//! Rays are traced in batches first. Only those that hit such a surface are traced again, one at a
//! time, with a filter that asks for the alpha of the texture. The file's own opacity (`bthc
//! compile --alpha`) saves that work where it is certain.

use super::context::{Chance, FrameContext};
use bth::rays::Hit;
use bth::{Accept, Alpha, TraceRay};

/// Returns true if a ray is stopped where it hits a surface. `camera` is the direction of a ray of
/// the camera.
fn stops(frame: &FrameContext<'_>, camera: Option<[f32; 3]>, hit: &Hit, chance: Chance) -> bool {
    let (materials, view) = (frame.materials, frame.geometry.object(hit.primitive));
    let Some(material) = materials.material(frame.scene, view, hit) else { return true };
    let sees_back = |direction| !frame.geometry.is_front(hit.primitive, direction);
    if !material.double_sided && camera.is_some_and(sees_back) {
        return false;
    }
    match material.alpha {
        Alpha::Opaque => true,
        Alpha::Mask(cutoff) => materials.alpha(frame.scene, hit, material) >= cutoff,
        Alpha::Blend => materials.alpha(frame.scene, hit, material) > chance.at(hit.primitive),
    }
}

/// Stores what each ray hits first. `camera` gives the directions of rays of the camera, and
/// `chance` the chance of each ray.
pub(super) fn nearest<R: TraceRay>(
    frame: &FrameContext<'_>,
    rays: &[R],
    camera: Option<fn(&R) -> [f32; 3]>,
    chance: impl Fn(usize) -> Chance,
    hits: &mut [Hit],
) {
    frame.scene.batch(rays).nearest(hits);
    if !frame.materials.lets_pass(camera.is_some()) {
        return;
    }
    for (row, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let chance = chance(row);
        if hit.is_hit() && !stops(frame, camera.map(|direction| direction(ray)), hit, chance) {
            let filter: &bth::Filter<'_> =
                &|ray, hit| stops(frame, camera.map(|_| ray.direction), hit, chance);
            let accept = Accept { filter: Some(filter), ..Accept::default() };
            *hit = frame.scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS);
        }
    }
}

/// A batch of any-hit rays: from hits, or from points that no triangle holds.
#[derive(Debug)]
pub(crate) struct OcclusionRays<R> {
    rays: Vec<R>,
    chances: Vec<Chance>,
}

impl<R: TraceRay> OcclusionRays<R> {
    pub(crate) fn new() -> Self {
        Self { rays: Vec::new(), chances: Vec::new() }
    }

    pub(crate) fn push(&mut self, ray: R, chance: Chance) {
        self.rays.push(ray);
        self.chances.push(chance);
    }

    /// Number of rays.
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Returns for each ray true if it is blocked.
    pub(super) fn trace(&self, frame: &FrameContext<'_>) -> Vec<bool> {
        let mut all = vec![false; self.rays.len()];
        frame.scene.batch(&self.rays).any(&mut all);
        if frame.materials.lets_pass(false) {
            for ((ray, blocked), chance) in self.rays.iter().zip(&mut all).zip(&self.chances) {
                let filter: &bth::Filter<'_> = &|_, hit| stops(frame, None, hit, *chance);
                let accept = Accept { filter: Some(filter), ..Accept::default() };
                *blocked = *blocked && frame.scene.any_accepted(ray, &accept);
            }
        }
        all
    }
}
