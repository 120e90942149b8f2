//! Lines of world space through instances: in f64 in the space of an object, and exactly in world
//! space, where the triangles of an instance are the images of the object's triangles.

use super::World;
use super::placement::Placement;
use super::scene_batch::SceneBatch;
use crate::intersect::exact_line::{ExactLine, ExactT, Rows, image, image_of_start};
use crate::intersect::exact_ray::{ExactRay, LineLanes, LineSource, WorldLines};
use crate::intersect::long::{
    LONG_ERROR, Long, LongLine, LongVector, long_difference, long_dot, long_start, long_vector,
};
use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start::corners_by_id;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::max_norm;
use crate::nodes::affine::ObjectRay;
use crate::object::single::SingleRay;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{Hit, Ray, Ray64};
use crate::shortcuts::free;
use crate::simd::{Isa, Kernel, LANES, Simd};
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::exact::{Dyadic, dyadic_vector};
use bth_format::object::{ObjectBounds, ObjectView};
use glam::Vec4;

/// Where a ray goes through an object.
#[derive(Clone, Copy)]
pub(super) enum Place<'a> {
    /// The object's space is world space. Rays may start on one of these objects; each is the
    /// instance with its index.
    World(Option<&'a Objects>),
    /// It is the object of this instance.
    Instance(&'a World, &'a Objects, u32),
}

impl Place<'_> {
    /// The transform to world space.
    fn rows(&self) -> Option<Rows> {
        match *self {
            Place::World(_) => None,
            Place::Instance(world, objects, instance) => Some(world.row(objects, instance).to_world.rows()),
        }
    }
}

/// The line of a ray in the space of an instance's object.
#[inline(always)]
pub(super) fn line_in(placement: &Placement, instance: u32, ray: &WorldRay<'_>) -> RoundedLine {
    let mut line = placement.line(&ray.line());
    if let Some(start) = ray.start_in(instance) {
        line.origin = start.origin;
    }
    line
}

/// The triangle on which a ray starts.
struct StartTriangle {
    corners: [[f64; 3]; 3],
    weights: [f64; 2],
    to_world: Option<Rows>,
}

impl StartTriangle {
    fn of(place: Place<'_>, start: &InstanceStart) -> Option<StartTriangle> {
        let (object, to_world) = match place {
            Place::World(objects) => (objects?.view(start.instance), None),
            Place::Instance(world, objects, _) => {
                let row = world.row(objects, start.instance);
                (objects.view(row.object), Some(row.to_world.rows()))
            }
        };
        let corners = corners_by_id(object, start.start.primitive.triangle)?;
        let weights = [start.point.u.into(), start.point.v.into()];
        Some(StartTriangle { corners, weights, to_world })
    }
}

/// The line of a ray through an object, exactly. Its direction is divided by `t_scale`.
#[cold]
pub(super) fn exact_line(place: Place<'_>, ray: &WorldRay<'_>, t_scale: f32) -> ExactLine {
    let start = ray.start.and_then(|start| StartTriangle::of(place, start));
    let (origin, weight) = match start {
        Some(of) => image_of_start(of.to_world.as_ref(), of.corners, of.weights),
        None => (image(None, ray.origin()), Dyadic::from(1.0)),
    };
    let scale = Dyadic::from(f64::from(t_scale));
    let direction = dyadic_vector(ray.direction()).map(|x| &x * &scale);
    ExactLine { origin, weight, direction, to_world: place.rows() }
}

/// The line of a ray through an object with more digits. Its direction is divided by `t_scale`.
#[cold]
pub(super) fn long_line(place: Place<'_>, ray: &WorldRay<'_>, t_scale: f32) -> Option<LongLine> {
    let direction = long_vector(ray.direction().map(|x| x * f64::from(t_scale)));
    let (origin, origin_error, to_world) = match ray.start {
        None => (long_vector(ray.origin()), 0.0, None),
        Some(start) => {
            let StartTriangle { corners, weights, to_world } = StartTriangle::of(place, start)?;
            let size = corners.iter().fold(0.0f64, |most, corner| most.max(max_norm(*corner)));
            (long_start(corners, weights), 8.0 * LONG_ERROR * size, to_world.map(|rows| (rows, size)))
        }
    };
    let Place::Instance(world, _, instance) = place else {
        return Some(LongLine { origin, origin_error, direction, direction_error: 0.0 });
    };
    let (rows, placement) = (place.rows()?, world.placed(instance)?);
    let Placement { inverse, accuracy, .. } = placement.as_ref();
    let (direction, off) = inverse.solve(*accuracy, &rows, (direction, 0.0));
    let direction_error = off / max_norm(direction.map(Long::rounded));
    if ray.start_in(instance).is_some() {
        return Some(LongLine { origin, origin_error, direction, direction_error });
    }
    let (origin, origin_error) = match to_world {
        Some((rows, size)) => image_of_long(&rows, origin, size),
        None => (origin, origin_error),
    };
    let relative = long_difference(origin, long_vector(inverse.origin));
    let (origin, origin_error) = inverse.solve(*accuracy, &rows, (relative, origin_error));
    Some(LongLine { origin, origin_error, direction, direction_error })
}

/// The image of a point with coordinates of at most `size`, and a bound of its error.
fn image_of_long(rows: &Rows, point: LongVector, size: f64) -> (LongVector, f64) {
    let image = rows.map(|[x, y, z, offset]| long_dot(long_vector([x, y, z]), point) + Long::from(offset));
    let norm = rows.iter().fold(0.0f64, |most, [x, y, z, _]| most.max(x.abs() + y.abs() + z.abs()));
    let greatest = max_norm(image.map(Long::rounded));
    (image, 16.0 * LONG_ERROR * (norm * size + greatest))
}

/// A ray through an instance, or through an object whose space is world space.
pub(crate) struct RayInInstance<'a> {
    place: Place<'a>,
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
        (instance, placement): (u32, &Placement),
        ray: WorldRay<'a>,
        tmax: f32,
    ) -> RayInInstance<'a> {
        let line = line_in(placement, instance, &ray);
        let of_object = ObjectRay::of(line, ray.ray.tmin, tmax);
        RayInInstance { place: Place::Instance(world, objects, instance), instance, ray, of_object }
    }

    /// A ray that ends at `tmax`, in an object whose space is world space. `objects` are those on
    /// which it may start.
    pub(crate) fn in_world(
        objects: Option<&'a Objects>,
        instance: u32,
        ray: WorldRay<'a>,
        tmax: f32,
    ) -> RayInInstance<'a> {
        let of_object = ObjectRay::of(ray.line().or_unknown(), ray.ray.tmin, tmax);
        RayInInstance { place: Place::World(objects), instance, ray, of_object }
    }

    /// The exact t at which the ray hits a triangle of the object.
    pub(crate) fn exact_t(&self, object: &ObjectView<'_>, triangle: u32) -> Option<ExactT> {
        Some(
            WorldLines::exact(self, 0)
                .exact_t(corners_by_id(object, triangle)?)?
                .times(f64::from(self.of_object.t_scale)),
        )
    }

    /// A hit of this ray with its t in world space; a miss where f32 does not hold that.
    pub(crate) fn hit_in_world(&self, hit: Hit) -> Hit {
        let t = hit.t * self.of_object.t_scale;
        if hit.is_hit() && t.is_finite() { Hit { t, ..hit } } else { Hit::MISS }
    }

    /// The same ray with its f32 numbers relative to an object's anchor.
    pub(crate) fn relative_to(mut self, anchor: [f64; 3]) -> Self {
        self.of_object.set_anchor(anchor);
        self
    }

    pub(crate) fn exact_ray(&self) -> ExactRay<'_> {
        ExactRay::new(&self.of_object.ray, LineSource::World(self, 0))
    }
}

impl WorldLines for RayInInstance<'_> {
    fn line(&self, _ray: usize) -> RoundedLine {
        self.of_object.line
    }
    fn lanes(&self, _first: usize, _rays: &[u32], of_lanes: &mut LineLanes) {
        of_lanes.set(0, &self.of_object.line);
    }
    fn common_origin(&self, _first: usize, _count: usize) -> Option<RoundedLine> {
        None
    }
    fn long(&self, _ray: usize) -> Option<LongLine> {
        long_line(self.place, &self.ray, self.of_object.t_scale)
    }
    fn exact(&self, _ray: usize) -> ExactLine {
        exact_line(self.place, &self.ray, self.of_object.t_scale)
    }
    fn start(&self, _ray: usize) -> Option<&StartPoint> {
        self.ray.start_in(self.instance)
    }
    fn are_from_starts(&self) -> bool {
        self.ray.start.is_some()
    }
    fn range(&self, _ray: usize) -> Option<[f64; 2]> {
        let Ray64 { tmin, tmax, .. } = self.ray.wide?;
        Some([tmin, tmax].map(|t| t / f64::from(self.of_object.t_scale)))
    }
}

/// A ray through an instance in the space of its object, its floats as rows of four, and the bounds
/// for which it is prepared.
pub(crate) struct InstanceLine {
    rows: [Vec4; 2],
    pub(super) ray: Ray,
    /// `None` where the object's bounds for [near lines](ObjectBounds::for_near_lines) hold.
    bounds: Option<ObjectBounds>,
}

impl InstanceLine {
    #[inline(always)]
    pub(super) fn new(rows: [Vec4; 2], bounds: Option<ObjectBounds>) -> InstanceLine {
        let floats = [rows[0].to_array(), rows[1].to_array()];
        InstanceLine { rows, ray: zerocopy::transmute!(floats), bounds }
    }

    #[inline(always)]
    pub(super) fn bounds<'a>(&'a self, object: &'a ObjectView<'_>) -> &'a ObjectBounds {
        self.bounds.as_ref().unwrap_or(&object.near_bounds)
    }

    #[inline(always)]
    pub(super) fn prepared<S: Simd>(&self, s: S, bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of_rows(s, bounds, self.rows, &self.ray)
    }
}

impl SingleRay for RayInInstance<'_> {
    type Line = InstanceLine;
    #[inline(always)]
    fn line<S: Simd>(&self, s: S, object: &ObjectView<'_>) -> Option<InstanceLine> {
        let (ObjectRay { ray, line, .. }, mut tmin) = (&self.of_object, self.of_object.ray.tmin);
        let origin = line.relative_to(object.anchor);
        let [[x, y, z], [dx, dy, dz]] = [origin, line.direction].map(|v| v.map(|x| x as f32));
        if let Some(start) = self.ray.start.filter(|start| start.instance == self.instance) {
            tmin = free::begin(s, object, start.start.primitive.triangle, &start.point, [dx, dy, dz]);
            if tmin == f32::INFINITY {
                return None;
            }
        }
        // Vectors are made in registers: loading what was just written word by word would stall.
        let rows = [Vec4::new(x, y, z, tmin), Vec4::new(dx, dy, dz, ray.tmax)];
        let line = if self.ray.wide.is_none() { *line } else { line.with_rounded_range() };
        let [x, y, z, _] = rows[0].abs().to_array();
        let errors = [line.origin.1, line.direction_error].map(|x| x as f32);
        let bounds = object.bounds.for_far_lines(x.max(y).max(z), errors[0], errors[1]);
        Some(InstanceLine::new(rows, bounds))
    }
    #[inline(always)]
    fn exact<'a>(&'a self, line: &'a InstanceLine) -> ExactRay<'a> {
        ExactRay::new(&line.ray, LineSource::World(self, 0))
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, line: &'a InstanceLine) -> &'a ObjectBounds {
        line.bounds(object)
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, line: &InstanceLine, bounds: &ObjectBounds) -> Option<PreparedRay> {
        line.prepared(s, bounds)
    }
}

/// The lines of the visits of an object by rays of a batch.
pub(super) struct VisitLines<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) visits: &'a [Visit],
    /// For each visit the factor from t in the object to t in world space.
    pub(super) t_scale: &'a [f32],
}

impl<'a> VisitLines<'a> {
    fn place_of(&self, visit: usize) -> (Place<'a>, WorldRay<'a>) {
        let (Visit { ray, instance }, SceneBatch { world, objects, .. }) = (self.visits[visit], self.batch);
        (Place::Instance(world, objects, instance), self.batch.world_ray(ray as usize))
    }
}

impl WorldLines for VisitLines<'_> {
    fn line(&self, visit: usize) -> RoundedLine {
        let Visit { ray, instance } = self.visits[visit];
        let line =
            line_in(self.batch.world.placement(instance), instance, &self.batch.world_ray(ray as usize));
        line.with_direction_times(f64::from(self.t_scale[visit]))
    }
    fn lanes(&self, first: usize, rays: &[u32], of_lanes: &mut LineLanes) {
        let visit = |lane: usize| first + rays[lane] as usize;
        let Some(Visit { instance, .. }) = self.visits.get(visit(0)) else { return };
        let mut is_plain = self.batch.starts.is_empty() && self.batch.wide.is_empty();
        let mut of_world = [[[0.0; LANES]; 3]; 2];
        for lane in 0..rays.len().min(LANES) {
            let Visit { ray, instance: of } = self.visits[visit(lane)];
            is_plain &= (of == *instance) & (self.t_scale[visit(lane)] == 1.0);
            let Ray { origin, direction, .. } = &self.batch.rays[ray as usize];
            for k in 0..3 {
                (of_world[0][k][lane], of_world[1][k][lane]) = (origin[k], direction[k]);
            }
        }
        if is_plain {
            let placement = self.batch.world.placement(*instance);
            return Isa::chosen().run(LanesKernel { placement, of_world: &of_world, of_lanes });
        }
        for lane in 0..rays.len().min(LANES) {
            of_lanes.set(lane, &self.line(visit(lane)));
        }
    }
    fn common_origin(&self, first: usize, count: usize) -> Option<RoundedLine> {
        let (visits, batch) = (&self.visits[first..first + count], self.batch);
        let Visit { ray, instance } = visits[0];
        let (origin, wide) = (batch.rays[ray as usize].origin, batch.wide.get(ray as usize));
        let is_same = |visit: &Visit| {
            let is_same_wide = batch.wide.get(visit.ray as usize).map(|ray| ray.origin);
            (visit.instance == instance)
                & (batch.rays[visit.ray as usize].origin == origin)
                & (is_same_wide == wide.map(|ray| ray.origin))
        };
        let is_scaled = self.t_scale[first..first + count].iter().any(|scale| *scale != 1.0);
        let is_common = batch.starts.is_empty() && !is_scaled && visits.iter().all(is_same);
        is_common.then(|| self.line(first))
    }
    fn long(&self, visit: usize) -> Option<LongLine> {
        let (place, ray) = self.place_of(visit);
        long_line(place, &ray, self.t_scale[visit])
    }
    fn exact(&self, visit: usize) -> ExactLine {
        let (place, ray) = self.place_of(visit);
        exact_line(place, &ray, self.t_scale[visit])
    }
    fn start(&self, visit: usize) -> Option<&StartPoint> {
        self.batch.start(self.visits[visit]).map(|start| &start.point)
    }
    fn are_from_starts(&self) -> bool {
        !self.batch.starts.is_empty()
    }
    fn range(&self, visit: usize) -> Option<[f64; 2]> {
        let Ray64 { tmin, tmax, .. } = self.batch.wide.get(self.visits[visit].ray as usize)?;
        Some([tmin, tmax].map(|t| t / f64::from(self.t_scale[visit])))
    }
}

/// Sets the lines of sixteen rays of f32 in one instance, with the bits of [`Placement::line`].
struct LanesKernel<'a> {
    placement: &'a Placement,
    /// Origins and directions in world space, by axis.
    of_world: &'a [[[f32; LANES]; 3]; 2],
    of_lanes: &'a mut LineLanes,
}

impl Kernel for LanesKernel<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let LanesKernel { placement, of_world: [origin, direction], of_lanes } = self;
        // There are no branches in this loop, so that the compiler vectorizes it.
        for lane in 0..LANES {
            let [origin, direction] =
                [origin, direction].map(|of| [of[0][lane].into(), of[1][lane].into(), of[2][lane].into()]);
            let origin = RoundedOrigin(origin, 0.0);
            of_lanes.set(lane, &placement.line(&RoundedLine { origin, direction, direction_error: 0.0 }));
        }
    }
}

/// The ray of a visit by itself, ended at `tmax`.
pub(super) fn visit_ray<'a>(batch: &SceneBatch<'a>, visit: Visit, tmax: f32) -> RayInInstance<'a> {
    let ray = batch.world_ray(visit.ray as usize);
    let placement = batch.world.placement(visit.instance);
    RayInInstance::new(batch.world, batch.objects, (visit.instance, placement), ray, tmax)
}
