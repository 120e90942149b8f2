//! Starts on surfaces of a scene: where they lie in the world, and whether rays can start there.

use crate::rays::{Ray, Start, StartRay};
use crate::scene::Scene;
use crate::starts::locate::{StartError, locate};
use crate::starts::world_ray::{InstanceStart, PlacedRay};
use bth_format::{Code, Error};
use std::borrow::Cow;

/// Why a ray cannot be placed.
pub(crate) enum Misplaced {
    NoInstance,
    Hidden,
    Start(StartError),
}

/// Places a start in the world: with its point in world space.
pub(crate) fn place_start(scene: &Scene, start: &Start) -> Result<InstanceStart, Misplaced> {
    let instance = start.primitive.instance;
    let Some(world) = scene.world() else {
        let object = Some(instance).filter(|instance| *instance < scene.object_count());
        let point = locate(scene.view(object.ok_or(Misplaced::NoInstance)?), *start);
        let point = point.map_err(Misplaced::Start)?;
        return Ok(InstanceStart { instance, start: *start, point, world: point.origin });
    };
    if instance >= world.instance_count() {
        return Err(Misplaced::NoInstance);
    }
    let placement = world.placed(instance).ok_or(Misplaced::Hidden)?;
    let point = locate(scene.view(placement.object()), *start).map_err(Misplaced::Start)?;
    let world = placement.point_in_world(point.origin);
    Ok(InstanceStart { instance, start: *start, point, world })
}

/// Places a ray in the world; `None` if its start is not a point of a visible instance.
pub(crate) fn place(scene: &Scene, ray: &StartRay) -> Option<PlacedRay> {
    let &StartRay { start, direction, tmax } = ray;
    let start = place_start(scene, &start).ok()?;
    let origin = start.rounded();
    Some(PlacedRay { ray: Ray { origin, tmin: 0.0, direction, tmax }, start: Some(start) })
}

/// Implements [`Scene::check_start`].
pub(crate) fn check_start(scene: &Scene, start: &Start) -> Result<(), Error> {
    let Start { primitive, u, v } = *start;
    let (instance, triangle) = (primitive.instance, primitive.triangle);
    let bad =
        |expected: &'static str, found: Cow<'static, str>| Err(Error::of_call(Code::Start, expected, found));
    match place_start(scene, start) {
        Ok(_) => Ok(()),
        Err(Misplaced::NoInstance) => {
            let expected = format!("an instance below {}", scene.instance_count());
            Err(Error::of_call(Code::NoSuchInstance, expected, format!("{instance}")))
        }
        Err(Misplaced::Hidden) => {
            bad("a visible instance", format!("instance {instance}, which is hidden").into())
        }
        Err(Misplaced::Start(StartError::NoTriangle | StartError::NoArea)) => {
            bad("a triangle with area", format!("triangle {triangle} of instance {instance}").into())
        }
        Err(Misplaced::Start(StartError::Weights)) => {
            bad("u >= 0, v >= 0 and u + v <= 1", format!("u = {u}, v = {v}").into())
        }
    }
}
