//! Where rays start: data that traversals pass on. [`super::start`] decides about them.

use super::origin::RoundedOrigin;
use super::vector::wide;
use crate::rays::Ray;
use bth_format::layout::{NONE, WIDTH};

/// A ray as decisions in f64 need it: with the exact point at which it starts, if it starts on a
/// triangle of the object.
pub(crate) type ExactRay<'r> = (&'r Ray, Option<&'r StartPoint>);

/// Where a ray of a batch starts, in the space of the object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StartPoint {
    /// The point, rounded, and a bound of its error.
    pub(crate) origin: RoundedOrigin,
    /// Child code of the leaf that holds the triangle; [`NONE`] if the ray starts on no triangle of
    /// the object, and `origin` is exact.
    pub(crate) leaf: u32,
    /// Slot of the triangle in the leaf.
    pub(crate) slot: u32,
    /// Weights of the second and the third corner.
    pub(crate) u: f32,
    pub(crate) v: f32,
}

impl StartPoint {
    /// For a ray that starts at its f32 origin, on no triangle of the object.
    pub(crate) fn beside(origin: [f32; 3]) -> StartPoint {
        let origin = RoundedOrigin(wide(origin), 0.0);
        StartPoint { origin, leaf: NONE, slot: 0, u: 0.0, v: 0.0 }
    }

    /// Returns true if the ray starts on a triangle of the object.
    #[inline(always)]
    pub(crate) fn is_on_triangle(&self) -> bool {
        self.leaf != NONE
    }
}

/// The bit of the triangle on which a ray starts if it is in the leaf with this child code: a ray
/// does not hit it.
#[inline(always)]
pub(crate) fn own_triangle(start: Option<&StartPoint>, leaf: u32) -> u32 {
    start.filter(|start| start.leaf == leaf).map_or(0, |start| 1 << (start.slot % WIDTH as u32))
}

/// The starts of the rays of a batch; empty where all of them start at their f32 origins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Starts<'a>(pub(crate) &'a [StartPoint]);

impl<'a> Starts<'a> {
    pub(crate) const NONE: Starts<'static> = Starts(&[]);

    /// The start of a ray, if it is on a triangle of the object.
    #[inline(always)]
    pub(crate) fn of(self, ray: usize) -> Option<&'a StartPoint> {
        self.0.get(ray).filter(|start| start.is_on_triangle())
    }

    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    /// The starts of the rays from `first` on.
    #[inline(always)]
    pub(crate) fn from(self, first: usize) -> Starts<'a> {
        Starts(self.0.get(first..).unwrap_or(&[]))
    }
}

impl StartPoint {
    /// The point, rounded to f32.
    #[inline(always)]
    pub(crate) fn rounded(&self) -> [f32; 3] {
        let RoundedOrigin([x, y, z], _) = self.origin;
        [x as f32, y as f32, z as f32]
    }
}
