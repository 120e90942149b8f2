//! Shafts: bounds of coherent rays for the box test.

use super::Span;
use crate::intersect::boxes::{self, LEAST_COMPONENT, PAD};
use crate::intersect::prepare;
use crate::simd::Simd;
use bth_format::layout::WideNode;
use bth_format::object::ObjectBounds;

/// Bounds of rays whose directions lie in one octant, by interval arithmetic over their origins and
/// directions (Wald, Boulos and Shirley, "Ray Tracing Deformable Scenes Using Dynamic Bounding
/// Volume Hierarchies", TOG 2007).
///
/// A ray reaches a plane at the depth (plane - o)·r. An interval of o, widened by a pad on both
/// sides, and an interval of r bound it. All operations round monotonically, so only roundings need
/// the pad. With u = 2^-24 and P a plane, they come to at most 2u|o||r| for the padded end, and to
/// u|P - o||r| each for the reciprocal, the difference and the product. Clamped components add
/// 4u|P - o||r|. With the distances from c of [`boxes::PAD`] these are
/// 7u|P - c| + 9u|o - c| + 2u|c|, which is 2 · PAD of the lengths there.
#[derive(Clone, Copy)]
pub(crate) struct Shaft<S: Simd> {
    /// For each axis the end of the origins' interval that is nearest to the planes at which rays
    /// enter boxes.
    pub(crate) near_origin: [f32; 3],
    /// For each axis the end that is nearest to the planes at which rays leave boxes.
    pub(crate) far_origin: [f32; 3],
    /// For each axis the min and the max reciprocal of the directions' components.
    reciprocal: [[S::F; 2]; 3],
    /// For each axis the offset of the row of a node with the planes at which rays enter boxes.
    pub(crate) near: [u32; 3],
    /// Min depth of the rays' ranges.
    first: S::F,
}

impl<S: Simd> Shaft<S> {
    /// The shaft of coherent rays ([`Span::is_coherent`]), given for each axis the min and the max
    /// reciprocal of the directions' components in the unit of depth, the min depth of the rays'
    /// ranges, and E.
    #[inline(always)]
    pub(crate) fn new(s: S, span: &Span, reciprocal: [[f32; 2]; 3], first: f32, padded: f32) -> Self {
        let zero = s.splat(0.0);
        let mut shaft = Shaft {
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            reciprocal: [[zero; 2]; 3],
            near: [0; 3],
            first: s.splat(first),
        };
        let pad = 2.0 * PAD as f32 * padded;
        for k in 0..3 {
            shaft.reciprocal[k] = [s.splat(reciprocal[k][0]), s.splat(reciprocal[k][1])];
            let [low, high] = [span.origin[k][0] - pad, span.origin[k][1] + pad];
            let is_negative = span.direction[k][0] < 0.0;
            [shaft.near_origin[k], shaft.far_origin[k]] = if is_negative { [low, high] } else { [high, low] };
            shaft.near[k] = if is_negative { boxes::FAR } else { 0 };
        }
        shaft
    }

    /// The shaft of rays with t as their depth, and the max t of their ranges. `None` if they are
    /// not coherent or if f32 may not be able to prepare them.
    #[inline(always)]
    pub(crate) fn of(s: S, bounds: &ObjectBounds, span: &Span) -> Option<(Self, f32)> {
        let ((padded, is_prepared), main) = (span.padded_extent(bounds), span.main_axis().1);
        if !(span.is_coherent() && is_prepared && 1.0 / prepare::LARGEST < main && main < prepare::LARGEST) {
            return None;
        }
        // The min component of a ray is relative to its max component, which is at least `main`.
        let least = main * LEAST_COMPONENT as f32;
        let mut reciprocal = [[0.0; 2]; 3];
        for k in 0..3 {
            for (i, d) in span.direction[k].into_iter().enumerate() {
                reciprocal[k][1 - i] = 1.0 / d.abs().max(least).copysign(d);
            }
        }
        // A hit's t is rounded before it is compared with the ends of the range.
        let [first, last] = span.range;
        let [first_slack, last_slack] =
            [first, last].map(|t| t.abs() * (4.0 / (1 << 24) as f32) + f32::MIN_POSITIVE);
        let first = (first - first_slack).max(-f32::MAX);
        Some((Shaft::new(s, span, reciprocal, first, padded), last + last_slack))
    }

    /// The children of a node that any ray may enter before the depth `limit`, one bit each, and
    /// lower bounds of the depths at which the rays enter them.
    #[inline(always)]
    pub(crate) fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (self.first, s.splat(limit));
        for k in 0..3 {
            let [least, greatest] = self.reciprocal[k];
            let near = s.load(boxes::row(&node.bounds[k], self.near[k]));
            let far = s.load(boxes::row(&node.bounds[k], self.near[k] ^ boxes::FAR));
            let (near, far) =
                (s.sub(near, s.splat(self.near_origin[k])), s.sub(far, s.splat(self.far_origin[k])));
            enter = s.max(s.min(s.mul(near, least), s.mul(near, greatest)), enter);
            leave = s.min(s.max(s.mul(far, least), s.mul(far, greatest)), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::box_oracle::meets;
    use crate::rays::Ray;
    use crate::simd::{Isa, Kernel};
    use bth_format::layout::{NONE, Object, WIDTH};
    use bth_random::Rng;
    use zerocopy::FromZeros;

    /// The children of a node that the shaft of rays reaches, one bit each, if the rays have a
    /// shaft.
    struct ReachedByShaft<'a>(&'a [Ray], &'a WideNode, ObjectBounds);

    impl Kernel for ReachedByShaft<'_> {
        type Output = Option<u32>;
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Option<u32> {
            let ReachedByShaft(rays, node, bounds) = self;
            let (shaft, limit) = Shaft::of(s, &bounds, &Span::of(s, rays))?;
            Some(shaft.children(s, node, limit).0)
        }
    }

    #[test]
    fn children_that_a_ray_meets_are_reached_and_those_far_from_all_are_not() {
        let mut rng = Rng::new(21);
        let (mut met, mut left_out, mut far) = (0, 0, 0);
        for round in 0..if cfg!(miri) { 20 } else { 4_000 } {
            // Coordinates of magnitude 8, scaled.
            let scale = [1.0, 1e-9, 3e10, 1e-30][round % 4];
            let mut unit = || rng.below(1 << 20) as f32 / (1 << 19) as f32 - 1.0;
            let size = |x: f32| x * scale;
            // In some rounds everything is far from the origin.
            let away = [0.0, 0.0, 1e4][round / 12 % 3];
            let place = |x: f32| size(away + x);
            let object = Object { lower: [place(-8.0); 3], upper: [place(8.0); 3], ..Object::new_zeroed() };
            let bounds = ObjectBounds::new(&object);
            assert_eq!(bounds.away != 0.0, away != 0.0 && scale < 1e10);
            let (eye, spread) = ([(); 3].map(|()| 8.0 * unit()), [0.0, 0.001, 0.3][round / 4 % 3]);
            let middle = [(); 3].map(|()| unit());
            // In some rounds a component is close to zero.
            let middle = [0, 1, 2].map(|k| if round % 5 == k { middle[k] * 1e-7 } else { middle[k] });
            let rays: Vec<Ray> = (0..64 - round % 60)
                .map(|_| Ray {
                    origin: eye.map(|x| place(x + spread * unit())),
                    tmin: if round % 3 == 0 { 2.0 + unit() } else { 0.0 },
                    direction: middle.map(|x| size(x * (1.0 + 0.1 * unit()))),
                    tmax: [f32::INFINITY, 8.0][round % 2],
                })
                .collect();
            let mut node =
                WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };
            let used = WIDTH - round % 3;
            for slot in 0..used {
                // Some boxes are flat, and many lie on the way of a ray.
                let t = 4.0 + 4.0 * unit();
                let ray = &rays[slot % rays.len()];
                for k in 0..3 {
                    let on = (ray.origin[k] + t * ray.direction[k]).clamp(place(-7.0), place(7.0));
                    let at = if slot % 2 == 0 { on } else { place(7.0 * unit()) };
                    let half = if slot % 7 == k { 0.0 } else { size(0.5 + 0.5 * unit()) };
                    (node.bounds[k][0][slot], node.bounds[k][1][slot]) = (at - half, at + half);
                }
            }
            for isa in Isa::ALL {
                let Some(reached) = isa.run(ReachedByShaft(&rays, &node, bounds)) else { continue };
                assert_eq!(reached >> used, 0, "{isa}: unused slots are not reached");
                for slot in 0..used {
                    let [lower, upper] = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
                    let is_reached = reached >> slot & 1 != 0;
                    // A hit's t is rounded before it is compared with the ends of the range.
                    let wider =
                        |ray: &Ray| Ray { tmin: ray.tmin.next_down(), tmax: ray.tmax.next_up(), ..*ray };
                    if rays.iter().any(|ray| meets(&wider(ray), lower, upper, 0.0)) {
                        assert!(is_reached, "{isa}, round {round}: {lower:?}, {upper:?}, {rays:?}");
                        met += 1;
                    } else {
                        far += 1;
                        left_out += usize::from(!is_reached);
                    }
                }
            }
        }
        assert!(met > 100, "{met}");
        assert!(left_out * 10 > far * 8, "{left_out} of {far} boxes that no ray meets are left out");
    }

    #[test]
    fn rays_that_are_not_coherent_or_not_prepared_in_f32_have_no_shaft() {
        let ray = |direction| Ray { origin: [0.0; 3], tmin: 0.0, direction, tmax: f32::INFINITY };
        let node = WideNode { bounds: [[[0.0; WIDTH]; 2]; 3], child: [NONE; WIDTH] };
        let shaft = |rays: [Ray; 2], greatest| {
            Isa::best().run(ReachedByShaft(&rays, &node, ObjectBounds::around(greatest)))
        };
        let coherent = [ray([1.0, 2.0, 3.0]), ray([1.1, 2.0, 3.0])];
        assert!(shaft(coherent, 1.0).is_some());
        assert!(shaft(coherent, 1e30).is_none());
        assert!(shaft([ray([1.0, 2.0, 3.0]), ray([-1.0, 2.0, 3.0])], 1.0).is_none());
        assert!(shaft([ray([1.0, 2.0, 3.0]), ray([1.0, 4.0, 3.0])], 1.0).is_none());
        assert!(shaft([ray([0.0, 2.0, 3.0]), ray([0.0, 2.0, 3.0])], 1.0).is_none());
        assert!(shaft([ray([1e20, 2e20, 3e20]), ray([1e20, 2e20, 3e20])], 1.0).is_none());
        assert!(shaft([ray([1e-20, 2e-20, 3e-20]), ray([1e-20, 2e-20, 3e-20])], 1.0).is_none());
    }
}
