//! Rays in world space that may start on a triangle of an instance.

use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::wide;
use crate::rays::{Ray, Ray64, Start};
use bth_format::layout::NONE;

/// A start in the space of the object of an instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceStart {
    pub(crate) instance: u32,
    pub(crate) start: Start,
    pub(crate) point: StartPoint,
    /// The point in world space.
    pub(crate) world: RoundedOrigin,
}

impl InstanceStart {
    /// For a ray that starts on no triangle.
    pub(crate) fn none(origin: [f32; 3]) -> InstanceStart {
        let point = StartPoint::beside(origin);
        InstanceStart { instance: NONE, start: Start::NONE, point, world: point.origin }
    }

    /// The point in world space, rounded to f32.
    pub(crate) fn rounded(&self) -> [f32; 3] {
        self.world.0.map(|x| x as f32)
    }
}

/// A ray in world space, and its start if that is on a triangle. Its origin is then the start
/// rounded to f32. A ray in f64 is rounded, too.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorldRay<'a> {
    pub(crate) ray: &'a Ray,
    pub(crate) start: Option<&'a InstanceStart>,
    /// The ray in f64, if it is one.
    pub(crate) wide: Option<&'a Ray64>,
}

impl<'a> WorldRay<'a> {
    /// A ray with an origin.
    #[inline(always)]
    pub(crate) fn plain(ray: &'a Ray) -> WorldRay<'a> {
        WorldRay { ray, start: None, wide: None }
    }

    /// The start, if it is on this instance.
    #[inline(always)]
    pub(crate) fn start_in(&self, instance: u32) -> Option<&'a StartPoint> {
        self.start.filter(|start| start.instance == instance).map(|start| &start.point)
    }

    /// The line in world space.
    #[inline(always)]
    pub(crate) fn line(&self) -> RoundedLine {
        let origin = match (self.start, self.wide) {
            (None, None) => return RoundedLine::of_ray(self.ray),
            (Some(start), _) => start.world,
            (None, Some(ray)) => RoundedOrigin(ray.origin, 0.0),
        };
        RoundedLine { origin, direction: self.direction(), direction_error: 0.0 }
    }

    /// The line with the error of its range in f32.
    pub(crate) fn rounded_line(&self) -> RoundedLine {
        let line = self.line();
        if self.wide.is_some() { line.with_rounded_range() } else { line }
    }

    /// The direction in world space.
    #[inline(always)]
    pub(crate) fn direction(&self) -> [f64; 3] {
        self.wide.map_or_else(|| wide(self.ray.direction), |ray| ray.direction)
    }

    /// The origin in world space of a ray that does not start on a triangle.
    pub(crate) fn origin(&self) -> [f64; 3] {
        self.wide.map_or_else(|| wide(self.ray.origin), |ray| ray.origin)
    }

    /// The range of t.
    pub(crate) fn range(&self) -> [f64; 2] {
        match self.wide {
            Some(ray) => [ray.tmin, ray.tmax],
            None => [self.ray.tmin.into(), self.ray.tmax.into()],
        }
    }
}

/// A ray that was placed in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedRay {
    pub(crate) ray: Ray,
    pub(crate) start: Option<InstanceStart>,
}

impl PlacedRay {
    pub(crate) fn world_ray(&self) -> WorldRay<'_> {
        WorldRay { ray: &self.ray, start: self.start.as_ref(), wide: None }
    }
}
