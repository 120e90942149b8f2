//! Queries of rays: the nearest hit and any hit of one ray, of a batch, and of arrays of
//! components; where rays can start, and which points see each other.
//!
//! Where some triangles let rays pass, the nearest hit is found as if every triangle were opaque.
//! If it lies on a transparent part, the ray is traced again with conditions
//! ([`mod@crate::hits`]), which pass over such hits. So scenes without opacity pay for one test in
//! each call, and rays that reach no holes pay for looking up the opacity of their hit.

use crate::batch::RayBatch;
use crate::hits::{Accept, results};
use crate::instances::{RayInInstance, UnplacedRay, in_place};
use crate::intersect::exact::precise;
use crate::intersect::exact_ray::WorldLines;
use crate::intersect::start::corners_by_id;
use crate::object;
use crate::query::Steps;
use crate::query::double::better_wide;
use crate::query::sink::Answers;
use crate::rays::{Hit, Hit64, PrimitiveRef, Start};
use crate::scene::Scene;
use crate::start_points;
use crate::starts::world_ray::WorldRay;
use crate::trace_ray::TraceRay;
use crate::trace_ray::sealed::Traced;
use crate::visible::{self, SegmentEnd};
use bth_format::Error;
use bth_format::layout::Opacity;
use bth_format::object::ObjectView;

impl Scene {
    /// Nearest hit of a ray in world space: a [`Ray`](crate::rays::Ray), a
    /// [`Ray64`](crate::rays::Ray64), or a [`StartRay`](crate::rays::StartRay).
    pub fn nearest<R: TraceRay>(&self, ray: &R) -> Option<Hit> {
        let mut hit = Hit::MISS;
        self.store_nearest(ray, &mut hit);
        hit.is_hit().then_some(hit)
    }

    /// Returns true if a ray in world space hits anything: a [`Ray`](crate::rays::Ray),
    /// a [`Ray64`](crate::rays::Ray64), or a [`StartRay`](crate::rays::StartRay).
    pub fn any<R: TraceRay>(&self, ray: &R) -> bool {
        self.hits_any(ray)
    }

    /// Like [`Self::nearest`], with statistics of the traversal. A miss is [`Hit::MISS`].
    pub fn nearest_counted<R: TraceRay>(&self, ray: &R) -> (Hit, Steps) {
        let (mut hit, mut steps) = (Hit::MISS, Steps::default());
        ray.in_world(self, |world_ray| match self.world() {
            Some(world) if self.sole_in_f32().is_none() => {
                (hit, steps) = world.nearest_counted(self.objects(), world_ray);
            }
            _ => self.nearest_of_objects(world_ray, &mut hit, |object, instance, ray| {
                let (hit, more) = ray.nearest_counted(object, instance);
                steps += more;
                hit
            }),
        });
        // The steps of the search behind holes are not counted.
        self.go_on(ray, &mut hit);
        (hit, steps)
    }

    /// A batch of rays, to be traced by [`RayBatch::nearest`] or [`RayBatch::any`].
    #[inline]
    pub fn batch<'a, R: TraceRay>(&'a self, rays: &'a [R]) -> RayBatch<'a, R> {
        RayBatch::new(self, rays)
    }

    /// The opacity of the triangle where a hit lies: [`Opacity::Opaque`] for triangles about which
    /// the file says nothing. A hit of a query is never transparent; where it is unknown, a filter
    /// ([`Accept::filter`](crate::Accept::filter)) may decide, and without one it counts.
    ///
    /// # Panics
    /// If `hit` is not from this scene.
    pub fn opacity(&self, hit: &Hit) -> Opacity {
        self.view(self.object_of(hit.primitive.instance)).opacity_at(hit.primitive.triangle, hit.u, hit.v)
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
        start_points::check_start(self, start)
    }

    /// Returns true if two points see each other: if no triangle crosses the open segment
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

    /// The numbers of a hit of a ray in f64; [`Hit64::MISS`] for a miss.
    ///
    /// They are the numbers of `hit` if the file keeps neither the place of the triangle in a leaf
    /// nor the triangles of the source: for triangles in tetrahedra with `--no-geometry`.
    ///
    /// ```
    /// use bth::rays::Ray64;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let ray = Ray64::new([0.25, 0.5, 1.0 + 1e-12], [0.0, 0.0, -1.0]);
    /// let hit = scene.nearest(&ray).expect("the top of the cube");
    /// assert!((scene.hit_f64(&ray, &hit).t - 1e-12).abs() < 1e-15);
    /// # Ok::<(), bth::Error>(())
    /// ```
    ///
    /// # Panics
    /// If `hit` is not from this scene.
    pub fn hit_f64<R: TraceRay>(&self, ray: &R, hit: &Hit) -> Hit64 {
        let Hit { t, u, v, primitive } = *hit;
        if !hit.is_hit() {
            return Hit64::MISS;
        }
        let rounded = Hit64 { t: t.into(), u: u.into(), v: v.into(), primitive };
        ray.in_world(self, |ray| hit_in_f64(self, ray, primitive)).flatten().unwrap_or(rounded)
    }

    /// Stores the nearest hit of a ray, or [`Hit::MISS`].
    ///
    /// Inlined up to the kernel. The kernel is not inlined, because every crate that traces single
    /// rays would then hold copies of the kernels. For a single ray in a model every instruction on
    /// the way there counts.
    #[inline(always)]
    pub(crate) fn store_nearest<R: Traced>(&self, ray: &R, hit: &mut Hit) {
        match self.sole_opaque() {
            Some(object) if ray.may_start_in(0) => ray.store_nearest_in(object, 0, hit),
            _ => self.store_nearest_elsewhere(ray, hit),
        }
    }

    /// Like [`Self::store_nearest`], in any scene.
    #[inline(never)]
    fn store_nearest_elsewhere<R: Traced>(&self, ray: &R, hit: &mut Hit) {
        *hit = Hit::MISS;
        let (sole, line) = (self.sole(), R::lines(std::slice::from_ref(ray)));
        if let Some((object, instance)) = sole
            && object.exact.is_empty()
        {
            if ray.may_start_in(instance) {
                ray.store_nearest_in(object, instance, hit);
            }
        } else if let (Some((object, instance)), Some([line])) = (sole, line) {
            in_place::store_nearest(object, line, instance, hit);
        } else {
            ray.in_world(self, |world_ray| match self.world() {
                Some(world) => world.store_nearest_of_ray(self.objects(), world_ray, hit),
                None => self.nearest_of_objects(world_ray, hit, |object, instance, ray| {
                    ray.nearest(object, instance)
                }),
            });
        }
        self.go_on(ray, hit);
    }

    /// Stores the nearest hit of a ray in all objects of a file without scene sections, each in
    /// world space, or in the only visible instance. `trace` returns the nearest hit in one.
    fn nearest_of_objects(
        &self,
        world_ray: WorldRay<'_>,
        best: &mut Hit,
        mut trace: impl FnMut(&ObjectView<'_>, u32, &UnplacedRay<'_>) -> Hit,
    ) {
        let (objects, ray) = (self.objects(), world_ray.ray);
        if let Some((object, instance)) = self.sole_in_f32() {
            *best = trace(object, instance, &UnplacedRay::new(objects, instance, world_ray, ray.tmax));
            return;
        }
        let is_wide = world_ray.wide.is_some();
        let exact_t = |hit: &Hit| {
            let PrimitiveRef { instance, triangle } = hit.primitive;
            let line = RayInInstance::in_world(Some(objects), instance, world_ray, ray.tmax);
            line.exact_t(self.view(instance), triangle)
        };
        for instance in 0..self.object_count() {
            // Another object may be nearer by less than f32 can tell.
            let end = if is_wide { best.t.next_up() } else { best.t };
            // Not `f32::min`, which would replace a `tmax` of NaN by a number.
            let tmax = if end < ray.tmax { end } else { ray.tmax };
            let of_object = UnplacedRay::new(objects, instance, world_ray, tmax);
            let hit = trace(self.view(instance), instance, &of_object);
            let nearer = match is_wide {
                true => better_wide(best, &hit, 1.0, exact_t),
                false => (hit.t < best.t).then_some(hit),
            };
            *best = nearer.unwrap_or(*best);
        }
    }

    /// Returns true if a ray hits anything.
    #[inline(always)]
    pub(crate) fn hits_any<R: Traced>(&self, ray: &R) -> bool {
        match self.sole_opaque() {
            Some(object) if ray.may_start_in(0) => ray.hits_any_in(object),
            _ => self.hits_any_elsewhere(ray),
        }
    }

    /// Like [`Self::hits_any`], in any scene.
    #[inline(never)]
    fn hits_any_elsewhere<R: Traced>(&self, ray: &R) -> bool {
        let (sole, line) = (self.sole(), R::lines(std::slice::from_ref(ray)));
        let is_hit = if let Some((object, instance)) = sole
            && object.exact.is_empty()
        {
            ray.may_start_in(instance) && ray.hits_any_in(object)
        } else if let (Some((object, _)), Some([line])) = (sole, line) {
            in_place::any(object, line)
        } else {
            let any = |world_ray: WorldRay<'_>| match self.world() {
                Some(world) => world.any_of_ray(self.objects(), world_ray),
                None => (0..self.object_count()).any(|instance| {
                    let tmax = world_ray.ray.tmax;
                    UnplacedRay::new(self.objects(), instance, world_ray, tmax).any(self.view(instance))
                }),
            };
            ray.in_world(self, any).unwrap_or(false)
        };
        is_hit && self.hits_what_is_not_transparent(ray)
    }

    /// Stores the answers of a batch.
    pub(crate) fn trace<R: Traced>(&self, rays: &[R], mut answers: Answers<'_>) {
        let (whole, world, lines) = (self.sole(), self.world(), R::lines(rays));
        let (exact, sole) = match whole {
            Some((object, _)) if !object.exact.is_empty() => (whole, None),
            _ => (None, whole),
        };
        // Rays through groups go one by one.
        let world = world.filter(|world| world.groups().is_none());
        let is_batch = rays.len() >= object::MIN_BATCH && (sole.is_some() || world.is_some());
        if !is_batch || !R::go_together(rays, if sole.is_some() { None } else { world }) {
            return match answers {
                Answers::Nearest(hits) => {
                    rays.iter().zip(hits).for_each(|(ray, hit)| self.store_nearest(ray, hit));
                }
                Answers::Any(found) => {
                    rays.iter().zip(found).for_each(|(ray, found)| *found = self.hits_any(ray));
                }
            };
        }
        answers.clear();
        if let (Some((object, instance)), Some(lines)) = (exact, lines) {
            object::with_scratch(|scratch| {
                in_place::trace_batch(object, lines, instance, scratch, answers.reborrow());
            });
        } else if let Some((object, instance)) = sole {
            object::with_scratch(|scratch| {
                R::trace_in_object(object, rays, instance, scratch, answers.reborrow());
            });
        } else if let Some(world) = world {
            R::with_placed(self, rays, |rays| match answers.reborrow() {
                Answers::Nearest(hits) => world.nearest(self.objects(), rays, hits),
                Answers::Any(found) => world.any(self.objects(), rays, found),
            });
        }
        if self.has_opacity() {
            match answers {
                Answers::Nearest(hits) => {
                    rays.iter().zip(hits).for_each(|(ray, hit)| self.go_on(ray, hit));
                }
                Answers::Any(found) => rays.iter().zip(found).for_each(|(ray, found)| {
                    *found = *found && self.hits_what_is_not_transparent(ray);
                }),
            }
        }
    }

    /// Returns true if a ray that hits something hits anything that is not transparent.
    fn hits_what_is_not_transparent<R: Traced>(&self, ray: &R) -> bool {
        let search = |ray: WorldRay<'_>| results::any(self, ray, &Accept::default());
        !self.has_opacity() || ray.in_world(self, search).unwrap_or(false)
    }

    /// Replaces a ray's nearest hit by its nearest one that is not transparent.
    fn go_on<R: Traced>(&self, ray: &R, hit: &mut Hit) {
        if self.has_opacity() && hit.is_hit() && self.opacity(hit) == Opacity::Transparent {
            let search = |ray: WorldRay<'_>| results::nearest(self, ray, &Accept::default());
            *hit = ray.in_world(self, search).flatten().unwrap_or(Hit::MISS);
        }
    }
}

/// The numbers of a ray's hit on a triangle in f64.
fn hit_in_f64(scene: &Scene, ray: WorldRay<'_>, primitive: PrimitiveRef) -> Option<Hit64> {
    let (objects, instance, tmax) = (scene.objects(), primitive.instance, ray.ray.tmax);
    let of_instance = match scene.world() {
        Some(world) => RayInInstance::new(world, objects, (instance, &*world.placed(instance)?), ray, tmax),
        None => RayInInstance::in_world(Some(objects), instance, ray, tmax),
    };
    let corners = corners_by_id(scene.view(scene.object_of(instance)), primitive.triangle)?;
    let found = precise(&WorldLines::line(&of_instance, 0), corners);
    let found = found.or_else(|| of_instance.exact(0).intersection(corners))?;
    let [u, v, determinant] = found.weight;
    let [u, v] = [u, v].map(|weight| (weight / determinant).clamp(0.0, 1.0));
    Some(Hit64 { t: found.t * f64::from(of_instance.of_object.t_scale) + 0.0, u, v, primitive })
}
