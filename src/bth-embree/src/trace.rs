//! One ray: through what a commit made, with masks and filters, then through the rest.
//!
//! Filters of the program are called with one hit at a time, never twice with the same. Their order
//! is not defined.
#![allow(unsafe_code)] // Calls filters of the program, whose structures it points to.

use crate::abi::*;
use crate::committed::Committed;
use crate::fallback::has_instance_arrays;
use crate::float_mode::ExactMode;
use crate::handles::Shared;
use crate::mesh::{Mesh, Surface};
use crate::scene::Scene;
use crate::statistics::{Kind, Who, counted};
use bth::rays::PrimitiveRef;
use bth::{Accept, rays};
use glam::Vec4;
use std::cell::Cell;
use std::sync::atomic::Ordering::Relaxed;

/// A query as the program makes it.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) ray: &'a Ray,
    /// Null if the program gave none.
    pub(crate) arguments: *const QueryArguments,
    pub(crate) is_occluded: bool,
    /// The instance that the program has entered by itself, and its number in an array.
    pub(crate) entered: [u32; 2],
}

/// The nearest hit of a query, or any, as the program reads it, with its t.
pub(crate) type Found = Option<(f32, Hit)>;

/// Finds the nearest hit of a ray in the part of a scene that bth holds, or any.
#[inline(always)]
pub(crate) fn trace(committed: &Committed, query: Query<'_>) -> Found {
    let &Ray { origin, tnear, direction, tfar, mask, .. } = query.ray;
    let scene = match &committed.world {
        Some(world) => &world.scene,
        None => committed.own.scene.as_ref()?,
    };
    // A negative start means the origin. Without the flag, rays exclude their start.
    let tnear = if tnear > 0.0 { tnear } else { 0.0 };
    let tmin = if committed.is_robust { tnear } else { tnear.next_up() };
    let mode = ExactMode::enter();
    // Made in vector registers: the kernel loads whole vectors, and would wait for words that were
    // just written one by one until all instructions before have ended.
    let [[x, y, z], [dx, dy, dz]] = [origin, direction];
    let rows = [Vec4::new(x, y, z, tmin).to_array(), Vec4::new(dx, dy, dz, tfar).to_array()];
    let ray: rays::Ray = zerocopy::transmute!(rows);
    let filters = Filtering::of(committed, &query);
    if !filters.may_apply && committed.all_meet(mask) {
        if query.is_occluded {
            return scene.any(&ray).then_some((f32::NEG_INFINITY, Hit::NONE));
        }
        let hit = scene.nearest(&ray)?;
        return Some((hit.t, filters.describe(committed, &hit).0));
    }
    let conditions = Conditions { committed, query, filters, mode: &mode, accepted: Cell::new(None) };
    conditions.trace(scene, &ray)
}

/// Which filters apply to a query.
#[derive(Clone, Copy)]
struct Filtering {
    /// The filter of the arguments, if the scene allows it.
    argument: Option<FilterFunction>,
    /// True if it applies to all geometries.
    for_all: bool,
    may_apply: bool,
    entered: [u32; 2],
}

impl Filtering {
    #[inline(always)]
    fn of(committed: &Committed, query: &Query<'_>) -> Filtering {
        let filters = committed.filters;
        // SAFETY: the program gives valid arguments, or null.
        let arguments = unsafe { query.arguments.as_ref() };
        let argument = arguments.filter(|_| filters.allows_argument).and_then(|arguments| arguments.filter);
        let for_all = arguments.is_some_and(|arguments| arguments.flags & QUERY_INVOKE_FILTER != 0);
        let of_geometry = if query.is_occluded { filters.occluded } else { filters.intersect };
        let may_apply = of_geometry || argument.is_some() && (for_all || filters.takes_argument);
        Filtering { argument, for_all, may_apply, entered: query.entered }
    }

    /// A hit as the program reads it, with where it is.
    #[inline(always)]
    fn describe<'a>(&self, committed: &'a Committed, hit: &rays::Hit) -> (Hit, Surface<'a>, &'a Mesh, u32) {
        let PrimitiveRef { instance, triangle } = hit.primitive;
        let [mut id, mut primitive] = self.entered;
        let (mesh, mask) = match &committed.world {
            None => (&committed.own, u32::MAX),
            Some(world) => {
                let place = &world.places[instance as usize];
                if place.instance != INVALID_ID {
                    (id, primitive) = (place.instance, place.instance_primitive);
                }
                (&place.mesh, place.mask)
            }
        };
        let surface = mesh.surface(triangle, hit.u, hit.v);
        let described = Hit {
            normal: surface.normal,
            u: surface.u,
            v: surface.v,
            primitive: surface.primitive,
            geometry: surface.part.id,
            instance: id,
            instance_primitive: primitive,
        };
        (described, surface, mesh, mask)
    }
}

/// The conditions of a query: masks and filters.
struct Conditions<'a> {
    committed: &'a Committed,
    query: Query<'a>,
    filters: Filtering,
    mode: &'a ExactMode,
    /// The hit that was accepted last, as the filters left it: the answer when the search ends.
    accepted: Cell<Found>,
}

// SAFETY: a query runs on the thread that made it, so nobody shares the cell.
unsafe impl Sync for Conditions<'_> {}

impl Conditions<'_> {
    fn trace(&self, scene: &bth::Scene, ray: &rays::Ray) -> Found {
        let filter = |_: &rays::Ray, hit: &rays::Hit| self.accept(hit);
        let accept = Accept { filter: Some(&filter), ..Accept::default() };
        if self.query.is_occluded {
            return scene.any_accepted(ray, &accept).then_some((f32::NEG_INFINITY, Hit::NONE));
        }
        scene.nearest_accepted(ray, &accept)?;
        self.accepted.get()
    }

    /// Returns true if the masks have a bit in common and the filters accept a hit.
    fn accept(&self, hit: &rays::Hit) -> bool {
        let (described, surface, mesh, place_mask) = self.filters.describe(self.committed, hit);
        let mask = self.query.ray.mask;
        if mask & surface.part.mask == 0 || mask & place_mask == 0 {
            return false;
        }
        let mut found = RayHit { ray: Ray { tfar: hit.t, ..*self.query.ray }, hit: described };
        let geometry = &surface.part.geometry;
        let own = if self.query.is_occluded { &geometry.occluded_filter } else { &geometry.intersect_filter };
        // SAFETY: it is null or a filter, which the program set.
        let own =
            unsafe { std::mem::transmute::<*const std::ffi::c_void, Option<FilterFunction>>(own.get()) };
        let takes = mesh.allows_argument_filter
            && (self.filters.for_all || geometry.takes_argument_filter.load(Relaxed));
        let argument = self.filters.argument.filter(|_| takes);
        for filter in own.into_iter().chain(argument) {
            if !self.ask(filter, geometry.user.load(Relaxed), &mut found) {
                return false;
            }
        }
        self.accepted.set(Some((found.ray.tfar, found.hit)));
        true
    }

    /// Calls a filter with a hit.
    fn ask(&self, filter: FilterFunction, user: *mut std::ffi::c_void, found: &mut RayHit) -> bool {
        let mut valid = -1;
        let mut own = QueryContext { instance: INVALID_ID, instance_primitive: INVALID_ID };
        // SAFETY: the program gives valid arguments, or null.
        let context = unsafe { self.query.arguments.as_ref() }.map(|arguments| arguments.context);
        let context = context.filter(|context| !context.is_null()).unwrap_or(&raw mut own);
        let RayHit { ray, hit } = found;
        let arguments = FilterArguments { valid: &mut valid, user, context, ray, hit, count: 1 };
        // SAFETY: the context is ours or the program's. The filter is the program's and is called
        // as documented, with pointers that are valid during the call.
        unsafe {
            let former = (*context).instance;
            let former_primitive = has_instance_arrays().then(|| (*context).instance_primitive);
            (*context).instance = hit.instance;
            if has_instance_arrays() {
                (*context).instance_primitive = hit.instance_primitive;
            }
            self.mode.outside(|| filter(&arguments));
            (*context).instance = former;
            if let Some(former) = former_primitive {
                (*context).instance_primitive = former;
            }
        }
        valid != 0
    }
}

/// Finds the nearest hit of a ray, and stores it there.
///
/// # Safety
/// The structures are as the documentation of `rtcIntersect1` asks.
#[inline(always)]
pub(crate) unsafe fn intersect(
    scene: &Shared<Scene>,
    ray_hit: *mut RayHit,
    arguments: *const QueryArguments,
) {
    let Some(committed) = scene.committed() else { return };
    // SAFETY: by contract the ray is valid; a hit of another layout has another end, so it is
    // written by `store`.
    let ray = unsafe { *ray_hit.cast::<Ray>() };
    let query = Query { ray: &ray, arguments, is_occluded: false, entered: [INVALID_ID; 2] };
    let found = counted(Kind::Rays, Who::Bth, 1, || trace(committed, query));
    if let Some(found) = found {
        // SAFETY: by contract the structure is valid for writes.
        unsafe { store(ray_hit, found) };
    }
    if !committed.rest.0.is_null() {
        counted(Kind::Rays, Who::Fallback, 1, || {
            let Some(fallback) = &scene.device.fallback else { return };
            // SAFETY: the scene of the other library lives; the structures are as it asks.
            unsafe { (fallback.functions.rtcIntersect1)(committed.rest.0, ray_hit, arguments.cast_mut()) };
        });
    }
}

/// Stores a hit and its t.
///
/// # Safety
/// The structure is valid for writes, with a hit of the layout in use.
#[inline(always)]
pub(crate) unsafe fn store(ray_hit: *mut RayHit, (t, hit): (f32, Hit)) {
    let words = if has_instance_arrays() { HIT_WORDS } else { SHORT_HIT_WORDS };
    // SAFETY: by contract the hit has this number of words; its field begins at the end of the ray.
    unsafe {
        (*ray_hit.cast::<Ray>()).tfar = t;
        let to = ray_hit.cast::<u32>().add(RAY_WORDS);
        std::ptr::copy_nonoverlapping((&raw const hit).cast::<u32>(), to, words);
    }
}

/// Sets the end of a ray to negative infinity if it hits anything.
///
/// # Safety
/// The structures are as the documentation of `rtcOccluded1` asks.
#[inline(always)]
pub(crate) unsafe fn occluded(scene: &Shared<Scene>, ray: *mut Ray, arguments: *const QueryArguments) {
    let Some(committed) = scene.committed() else { return };
    // SAFETY: by contract the ray is valid.
    let own = unsafe { *ray };
    let query = Query { ray: &own, arguments, is_occluded: true, entered: [INVALID_ID; 2] };
    let found = counted(Kind::Rays, Who::Bth, 1, || trace(committed, query));
    if found.is_some() {
        // SAFETY: by contract the ray is valid for writes.
        unsafe { (*ray).tfar = f32::NEG_INFINITY };
    } else if !committed.rest.0.is_null() {
        counted(Kind::Rays, Who::Fallback, 1, || {
            let Some(fallback) = &scene.device.fallback else { return };
            // SAFETY: the scene of the other library lives; the structures are as it asks.
            unsafe { (fallback.functions.rtcOccluded1)(committed.rest.0, ray, arguments.cast_mut()) };
        });
    }
}
