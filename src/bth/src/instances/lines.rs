//! Lines of world space through instances: in f64 in the space of an object, and exactly in world
//! space, where the triangles of an instance are the images of the object's triangles.

use super::World;
use super::placement::Placement;
use super::scene_batch::SceneBatch;
use crate::intersect::exact_line::{ExactLine, image, image_of_start};
use crate::intersect::exact_ray::{ExactRay, LineSource, WorldLines};
use crate::intersect::origin::RoundedLine;
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start::start_corners;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::wide;
use crate::nodes::affine::ObjectRay;
use crate::object::single::SingleRay;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::shortcuts::free;
use crate::simd::Simd;
use crate::starts::world_ray::WorldRay;
use bth_format::exact::{Dyadic, dyadic_vector};
use bth_format::object::{ObjectBounds, ObjectView};

/// The line of a ray in the space of an instance's object.
#[inline(always)]
pub(super) fn line_in(placement: &Placement, instance: u32, ray: &WorldRay<'_>) -> RoundedLine {
    let mut line = placement.line(&ray.line());
    if let Some(start) = ray.start_in(instance) {
        line.origin = start.origin;
    }
    line
}

/// The line of a ray through an instance, exactly. Its direction is divided by `t_scale`.
#[cold]
fn exact_line(
    world: &World,
    objects: &Objects,
    instance: u32,
    (ray, t_scale): (&WorldRay<'_>, f32),
) -> ExactLine {
    let rows = |instance: u32| world.row(objects, instance).to_world.rows();
    let start = ray.start.and_then(|start| {
        let object = objects.view(world.placement(start.instance).object());
        let corners = start_corners(object, start.point.leaf, start.point.slot)?.map(wide);
        let weights = [start.point.u.into(), start.point.v.into()];
        Some(image_of_start(Some(&rows(start.instance)), corners, weights))
    });
    let (origin, weight) = start.unwrap_or_else(|| (image(None, wide(ray.ray.origin)), Dyadic::from(1.0)));
    let scale = Dyadic::from(f64::from(t_scale));
    let direction = dyadic_vector(wide(ray.ray.direction)).map(|x| &x * &scale);
    ExactLine { origin, weight, direction, to_world: Some(rows(instance)) }
}

/// A ray through an instance.
pub(crate) struct RayInInstance<'a> {
    world: &'a World,
    objects: &'a Objects,
    pub(crate) instance: u32,
    ray: WorldRay<'a>,
    /// The ray in the space of the object.
    pub(crate) of_object: ObjectRay,
}

impl<'a> RayInInstance<'a> {
    /// A ray that ends at `tmax`, in a visible instance.
    #[inline(always)]
    pub(crate) fn new(
        world: &'a World,
        objects: &'a Objects,
        instance: u32,
        ray: WorldRay<'a>,
        tmax: f32,
    ) -> RayInInstance<'a> {
        let line = line_in(world.placement(instance), instance, &ray);
        let of_object = ObjectRay::of(line, ray.ray.tmin, tmax);
        RayInInstance { world, objects, instance, ray, of_object }
    }

    pub(crate) fn exact_ray(&self) -> ExactRay<'_> {
        ExactRay { ray: &self.of_object.ray, line: LineSource::World(self, 0) }
    }
}

impl WorldLines for RayInInstance<'_> {
    fn line(&self, _ray: usize) -> RoundedLine {
        self.of_object.line
    }
    fn exact(&self, _ray: usize) -> ExactLine {
        exact_line(self.world, self.objects, self.instance, (&self.ray, self.of_object.t_scale))
    }
    fn start(&self, _ray: usize) -> Option<&StartPoint> {
        self.ray.start_in(self.instance)
    }
    fn are_from_starts(&self) -> bool {
        self.ray.start.is_some()
    }
}

/// A ray through an instance in the space of its object, and the bounds for which it is prepared.
pub(crate) struct InstanceLine {
    ray: Ray,
    bounds: ObjectBounds,
}

impl SingleRay for RayInInstance<'_> {
    type Line = InstanceLine;
    #[inline(always)]
    fn line<S: Simd>(&self, s: S, object: &ObjectView<'_>) -> Option<InstanceLine> {
        let mut ray = self.of_object.ray;
        if let Some(start) = self.ray.start.filter(|start| start.instance == self.instance) {
            ray.tmin = free::begin(s, object, start.start.primitive.triangle, &start.point, ray.direction);
        }
        let bounds = self.of_object.line.bounds(&object.bounds);
        (ray.tmin < f32::INFINITY).then_some(InstanceLine { ray, bounds })
    }
    #[inline(always)]
    fn exact<'a>(&'a self, line: &'a InstanceLine) -> ExactRay<'a> {
        ExactRay { ray: &line.ray, line: LineSource::World(self, 0) }
    }
    #[inline(always)]
    fn bounds<'a>(_object: &'a ObjectView<'_>, line: &'a InstanceLine) -> &'a ObjectBounds {
        &line.bounds
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, line: &InstanceLine, bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of(s, bounds, &line.ray)
    }
}

/// The lines of the visits of an object by rays of a batch.
pub(super) struct VisitLines<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) visits: &'a [Visit],
    /// For each visit the factor from t in the object to t in world space.
    pub(super) t_scale: &'a [f32],
}

impl WorldLines for VisitLines<'_> {
    fn line(&self, visit: usize) -> RoundedLine {
        let Visit { ray, instance } = self.visits[visit];
        let line =
            line_in(self.batch.world.placement(instance), instance, &self.batch.world_ray(ray as usize));
        line.with_direction_times(f64::from(self.t_scale[visit]))
    }
    fn exact(&self, visit: usize) -> ExactLine {
        let (Visit { ray, instance }, SceneBatch { world, objects, .. }) = (self.visits[visit], self.batch);
        let ray = self.batch.world_ray(ray as usize);
        exact_line(world, objects, instance, (&ray, self.t_scale[visit]))
    }
    fn start(&self, visit: usize) -> Option<&StartPoint> {
        self.batch.start(self.visits[visit]).map(|start| &start.point)
    }
    fn are_from_starts(&self) -> bool {
        !self.batch.starts.is_empty()
    }
}

/// The ray of a visit by itself, ended at `tmax`.
pub(super) fn visit_ray<'a>(batch: &SceneBatch<'a>, visit: Visit, tmax: f32) -> RayInInstance<'a> {
    let ray = batch.world_ray(visit.ray as usize);
    RayInInstance::new(batch.world, batch.objects, visit.instance, ray, tmax)
}
