//! Mutual visibility of two points: no triangle may cross the open segment between them.
//!
//! A triangle blocks the segment from A to B if A and B lie strictly on different sides of its
//! plane, and the segment's line crosses the closed triangle: if the volumes det[a-A, b-A, c-A] and
//! det[a-B, b-B, c-B] have opposite signs, and the signs of det[B-A, p-A, q-A] over its edges p→q
//! do not differ. These are affine in A and in B, so starts on triangles are decided exactly, as
//! for rays ([`mod@crate::intersect::start`]). Triangles through A or B, or in a plane with both,
//! do not block.

use crate::bvh::enumerate::enumerate_within;
use crate::enumerate::{EnteredInstance, enumerate_instances};
use crate::intersect::segment::{ExactEnd, Segment};
use crate::intersect::start::start_on;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::wide;
use crate::query::{Receiver, TriangleRef};
use crate::rays::{Ray, Start};
use crate::scene::Scene;
use crate::start_points::place_start;
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::layout::Opacity;
use bth_format::object::ObjectView;

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
    /// In world space, rounded to f32 unless it is a point.
    origin: [f32; 3],
    start: Option<InstanceStart>,
}

/// Returns true if no triangle crosses the open segment between two points.
pub(super) fn see_each_other(scene: &Scene, a: SegmentEnd, b: SegmentEnd) -> bool {
    let (a, b) = if b.order() < a.order() { (b, a) } else { (a, b) };
    let (Some(a), Some(b)) = (place_end(scene, &a), place_end(scene, &b)) else { return false };
    let direction = [0, 1, 2].map(|k| (f64::from(b.origin[k]) - f64::from(a.origin[k])) as f32);
    // Only which instances lie near the segment: those that hold an end are hit in any case.
    let ray = Ray { origin: a.origin, tmin: 0.0, direction, tmax: 1.0 };
    let ends = [&a, &b].map(|end| end.start.as_ref().map(|start| start.instance));
    for (i, end) in ends.into_iter().enumerate() {
        let is_new = i == 0 || end != ends[0];
        if let (Some(instance), true) = (end, is_new)
            && blocks_in(&EnteredInstance::new(scene, instance), &a, &b)
        {
            return false;
        }
    }
    let is_blocked = enumerate_instances(scene, &ray, &mut |entered| {
        let was_met = ends.contains(&Some(entered.instance));
        let blocks = !was_met && blocks_in(&entered, &a, &b);
        (!blocks).then_some(1.0)
    });
    !is_blocked
}

fn place_end(scene: &Scene, end: &SegmentEnd) -> Option<PlacedEnd> {
    match end {
        SegmentEnd::Point(point) => {
            let origin = *point;
            origin.iter().all(|x| x.is_finite()).then_some(PlacedEnd { origin, start: None })
        }
        SegmentEnd::Start(start) => {
            let (start, origin) = place_start(scene, start).ok()?;
            Some(PlacedEnd { origin, start: Some(start) })
        }
    }
}

/// Returns true if a triangle of an instance blocks a segment.
fn blocks_in(entered: &EnteredInstance<'_>, a: &PlacedEnd, b: &PlacedEnd) -> bool {
    let object = entered.object;
    let in_object = |end: &PlacedEnd| {
        let ray = Ray::new(end.origin, [1.0, 0.0, 0.0]);
        let world_ray = WorldRay { ray: &ray, start: end.start.as_ref() };
        match world_ray.start_in(entered.instance) {
            Some(start) => *start,
            None => StartPoint::beside(entered.object_ray(world_ray).ray.origin),
        }
    };
    let (a, b) = (in_object(a), in_object(b));
    let exact = |point: &StartPoint| match start_on(object, point) {
        Some(start) => ExactEnd::Start(start),
        None => ExactEnd::Point(point.origin.0),
    };
    let segment = Segment { from: exact(&a), to: exact(&b), rounded: [a.origin, b.origin] };
    let farthest = a.origin.0.iter().fold(0.0f32, |most, x| most.max((x.abs() as f32).next_up()));
    let bounds = object.bounds.for_segments(farthest);
    let ray = segment.ray(bounds.origin_error);
    enumerate_within(object, &bounds, (&ray, None), &mut Blocking { object, segment: &segment })
}

/// Ends the enumeration at a triangle that blocks a segment.
struct Blocking<'a> {
    object: &'a ObjectView<'a>,
    segment: &'a Segment,
}

impl Receiver for Blocking<'_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        let Some([u, v]) = self.segment.crossed(corners.map(wide)) else { return false };
        let opacity = self.object.opacity.is_empty();
        opacity || self.object.opacity_at(triangle.read(), u, v) != Opacity::Transparent
    }
    fn limit(&self) -> f64 {
        f64::INFINITY
    }
}
