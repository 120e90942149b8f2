//! The step of sixteen tet walks, one in each lane, from a tetrahedron to the next, in f32.
//!
//! The method is the same as in [`super::walk`], but a sign is used only if it is certain in f32.
//!
//! **Error of a cross product.** Let u = 2^-24, let (x, y, z) be the computed projection of a
//! point, where z is its depth, and let W = |x| + |y| + |z|. The differences from the origin are
//! off by a factor of 1 + u, and so is the shear, at most 1. With the roundings of the product and
//! of the last difference, x and y are off by u (2|x| + 4|z|), less than δ = 4.1 u W. For two
//! points a and b let S = |x| + |y|. Their cross product is then off by δa Sb + δb Sa + 2 δa δb
//! because of the points, and by 2 u Sa Sb because of the roundings of the product. Where B is not
//! below the W of either point, the sum is less than 5.1 u B (Sa + Sb) + 34 u² B². What is computed
//! is a bound of E = 6 u B (Sa + T + 8 u B).
//!
//! B and T are the largest W and S of the points that the lane has projected so far, and B is never
//! below 2^-38. Therefore E exceeds 2^-119, which is more than the effect of underflow. From B =
//! 2^61 on, where products might overflow, E is infinite and no sign is certain. One E serves all
//! three products of a step. Of the diffuse rays in a scanned model, fewer than one in 500 have an
//! uncertain sign.
//!
//! The two signs that select the face of exit are all that a step needs: the entered face was
//! crossed with certain signs, so the signs of the face of exit are certain, too.

use crate::simd::Simd;
use bth_format::layout::{FACE_BIT, NONE};

/// u = 2^-24, the largest relative error of a rounding.
const U: f32 = 1.0 / (1 << 24) as f32;
/// The smallest value of B in the error bound at the head of this file.
const LEAST_REACH: f32 = 1.0 / (1u64 << 38) as f32;
/// Factor by which a B of 2^61 or more becomes infinite.
const TO_INFINITY: f32 = (1u128 << 67) as f32;

/// An array of three elements. `array::map` would call a closure that is not compiled for the
/// kernel's instruction set.
macro_rules! three {
    (|$i:ident| $element:expr) => {
        [
            {
                let $i = 0;
                $element
            },
            {
                let $i = 1;
                $element
            },
            {
                let $i = 2;
                $element
            },
        ]
    };
}
pub(super) use three;

/// Set in the `TET` word of a lane that stops because a sign is uncertain; the lower bits hold the
/// tetrahedron.
pub(super) const UNCERTAIN: u32 = FACE_BIT | 1 << 30;

/// Indices of the u32 values of a lane.
pub(super) mod word {
    /// Index of the tetrahedron. In a lane that has stopped: the link behind the face at which it
    /// stopped, or the tetrahedron's index with [`super::UNCERTAIN`].
    pub(crate) const TET: usize = 0;
    /// The fourth vertex of the tetrahedron, from the link that was followed.
    pub(crate) const APEX: usize = 1;
    /// The first of the three vertices of the entered face.
    pub(crate) const FACE: usize = 2;
    /// The axis of the depth: 0, 1 or 2.
    pub(crate) const AXIS: usize = 5;
    /// The sign bit of the direction along the axis of the depth; the other bits are 0.
    pub(crate) const SIGN: usize = 6;
    /// Index of the ray in the batch.
    pub(crate) const RAY: usize = 7;
    pub(crate) const COUNT: usize = 8;
}

/// Indices of the f32 values of a lane; for arrays the index of the first element.
pub(super) mod float {
    /// Three elements: the ray's origin along the axes of the lane.
    pub(crate) const ORIGIN: usize = 0;
    /// Two elements: the direction in the plane of projection, divided by its |component| along the
    /// axis of the depth.
    pub(crate) const SHEAR: usize = 3;
    /// Three elements: x of the projected corners of the entered face.
    pub(crate) const X: usize = 5;
    /// Three elements: y of the projected corners of the entered face.
    pub(crate) const Y: usize = 8;
    /// Three elements: the depths of the corners of the entered face, which increase along the ray.
    pub(crate) const DEPTH: usize = 11;
    /// B of the error bound.
    pub(crate) const REACH: usize = 14;
    /// T of the error bound.
    pub(crate) const SIZE: usize = 15;
    /// Upper bound of the depth at tmax.
    pub(crate) const LIMIT: usize = 16;
    pub(crate) const COUNT: usize = 17;
}

/// The state of sixteen walks.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    pub(super) words: [S::U; word::COUNT],
    pub(super) floats: [S::F; float::COUNT],
}

/// Points projected along the rays of the lanes.
#[derive(Clone, Copy)]
pub(super) struct ProjectedLanes<S: Simd> {
    pub(super) x: S::F,
    pub(super) y: S::F,
    pub(super) depth: S::F,
}

/// B and T of the error bound at the head of this file.
#[derive(Clone, Copy)]
pub(super) struct Extent<S: Simd> {
    /// B.
    pub(super) reach: S::F,
    /// T.
    pub(super) size: S::F,
}

impl<S: Simd> Extent<S> {
    /// The extent of no points.
    #[inline(always)]
    pub(super) fn least(s: S) -> Self {
        Extent { reach: s.splat(LEAST_REACH), size: s.splat(0.0) }
    }
    /// The extent with one more point, and the point's S.
    #[inline(always)]
    pub(super) fn with(self, s: S, p: &ProjectedLanes<S>) -> (Self, S::F) {
        let size = s.add(s.abs(p.x), s.abs(p.y));
        let reach = s.add(size, s.abs(p.depth));
        (Extent { reach: s.max(reach, self.reach), size: s.max(size, self.size) }, size)
    }
    /// E for the cross product of any point of the extent with a point whose S is `size`.
    #[inline(always)]
    pub(super) fn bound(&self, s: S, size: S::F) -> S::F {
        let factor = s.mul(s.mul(self.reach, s.splat(TO_INFINITY)), s.splat(6.0 * U / TO_INFINITY));
        s.mul(factor, s.add(size, s.fma(s.splat(8.0 * U), self.reach, self.size)))
    }
}

/// Twice the signed area of the triangle (line, a, b) in the plane of projection, with an error
/// below E.
#[inline(always)]
pub(super) fn cross<S: Simd>(s: S, a: &ProjectedLanes<S>, b: &ProjectedLanes<S>) -> S::F {
    s.fnma(a.y, b.x, s.mul(a.x, b.y))
}

impl<S: Simd> Lanes<S> {
    /// Lanes without walks.
    #[inline(always)]
    pub(super) fn idle(s: S) -> Self {
        let mut lanes = Lanes { words: [s.splat_u(0); word::COUNT], floats: [s.splat(0.0); float::COUNT] };
        lanes.words[word::TET] = s.splat_u(NONE);
        lanes
    }

    /// The lanes whose walks have not stopped.
    #[inline(always)]
    pub(super) fn active(&self, s: S) -> S::M {
        s.lt_u(self.words[word::TET], s.splat_u(FACE_BIT))
    }

    /// A projected corner of the entered face.
    #[inline(always)]
    pub(super) fn corner(&self, i: usize) -> ProjectedLanes<S> {
        let f = &self.floats;
        ProjectedLanes { x: f[float::X + i], y: f[float::Y + i], depth: f[float::DEPTH + i] }
    }

    /// Positions of vertices relative to the rays' origins, along the axes of the lanes. `vertices`
    /// are rows of x, y, z and an unused word.
    #[inline(always)]
    pub(super) fn gather_positions(&self, s: S, m: S::M, vertices: &[[f32; 4]], vertex: S::U) -> [S::F; 3] {
        let [x, y, z, _] = s.rows4(m, vertices, vertex);
        let along = self.permute(s, [x, y, z]);
        three!(|k| s.sub(along[k], self.floats[float::ORIGIN + k]))
    }

    /// Permutes coordinates to the axes of the lanes: first the two axes of the plane of
    /// projection, then the axis of the depth. The two follow the axis of the depth cyclically, and
    /// are swapped for rays whose direction along that axis is negative.
    #[inline(always)]
    pub(super) fn permute(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let axis = self.words[word::AXIS];
        let (is_x, is_y) = (s.eq_u(axis, s.splat_u(0)), s.eq_u(axis, s.splat_u(1)));
        let negative = s.lt_u(s.splat_u(0), self.words[word::SIGN]);
        let next = s.select(is_x, y, s.select(is_y, z, x));
        let last = s.select(is_x, z, s.select(is_y, x, y));
        let depth = s.select(is_x, x, s.select(is_y, y, z));
        [s.select(negative, last, next), s.select(negative, next, last), depth]
    }

    /// Projects points that are given relative to the rays' origins, along the axes of the lanes.
    #[inline(always)]
    pub(super) fn project(&self, s: S, [x, y, z]: [S::F; 3]) -> ProjectedLanes<S> {
        let depth = s.floats(s.xor_u(s.bits(z), self.words[word::SIGN]));
        let x = s.fnma(self.floats[float::SHEAR], depth, x);
        let y = s.fnma(self.floats[float::SHEAR + 1], depth, y);
        ProjectedLanes { x, y, depth }
    }
}

/// Results that one part of a step passes to the next. A step has three parts, so that the gathers
/// of several groups of lanes overlap.
#[derive(Clone, Copy)]
pub(super) struct Step<S: Simd> {
    /// The fourth vertex of the tetrahedron.
    apex: S::U,
    /// The position of `apex` relative to the ray's origin, along the axes of the lane.
    position: [S::F; 3],
    /// The lanes whose signs are certain.
    certain: S::M,
    /// The vertex opposite to the face of exit.
    opposite_vertex: S::U,
    /// The vertices of the face through which the tetrahedron was entered.
    face: [S::U; 3],
    /// The lanes whose face of exit lies beyond their limit; none if no depths are kept.
    passed: S::M,
}

impl<S: Simd> Step<S> {
    #[inline(always)]
    pub(super) fn empty(s: S) -> Self {
        let (u, f) = (s.splat_u(0), s.splat(0.0));
        let none = s.mask(0);
        Step { apex: u, position: [f; 3], certain: none, opposite_vertex: u, face: [u; 3], passed: none }
    }
}

impl<S: Simd> Lanes<S> {
    /// First part of a step: fetches the fourth vertex of each active lane's tetrahedron.
    #[inline(always)]
    pub(super) fn fetch_apex(&self, s: S, step: &mut Step<S>, vertices: &[[f32; 4]]) {
        step.apex = self.words[word::APEX];
        step.position = self.gather_positions(s, self.active(s), vertices, step.apex);
    }

    /// Second part of a step: finds the face through which the line leaves the tetrahedron, and
    /// stores it as the entered face of the next. The depths of its corners are stored only if
    /// `keeps_depths` is set.
    #[inline(always)]
    pub(super) fn choose_exit(&mut self, s: S, keeps_depths: bool, step: &mut Step<S>) {
        let apex = self.project(s, step.position);
        let extent = Extent { reach: self.floats[float::REACH], size: self.floats[float::SIZE] };
        let (extent, size) = extent.with(s, &apex);
        let bound = extent.bound(s, size);
        let minus_bound = s.sub(s.splat(0.0), bound);
        let side = three!(|i| cross(s, &apex, &self.corner(i)));
        let positive = three!(|i| s.lt(bound, side[i]));
        let negative = three!(|i| s.lt(side[i], minus_bound));
        let active = self.active(s);
        let out = [
            s.and(active, s.and(positive[1], negative[2])),
            s.and(active, s.and(positive[2], negative[0])),
            s.and(active, s.and(positive[0], negative[1])),
        ];
        step.certain = s.or(out[0], s.or(out[1], out[2]));
        step.face = three!(|i| self.words[word::FACE + i]);
        step.opposite_vertex =
            s.select_u(out[2], step.face[2], s.select_u(out[1], step.face[1], step.face[0]));
        self.floats[float::REACH] = extent.reach;
        self.floats[float::SIZE] = extent.size;
        for (i, &out) in out.iter().enumerate() {
            let word = &mut self.words[word::FACE + i];
            *word = s.select_u(out, step.apex, *word);
            let corner = self.corner(i);
            self.floats[float::X + i] = s.select(out, apex.x, corner.x);
            self.floats[float::Y + i] = s.select(out, apex.y, corner.y);
        }
        if keeps_depths {
            let f = &mut self.floats;
            for (i, &out) in out.iter().enumerate() {
                f[float::DEPTH + i] = s.select(out, apex.depth, f[float::DEPTH + i]);
            }
            let nearest = s.min(s.min(f[float::DEPTH], f[float::DEPTH + 1]), f[float::DEPTH + 2]);
            step.passed = s.lt(f[float::LIMIT], nearest);
        }
    }

    /// Third part of a step: moves to the tetrahedron behind the face of exit. A walk stops where
    /// it reaches a constrained face, leaves the hull or, where depths are kept, passes its limit;
    /// `TET` is then a link with [`FACE_BIT`]. A walk with an uncertain sign stops with
    /// [`UNCERTAIN`] in `TET` and is otherwise unchanged.
    ///
    /// `links` are the links of all tetrahedra, four each, by ascending opposite vertex. `one` is 1
    /// in every lane; a variable, because the compiler replaces the masked addition of a constant
    /// by slower code.
    #[inline(always)]
    pub(super) fn follow_link(&mut self, s: S, one: S::U, step: &Step<S>, links: &[[u32; 2]]) {
        let tet = self.words[word::TET];
        let mut rank = s.splat_u(0);
        for vertex in [step.apex, step.face[0], step.face[1], step.face[2]] {
            rank = s.add_where(rank, s.lt_u(vertex, step.opposite_vertex), one);
        }
        let (next, opposite) = s.gather_pair(step.certain, links, s.add_u(s.shl_u::<2>(tet), rank));
        let next = s.select_u(step.passed, s.splat_u(NONE), next);
        let next = s.select_u(step.certain, next, s.or_u(tet, s.splat_u(UNCERTAIN)));
        self.words[word::TET] = s.select_u(self.active(s), next, tet);
        self.words[word::APEX] = s.select_u(step.certain, opposite, self.words[word::APEX]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::queue::PreparedWalks;
    use super::*;
    use crate::intersect::line::Line;
    use crate::rays::Ray;
    use crate::simd::{Isa, Kernel, LANES};
    use bth_random::Rng;

    /// For sixteen rays with three points each: the cross products of the points in cyclic order,
    /// their bound, and the bits of the rays that f32 can represent.
    struct CrossProducts<'a>(&'a [Ray], &'a [[f32; 4]]);

    impl Kernel for CrossProducts<'_> {
        type Output = ([[f32; LANES]; 3], [f32; LANES], u32);
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let lane = s.load_u(&std::array::from_fn(|i| i as u32));
            let first = s.add_u(lane, s.shl_u::<1>(lane));
            let vertex = three!(|k| s.add_u(first, s.splat_u(k)));
            let prepared = PreparedWalks::new(s, s.mask(0xffff), self.0, self.1, lane, vertex);
            let lanes = &prepared.lanes;
            let extent = Extent { reach: lanes.floats[float::REACH], size: lanes.floats[float::SIZE] };
            let (mut out, mut bound) = ([[0.0; LANES]; 3], [0.0; LANES]);
            s.store(cross(s, &lanes.corner(0), &lanes.corner(1)), &mut out[0]);
            s.store(cross(s, &lanes.corner(1), &lanes.corner(2)), &mut out[1]);
            s.store(cross(s, &lanes.corner(2), &lanes.corner(0)), &mut out[2]);
            s.store(extent.bound(s, extent.size), &mut bound);
            (out, bound, s.mask_bits(prepared.representable))
        }
    }

    #[test]
    fn cross_products_are_off_by_less_than_their_bound_at_any_scale() {
        let mut rng = Rng::new(51);
        let (mut certain, mut tested) = (0, 0);
        for round in 0..4_000 {
            let scale = 2f32.powi(rng.below(180) as i32 - 95);
            let unit = |rng: &mut Rng| (rng.below(1 << 24) as f32 / (1 << 23) as f32) - 1.0;
            let spread = [1.0, 1e-3, 1e-6][round % 3];
            let rays: [Ray; LANES] = std::array::from_fn(|_| Ray {
                origin: [(); 3].map(|()| unit(&mut rng) * scale),
                tmin: 0.0,
                direction: [(); 3].map(|()| unit(&mut rng)),
                tmax: f32::INFINITY,
            });
            // The corners of each triangle are near points of the ray's line.
            let vertices: Vec<[f32; 4]> = (0..3 * LANES)
                .map(|i| {
                    let (ray, t) = (&rays[i / 3], unit(&mut rng) * scale);
                    let p = [0, 1, 2]
                        .map(|k| ray.origin[k] + ray.direction[k] * t + unit(&mut rng) * spread * scale);
                    [p[0], p[1], p[2], 0.0]
                })
                .collect();
            for isa in Isa::ALL {
                let (crosses, bound, representable) = isa.run(CrossProducts(&rays, &vertices));
                for lane in (0..LANES).filter(|i| representable >> i & 1 != 0) {
                    let line = Line::new(&rays[lane]).expect("a direction");
                    let p = [0, 1, 2].map(|k| {
                        let [x, y, z, _] = vertices[3 * lane + k];
                        line.project([x, y, z])
                    });
                    for k in 0..3 {
                        let (a, b) = (p[k], p[(k + 1) % 3]);
                        let exact = a.x * b.y - a.y * b.x;
                        let error = (f64::from(crosses[k][lane]) - exact).abs();
                        let bound = f64::from(bound[lane]);
                        assert!(
                            bound == f64::INFINITY || error <= bound,
                            "{isa}: {error:e} exceeds {bound:e}: {:?}",
                            rays[lane]
                        );
                        certain += u32::from(f64::from(crosses[k][lane]).abs() > bound);
                        tested += 1;
                    }
                }
            }
        }
        assert!(certain * 2 > tested, "{certain} of {tested} signs are certain");
    }
}
