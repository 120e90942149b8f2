//! Mutual visibility of two points: no triangle may cross the open segment between them.
//!
//! A triangle blocks the segment from A to B if the line of the direction B - A from A crosses the
//! closed triangle at a t between 0 and 1, exclusive. Triangles through A or B, or in a plane with
//! both, do not block.

use crate::bvh::enumerate::enumerate_within;
use crate::enumerate::{EnteredInstance, enumerate_instances};
use crate::intersect::exact::{Estimate, RATIO_ERROR, estimate};
use crate::intersect::exact_line::{ExactLine, Rows, SegmentLine, image, image_of_start};
use crate::intersect::exact_ray::{ExactRay, LineLanes, LineSource, WorldLines};
use crate::intersect::long::LongLine;
use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::start::corners_by_id;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::{max_norm, minus, wide};
use crate::nodes::ObjectRay;
use crate::query::{Receiver, TriangleRef};
use crate::rays::{Ray, Start};
use crate::scene::Scene;
use crate::start_points::place_start;
use crate::starts::world_ray::InstanceStart;
use bth_format::exact::{Dyadic, DyadicVector, wide_side};
use bth_format::layout::Opacity;
use bth_format::object::ObjectView;
use std::cmp::Ordering;

/// An end of a segment: a point of a surface, or a point in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentEnd {
    /// The exact point of a triangle.
    Start(Start),
    /// A point in world space.
    Point([f32; 3]),
}

impl From<Start> for SegmentEnd {
    fn from(start: Start) -> Self {
        SegmentEnd::Start(start)
    }
}

impl From<[f32; 3]> for SegmentEnd {
    fn from(point: [f32; 3]) -> Self {
        SegmentEnd::Point(point)
    }
}

impl SegmentEnd {
    /// The order in which the ends of a segment are taken, so that both directions have the same
    /// answer whatever is rounded.
    fn order(&self) -> [u32; 5] {
        match self {
            SegmentEnd::Start(Start { primitive, u, v }) => {
                [0, primitive.instance, primitive.triangle, u.to_bits(), v.to_bits()]
            }
            SegmentEnd::Point(point) => {
                let [x, y, z] = point.map(f32::to_bits);
                [1, x, y, z, 0]
            }
        }
    }
}

/// An end of a segment in the world.
struct PlacedEnd {
    world: RoundedOrigin,
    start: Option<InstanceStart>,
}

/// Returns true if no triangle crosses the open segment between two points.
pub(super) fn see_each_other(scene: &Scene, a: SegmentEnd, b: SegmentEnd) -> bool {
    let (a, b) = if b.order() < a.order() { (b, a) } else { (a, b) };
    let (Some(a), Some(b)) = (place_end(scene, &a), place_end(scene, &b)) else { return false };
    let origin = a.world.0.map(|x| x as f32);
    let direction = minus(b.world.0, wide(origin)).map(|x| x as f32);
    // Only which instances lie near the segment: those that hold an end are hit in any case.
    let ray = Ray { origin, tmin: 0.0, direction, tmax: 1.0 };
    let ends = [&a, &b].map(|end| end.start.as_ref().map(|start| start.instance));
    for (i, end) in ends.into_iter().enumerate() {
        let is_new = i == 0 || end != ends[0];
        let Some(instance) = end.filter(|_| is_new) else { continue };
        let placement = scene.world().and_then(|world| world.placed(instance));
        let entered = EnteredInstance::new(scene, instance, placement.as_deref());
        if blocks_in(scene, &entered, &a, &b) {
            return false;
        }
    }
    let line = || {
        let direction = minus(b.world.0, a.world.0);
        let off = (a.world.1 + b.world.1) * (1.0 + RATIO_ERROR) / max_norm(direction) + DIFFERENCE_ERROR;
        RoundedLine { origin: a.world, direction, direction_error: off }.or_unknown()
    };
    let is_blocked = enumerate_instances(scene, (&ray, &line), &mut |entered| {
        let was_met = ends.contains(&Some(entered.instance));
        let blocks = !was_met && blocks_in(scene, &entered, &a, &b);
        (!blocks).then_some(1.0)
    });
    !is_blocked
}

fn place_end(scene: &Scene, end: &SegmentEnd) -> Option<PlacedEnd> {
    match end {
        SegmentEnd::Point(point) => {
            let world = RoundedOrigin(wide(*point), 0.0);
            point.iter().all(|x| x.is_finite()).then_some(PlacedEnd { world, start: None })
        }
        SegmentEnd::Start(start) => {
            let start = place_start(scene, start).ok()?;
            Some(PlacedEnd { world: start.world, start: Some(start) })
        }
    }
}

impl PlacedEnd {
    /// The end in the space of an instance's object.
    fn in_object(&self, entered: &EnteredInstance<'_>) -> RoundedOrigin {
        match &self.start {
            Some(start) if start.instance == entered.instance => start.point.origin,
            _ => entered.point(self.world),
        }
    }

    /// The end in world space exactly, times a positive number, which is the second result.
    fn exact(&self, scene: &Scene) -> (DyadicVector, Dyadic) {
        let start = self.start.as_ref().and_then(|start| {
            let object = scene.view(scene.object_of(start.instance));
            let corners = corners_by_id(object, start.start.primitive.triangle)?;
            let weights = [start.point.u.into(), start.point.v.into()];
            Some(image_of_start(rows(scene, start.instance).as_ref(), corners, weights))
        });
        start.unwrap_or_else(|| (image(None, self.world.0), Dyadic::from(1.0)))
    }
}

/// The transform of an instance, if there are any.
fn rows(scene: &Scene, instance: u32) -> Option<Rows> {
    scene.world().map(|world| world.row(scene.objects(), instance).to_world.rows())
}

/// 2^-52: bounds the rounding of a difference, relative to the difference.
const DIFFERENCE_ERROR: f64 = f64::EPSILON;

/// Returns true if a triangle of an instance blocks a segment.
fn blocks_in(scene: &Scene, entered: &EnteredInstance<'_>, a: &PlacedEnd, b: &PlacedEnd) -> bool {
    let [RoundedOrigin(from, from_off), RoundedOrigin(to, to_off)] = [a, b].map(|end| end.in_object(entered));
    let direction = minus(to, from);
    let off = (from_off + to_off) * (1.0 + RATIO_ERROR) / max_norm(direction) + DIFFERENCE_ERROR;
    let line =
        RoundedLine { origin: RoundedOrigin(from, from_off), direction, direction_error: off }.or_unknown();
    let mut of_object = ObjectRay::of(line, 0.0, 1.0);
    of_object.set_anchor(entered.object.anchor);
    let segment = Segment { scene, instance: entered.instance, ends: [a, b], line: of_object.line };
    let ray = ExactRay::new(&of_object.ray, LineSource::World(&segment, 0));
    let t_scale = f64::from(of_object.t_scale);
    let bounds = of_object.line.bounds(entered.object);
    let mut blocking = Blocking { object: entered.object, segment: &segment, t_scale };
    enumerate_within(entered.object, &bounds, ray, &mut blocking)
}

/// The segment between two points through an instance.
struct Segment<'a> {
    scene: &'a Scene,
    instance: u32,
    ends: [&'a PlacedEnd; 2],
    /// The line in the space of the object.
    line: RoundedLine,
}

impl Segment<'_> {
    /// Returns true if an end lies on a triangle, which then does not block: its plane holds only
    /// the end, or the whole segment.
    fn is_at_end(&self, triangle: TriangleRef<'_>) -> bool {
        let starts = self.ends.iter().filter_map(|end| end.start.as_ref());
        let mut starts = starts.filter(|start| start.instance == self.instance);
        starts.any(|start| start.start.primitive.triangle == triangle.read())
    }

    /// Returns true if the corners of the triangles that the ends lie on tell that a triangle does
    /// not block: both ends are on one side of its plane, or one is in it. Most triangles that f64
    /// leaves open are neighbors in a surface that is flat or nearly flat.
    #[cold]
    fn is_passed(&self, object: &ObjectView<'_>, triangle: [[f64; 3]; 3]) -> bool {
        let side_of = |end: &PlacedEnd| {
            let start = end.start.as_ref().filter(|start| start.instance == self.instance)?;
            let corners = corners_by_id(object, start.start.primitive.triangle)?;
            let sides = corners.map(|corner| wide_side(triangle, corner));
            let has = |side| sides.contains(&side);
            match (has(Ordering::Less), has(Ordering::Greater)) {
                (true, true) => None,
                (true, false) => Some(Ordering::Less),
                (false, true) => Some(Ordering::Greater),
                (false, false) => Some(Ordering::Equal),
            }
        };
        let [from, to] = self.ends;
        match side_of(from) {
            Some(Ordering::Equal) => true,
            from => matches!(side_of(to), Some(to) if to == Ordering::Equal || Some(to) == from),
        }
    }

    fn exact_segment(&self) -> SegmentLine {
        let [from, to] = self.ends.map(|end| end.exact(self.scene));
        SegmentLine::between(from, to, rows(self.scene, self.instance))
    }
}

impl WorldLines for Segment<'_> {
    fn line(&self, _ray: usize) -> RoundedLine {
        self.line
    }
    fn lanes(&self, _first: usize, _rays: &[u32], of_lanes: &mut LineLanes) {
        of_lanes.set(0, &self.line);
    }
    fn common_origin(&self, _first: usize, _count: usize) -> Option<RoundedLine> {
        None
    }
    fn long(&self, _ray: usize) -> Option<LongLine> {
        None
    }
    fn exact(&self, _ray: usize) -> ExactLine {
        self.exact_segment().line
    }
    fn start(&self, _ray: usize) -> Option<&StartPoint> {
        None
    }
    fn range(&self, _ray: usize) -> Option<[f64; 2]> {
        None
    }
    fn are_from_starts(&self) -> bool {
        true
    }
}

/// Ends the enumeration at a triangle that blocks a segment.
struct Blocking<'a> {
    object: &'a ObjectView<'a>,
    segment: &'a Segment<'a>,
    /// Factor from t of the line to t of the segment.
    t_scale: f64,
}

impl Blocking<'_> {
    /// u and v where a triangle blocks the segment, if it does.
    fn crossed(&self, corners: [[f64; 3]; 3]) -> Option<[f32; 2]> {
        let line = self.segment.line;
        match estimate(line, line.direction, corners) {
            Estimate::Missed => None,
            Estimate::Intersects(found) => {
                let (t, off) = (found.t * self.t_scale, 2.0 * RATIO_ERROR);
                if t <= 0.0 || t > 1.0 + off {
                    None
                } else if t < 1.0 - off {
                    Some(found.uv())
                } else {
                    self.segment.exact_segment().crossed(corners)
                }
            }
            Estimate::Open(_, [_, last]) if last <= 0.0 => None,
            Estimate::Open(uncertain, [first, last])
                if first > 0.0 && last * self.t_scale < 1.0 - RATIO_ERROR =>
            {
                Some(uncertain.uv())
            }
            Estimate::Open(..) if self.segment.is_passed(self.object, corners) => None,
            Estimate::Open(..) => self.segment.exact_segment().crossed(corners),
        }
    }
}

impl Receiver for Blocking<'_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        if self.segment.is_at_end(triangle) {
            return false;
        }
        let Some([u, v]) = self.crossed(self.object.exact_corners(|| triangle.read(), corners)) else {
            return false;
        };
        let opacity = self.object.opacity.is_empty();
        opacity || self.object.opacity_at(triangle.read(), u, v) != Opacity::Transparent
    }
    fn limit(&self) -> f64 {
        f64::INFINITY
    }
}
