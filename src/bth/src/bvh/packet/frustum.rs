//! Packet bounds of coherent rays: a frustum, by interval arithmetic.

use super::bounds::{FrustumView, PacketBounds, SLACK};
use super::ray_group::RayGroup;
use crate::coherence::Span;
use crate::coherence::shaft::Shaft;
use crate::intersect::boxes;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectBounds;

/// Bounds of coherent rays: a [`Shaft`] for boxes, and for triangles what follows.
///
/// With s = d_x/d_z along one axis z for all, a point's sheared x is
/// (x - c_x) - s₀(z - c_z) + (s₀ - s)(z - c_z) + a with a = (c_x - o_x) - s(c_z - o_z): the middle
/// of the interval of s, its half width, and an interval of a.
///
/// Coherent rays have |s| <= 1.25, rounded at most twice. With u = 2^-24, the first two terms and
/// their difference x' are wrong by at most 4u|z - c_z| + 2u|x'|, s in the third by 3u, the
/// products and sums on the other side by 2u of each of their terms, and a by 16u of the largest
/// distance D of two origins along an axis. [`SLACK`] = 32u of |z - c_z|, of D and of each term on
/// the other side covers them: where |x'| is greater than that side, its error is less than what it
/// exceeds it by. Where all rays have the same origin (`POINT`), the intervals of origins, widened
/// by their pads, are also used for the single rays ([`RayGroup::may_enter`]), and the interval of
/// a is zero.
pub(crate) struct Frustum<S: Simd, const POINT: bool> {
    view: FrustumView,
    shaft: Shaft<S>,
    /// Padded bound of the sheared coordinates of points within the upper sides.
    upper: [f32; 2],
    /// The same for the lower sides, negated.
    lower: [f32; 2],
}

/// Computes the frustum of coherent rays ([`Span::is_coherent`]) that are prepared in `groups`, as
/// a part of kernels.
pub(crate) struct FrustumOf<'a, S: Simd, const POINT: bool> {
    pub(crate) bounds: &'a ObjectBounds,
    pub(crate) span: &'a Span,
    pub(crate) groups: &'a [RayGroup<S>],
}

impl<S: Simd, const POINT: bool> Part<S> for FrustumOf<'_, S, POINT> {
    type Output = Frustum<S, POINT>;
    #[inline(always)]
    fn run(self, s: S) -> Frustum<S, POINT> {
        let FrustumOf { bounds, span, groups } = self;
        let zero = s.splat(0.0);
        let (padded, _) = span.padded_extent(bounds);
        let (main, _) = span.main_axis();
        let axis = [(main + 1) % 3, (main + 2) % 3, main];
        let mut center = [0.0; 3];
        for k in 0..3 {
            let [least, greatest] = span.origin[k];
            center[k] = if POINT { least } else { 0.5 * least + 0.5 * greatest };
        }
        // The ranges of three reciprocals, two slopes and two terms a of sheared coordinates, and
        // the smallest depth.
        let (mut least, mut greatest) = ([s.splat(f32::INFINITY); 8], [s.splat(f32::NEG_INFINITY); 7]);
        for group in groups {
            for k in 0..3 {
                let r = group.reciprocal[k];
                (least[k], greatest[k]) = (s.min(least[k], r), s.max(greatest[k], r));
            }
            for j in 0..2 {
                let slope = match group.common {
                    // This is the same slope, computed when the rays were prepared.
                    Some(common) if common.0 == main => {
                        s.mul(group.projection.shear[j], group.projection.forward)
                    }
                    _ => s.div(group.direction[axis[j]], group.direction[main]),
                };
                (least[3 + j], greatest[3 + j]) = (s.min(least[3 + j], slope), s.max(greatest[3 + j], slope));
                let addend = if POINT {
                    zero
                } else {
                    let from = s.sub(s.splat(center[main]), group.origin[main]);
                    let beside = s.sub(s.splat(center[axis[j]]), group.origin[axis[j]]);
                    s.fnma(slope, from, beside)
                };
                (least[5 + j], greatest[5 + j]) =
                    (s.min(least[5 + j], addend), s.max(greatest[5 + j], addend));
            }
            least[7] = s.min(least[7], group.first);
        }
        let mut ends = [least[7]; LANES];
        for i in 0..7 {
            (ends[i], ends[8 + i]) = (least[i], s.sub(s.splat(0.0), greatest[i]));
        }
        let mut least = [0.0; LANES];
        s.store(s.least_of_each(ends), &mut least);
        let ends = least;
        let both = |of: usize| [ends[of], -ends[8 + of]];
        let view = FrustumView { origin: center, axis, shear: [0.0; 2], shear_width: [0.0; 2] };
        let shaft = Shaft::new(s, span, [both(0), both(1), both(2)], ends[7], padded);
        let mut frustum = Frustum { view, shaft, upper: [0.0; 2], lower: [0.0; 2] };
        let pad = if POINT {
            f32::MIN_POSITIVE
        } else {
            let apart = span.origin.map(|[least, greatest]| greatest - least);
            // A moved origin moves a by at most 2.25 times as much.
            let moved = bounds.origin_error * 2.5;
            apart[0].max(apart[1]).max(apart[2]) * SLACK + moved + f32::MIN_POSITIVE
        };
        for j in 0..2 {
            let shear = both(3 + j);
            let addend = if POINT { [0.0; 2] } else { both(5 + j) };
            let middle = 0.5 * (shear[0] + shear[1]);
            frustum.view.shear[j] = middle;
            frustum.view.shear_width[j] = (shear[1] - middle).max(middle - shear[0]) * (1.0 + SLACK) + SLACK;
            frustum.upper[j] = pad + addend[0].abs() * SLACK - addend[0];
            frustum.lower[j] = pad + addend[1].abs() * SLACK + addend[1];
        }
        frustum
    }
}

impl<S: Simd, const POINT: bool> PacketBounds<S> for Frustum<S, POINT> {
    const MIXED_OCTANTS: bool = false;
    const COMMON_ORIGIN: bool = POINT;
    const IS_ANY: Option<bool> = if POINT { Some(false) } else { None };

    #[inline(always)]
    fn view(&self) -> Option<&FrustumView> {
        POINT.then_some(&self.view)
    }

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        self.shaft.children(s, node, limit)
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let FrustumView { origin, axis, shear, shear_width } = &self.view;
        let depth = s.sub(rows[axis[2]], s.splat(origin[axis[2]]));
        let far = s.abs(depth);
        let mut out = s.splat_u(0);
        for j in 0..2 {
            let x = s.sub(rows[axis[j]], s.splat(origin[axis[j]]));
            let x = s.fnma(s.splat(shear[j]), depth, x);
            let width = s.splat(shear_width[j]);
            let above = s.lt(s.fma(far, width, s.splat(self.upper[j])), x);
            let below = s.lt(s.fma(far, width, s.add(x, s.splat(self.lower[j]))), s.splat(0.0));
            out = s.or_u(out, s.select_u(above, s.splat_u(1 << (2 * j)), s.splat_u(0)));
            out = s.or_u(out, s.select_u(below, s.splat_u(2 << (2 * j)), s.splat_u(0)));
        }
        out
    }

    #[inline(always)]
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2] {
        let mut out = [[0.0; 3]; 2];
        for k in 0..3 {
            out[0][k] = boxes::row(&node.bounds[k], self.shaft.near[k])[slot % WIDTH];
            out[1][k] = boxes::row(&node.bounds[k], self.shaft.near[k] ^ boxes::FAR)[slot % WIDTH];
            if POINT {
                out[0][k] -= self.shaft.near_origin[k];
                out[1][k] -= self.shaft.far_origin[k];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::packet::entry::{GROUPS, PACKET};
    use crate::bvh::packet::prepare_group::PrepareGroup;
    use crate::rays::Ray;
    use crate::simd::{Isa, Kernel};
    use bth_random::Rng;

    /// For each of sixteen points, given as rows, the sides of the frustum of the rays beyond which
    /// it lies.
    struct SidesOfPoints<'a, const POINT: bool>(&'a [Ray], &'a ObjectBounds, &'a [[f32; LANES]; 3]);

    impl<const POINT: bool> Kernel for SidesOfPoints<'_, POINT> {
        type Output = [u32; LANES];
        const SCALAR: bool = false;
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> [u32; LANES] {
            let SidesOfPoints(rays, bounds, points) = self;
            let span = Span::of(s, rays);
            assert!(span.is_coherent() && span.is_from_point() == POINT, "{rays:?}");
            let mut groups = [RayGroup::vacant(s); GROUPS];
            for (group, rays) in groups.iter_mut().zip(rays.chunks(LANES)) {
                assert!(PrepareGroup::<S, Frustum<S, POINT>>::of(group, bounds, rays, true).run(s));
            }
            let groups = &groups[..rays.len().div_ceil(LANES)];
            let frustum = FrustumOf::<S, POINT> { bounds, span: &span, groups }.run(s);
            let rows = [s.load(&points[0]), s.load(&points[1]), s.load(&points[2])];
            let mut sides = [0; LANES];
            s.store_u(frustum.sides(s, rows), &mut sides);
            sides
        }
    }

    /// Points on rays, which are exact because all coordinates are integers below 2^24 times a
    /// power of two, and such points moved away from all rays by about 2^-15 of their distance.
    fn check<const POINT: bool>(seed: u64) {
        let mut rng = Rng::new(seed);
        let mut below = |limit: u64| rng.below(limit) as f32;
        let (mut on, mut beyond) = (0, 0);
        for round in 0..if cfg!(miri) { 4 } else { 400 } {
            let scale = [1.0, 2f32.powi(-30), 2f32.powi(6), 2f32.powi(-50)][round % 4];
            // The object may be much larger than the distances of rays and points.
            let bounds = ObjectBounds::around((1u64 << 24) as f32 * scale * [1.0, 256.0][round / 4 % 2]);
            let main = round % 3;
            let signs = [(); 3].map(|()| below(2) * 2.0 - 1.0);
            let middle = [0, 1, 2].map(|k| if k == main { 1_000_000.0 } else { 1.0 + below(700_000) });
            let jitter = [1, 1 << 10, 1 << 17][round / 8 % 3];
            let place = [(); 3].map(|()| below(1 << 21) - (1 << 20) as f32);
            let apart = [1 << 4, 1 << 18][round / 24 % 2];
            let rays: Vec<Ray> = (0..PACKET - round % 60)
                .map(|_| Ray {
                    origin: place.map(|x| (x + if POINT { 0.0 } else { below(apart) }) * scale),
                    tmin: 0.0,
                    direction: [0, 1, 2].map(|k| (middle[k] + below(jitter)) * signs[k] * scale),
                    tmax: f32::INFINITY,
                })
                .collect();
            let axis = [(main + 1) % 3, (main + 2) % 3];
            let mut points = [[0.0; LANES]; 3];
            let mut is_on = [true; LANES];
            for i in 0..LANES {
                let (ray, t) = (&rays[below(rays.len() as u64) as usize], [0.0, 1.0, 4.0, 8.0][i % 4]);
                for k in 0..3 {
                    points[k][i] = ray.origin[k] + t * ray.direction[k];
                }
                if POINT && i % 2 == 1 {
                    let (k, sign) = (axis[i / 2 % 2], if i / 4 % 2 == 0 { 1.0 } else { -1.0 });
                    let slopes =
                        rays.iter().map(|r| f64::from(r.direction[k]) / f64::from(r.direction[main]));
                    let depth = f64::from(points[main][i]) - f64::from(ray.origin[main]);
                    let ends = slopes.map(|s| sign * s * depth).fold(f64::NEG_INFINITY, f64::max);
                    let at = f64::from(ray.origin[k]) + sign * (ends + depth.abs() / f64::from(1 << 15));
                    points[k][i] = at as f32;
                    is_on[i] = false;
                }
            }
            for isa in Isa::ALL {
                // There are no packets in scalar code.
                if isa == Isa::Scalar || !isa.is_available() {
                    continue;
                }
                let sides = isa.run(SidesOfPoints::<POINT>(&rays, &bounds, &points));
                for i in 0..LANES {
                    let point = points.map(|row| row[i]);
                    if is_on[i] {
                        assert_eq!(sides[i], 0, "{isa}, round {round}: a ray meets {point:?}");
                        on += 1;
                    } else {
                        assert_ne!(sides[i], 0, "{isa}, round {round}: no ray comes close to {point:?}");
                        beyond += 1;
                    }
                }
            }
        }
        let least = if Isa::best() == Isa::Scalar { 0 } else { 16 };
        assert!(on >= least && (beyond >= least || !POINT), "{on}, {beyond}");
    }

    #[test]
    fn points_that_rays_from_a_point_meet_lie_within_all_sides_and_those_beyond_do_not_however_large_the_object()
     {
        check::<true>(41);
    }

    #[test]
    fn points_that_coherent_rays_meet_lie_within_all_sides() {
        check::<false>(42);
    }
}
