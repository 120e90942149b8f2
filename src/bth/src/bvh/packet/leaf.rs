//! Intersection of the rays of a packet with the triangles of a leaf: one triangle at a time with a
//! ray in each lane or, where few rays are left, one ray at a time ([`super::single_rays`]).
//!
//! Points are projected once for a group of sixteen rays or, if all rays of the packet have the
//! same origin, for each tested triangle. Most triangles are excluded by the error bound of
//! [`crate::intersect::edge_functions`] for the largest corner of the whole leaf; only for the
//! others the bound of the triangle itself is computed.

use super::bounds::PacketBounds;
use super::hit_cache::UNCACHED;
use super::leaf_mesh::{FindOutside, LeafMesh, LeafPoints};
use super::packet_rays::{PacketRays, SettleLanes};
use super::points::{CornerSource, ProjectedMaxima, ProjectedOnDemand, ProjectedPoints, RelativePoints};
use super::ray_group::{RayGroup, RayLimits};
use super::single_rays::FEW_OF_GROUP;
use crate::bvh::candidate::Candidate;
use crate::intersect::edge_functions::{self, Corners, FilteredTriangles};
use crate::intersect::exact_ray::ExactRay;
use crate::intersect::prepare::{Axes, CommonAxis};
use crate::query::Goal;
use crate::simd::{LANES, Lanewise, Part, Simd, lanes_of_piece};
use bth_format::layout::WIDTH;
use bth_format::object::ObjectBounds;

/// Instead of a triangle's index in the hit cache: no ray has hit it certainly so far.
const NOT_CACHED_YET: u8 = u8::MAX;

/// The rays of a group that may hit a triangle, one bit per ray.
struct RayTest<S: Simd> {
    /// Rays that do not certainly miss it.
    maybe: u32,
    /// Rays that certainly hit it within their range.
    sure: u32,
    /// Lower bounds of the depths of the hits.
    nearest: S::F,
    /// Upper bounds of the depths of the hits.
    farthest: S::F,
}

/// Rays that certainly miss a triangle; `error` bounds the errors of its weights.
#[inline(always)]
fn missed<S: Lanewise>(s: S, [a, b, c]: &Corners<S>, error: S::F) -> S::M {
    let weight = [
        edge_functions::cross(s, *b, *c),
        edge_functions::cross(s, *c, *a),
        edge_functions::cross(s, *a, *b),
    ];
    let least = s.min(s.min(weight[0], weight[1]), weight[2]);
    let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
    s.and(s.lt(least, s.sub(s.splat(0.0), error)), s.lt(error, greatest))
}

impl<S: Lanewise> RayLimits<S> {
    /// Tests rays against a triangle, with the error bound of the triangle itself.
    #[inline(always)]
    fn test(&self, s: S, [a, b, c]: Corners<S>, bounds: &ObjectBounds) -> FilteredTriangles<S> {
        let (origin_reach, floor) = (s.splat(bounds.origin_reach), s.splat(f32::MIN_POSITIVE));
        let error = edge_functions::error_of(s, &[a, b, c], origin_reach, floor);
        let tested = edge_functions::test_triangles(
            s,
            [a, b, c],
            error,
            [self.first, self.limit],
            bounds.corner_error,
        );
        let in_range = s.and(s.le(self.certain[0], tested.nearest), s.le(tested.farthest, self.certain[1]));
        FilteredTriangles { certain: s.and(tested.certain, in_range), ..tested }
    }
}

/// The test of the active rays of a group against a triangle, as a part of kernels.
struct TestRays<'a, S: Simd, C> {
    group: &'a RayGroup<S>,
    corners: &'a C,
    /// Indices of the triangle's points.
    points: [usize; 3],
    /// Bound of the errors of weights.
    error: &'a S::F,
    bounds: &'a ObjectBounds,
    active: u32,
}

impl<S: Simd, C: CornerSource<S>> Part<S> for TestRays<'_, S, C> {
    type Output = RayTest<S>;
    #[inline(always)]
    fn run(self, s: S) -> RayTest<S> {
        let TestRays { group, corners, points: [a, b, c], error, bounds, active } = self;
        let (mut maybe, mut sure, mut nearest, mut farthest) = (0, 0, [0.0; LANES], [0.0; LANES]);
        for i in 0..S::PIECES {
            let (active, p) = (active & lanes_of_piece::<S>(i), s.piece(i));
            if active == 0 {
                continue;
            }
            let corners =
                [corners.corner_of_piece(p, a), corners.corner_of_piece(p, b), corners.corner_of_piece(p, c)];
            if active & !p.mask_bits(missed(p, &corners, S::pick(p, error))) == 0 {
                continue;
            }
            let tested = group.limits_of_piece(p).test(p, corners, bounds);
            maybe |= active & !p.mask_bits(tested.excluded);
            sure |= active & p.mask_bits(tested.certain);
            p.store(tested.nearest, &mut nearest);
            p.store(tested.farthest, &mut farthest);
        }
        RayTest { maybe, sure: sure & maybe, nearest: s.load(&nearest), farthest: s.load(&farthest) }
    }
}

/// The active rays of a group and the triangles of a leaf that they are tested against.
struct GroupTest<'a, 'l, S: Simd> {
    group: &'a mut RayGroup<S>,
    /// Index of the group.
    at: usize,
    leaf: &'a LeafPoints<'l>,
    /// Points of the leaf that the triangles use, one bit per point.
    used: u64,
    /// Where all rays have the same origin: the largest |coordinate| and |depth| of these points.
    spread: [f32; 2],
    /// For each triangle its index in the hit cache, or [`NOT_CACHED_YET`].
    cache_indices: &'a mut [u8; WIDTH],
    /// One bit per triangle.
    triangles: u32,
    /// One bit per ray.
    active: u32,
}

/// Triangles of a leaf that rays of a packet may hit.
pub(super) struct ReachedTriangles<'a> {
    leaf: LeafPoints<'a>,
    /// A bit each.
    triangles: u32,
    /// The rays to test, one bit per ray.
    rays: u64,
}

impl<G: Goal> PacketRays<'_, G> {
    /// Finds the triangles of a leaf that the rays whose bit is set may hit, if there are any.
    /// Where few rays of an any-hit group are left, it intersects them with the leaf. This is a
    /// part of the kernel of packets and inlined into it, once for each format of leaves.
    #[inline(always)]
    pub(super) fn reached<'b, S: Simd, H: PacketBounds<S>, B: LeafMesh>(
        &mut self,
        s: S,
        bounds: &H,
        groups: &[RayGroup<S>],
        (block, code): (&'b B, u32),
        mut rays: u64,
    ) -> Option<ReachedTriangles<'b>> {
        // In packets for nearest hits, whose rays are coherent, few rays are rarely left.
        if H::is_any(self.goal) {
            for (i, group) in groups.iter().enumerate() {
                let active = (rays >> (i * LANES)) as u32 & 0xffff;
                if active.count_ones() <= FEW_OF_GROUP {
                    rays &= !(0xffff << (i * LANES));
                    self.enter_leaf_singly::<S, H, B>(s, group, i, (block, code), active);
                }
            }
            if rays == 0 {
                return None;
            }
        }
        let count = block.triangles().min(WIDTH as u32);
        let outside = FindOutside { bounds, block }.inline_or_call(s);
        let triangles = !outside & ((1 << count) - 1);
        (triangles != 0).then(|| ReachedTriangles { leaf: block.points(code), triangles, rays })
    }

    /// Intersects rays with triangles of a leaf. Returns true if any ray has a nearer hit than
    /// before. Like [`Self::reached`], it is inlined into the kernel, but it serves both formats of
    /// leaves.
    #[inline(always)]
    pub(super) fn enter_triangles<S: Simd, H: PacketBounds<S>>(
        &mut self,
        s: S,
        bounds: &H,
        groups: &mut [RayGroup<S>],
        (points, relative): (&mut ProjectedPoints, &mut RelativePoints),
        ReachedTriangles { leaf, triangles, rays }: ReachedTriangles<'_>,
    ) -> bool {
        let (mut used, mut remaining) = (0u64, triangles);
        while remaining != 0 {
            let [a, b, c] = leaf.points_of(remaining.trailing_zeros() as usize);
            used |= 1 << a | 1 << b | 1 << c;
            remaining &= remaining - 1;
        }
        let mut spread = [0.0; 2];
        if let Some(view) = bounds.view() {
            leaf.relative(s, view.origin, relative);
            spread = relative.spread(s, view, leaf.parts.len(), used);
        }
        let (mut nearer, mut cache_indices) = (false, [NOT_CACHED_YET; WIDTH]);
        for (i, group) in groups.iter_mut().enumerate() {
            let active = (rays >> (i * LANES)) as u32 & 0xffff;
            if active != 0 {
                let cache_indices = &mut cache_indices;
                let test =
                    GroupTest { group, at: i, leaf: &leaf, used, spread, cache_indices, triangles, active };
                nearer |= self.enter_group(s, bounds, points, relative, test);
            }
        }
        nearer
    }

    /// Intersects the active rays of an any-hit group with the triangles of a leaf, one ray at a
    /// time. `at` is the index of the group.
    #[inline(always)]
    fn enter_leaf_singly<S: Simd, H: PacketBounds<S>, B: LeafMesh>(
        &mut self,
        s: S,
        group: &RayGroup<S>,
        at: usize,
        (block, code): (&B, u32),
        mut active: u32,
    ) {
        while active != 0 {
            let lane = active.trailing_zeros() as usize;
            active &= active - 1;
            let ray = at * LANES + lane;
            let own = match self.have_starts {
                true => ExactRay::new(&self.rays[ray], self.lines.of(ray)).own_triangle(code),
                false => 0,
            };
            let found =
                self.single_rays.candidates::<S, H>(s, group, (at, lane), (block, own), &self.object.bounds);
            let hit = found.sure != 0
                || found.maybe != 0 && self.settle_one(s, ray, Candidate::NONE, (code, found.maybe));
            self.alive &= !(u64::from(hit) << ray);
        }
    }

    /// Intersects the active rays of a group with triangles of a leaf. Returns true if any ray has
    /// a nearer hit than before. This is a part of a kernel and inlined into it.
    #[inline(always)]
    fn enter_group<S: Simd, H: PacketBounds<S>>(
        &mut self,
        s: S,
        bounds: &H,
        points: &mut ProjectedPoints,
        relative: &RelativePoints,
        test: GroupTest<'_, '_, S>,
    ) -> bool {
        let (group, leaf) = (&*test.group, test.leaf);
        let floor = s.splat(f32::MIN_POSITIVE);
        if let Some(view) = bounds.view() {
            let along = CommonAxis(view.axis());
            debug_assert_eq!(group.common, Some(along), "see `Span::is_from_point`");
            let rows = along.order().map(|axis| relative.row(axis));
            let [size, depth] = test.spread;
            let depth = s.splat(depth + self.object.bounds.origin_reach);
            let error = edge_functions::error(s, s.splat(size + size), depth, floor);
            let corners = ProjectedOnDemand { rows, projection: group.projection.relative(s) };
            return self.test_triangles::<S, H>(s, &corners, error, test);
        }
        let order = group.common.map_or([0, 1, 2], CommonAxis::order);
        // Copies stay in registers; fields of `group` would be loaded for each point.
        let (projection, mixed, is_common) = (group.projection, group.mixed, group.common.is_some());
        let mut greatest = ProjectedMaxima { coordinate: s.splat(0.0), depth: s.splat(0.0) };
        for (part, rows) in leaf.parts.iter().enumerate() {
            let rows = order.map(|axis| &rows[axis]);
            let mut used = (test.used >> (part * LANES)) as u32 & 0xffff;
            while used != 0 {
                let i = used.trailing_zeros() as usize % WIDTH;
                used &= used - 1;
                let point = rows.map(|row| s.splat(row[i]));
                let point = if is_common { point } else { mixed.permute(s, point) };
                let point = projection.of(s, point);
                points.put(s, part * WIDTH + i, greatest.including(s, point));
            }
        }
        let size = s.add(greatest.coordinate, greatest.coordinate);
        let depth = s.add(greatest.depth, s.splat(self.object.bounds.origin_reach));
        let error = edge_functions::error(s, size, depth, floor);
        self.test_triangles::<S, H>(s, &*points, error, test)
    }

    /// Intersects the active rays of a group with triangles, given the projections of their
    /// corners. `error` bounds the errors of the weights of all of them. Returns true if any ray
    /// has a nearer hit.
    #[inline(always)]
    fn test_triangles<S: Simd, H: PacketBounds<S>>(
        &mut self,
        s: S,
        corners: &impl CornerSource<S>,
        error: S::F,
        test: GroupTest<'_, '_, S>,
    ) -> bool {
        let GroupTest { group, at, leaf, cache_indices, mut triangles, mut active, .. } = test;
        let (mut nearer, object) = (false, self.object);
        let bounds = &object.bounds;
        let starting = self.starting_in(s, at, leaf.code);
        while triangles != 0 {
            let triangle = triangles.trailing_zeros();
            triangles &= triangles - 1;
            let [a, b, c] = leaf.points_of(triangle as usize);
            let RayTest { mut maybe, mut sure, nearest, farthest } = if S::INLINES_PARTS {
                let corners = [corners.corner(s, a), corners.corner(s, b), corners.corner(s, c)];
                if active & !s.mask_bits(missed(s, &corners, error)) == 0 {
                    continue;
                }
                let tested = group.limits().test(s, corners, bounds);
                let maybe = active & !s.mask_bits(tested.excluded);
                let sure = maybe & s.mask_bits(tested.certain);
                RayTest { maybe, sure, nearest: tested.nearest, farthest: tested.farthest }
            } else {
                let error = &error;
                s.call(TestRays { group: &*group, corners, points: [a, b, c], error, bounds, active })
            };
            if !S::INLINES_PARTS && maybe == 0 {
                continue;
            }
            let candidate = Candidate { leaf: leaf.code, triangle };
            if starting != 0 {
                // No ray hits the triangle on which it starts.
                let others = !(starting & self.starting_at(s, at, triangle));
                (maybe, sure) = (maybe & others, sure & others);
            }
            let clear = if H::is_any(self.goal) {
                self.alive &= !(u64::from(sure) << (at * LANES));
                active &= !sure;
                sure
            } else {
                let clear = sure & s.mask_bits(s.lt(farthest, group.nearest));
                let m = s.mask(clear);
                if clear != 0 {
                    let cache_index = &mut cache_indices[triangle as usize % WIDTH];
                    if *cache_index == NOT_CACHED_YET {
                        let index = (leaf.first + triangle) as usize;
                        s.prefetch(self.object.triangle_ids.as_ptr().wrapping_add(index));
                        *cache_index = self.hit_cache.add(leaf, triangle) as u8;
                    }
                    let pending = u32::from(*cache_index);
                    group.accept(s, m, [nearest, farthest], pending);
                    if pending == UNCACHED {
                        group.store_uncached(s, m, leaf, triangle);
                    }
                }
                nearer |= clear != 0;
                clear
            };
            if maybe & !clear != 0 {
                s.call(SettleLanes { rays: self, group, at, candidate, lanes: maybe & !clear });
                nearer = true;
                active &= (self.alive >> (at * LANES)) as u32;
            }
            if active == 0 {
                break;
            }
        }
        nearer
    }
}
