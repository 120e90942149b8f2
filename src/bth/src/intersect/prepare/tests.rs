//! For every way to prepare a ray and every instruction set, box test and filter exclude nothing
//! that exact arithmetic accepts, and the filter is sure of nothing that exact arithmetic rejects.

use super::{LARGEST, Prepared, PreparedRay, SMALLEST, lies_between};
use crate::intersect::boxes::RaySlabs;
use crate::intersect::exact::Intersection;
use crate::intersect::filter::TriangleFilter;
use crate::intersect::line::Line;
use crate::intersect::origin::RoundedLine;
use crate::intersect::start::{ExactStart, rounded_start};
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::wide;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::layout::{BOX_MARGIN, IndexedLeaf, NONE, Object, WIDENED_BOXES, WIDTH, WideNode};
use bth_format::object::ObjectBounds;
use bth_random::Rng;
use zerocopy::FromZeros;

/// An object of one triangle, with its node and leaf.
struct OneTriangle {
    node: WideNode,
    leaf: IndexedLeaf,
    object: Object,
}

impl OneTriangle {
    fn new(corners: [[f32; 3]; 3]) -> OneTriangle {
        let mut node = WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };
        let mut object = Object::new_zeroed();
        let mut leaf = IndexedLeaf::new_zeroed();
        (node.child[0], leaf.triangles, leaf.vertices, object.triangles, object.depth) = (7, 1, 3, 1, 1);
        for k in 0..3 {
            object.lower[k] = corners.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
            object.upper[k] = corners.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max);
            node.bounds[k][0][0] = object.lower[k];
            node.bounds[k][1][0] = object.upper[k];
            leaf.vertex[k] = [corners[0][k]; WIDTH];
            (leaf.vertex[k][1], leaf.vertex[k][2]) = (corners[1][k], corners[2][k]);
            leaf.corner[k][0] = k as u8;
        }
        OneTriangle { node, leaf, object }
    }

    /// Gives the box of the triangle the smallest room that widened boxes have.
    fn widen(&mut self, corners: [[f32; 3]; 3]) {
        self.object.coordinates |= WIDENED_BOXES;
        for corner in corners {
            let greatest = corner.into_iter().fold(0.0, |m: f64, x| m.max(f64::from(x).abs()));
            for (k, x) in corner.into_iter().enumerate() {
                let [lower, upper] = [-1.0, 1.0].map(|sign| f64::from(x) + sign * greatest * BOX_MARGIN);
                let (mut least, mut most) = (lower as f32, upper as f32);
                if f64::from(least) > lower {
                    least = least.next_down();
                }
                if f64::from(most) < upper {
                    most = most.next_up();
                }
                let [from, to] = &mut self.node.bounds[k];
                (from[0], to[0]) = (from[0].min(least), to[0].max(most));
            }
        }
    }

    /// Makes the object hold other points.
    fn include(&mut self, points: [[f32; 3]; 3]) {
        for p in points {
            for k in 0..3 {
                self.object.lower[k] = self.object.lower[k].min(p[k]);
                self.object.upper[k] = self.object.upper[k].max(p[k]);
            }
        }
    }

    /// Makes the object reach beyond its triangle on all sides, as where there are others.
    fn enlarge(&mut self, by: f32) {
        for k in 0..3 {
            self.object.lower[k] = (self.object.lower[k] - by).max(f32::MIN);
            self.object.upper[k] = (self.object.upper[k] + by).min(f32::MAX);
        }
    }
}

/// Where a ray starts on a triangle.
struct RoundStart {
    corners: [[f32; 3]; 3],
    u: f32,
    v: f32,
}

impl RoundStart {
    fn point(&self) -> StartPoint {
        let &RoundStart { corners, u, v } = self;
        let origin = rounded_start(corners.map(wide), [u, v].map(f64::from));
        StartPoint { origin, leaf: 7, slot: 0, u, v }
    }
}

/// Result of the filter for the triangle.
struct FilterResult {
    maybe: u32,
    sure: u32,
    /// Bounds of the depth of the hit.
    depth: [f32; 2],
}

/// Kernel of box test and filter, with the bounds of the ray. Its output is the set of
/// children that are hit, as bits, and the result of the filter.
struct BoxAndFilter<'a>(&'a PreparedRay, &'a OneTriangle, &'a ObjectBounds);

impl Kernel for BoxAndFilter<'_> {
    type Output = (u32, FilterResult);
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let BoxAndFilter(PreparedRay { slabs, filter, .. }, OneTriangle { node, leaf, .. }, bounds) = self;
        let (bits, _) = slabs.children(s, node, slabs.last);
        let children = (0..WIDTH).filter(|&i| bits >> i & 1 != 0 && node.child[i] != NONE);
        let candidates = filter.candidates(s, (leaf, 0), slabs.first, slabs.last, bounds);
        let (mut nearest, mut farthest) = ([0.0; LANES], [0.0; LANES]);
        s.store(candidates.nearest, &mut nearest);
        s.store(candidates.farthest, &mut farthest);
        let found =
            FilterResult { maybe: candidates.maybe, sure: candidates.sure, depth: [nearest[0], farthest[0]] };
        (children.fold(0, |m, i| m | 1 << i), found)
    }
}

/// Kernel that prepares sixteen rays together.
struct PrepareTest<'a>(&'a [Ray; LANES], &'a ObjectBounds);

impl Kernel for PrepareTest<'_> {
    type Output = Prepared;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Prepared {
        let mut prepared = Prepared::new();
        let at = std::array::from_fn(|i| i as u32);
        prepared.fill(s, self.1, self.0, &at, LANES);
        prepared
    }
}

/// Kernel that prepares one ray alone.
struct PrepareOneKernel<'a>(&'a Ray, &'a ObjectBounds);

impl Kernel for PrepareOneKernel<'_> {
    type Output = Option<PreparedRay>;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<PreparedRay> {
        PreparedRay::of(s, self.1, self.0)
    }
}

/// The ray prepared in all ways: in f64, and on every instruction set alone and in a lane among
/// others.
fn all_preparations(ray: &Ray, line: &Line, bounds: &ObjectBounds, lane: usize) -> Vec<PreparedRay> {
    let slabs = RaySlabs::new(ray, line, bounds);
    let mut all = vec![PreparedRay::new(slabs, TriangleFilter::new(ray, line, &slabs, bounds))];
    all.extend(PreparedRay::in_f64(bounds, ray));
    let mut others = [Ray { origin: [f32::NAN; 3], ..*ray }; LANES];
    others[lane] = *ray;
    for isa in Isa::ALL {
        all.extend(isa.run(PrepareOneKernel(ray, bounds)));
        let prepared = isa.run(PrepareTest(&others, bounds));
        all.extend(prepared.prepared(lane));
        assert!(prepared.prepared((lane + 1) % LANES).is_none(), "a ray without a line is not prepared");
    }
    all
}

fn in_range(ray: &Ray, intersection: &Option<Intersection>) -> bool {
    intersection.is_some_and(|intersection| {
        let t = intersection.t as f32;
        ray.tmin <= t && t <= ray.tmax && t.is_finite()
    })
}

#[test]
fn boxes_and_triangles_that_the_line_crosses_are_kept_and_sure_hits_are_hits() {
    let mut rng = Rng::new(3);
    let (mut intersections, mut missed, mut sure, mut prepared) = (0, 0, 0, 0);
    for round in 0..60_000 {
        let unit = |rng: &mut Rng| (rng.below(1 << 24) as f32 / (1 << 23) as f32) - 1.0;
        let scale = [1.0, 1e-30, 1e30, 3e37, 1e-42, 1e-14, 1e-20, 1e12, 1e-36, 1e20][round % 10];
        let away = [0.0, 1.0, 1e3, 1e6][round / 10 % 4] * scale;
        // Every third round lies on a coarse grid, so that many boxes have no volume and rays run
        // along their sides.
        let coarse = round % 3 == 0;
        let mut point = |spread: f32| {
            [(); 3].map(|()| {
                let x = unit(&mut rng);
                let x = if coarse { (x * 2.0).round() } else { x };
                (x * spread * scale + away).clamp(f32::MIN, f32::MAX)
            })
        };
        let corners = [point(1.0), point(1.0), point(1.0)];
        let (origin, target) = (point(4.0), point(1.0));
        let mut direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        if round % 4 == 0 {
            direction[round / 4 % 3] = if round % 8 == 0 { 0.0 } else { -0.0 };
        }
        let mut endless = Ray { origin, tmin: f32::NEG_INFINITY, direction, tmax: f32::INFINITY };
        // Every other ray starts on another triangle of the object.
        let start = (round % 2 == 1).then(|| {
            let [u, v] = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [0.25, 0.1], [1.0 / 3.0, 2.0 / 3.0]][round % 5];
            RoundStart { corners: [origin, point(4.0), point(1.0)], u, v }
        });
        if let Some(start) = &start {
            (endless.origin, endless.tmin) = (start.point().rounded(), 0.0);
        }
        let Some(mut line) = Line::new(&endless) else { continue };
        let mut object = OneTriangle::new(corners);
        if round % 7 == 0 {
            object.enlarge([1e3, 1e6, 1e11][round / 7 % 3] * scale);
        }
        if round % 5 < 2 {
            object.widen(corners);
        }
        let (bounds, intersection) = match &start {
            None => (ObjectBounds::new(&object.object), line.intersection(corners)),
            Some(start) => {
                object.include(start.corners);
                let StartPoint { origin, .. } = start.point();
                line = Line::of(&RoundedLine { origin, ..RoundedLine::of_ray(&endless) }).expect("a line");
                let exact = ExactStart::new(start.corners, start.u, start.v);
                (ObjectBounds::new(&object.object).for_starts(), exact.intersection(&line, corners))
            }
        };
        let t = intersection.map_or(1.0, |c| c.t as f32);
        // The whole line, and ranges that end or begin at the intersection or directly next to it.
        let ranges = [
            (endless.tmin, f32::INFINITY),
            (t, t),
            (t.next_up(), f32::INFINITY),
            (endless.tmin, t.next_down()),
        ];
        for (tmin, tmax) in ranges {
            let ray = Ray { tmin, tmax, ..endless };
            if tmin > tmax || !in_range(&endless, &intersection) && tmax < f32::INFINITY {
                continue;
            }
            let hit = in_range(&ray, &intersection);
            let preparations = all_preparations(&ray, &line, &bounds, round % LANES);
            prepared += preparations.len() - 1;
            for preparation in &preparations {
                for isa in Isa::ALL {
                    let (children, found) = isa.run(BoxAndFilter(preparation, &object, &bounds));
                    let context = || {
                        format!(
                            "{isa}, round {round}: {ray:?}, {corners:?}, {intersection:?}, {preparation:?}"
                        )
                    };
                    assert!(!hit || children == 1, "the box is lost: {}", context());
                    assert!(!hit || found.maybe == 1, "the triangle is lost: {}", context());
                    assert!(hit || found.sure == 0, "sure of what is no hit: {}", context());
                    let depth = intersection.map_or(0.0, |c| c.t * f64::from(preparation.slabs.scale));
                    let [near, far] = found.depth.map(f64::from);
                    let within = near <= depth && depth <= far;
                    assert!(
                        found.sure == 0 || within,
                        "its depth is not {depth}: {near} to {far}, {}",
                        context()
                    );
                    assert!(children <= 1 && found.maybe <= 1, "what is empty is never entered");
                    missed += u32::from(children == 0);
                    sure += u32::from(found.sure != 0);
                }
            }
        }
        intersections += u32::from(intersection.is_some());
    }
    assert!(intersections > 2_000 && missed > 10_000, "{intersections} intersections, {missed} boxes missed");
    assert!(sure > 10_000 && prepared > 100_000, "{sure} sure, {prepared} prepared in f32");
}

#[test]
fn small_triangles_of_large_objects_are_decided_in_f32() {
    let mut rng = Rng::new(5);
    let mut decided = [0; 2];
    for round in 0..500 {
        let unit = |rng: &mut Rng| rng.below(1 << 24) as f32 / (1 << 24) as f32;
        let corners = [[0.0, 0.0, 0.0], [1e-3, 0.0, 2e-4], [0.0, 1e-3, -1e-4]];
        let mut object = OneTriangle::new(corners);
        object.enlarge(1e3);
        // A point within the triangle or outside of it, at least a fifth of it away from its edges.
        let [u, v] = [0.2 + 0.2 * unit(&mut rng), 0.2 + 0.2 * unit(&mut rng)];
        let is_hit = round % 2 == 0;
        let [u, v] = if is_hit { [u, v] } else { [-u, v] };
        let target = [0, 1, 2].map(|k| u * corners[1][k] + v * corners[2][k]);
        let origin = [unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, 1.0];
        let ray = Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]));
        let line = Line::new(&ray).unwrap();
        let bounds = ObjectBounds::new(&object.object);
        for preparation in all_preparations(&ray, &line, &bounds, round % LANES) {
            for isa in Isa::ALL {
                let (_, found) = isa.run(BoxAndFilter(&preparation, &object, &bounds));
                let expected = u32::from(is_hit);
                assert_eq!([found.maybe, found.sure], [expected; 2], "{isa}, round {round}: {preparation:?}");
                decided[expected as usize] += 1;
            }
        }
    }
    assert!(decided[0] > 1_000 && decided[1] > 1_000, "{decided:?}");
}

#[test]
fn small_boxes_of_large_objects_are_told_apart_where_they_are_widened() {
    let mut rng = Rng::new(6);
    let mut entered = [[0; 2]; 2];
    for round in 0..500 {
        let unit = |rng: &mut Rng| rng.below(1 << 24) as f32 / (1 << 24) as f32;
        let corners = [[0.5, 0.5, 0.5], [0.501, 0.5, 0.501], [0.5, 0.501, 0.5]];
        let mut object = OneTriangle::new(corners);
        // The two largest objects are beyond what f32 prepares rays for.
        object.enlarge([1e5, 1e11, 1e13, 1e29][round / 4 % 4]);
        let is_widened = round % 2 == 0;
        if is_widened {
            object.widen(corners);
        }
        // A point within the box, or outside of it by the size of the box.
        let is_met = round % 4 < 2;
        let away = if is_met { 0.0 } else { 1e-3 };
        let target = [0.5005 + away, 0.5005, 0.5005];
        let origin = [0.4 + 0.2 * unit(&mut rng), unit(&mut rng), 1.5];
        let ray = Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]));
        let line = Line::new(&ray).unwrap();
        let bounds = ObjectBounds::new(&object.object);
        for preparation in all_preparations(&ray, &line, &bounds, round % LANES) {
            for isa in Isa::ALL {
                let (children, _) = isa.run(BoxAndFilter(&preparation, &object, &bounds));
                assert!(!is_met || children == 1, "{isa}, round {round}: {preparation:?}");
                entered[usize::from(is_widened)][usize::from(is_met)] += children;
            }
        }
    }
    let [[plain, _], [widened, met]] = entered;
    assert!(met > 1_000 && plain > 1_000, "{entered:?}");
    assert_eq!(widened, 0, "what is beside a box is not entered: {entered:?}");
}

#[test]
fn boxes_of_objects_far_from_the_origin_are_told_apart() {
    let mut rng = Rng::new(7);
    let mut met = 0;
    for round in 0..500 {
        // Coordinates of f32 are 2^-10 apart here, and the pads that are relative to the origin
        // would be 2^-6.
        let away = [1, 2, 3].map(|k| if (round % 7) & k == 0 { 8192.0 } else { -8193.0 });
        let place = |p: [f32; 3]| [0, 1, 2].map(|k| p[k] + away[k]);
        let size = 1.0 / 32.0;
        let corners = [[0.5, 0.5, 0.5], [0.5 + size, 0.5, 0.5], [0.5, 0.5 + size, 0.5 + size]].map(place);
        let mut object = OneTriangle::new(corners);
        (object.object.lower, object.object.upper) = (place([0.0; 3]), place([1.0; 3]));
        // A point within the box, or outside of it by three eighths of its size.
        let is_met = round % 2 == 0;
        let beside = if is_met { 0.5 } else { 1.375 };
        let target = place([0.5 + beside * size, 0.5 + size / 2.0, 0.5 + size / 2.0]);
        let mut unit = || rng.below(1 << 10) as f32 / (1 << 10) as f32;
        let origin = place([0.4 + 0.2 * unit(), unit(), 1.5]);
        let ray = Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]));
        let line = Line::new(&ray).unwrap();
        let bounds = ObjectBounds::new(&object.object);
        for preparation in all_preparations(&ray, &line, &bounds, round % LANES) {
            for isa in Isa::ALL {
                let (children, _) = isa.run(BoxAndFilter(&preparation, &object, &bounds));
                assert_eq!(children, u32::from(is_met), "{isa}, round {round}: {preparation:?}");
                met += children;
            }
        }
    }
    assert!(met > 1_000, "{met}");
}

#[test]
fn rays_that_f32_cannot_prepare_are_left_to_f64() {
    let bounds = ObjectBounds::around(1.0);
    let usual = Ray::new([0.5, -3.0, 0.25], [0.3, 0.9, -0.1]);
    let is_prepared = |ray: Ray| {
        let all = Isa::ALL.map(|isa| isa.run(PrepareOneKernel(&ray, &bounds)).is_some());
        assert!(all.iter().all(|of| *of == all[0]), "{ray:?}: {all:?}");
        all[0]
    };
    assert!(is_prepared(usual));
    assert!(is_prepared(Ray { tmin: -2.0, tmax: f32::MAX, ..usual }));
    assert!(!is_prepared(Ray { tmin: 2.0, tmax: 1.0, ..usual }));
    for tmax in [-0.0, 0.0, 1e-41] {
        let empty = Ray { tmin: 1e-40, tmax, ..usual };
        assert!(PreparedRay::in_f64(&bounds, &empty).is_none(), "an empty range up to {tmax}");
    }
    // Products of these are denormal; 0 is used instead.
    for tmin in [f32::MIN_POSITIVE, -f32::MIN_POSITIVE, 1e-40, f32::from_bits(1)] {
        let (ray, zero) = (Ray { tmin, ..usual }, Ray { tmin: 0.0, ..usual });
        assert!(is_prepared(ray) && is_prepared(zero));
        let [of_tiny, of_zero] = [ray, zero]
            .map(|ray| PreparedRay::of(crate::simd::Scalar, &bounds, &ray).expect("a ray with a line"));
        let depth = f64::from(tmin) * f64::from(of_tiny.slabs.scale);
        assert!(f64::from(of_tiny.slabs.first) <= depth && depth <= f64::from(of_tiny.filter.first));
        assert!((of_tiny.slabs.first - of_zero.slabs.first).abs() <= 4.0 * f32::MIN_POSITIVE);
    }
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, LARGEST, -f32::MAX] {
        for k in 0..3 {
            let put = |mut of: [f32; 3]| {
                of[k] = bad;
                of
            };
            assert!(!is_prepared(Ray { origin: put(usual.origin), ..usual }), "origin {bad} along {k}");
            assert!(
                !is_prepared(Ray { direction: put(usual.direction), ..usual }),
                "direction {bad} along {k}"
            );
        }
        if bad.is_nan() {
            assert!(!is_prepared(Ray { tmin: bad, ..usual }) && !is_prepared(Ray { tmax: bad, ..usual }));
        }
    }
    let scaled = |by: f32| Ray { direction: usual.direction.map(|d| d / 0.9 * by), ..usual };
    assert!(
        !is_prepared(scaled(0.0)) && !is_prepared(scaled(1.0 / LARGEST)) && !is_prepared(scaled(LARGEST))
    );
    assert!(is_prepared(scaled(1.001 / LARGEST)) && is_prepared(scaled(LARGEST * 0.999)));
}

#[test]
fn one_comparison_of_bits_tells_what_lies_between() {
    let (lower, upper) = (SMALLEST, LARGEST);
    let about = [lower, upper, 1.0].map(|x| [x.next_down(), x, x.next_up()]);
    let others =
        [0.0, -0.0, f32::NAN, -f32::NAN, f32::INFINITY, f32::MAX, f32::from_bits(1), f32::MIN_POSITIVE];
    for x in about.into_iter().flatten().chain(others) {
        for x in [x, -x] {
            assert_eq!(lies_between(x, lower, upper), lower < x && x < upper, "{x}");
        }
    }
}

/// Of a direction so small that t overflows before the depth does.
#[test]
fn no_t_that_is_certainly_in_the_range_is_infinite() {
    let ray = Ray::new([0.0; 3], [1e-42, 0.0, 0.0]).with_range(f32::NEG_INFINITY, f32::INFINITY);
    let slabs = RaySlabs::widened(&ray, 1.0, |_| 0.0).unwrap();
    for end in slabs.certain_range(&ray, 0.0) {
        assert!(((f64::from(end) / f64::from(slabs.scale)) as f32).is_finite(), "{end}");
    }
}
