//! However a ray is prepared, and on every instruction set, f32 leaves out nothing that exact arithmetic accepts, and is
//! sure of nothing that it does not.

use super::{Prepared, PreparedRay};
use crate::intersect::boxes::RaySlabs;
use crate::intersect::exact::Intersection;
use crate::intersect::filter::TriangleFilter;
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::layout::{IndexedLeaf, NONE, Object, WIDTH, WideNode};
use bth_format::object::ObjectBounds;
use bth_random::Rng;
use zerocopy::FromZeros;

/// One triangle: its node, its leaf, and the object whose bounds it has.
struct Single {
    node: WideNode,
    leaf: IndexedLeaf,
    object: Object,
}

impl Single {
    fn new(corners: [[f32; 3]; 3]) -> Single {
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
        Single { node, leaf, object }
    }
}

/// What is known of the triangle.
struct Found {
    maybe: u32,
    sure: u32,
    /// Between which depths it is hit.
    depth: [f32; 2],
}

/// Children and candidates as a kernel.
struct Look<'a>(&'a PreparedRay, &'a Single);

impl Kernel for Look<'_> {
    type Output = (u32, Found);
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let Look(PreparedRay { slabs, sight, .. }, Single { node, leaf, .. }) = self;
        let (bits, _) = slabs.children(s, node, slabs.last);
        let children = (0..WIDTH).filter(|&i| bits >> i & 1 != 0 && node.child[i] != NONE);
        let candidates = sight.candidates(s, leaf, slabs.first, slabs.last);
        let (mut nearest, mut farthest) = ([0.0; LANES], [0.0; LANES]);
        s.store(candidates.nearest, &mut nearest);
        s.store(candidates.farthest, &mut farthest);
        let found =
            Found { maybe: candidates.maybe, sure: candidates.sure, depth: [nearest[0], farthest[0]] };
        (children.fold(0, |m, i| m | 1 << i), found)
    }
}

/// Sixteen rays prepared together, as a kernel.
struct PacketKernel<'a>(&'a [Ray; LANES], &'a Object);

impl Kernel for PacketKernel<'_> {
    type Output = Prepared;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Prepared {
        let mut prepared = Prepared::new();
        let at = std::array::from_fn(|i| i as u32);
        prepared.fill(s, &ObjectBounds::new(self.1), self.0, &at, LANES);
        prepared
    }
}

/// All ways to prepare a ray: in f64, alone in f32, and with others on every instruction set.
fn aims(ray: &Ray, line: &Line, object: &Object, lane: usize) -> Vec<PreparedRay> {
    let slabs = RaySlabs::new(ray, line, object);
    let mut aims = vec![PreparedRay::new(slabs, TriangleFilter::new(ray, line, &slabs, object))];
    aims.extend(PreparedRay::of(&ObjectBounds::new(object), ray));
    aims.extend(PreparedRay::in_f64(object, ray));
    let mut others = [Ray { origin: [f32::NAN; 3], ..*ray }; LANES];
    others[lane] = *ray;
    for isa in Isa::ALL {
        let prepared = isa.run(PacketKernel(&others, object));
        aims.extend(prepared.aim(lane));
        assert!(prepared.aim((lane + 1) % LANES).is_none(), "a ray without a line is not prepared");
    }
    aims
}

fn in_range(ray: &Ray, crossing: &Option<Intersection>) -> bool {
    crossing.is_some_and(|crossing| {
        let t = crossing.t as f32;
        ray.tmin <= t && t <= ray.tmax && t < f32::INFINITY
    })
}

#[test]
fn nothing_is_lost_that_the_line_crosses_and_sure_hits_are_hits() {
    let mut rng = Rng::new(3);
    let (mut crossings, mut missed, mut sure, mut prepared) = (0, 0, 0, 0);
    for round in 0..60_000 {
        let unit = |rng: &mut Rng| (rng.below(1 << 24) as f32 / (1 << 23) as f32) - 1.0;
        let scale = [1.0, 1e-30, 1e30, 3e37, 1e-42, 1e-14, 1e-20, 1e12, 1e-36, 3.0][round % 10];
        let away = [0.0, 1.0, 1e3, 1e6][round / 10 % 4] * scale;
        // Often flat, often on a coarse grid: boxes without volume, rays along their sides.
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
        let endless = Ray { origin, tmin: f32::NEG_INFINITY, direction, tmax: f32::INFINITY };
        let Some(line) = Line::new(&endless) else { continue };
        let single = Single::new(corners);
        let crossing = line.crossing(corners);
        let t = crossing.map_or(1.0, |c| c.t as f32);
        // Also with the range cut off right at the crossing, and right before and behind it.
        let ranges = [
            (f32::NEG_INFINITY, f32::INFINITY),
            (t, t),
            (t.next_up(), f32::INFINITY),
            (f32::NEG_INFINITY, t.next_down()),
        ];
        for (tmin, tmax) in ranges {
            let ray = Ray { tmin, tmax, ..endless };
            if tmin > tmax || !in_range(&endless, &crossing) && tmax < f32::INFINITY {
                continue;
            }
            let hit = in_range(&ray, &crossing);
            let aims = aims(&ray, &line, &single.object, round % LANES);
            prepared += aims.len() - 1;
            for aim in &aims {
                for isa in Isa::ALL {
                    let (children, found) = isa.run(Look(aim, &single));
                    let context =
                        || format!("{isa}, round {round}: {ray:?}, {corners:?}, {crossing:?}, {aim:?}");
                    assert!(!hit || children == 1, "the box is lost: {}", context());
                    assert!(!hit || found.maybe == 1, "the triangle is lost: {}", context());
                    assert!(hit || found.sure == 0, "sure of what is no hit: {}", context());
                    let depth = crossing.map_or(0.0, |c| c.t * f64::from(aim.slabs.scale));
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
        crossings += u32::from(crossing.is_some());
    }
    assert!(crossings > 2_000 && missed > 10_000, "{crossings} crossings, {missed} boxes missed");
    assert!(sure > 10_000 && prepared > 100_000, "{sure} sure, {prepared} prepared in f32");
}
