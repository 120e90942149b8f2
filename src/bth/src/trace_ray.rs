//! The kinds of rays that can be traced: from an origin, and from a start on a surface.

// `sealed::Traced` is out of reach for other crates, so its types may be private.
#![allow(private_interfaces, private_bounds)]

use self::sealed::Traced;
use crate::instances::in_place::{self, LineRay};
use crate::instances::{World, WorldRays};
use crate::object::{self, Scratch};
use crate::query::sink::{Answers, Sink};
use crate::rays::{Hit, Ray, Ray64, StartRay};
use crate::scene::Scene;
use crate::start_points;
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::{InstanceStart, PlacedRay, WorldRay};
use bth_format::object::ObjectView;
use std::cell::Cell;

/// A ray that can be traced: a [`Ray`], a [`Ray64`], or a [`StartRay`].
pub trait TraceRay: sealed::Traced {}

impl TraceRay for Ray {}
impl TraceRay for Ray64 {}
impl TraceRay for StartRay {}

pub(crate) mod sealed {
    use super::{Answers, Hit, LineRay, ObjectView, Scene, Scratch, World, WorldRay, WorldRays};

    /// How rays of a kind are traced.
    pub trait Traced: Copy + Sync {
        /// What these rays are if they have an origin.
        type Line: LineRay;
        /// The rays if they have an origin: they are traced directly through an object in world
        /// space that f32 does not hold.
        fn lines(rays: &[Self]) -> Option<&[Self::Line]>;
        /// Stores the nearest hit in an instance whose object's space is world space.
        fn store_nearest_in(&self, object: &ObjectView<'_>, instance: u32, hit: &mut Hit);
        /// Returns true if the ray hits anything in an object whose space is world space.
        fn hits_any_in(&self, object: &ObjectView<'_>) -> bool;
        /// Returns true if the ray may hit something in a scene that is this instance, whose
        /// object's space is world space.
        fn may_start_in(&self, instance: u32) -> bool;
        /// Calls `trace` with the ray in world space; `None` if its start is not in the scene.
        fn in_world<T>(&self, scene: &Scene, trace: impl FnOnce(WorldRay<'_>) -> T) -> Option<T>;
        /// Returns true if rays are traced together, through instances if there is a world.
        fn go_together(rays: &[Self], world: Option<&World>) -> bool;
        /// Stores the answers of rays that hit anything in an instance whose object's space is
        /// world space.
        fn trace_in_object(
            object: &ObjectView<'_>,
            rays: &[Self],
            instance: u32,
            scratch: &mut Scratch,
            answers: Answers<'_>,
        );
        /// Calls `trace` with the rays of a batch in world space.
        fn with_placed(scene: &Scene, rays: &[Self], trace: impl FnOnce(WorldRays<'_>));
    }
}

impl Traced for Ray {
    type Line = Ray;
    #[inline(always)]
    fn lines(rays: &[Ray]) -> Option<&[Ray]> {
        Some(rays)
    }
    #[inline(always)]
    fn store_nearest_in(&self, object: &ObjectView<'_>, instance: u32, hit: &mut Hit) {
        object::store_nearest(object, self, instance, hit);
    }
    #[inline(always)]
    fn hits_any_in(&self, object: &ObjectView<'_>) -> bool {
        object::any(object, self)
    }
    #[inline(always)]
    fn may_start_in(&self, _instance: u32) -> bool {
        true
    }
    #[inline(always)]
    fn in_world<T>(&self, _scene: &Scene, trace: impl FnOnce(WorldRay<'_>) -> T) -> Option<T> {
        // Not copied: loading what was just written would stall.
        Some(trace(WorldRay::plain(self)))
    }
    fn go_together(rays: &[Ray], world: Option<&World>) -> bool {
        world.is_none_or(|world| !world.go_one_by_one(rays.len(), |i| rays[i]))
    }
    fn trace_in_object(
        object: &ObjectView<'_>,
        rays: &[Ray],
        instance: u32,
        scratch: &mut Scratch,
        answers: Answers<'_>,
    ) {
        object::trace_batch(
            object,
            rays,
            None,
            scratch,
            &mut Sink::new(object.triangle_ids, answers, instance),
        );
    }
    fn with_placed(_scene: &Scene, rays: &[Ray], trace: impl FnOnce(WorldRays<'_>)) {
        trace(WorldRays { rays, starts: &[], wide: &[] });
    }
}

thread_local! {
    /// The rays of a batch in world space. A thread keeps their memory from one batch to the next.
    static PLACED: Cell<(Vec<Ray>, Vec<InstanceStart>)> = const { Cell::new((Vec::new(), Vec::new())) };
}

impl Traced for StartRay {
    type Line = Ray;
    #[inline(always)]
    fn lines(_rays: &[StartRay]) -> Option<&[Ray]> {
        None
    }
    #[inline(always)]
    fn store_nearest_in(&self, object: &ObjectView<'_>, instance: u32, hit: &mut Hit) {
        object::store_nearest(object, self, instance, hit);
    }
    #[inline(always)]
    fn hits_any_in(&self, object: &ObjectView<'_>) -> bool {
        object::any(object, self)
    }
    #[inline(always)]
    fn may_start_in(&self, instance: u32) -> bool {
        self.start.primitive.instance == instance
    }
    fn in_world<T>(&self, scene: &Scene, trace: impl FnOnce(WorldRay<'_>) -> T) -> Option<T> {
        start_points::place(scene, self).map(|placed| trace(placed.world_ray()))
    }
    fn go_together(_rays: &[StartRay], _world: Option<&World>) -> bool {
        true
    }
    fn trace_in_object(
        object: &ObjectView<'_>,
        rays: &[StartRay],
        instance: u32,
        scratch: &mut Scratch,
        answers: Answers<'_>,
    ) {
        object::trace_starts(object, rays, instance, scratch, answers);
    }
    fn with_placed(scene: &Scene, rays: &[StartRay], trace: impl FnOnce(WorldRays<'_>)) {
        let (mut world_rays, mut starts) = PLACED.take();
        world_rays.clear();
        starts.clear();
        for ray in rays {
            let (ray, start) = match start_points::place(scene, ray) {
                Some(PlacedRay { ray, start: Some(start) }) => (ray, start),
                _ => (ENDED, InstanceStart::none(ENDED.origin)),
            };
            world_rays.push(ray);
            starts.push(start);
        }
        trace(WorldRays { rays: &world_rays, starts: &starts, wide: &[] });
        PLACED.set((world_rays, starts));
    }
}

impl Traced for Ray64 {
    type Line = Ray64;
    #[inline(always)]
    fn lines(rays: &[Ray64]) -> Option<&[Ray64]> {
        Some(rays)
    }
    #[inline]
    fn store_nearest_in(&self, object: &ObjectView<'_>, instance: u32, hit: &mut Hit) {
        in_place::store_nearest(object, self, instance, hit);
    }
    #[inline]
    fn hits_any_in(&self, object: &ObjectView<'_>) -> bool {
        in_place::any(object, self)
    }
    fn may_start_in(&self, _instance: u32) -> bool {
        true
    }
    fn in_world<T>(&self, _scene: &Scene, trace: impl FnOnce(WorldRay<'_>) -> T) -> Option<T> {
        Some(trace(WorldRay { ray: &self.narrow(), ..self.world_ray() }))
    }
    fn go_together(rays: &[Ray64], world: Option<&World>) -> bool {
        world.is_none_or(|world| !world.go_one_by_one(rays.len(), |i| rays[i].narrow()))
    }
    fn trace_in_object(
        object: &ObjectView<'_>,
        rays: &[Ray64],
        instance: u32,
        scratch: &mut Scratch,
        answers: Answers<'_>,
    ) {
        in_place::trace_batch(object, rays, instance, scratch, answers);
    }
    fn with_placed(_scene: &Scene, rays: &[Ray64], trace: impl FnOnce(WorldRays<'_>)) {
        let (mut narrow, starts) = PLACED.take();
        narrow.clear();
        narrow.extend(rays.iter().map(Ray64::narrow));
        trace(WorldRays { rays: &narrow, starts: &[], wide: rays });
        PLACED.set((narrow, starts));
    }
}
