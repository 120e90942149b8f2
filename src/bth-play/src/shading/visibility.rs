//! What rays meet: surfaces, but not the holes that alpha makes in them, and for rays of the camera not the backs of surfaces
//! that are seen from the front only.
//!
//! Rays are traced in batches first. Only those that meet such a surface are traced again, one at a time, with a filter that
//! asks for the alpha of the texture. The file's own opacity (`bthc compile --alpha`) saves that work where it is certain.

use super::chance::Chance;
use super::context::FrameContext;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Accept, Alpha};

/// Whether a ray is stopped where it hits a surface.
fn stops(frame: &FrameContext<'_>, ray: &Ray, hit: &Hit, camera: bool, chance: Chance) -> bool {
    let (materials, view) = (frame.materials, frame.geometry.object(hit.primitive));
    let Some(material) = materials.material(frame.scene, view, hit) else { return true };
    if camera && !material.double_sided && !frame.geometry.is_front(hit.primitive, ray) {
        return false;
    }
    match material.alpha {
        Alpha::Opaque => true,
        Alpha::Mask(cutoff) => materials.alpha(frame.scene, hit, material) >= cutoff,
        Alpha::Blend => materials.alpha(frame.scene, hit, material) > chance.at(hit.primitive),
    }
}

/// Stores what each ray meets first. `chance` gives the chance of each ray.
pub(super) fn nearest(
    frame: &FrameContext<'_>,
    (rays, from): (&[Ray], Option<&[PrimitiveRef]>),
    camera: bool,
    chance: impl Fn(usize) -> Chance,
    hits: &mut [Hit],
) {
    frame.scene.batch(rays).from(from).nearest(hits);
    if !frame.materials.lets_pass(camera) {
        return;
    }
    for (row, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        if hit.is_hit() && !stops(frame, ray, hit, camera, chance(row)) {
            let chance = chance(row);
            let filter: &bth::Filter<'_> = &|ray, hit| stops(frame, ray, hit, camera, chance);
            let accept = Accept { filter: Some(filter), ..Accept::default() };
            *hit = frame.scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS);
        }
    }
}

/// Stores whether each ray is stopped by anything.
pub(super) fn any(
    frame: &FrameContext<'_>,
    (rays, from): (&[Ray], &[PrimitiveRef]),
    chances: &[Chance],
    blocked: &mut [bool],
) {
    frame.scene.batch(rays).from(from).any(blocked);
    if !frame.materials.lets_pass(false) {
        return;
    }
    for ((ray, blocked), chance) in rays.iter().zip(blocked).zip(chances) {
        if *blocked {
            let filter: &bth::Filter<'_> = &|ray, hit| stops(frame, ray, hit, false, *chance);
            let accept = Accept { filter: Some(filter), ..Accept::default() };
            *blocked = frame.scene.any_accepted(ray, &accept);
        }
    }
}
