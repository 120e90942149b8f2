//! The rays of a batch that start on triangles of an object, as rays of the object with the exact
//! points at which they start.

use super::locate::locate;
use super::triangles::{StartTriangles, TriangleIds};
use crate::intersect::origin::RoundedOrigin;
use crate::intersect::start::{ABOVE_ONE, rounded_start};
use crate::intersect::start_point::StartPoint;
use crate::rays::{PrimitiveRef, Ray, Start, StartRay};
use crate::shortcuts::free::{self, FreeRow, NoRow, free_rays};
use crate::simd::{Isa, Kernel, LANES, Scalar, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// The rays of a batch in object space. Lists have one element per ray but for `order`.
#[derive(Debug, Default)]
pub(crate) struct PreparedStarts {
    /// Rays from the starts rounded to f32. A range begins later where nothing is hit before.
    pub(crate) rays: Vec<Ray>,
    /// Where they start.
    pub(crate) points: Vec<StartPoint>,
    /// Indices of the rays that may hit something, ascending.
    pub(crate) order: Vec<u32>,
}

/// A ray that hits nothing.
pub(crate) const ENDED: Ray = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: -1.0 };

impl PreparedStarts {
    /// Prepares rays that start on triangles of the instance with the given index; the others hit
    /// nothing.
    pub(crate) fn fill(&mut self, object: &ObjectView<'_>, rays: &[StartRay], instance: u32) {
        // All elements are replaced.
        self.rays.resize(rays.len(), ENDED);
        self.points.resize(rays.len(), StartPoint::beside([0.0; 3]));
        self.order.clear();
        if !object.free.is_empty() {
            self.fill_by(object, object.free, (rays, instance));
        } else if !object.free_distances.is_empty() {
            self.fill_by(object, object.free_distances, (rays, instance));
        } else {
            self.fill_by::<NoRow>(object, &[], (rays, instance));
        }
    }

    fn fill_by<R: FreeRow>(&mut self, object: &ObjectView<'_>, rows: &[R], of: (&[StartRay], u32)) {
        let (rays, instance) = of;
        let isa = Isa::chosen();
        let whole = if isa == Isa::Scalar { 0 } else { rays.len() / LANES * LANES };
        if whole > 0 {
            isa.run(PrepareKernel { object, rows, rays: &rays[..whole], instance, prepared: &mut *self });
        }
        for index in whole..rays.len() {
            self.fill_one(object, &rays[index], instance, index);
        }
    }

    fn fill_one(&mut self, object: &ObjectView<'_>, ray: &StartRay, instance: u32, index: usize) {
        let triangle = ray.start.primitive.triangle_of(instance);
        let start = Start { primitive: PrimitiveRef { instance, triangle }, ..ray.start };
        let Ok(point) = locate(object, start) else {
            (self.rays[index], self.points[index]) = (ENDED, StartPoint::beside([0.0; 3]));
            return;
        };
        let begin = free::begin(Scalar, object, triangle, &point, ray.direction);
        let is_free = begin == f32::INFINITY;
        let tmin = if is_free { 0.0 } else { begin };
        self.rays[index] = Ray { origin: point.rounded(), tmin, direction: ray.direction, tmax: ray.tmax };
        self.points[index] = point;
        if !is_free && begin <= ray.tmax {
            self.order.push(index as u32);
        }
    }
}

/// Prepares whole groups of sixteen rays.
struct PrepareKernel<'a, 'p, R> {
    object: &'a ObjectView<'a>,
    rows: &'a [R],
    rays: &'a [StartRay],
    instance: u32,
    prepared: &'p mut PreparedStarts,
}

/// The words of sixteen rays.
#[inline(always)]
fn words<S: Simd>(s: S, rays: &[StartRay; LANES]) -> [S::U; 8] {
    s.columns8(StartRay::rows(rays).first_chunk().expect("sixteen rows"))
}

/// The triangles of an instance on which the rays of a group start.
#[inline(always)]
fn ids<S: Simd>(s: S, groups: &[[StartRay; LANES]], group: usize, instance: u32) -> TriangleIds {
    let Some(rays) = groups.get(group) else { return TriangleIds::NONE };
    let [of, triangle, ..] = words(s, rays);
    TriangleIds::new(s, s.select_u(s.eq_u(of, s.splat_u(instance)), triangle, s.splat_u(NONE)))
}

impl<R: FreeRow> Kernel for PrepareKernel<'_, '_, R> {
    type Output = ();
    const SCALAR: bool = false;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let PrepareKernel { object, rows, rays, instance, prepared } = self;
        let PreparedStarts { rays: object_rays, points, order } = prepared;
        let levels = object.free_levels.first().copied().unwrap_or_default();
        let (blocks, _) = rays.as_chunks::<LANES>();
        // What is stored lane by lane and loaded at once waits until the stores are done, so
        // sixteen rays are fetched before the sixteen before them are decided.
        let mut triangles = [StartTriangles::NONE; 2];
        // Sixteen indices are stored at once; the next store overwrites the indices of rays that
        // have ended.
        let mut end = order.len();
        order.resize(end + rays.len() + LANES, 0);
        let mut ahead = [ids(s, blocks, 0, instance), ids(s, blocks, 1, instance)];
        ahead[0].prefetch_rows(s, object, rows);
        ahead[1].prefetch_rows(s, object, rows);
        ahead[0].prefetch_leaves(s, object);
        for i in 0..=blocks.len() {
            let next = ids(s, blocks, i + 2, instance);
            next.prefetch_rows(s, object, rows);
            ahead[1].prefetch_leaves(s, object);
            triangles[i % 2].fetch(s, object, rows, &ahead[0]);
            ahead = [ahead[1], next];
            let Some(before) = i.checked_sub(1) else { continue };
            let first = before * LANES;
            let group = Group { rays: &blocks[before], triangles: &mut triangles[before % 2] };
            let object_rays = object_rays[first..].first_chunk_mut().expect("room for a group");
            let points = points[first..].first_chunk_mut().expect("room for a group");
            let left = group.prepare::<S, R>(s, &levels, object_rays, points);
            let mut index = [0; LANES];
            for lane in 0..LANES {
                index[lane] = (first + lane) as u32;
            }
            let to = order[end..].first_chunk_mut().expect("room for a group");
            end += s.compress(left, s.load_u(&index), to);
        }
        order.truncate(end);
    }
}

/// Sixteen rays and the triangles on which they start.
struct Group<'a> {
    rays: &'a [StartRay; LANES],
    triangles: &'a mut StartTriangles,
}

impl Group<'_> {
    /// Stores the rays and their starts. Returns the bits of those that may hit something.
    #[inline(always)]
    fn prepare<S: Simd, R: FreeRow>(
        self,
        s: S,
        levels: &bth_format::layout::FreeLevels,
        object_rays: &mut [Ray; LANES],
        points: &mut [StartPoint; LANES],
    ) -> u32 {
        let Group { rays, triangles } = self;
        triangles.expand::<S, R>(s);
        let [_, _, u, v, dx, dy, dz, tmax] = words(s, rays);
        let (u, v, tmax) = (s.floats(u), s.floats(v), s.floats(tmax));
        let (dx, dy, dz) = (s.floats(dx), s.floats(dy), s.floats(dz));
        let zero = s.splat(0.0);
        let sum = s.le(s.add(u, v), s.splat(1.0 + ABOVE_ONE));
        let weights = s.and(s.and(s.le(zero, u), s.le(zero, v)), sum);
        let is_start = s.mask_bits(s.and_not(weights, s.eq_u(s.load_u(&triangles.leaf), s.splat_u(NONE))));
        let (mut left, mut begins) = (is_start, [0.0; LANES]);
        if R::TELLS {
            let (free, begin) =
                free_rays::<S, R>(s, &triangles.corners, &triangles.known, [dx, dy, dz], levels);
            // A ray whose range ends before it begins has ended, too.
            left &= !(free | s.mask_bits(s.lt(tmax, begin)));
            s.store(begin, &mut begins);
        }
        let StartTriangles { corners, leaf, slot, .. } = &*triangles;
        let (mut origin, mut error) = ([[0.0f64; LANES]; 3], [0.0f64; LANES]);
        let mut of_lane = [[0.0; LANES]; 2];
        s.store(u, &mut of_lane[0]);
        s.store(v, &mut of_lane[1]);
        // There are no branches in this loop, and it reads whole vectors, so that the compiler
        // vectorizes all of it.
        for i in 0..LANES {
            let weights = [of_lane[0][i].into(), of_lane[1][i].into()];
            let mut corner = [[0.0f64; 3]; 3];
            for c in 0..3 {
                for k in 0..3 {
                    corner[c][k] = f64::from(corners[c][k][i]);
                }
            }
            let RoundedOrigin([x, y, z], off) = rounded_start(corner, weights);
            (origin[0][i], origin[1][i], origin[2][i], error[i]) = (x, y, z, off);
        }
        for lane in 0..LANES {
            let ray = &rays[lane];
            let is_start = is_start >> lane & 1 != 0;
            let point = [origin[0][lane], origin[1][lane], origin[2][lane]];
            points[lane] = StartPoint {
                origin: RoundedOrigin(point, error[lane]),
                leaf: if is_start { leaf[lane] } else { NONE },
                slot: slot[lane],
                u: ray.start.u,
                v: ray.start.v,
            };
            object_rays[lane] = Ray {
                origin: [point[0] as f32, point[1] as f32, point[2] as f32],
                tmin: begins[lane],
                direction: ray.direction,
                tmax: if is_start { ray.tmax } else { -1.0 },
            };
        }
        left
    }
}
