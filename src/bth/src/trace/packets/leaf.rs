//! The triangles of a leaf before the rays of a packet: lanes are rays, one triangle at a time.
//!
//! Points are projected once for a group of sixteen rays. Most triangles are left out by the error bound of the whole
//! leaf, which is that of [`crate::trace::sight`] for the greatest corner of all; only for the others is it worked out.

use super::group::{Group, Projection};
use super::hull::Hull;
use super::met::{APART, Met};
use crate::layout::{IndexedLeaf, NONE, RawLeaf, WIDTH};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use crate::trace::candidate::{Candidate, Settled, settle};
use crate::trace::crossings::Many;
use crate::trace::prepare::{Axes, Common};
use crate::trace::query::Query;
use crate::trace::sight::{self, Block};

/// Points of a leaf at most.
const POINTS: usize = 3 * WIDTH;

/// In place of the number of a triangle among those that the packet keeps: it has not been asked for.
const UNKNOWN: u8 = u8::MAX;

/// Projected points of a leaf, x, y and depth of each as sixteen rays see it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Points([[Many; 3]; POINTS]);

impl Points {
    pub(crate) const NONE: Points = Points([[[0.0; LANES]; 3]; POINTS]);

    #[inline(always)]
    fn put<S: Simd>(&mut self, s: S, i: usize, point: [S::F; 3]) {
        for k in 0..3 {
            s.store(point[k], &mut self.0[i][k]);
        }
    }

    #[inline(always)]
    fn get<S: Simd>(&self, s: S, i: usize) -> [S::F; 3] {
        let [x, y, depth] = &self.0[i];
        [s.load(x), s.load(y), s.load(depth)]
    }
}

/// Points of a leaf relative to the point at which all rays start, a row for each axis.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Relative(pub(crate) [[Many; 3]; 3]);

impl Relative {
    pub(crate) const NONE: Relative = Relative([[[0.0; LANES]; 3]; 3]);

    /// Sixteen of them.
    #[inline(always)]
    fn put<S: Simd>(&mut self, s: S, part: usize, rows: [S::F; 3], from: [f32; 3]) {
        for k in 0..3 {
            s.store(s.sub(rows[k], s.splat(from[k])), &mut self.0[k][part]);
        }
    }

    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; POINTS] {
        self.0[axis].as_flattened().first_chunk().expect("as many")
    }

    /// Bounds of the size and the depth of these points, a bit each, as any ray sees them.
    #[inline(always)]
    fn spread<S: Simd, H: Hull<S>>(&self, s: S, hull: &H, parts: usize, used: u64) -> [f32; 2] {
        let (mut size, mut depth) = (s.splat(0.0), s.splat(0.0));
        for part in 0..parts {
            let m = s.mask((used >> (part * LANES)) as u32 & 0xffff);
            let [x, y, z] = &self.0;
            let [own, far] = hull.spread(s, [s.load(&x[part]), s.load(&y[part]), s.load(&z[part])]);
            size = s.select(m, s.max(own, size), size);
            depth = s.select(m, s.max(far, depth), depth);
        }
        let zero = s.splat(0.0);
        [-s.least(s.sub(zero, size)), -s.least(s.sub(zero, depth))]
    }
}

/// Where the corners of triangles come from, as sixteen rays see them.
trait Sightings<S: Simd> {
    fn corner(&self, s: S, point: usize) -> [S::F; 3];
}

impl<S: Simd> Sightings<S> for Points {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        self.get(s, point)
    }
}

/// Projected where they are asked for: with origins left out of it that takes less than to store and load them.
struct AtOnce<'a, S: Simd> {
    rows: [&'a [f32; POINTS]; 3],
    projection: Projection<S>,
}

impl<S: Simd> Sightings<S> for AtOnce<'_, S> {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        let [x, y, z] = self.rows;
        self.projection.of_relative(s, [s.splat(x[point]), s.splat(y[point]), s.splat(z[point])])
    }
}

/// A leaf as points, and triangles between them.
pub(crate) trait Mesh: Block {
    /// Rows of sixteen that hold all points.
    const PARTS: usize;
    /// One coordinate of all points.
    type Row<'a>: Copy
    where
        Self: 'a;
    fn row(&self, axis: usize) -> Self::Row<'_>;
    /// That of a point, whose number is below [`POINTS`].
    fn at(row: Self::Row<'_>, point: usize) -> f32;
    /// The points of a triangle, below [`POINTS`].
    fn points_of(&self, triangle: usize) -> [usize; 3];
    /// All points, relative to one.
    fn relative<S: Simd>(&self, s: S, from: [f32; 3], to: &mut Relative);
    /// The triangles that have no corner inside, and none on another side of the hull than the others: missed by
    /// all rays.
    fn outside<S: Simd, H: Hull<S>>(&self, s: S, hull: &H) -> u32;
}

/// Lanes that have a bit in common.
#[inline(always)]
fn common<S: Simd>(s: S, [a, b, c]: [S::U; 3]) -> u32 {
    s.mask_bits(s.lt_u(s.splat_u(0), s.and_u(a, s.and_u(b, c))))
}

/// Three rows of lanes.
#[inline(always)]
fn load<S: Simd>(s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
    [s.load(&rows[0]), s.load(&rows[1]), s.load(&rows[2])]
}

/// From the first corner's row of an axis to the end of the last one's.
const RAW_ROW: usize = 7 * WIDTH;

impl Mesh for IndexedLeaf {
    const PARTS: usize = 1;
    type Row<'a> = &'a [f32; WIDTH];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; WIDTH] {
        &self.vertex[axis]
    }
    #[inline(always)]
    fn at(row: &[f32; WIDTH], point: usize) -> f32 {
        row[point % WIDTH]
    }
    #[inline(always)]
    fn points_of(&self, triangle: usize) -> [usize; 3] {
        let at = triangle % WIDTH;
        let [a, b, c] = &self.corner;
        [usize::from(a[at]) % WIDTH, usize::from(b[at]) % WIDTH, usize::from(c[at]) % WIDTH]
    }
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, from: [f32; 3], to: &mut Relative) {
        to.put(s, 0, load(s, &self.vertex), from);
    }
    #[inline(always)]
    fn outside<S: Simd, H: Hull<S>>(&self, s: S, hull: &H) -> u32 {
        let sides = hull.sides(s, load(s, &self.vertex));
        let [a, b, c] = &self.corner;
        let of = [s.load_bytes(a), s.load_bytes(b), s.load_bytes(c)];
        common(s, [s.lookup_u(sides, of[0]), s.lookup_u(sides, of[1]), s.lookup_u(sides, of[2])])
    }
}

impl Mesh for RawLeaf {
    const PARTS: usize = 3;
    type Row<'a> = &'a [f32; RAW_ROW];
    #[inline(always)]
    fn row(&self, axis: usize) -> &[f32; RAW_ROW] {
        self.corner.as_flattened().as_flattened()[axis * WIDTH..]
            .first_chunk()
            .expect("up to the last corner")
    }
    #[inline(always)]
    fn at(row: &[f32; RAW_ROW], point: usize) -> f32 {
        // Rows of other axes lie between those of two corners.
        row[(point + point / WIDTH * (2 * WIDTH)).min(RAW_ROW - 1)]
    }
    #[inline(always)]
    fn points_of(&self, triangle: usize) -> [usize; 3] {
        let at = triangle % WIDTH;
        [at, WIDTH + at, 2 * WIDTH + at]
    }
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, from: [f32; 3], to: &mut Relative) {
        for c in 0..3 {
            to.put(s, c, load(s, &self.corner[c]), from);
        }
    }
    #[inline(always)]
    fn outside<S: Simd, H: Hull<S>>(&self, s: S, hull: &H) -> u32 {
        let [a, b, c] = &self.corner;
        let sides = [hull.sides(s, load(s, a)), hull.sides(s, load(s, b)), hull.sides(s, load(s, c))];
        common(s, sides)
    }
}

/// The rays of a packet, and what has been found for them.
pub(crate) struct Rays<'a, Q> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    /// Queries of rays for which anything has been decided, where their bit is set.
    pub(crate) queries: &'a mut [Q],
    pub(crate) asked: u64,
    pub(crate) met: &'a mut Met,
    /// Those that are not done.
    pub(crate) alive: u64,
}

/// Of projected points: |x| or |y|, and |depth|.
struct Greatest<S: Simd> {
    coordinate: S::F,
    depth: S::F,
}

impl<S: Simd> Greatest<S> {
    /// Takes in a point, and hands it back.
    #[inline(always)]
    fn including(&mut self, s: S, point: [S::F; 3]) -> [S::F; 3] {
        self.coordinate = s.max_abs(s.max_abs(point[0], self.coordinate), point[1]);
        self.depth = s.max_abs(point[2], self.depth);
        point
    }
}

/// What groups keep of triangles that wait, lane by lane.
struct Apart {
    leaf: [u32; LANES],
    triangle: [u32; LANES],
}

impl Apart {
    #[inline(always)]
    fn of<S: Simd>(s: S, group: &Group<S>) -> Self {
        let mut apart = Apart { leaf: [0; LANES], triangle: [0; LANES] };
        s.store_u(group.leaf, &mut apart.leaf);
        s.store_u(group.triangle, &mut apart.triangle);
        apart
    }

    /// What waits in a lane.
    #[inline(always)]
    fn candidate(&self, met: &Met, waiting: u32, lane: usize) -> Candidate {
        match waiting {
            NONE => Candidate::NONE,
            APART => Candidate { leaf: self.leaf[lane], triangle: self.triangle[lane] },
            number => met.candidate(number),
        }
    }
}

/// A leaf and its code.
pub(crate) struct Leaf<'a, B> {
    pub(crate) block: &'a B,
    pub(crate) code: u32,
}

impl<Q: Query> Rays<'_, Q> {
    /// Tests the triangles of a leaf for rays of the packet, a bit each. Returns whether any has a nearer hit.
    #[inline(always)]
    pub(crate) fn enter_leaf<S: Simd, H: Hull<S>, B: Mesh>(
        &mut self,
        s: S,
        hull: &H,
        groups: &mut [Group<S>],
        (points, relative): (&mut Points, &mut Relative),
        leaf: &Leaf<'_, B>,
        rays: u64,
    ) -> bool {
        let count = leaf.block.triangles().min(WIDTH as u32);
        let triangles = !leaf.block.outside(s, hull) & ((1 << count) - 1);
        let (mut used, mut rest) = (0u64, triangles);
        while rest != 0 {
            let [a, b, c] = leaf.block.points_of(rest.trailing_zeros() as usize);
            used |= 1 << a | 1 << b | 1 << c;
            rest &= rest - 1;
        }
        if triangles == 0 {
            return false;
        }
        let mut spread = [0.0; 2];
        if H::FROM_POINT {
            leaf.block.relative(s, hull.point(), relative);
            spread = relative.spread(s, hull, B::PARTS, used);
        }
        let (mut nearer, mut numbers) = (false, [UNKNOWN; WIDTH]);
        for (i, group) in groups.iter_mut().enumerate() {
            let active = (rays >> (i * LANES)) as u32 & 0xffff;
            if active != 0 {
                nearer |= self.enter_group(
                    s,
                    hull,
                    group,
                    i,
                    (points, relative, spread),
                    leaf,
                    &mut numbers,
                    (triangles, used),
                    active,
                );
            }
        }
        nearer
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    fn enter_group<S: Simd, H: Hull<S>, B: Mesh>(
        &mut self,
        s: S,
        hull: &H,
        group: &mut Group<S>,
        at: usize,
        (points, relative, spread): (&mut Points, &Relative, [f32; 2]),
        leaf: &Leaf<'_, B>,
        numbers: &mut [u8; WIDTH],
        (triangles, mut used): (u32, u64),
        active: u32,
    ) -> bool {
        let floor = s.splat(f32::MIN_POSITIVE);
        let order = group.common.map_or([0, 1, 2], Common::order);
        // Copies, which stay in registers where the group itself would be read for each point.
        let (projection, mixed, is_common) = (group.projection, group.mixed, group.common.is_some());
        let projection = if H::FROM_POINT { projection.relative(s) } else { projection };
        let relative = [relative.row(order[0]), relative.row(order[1]), relative.row(order[2])];
        if H::FROM_POINT && group.common.is_some_and(|common| common.0 == hull.axis()) {
            let [size, depth] = spread;
            let error = sight::error(s, s.splat(size + size), s.splat(depth), floor);
            let corners = AtOnce { rows: relative, projection };
            return self.test(s, group, at, &corners, error, leaf, numbers, triangles, active);
        }
        let mut greatest = Greatest { coordinate: s.splat(0.0), depth: s.splat(0.0) };
        let rows = [leaf.block.row(order[0]), leaf.block.row(order[1]), leaf.block.row(order[2])];
        while used != 0 {
            let i = used.trailing_zeros() as usize % POINTS;
            used &= used - 1;
            let point = if H::FROM_POINT {
                [s.splat(relative[0][i]), s.splat(relative[1][i]), s.splat(relative[2][i])]
            } else {
                [s.splat(B::at(rows[0], i)), s.splat(B::at(rows[1], i)), s.splat(B::at(rows[2], i))]
            };
            let point = if is_common { point } else { mixed.turn(s, point) };
            let point =
                if H::FROM_POINT { projection.of_relative(s, point) } else { projection.of(s, point) };
            points.put(s, i, greatest.including(s, point));
        }
        let size = s.add(greatest.coordinate, greatest.coordinate);
        let error = sight::error(s, size, greatest.depth, floor);
        self.test(s, group, at, &*points, error, leaf, numbers, triangles, active)
    }

    /// Tests triangles, a bit each, for rays of a group; `error` bounds those of weights for all of them.
    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    fn test<S: Simd, B: Mesh>(
        &mut self,
        s: S,
        group: &mut Group<S>,
        at: usize,
        corners: &impl Sightings<S>,
        error: S::F,
        leaf: &Leaf<'_, B>,
        numbers: &mut [u8; WIDTH],
        mut triangles: u32,
        mut active: u32,
    ) -> bool {
        let floor = s.splat(f32::MIN_POSITIVE);
        let minus_error = s.sub(s.splat(0.0), error);
        let mut nearer = false;
        while triangles != 0 {
            let triangle = triangles.trailing_zeros();
            triangles &= triangles - 1;
            let [a, b, c] = leaf.block.points_of(triangle as usize);
            let (a, b, c) = (corners.corner(s, a), corners.corner(s, b), corners.corner(s, c));
            let weight = [sight::cross(s, b, c), sight::cross(s, c, a), sight::cross(s, a, b)];
            let least = s.min(s.min(weight[0], weight[1]), weight[2]);
            let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
            let missed = s.mask_bits(s.and(s.lt(least, minus_error), s.lt(error, greatest)));
            if active & !missed == 0 {
                continue;
            }
            let size = s.max(s.max(sight::size(s, a), sight::size(s, b)), sight::size(s, c));
            let depth = s.max_abs(s.max_abs(a[2], b[2]), c[2]);
            let error = sight::error(s, size, depth, floor);
            let weighed = sight::weigh(s, [a, b, c], error, group.first, group.limit);
            let maybe = active & !s.mask_bits(weighed.out);
            let in_range =
                s.and(s.le(group.certain[0], weighed.nearest), s.le(weighed.farthest, group.certain[1]));
            let sure = maybe & s.mask_bits(s.and(weighed.certain, in_range));
            let candidate = Candidate { leaf: leaf.code, triangle };
            let clear = if Q::ANY {
                self.alive &= !(u64::from(sure) << (at * LANES));
                active &= !sure;
                sure
            } else {
                let clear = sure & s.mask_bits(s.lt(weighed.farthest, group.nearest));
                let m = s.mask(clear);
                if clear != 0 {
                    let number = &mut numbers[triangle as usize % WIDTH];
                    if *number == UNKNOWN {
                        let place = (leaf.block.first() + triangle) as usize;
                        s.prefetch(self.object.triangle_ids.as_ptr().wrapping_add(place));
                        *number = self.met.add(leaf, triangle) as u8;
                    }
                    let number = u32::from(*number);
                    group.accept(s, m, [weighed.nearest, weighed.farthest], number);
                    if number == APART {
                        group.keep(s, m, leaf, triangle);
                    }
                }
                nearer |= clear != 0;
                clear
            };
            if maybe & !clear != 0 {
                self.settle_lanes(s, group, at, candidate, maybe & !clear);
                nearer = true;
                active &= (self.alive >> (at * LANES)) as u32;
            }
            if active == 0 {
                break;
            }
        }
        nearer
    }

    /// Decides a candidate for a few rays of a group, and with it the one that waits.
    #[inline(always)]
    fn settle_lanes<S: Simd>(
        &mut self,
        s: S,
        group: &mut Group<S>,
        at: usize,
        candidate: Candidate,
        mut lanes: u32,
    ) {
        let mut waiting = [0; LANES];
        s.store_u(group.waiting, &mut waiting);
        let apart = Apart::of(s, group);
        let (mut scale, mut limit, mut nearest) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        s.store(group.scale, &mut scale);
        s.store(group.limit, &mut limit);
        s.store(group.nearest, &mut nearest);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let ray = at * LANES + lane;
            match self.settle_one(ray, [apart.candidate(self.met, waiting[lane], lane), candidate]) {
                Settled::Enough => self.alive &= !(1 << ray),
                Settled::Found(t) => {
                    let [near, far] = t.map(|t| t * f64::from(scale[lane]));
                    nearest[lane] = (near as f32).next_down();
                    limit[lane] = limit[lane].min((far as f32).next_up());
                }
                Settled::Nothing => {}
            }
            waiting[lane] = NONE;
        }
        group.waiting = s.load_u(&waiting);
        group.limit = s.load(&limit);
        group.nearest = s.load(&nearest);
    }

    /// Decides for a few rays of a group the candidate that waits.
    #[inline(always)]
    pub(crate) fn settle_last<S: Simd>(&mut self, s: S, group: &Group<S>, at: usize, mut lanes: u32) {
        let mut waiting = [0; LANES];
        s.store_u(group.waiting, &mut waiting);
        let apart = Apart::of(s, group);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let waiting = apart.candidate(self.met, waiting[lane], lane);
            self.settle_one(at * LANES + lane, [waiting, Candidate::NONE]);
        }
    }

    /// Offers candidates of a ray to its query.
    #[inline(always)]
    fn settle_one(&mut self, ray: usize, candidates: [Candidate; 2]) -> Settled {
        if self.asked >> ray & 1 == 0 {
            self.queries[ray] = Q::new(&self.rays[ray]);
            self.asked |= 1 << ray;
        }
        settle(self.object, &self.rays[ray], candidates, &mut self.queries[ray])
    }
}
