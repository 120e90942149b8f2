//! The conditions on a hit in an instance: the side of its triangle, its group, its opacity, and
//! the filter of the caller.

use super::accept::Accept;
use crate::intersect::exact::{Intersection, reported};
use crate::masks::Masks;
use crate::query::{Goal, TriangleRef, better};
use crate::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::Opacity;
use bth_format::object::ObjectView;

/// The conditions of a ray in an instance that its mask does not exclude.
pub(super) struct Conditions<'a> {
    /// In world space.
    pub(super) ray: &'a Ray,
    pub(super) instance: u32,
    pub(super) object: &'a ObjectView<'a>,
    /// The masks of the object's groups, if any was set.
    pub(super) groups: Option<&'a [u32]>,
    pub(super) accept: &'a Accept<'a>,
}

impl Conditions<'_> {
    /// The hit of a triangle with this t in world space, if its side, its group and its opacity
    /// allow it.
    pub(super) fn hit(&self, triangle: TriangleRef<'_>, found: &Intersection, t: f32) -> Option<Hit> {
        let [.., determinant] = found.weight;
        if !self.accept.cull.keeps(determinant) || !self.meets_group(triangle) {
            return None;
        }
        let [u, v] = found.uv();
        let primitive = PrimitiveRef { instance: self.instance, triangle: triangle.read() };
        let is_opaque = self.object.opacity_at(primitive.triangle, u, v) != Opacity::Transparent;
        is_opaque.then_some(Hit { t, u, v, primitive })
    }

    /// Returns true if the filter of the caller accepts a hit.
    pub(super) fn pass_filter(&self, hit: &Hit) -> bool {
        self.accept.filter.is_none_or(|accepts| accepts(self.ray, hit))
    }

    /// Returns true if the mask of a triangle's group and the ray's mask have a bit in common.
    fn meets_group(&self, triangle: TriangleRef<'_>) -> bool {
        self.groups.is_none_or(|groups| {
            let group = self.object.group_of(triangle.read());
            self.accept.mask & Masks::of_group(groups, group) != 0
        })
    }
}

/// The nearest hit, or any, that conditions allow.
#[derive(Clone, Copy)]
pub(super) struct AcceptedHit<'a, const IS_ANY: bool> {
    pub(super) conditions: &'a Conditions<'a>,
    /// The nearest hit so far in other instances, in world space.
    pub(super) so_far: &'a Hit,
    /// Factor from t in the space of the object to t in world space.
    pub(super) t_scale: f32,
}

impl<const IS_ANY: bool> Goal for AcceptedHit<'_, IS_ANY> {
    const HAS_CONDITIONS: bool = true;
    #[inline(always)]
    fn is_any(self) -> bool {
        IS_ANY
    }
    #[inline]
    fn accepts(self, triangle: TriangleRef<'_>, found: &Intersection) -> bool {
        let AcceptedHit { conditions, so_far, t_scale } = self;
        let hit = conditions.hit(triangle, found, reported(found.t));
        let hit = hit.and_then(|hit| better(conditions.ray, so_far, &hit, t_scale));
        hit.is_some_and(|hit| conditions.pass_filter(&hit))
    }
}
