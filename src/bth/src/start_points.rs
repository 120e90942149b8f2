//! Queries of scenes about starts on surfaces: where they lie in the world, whether rays can start
//! there, and what they see.

use crate::intersect::origin::RoundedOrigin;
use crate::rays::{Ray, Start, StartRay};
use crate::scene::Scene;
use crate::starts::locate::{StartError, locate};
use crate::starts::world_ray::{InstanceStart, PlacedRay};
use crate::visible::{self, SegmentEnd};
use bth_format::{Code, Error};
use std::borrow::Cow;

/// Why a ray cannot be placed.
pub(crate) enum Misplaced {
    NoInstance,
    Hidden,
    Start(StartError),
}

impl Scene {
    /// Places a start in the world: with its point in world space, rounded to f32.
    pub(crate) fn place_start(&self, start: &Start) -> Result<(InstanceStart, [f32; 3]), Misplaced> {
        let instance = start.primitive.instance;
        let Some(world) = self.world() else {
            let object = Some(instance).filter(|instance| *instance < self.object_count());
            let point = locate(self.view(object.ok_or(Misplaced::NoInstance)?), *start);
            let point = point.map_err(Misplaced::Start)?;
            return Ok((InstanceStart { instance, start: *start, point }, point.rounded()));
        };
        let placement = world.placements.get(instance as usize).ok_or(Misplaced::NoInstance)?;
        let placement = placement.as_ref().ok_or(Misplaced::Hidden)?;
        let point = locate(self.view(placement.object()), *start).map_err(Misplaced::Start)?;
        let RoundedOrigin(origin, _) = point.origin;
        let origin = placement.inverse.point_in_world(origin).map(|x| x as f32);
        Ok((InstanceStart { instance, start: *start, point }, origin))
    }

    /// Places a ray in the world; `None` if its start is not a point of a visible instance.
    pub(crate) fn place(&self, ray: &StartRay) -> Option<PlacedRay> {
        let &StartRay { start, direction, tmax } = ray;
        let (start, origin) = self.place_start(&start).ok()?;
        Some(PlacedRay { ray: Ray { origin, tmin: 0.0, direction, tmax }, start: Some(start) })
    }

    /// Checks that rays can start at a point: that it is a point of a triangle with area of a
    /// visible instance.
    ///
    /// Queries do not check starts: a ray whose start is not such a point hits nothing.
    ///
    /// # Errors
    /// `BTH-S003` if there is no such instance, `BTH-S008` if it is hidden, if it has no such
    /// triangle or the triangle has no area, or if u or v is not finite, negative, or their sum
    /// above 1 by more than 2^-22. The error says what was found.
    pub fn check_start(&self, start: &Start) -> Result<(), Error> {
        let Start { primitive, u, v } = *start;
        let (instance, triangle) = (primitive.instance, primitive.triangle);
        let bad = |expected: &'static str, found: Cow<'static, str>| {
            Err(Error::of_call(Code::Start, expected, found))
        };
        match self.place_start(start) {
            Ok(_) => Ok(()),
            Err(Misplaced::NoInstance) => {
                let expected = format!("an instance below {}", self.instance_count());
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

    /// Returns true if two points see each other: whether no triangle crosses the open segment
    /// between them. Each is a [`Start`], or a point in world space.
    ///
    /// It is decided exactly, so it is symmetrical: `visible(a, b)` is `visible(b, a)`. Triangles
    /// through an end, or in a plane with the whole segment, do not block. Rays pass through the
    /// transparent parts of triangles. An end that is not a point of a visible instance, or not
    /// finite, sees nothing.
    ///
    /// ```no_run
    /// use bth::rays::Ray;
    ///
    /// let scene = bth::open("bunny.bth")?;
    /// let light = [0.0, 3.0, 1.0];
    /// if let Some(hit) = scene.nearest(&Ray::new([0.0, 0.1, 1.0], [0.0, 0.0, -1.0])) {
    ///     println!("lit: {}", scene.visible(hit.start(), light));
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn visible(&self, a: impl Into<SegmentEnd>, b: impl Into<SegmentEnd>) -> bool {
        visible::see_each_other(self, a.into(), b.into())
    }
}
