//! The step of sixteen tet walks, one in each lane, from a tetrahedron to the next, in f32.
//!
//! The method is that of [`super::walk`]; a sign is used only if it is certain in f32. With u = 2^-24, the computed projection
//! (x, y, z) of a point, z its depth, and W = |x| + |y| + |z|: the differences from the origin are off by a factor of
//! 1 + u, the shear, at most 1, too, and with the roundings of the product and the last difference x and y are off by
//! u (2|x| + 4|z|), less than δ = 4.1 u W. For two points a and b with S = |x| + |y| the cross product is then off
//! by δa Sb + δb Sa + 2 δa δb, and by 2 u Sa Sb for its own roundings; where B is at least the W of both, that is
//! less than 5.1 u B (Sa + Sb) + 34 u² B². What is computed is a bound of E = 6 u B (Sa + T + 8 u B).
//!
//! B and T are the greatest W and S of the points that the lane has projected so far, and B is at least 2^-38, so E exceeds 2^-119
//! and with it the effect of underflow. From 2^61 on, where products might overflow, B makes E infinite and nothing is certain.
//! One E serves all three products of a step. Of the diffuse rays in a scanned model it leaves fewer than one in 500 uncertain.
//!
//! The two signs that select the exit are all that a step needs: the entered face was crossed with certain signs, so those of the face
//! of exit are certain, too.

use super::records::{EnteredLanes, LaneRecords};
use crate::simd::Simd;
use bth_format::layout::{FACE_BIT, NONE};

/// 2^-24.
const U: f32 = 1.0 / (1 << 24) as f32;
/// The least B; see the head of this file.
const LEAST_REACH: f32 = 1.0 / (1u64 << 38) as f32;
/// A factor that makes a B of 2^61 infinite.
const TO_INFINITY: f32 = (1u128 << 67) as f32;

/// An array of three elements. `array::map` would call a closure that is not compiled for the kernel's instruction set.
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

/// Set in the `TET` word of a lane that stops because a sign is uncertain; the lower bits hold the tetrahedron.
pub(super) const DOUBT: u32 = FACE_BIT | 1 << 30;

/// Indices of the u32 values of a lane.
pub(super) mod word {
    /// The tetrahedron. After the lane has stopped: the link behind the face at which it stopped, or the tetrahedron with
    /// [`super::DOUBT`].
    pub(crate) const TET: usize = 0;
    /// Opposite vertex stored in the link that was followed; of use in the format `Link32` only.
    pub(crate) const APEX: usize = 1;
    /// The link behind the entered face, as the record of the tetrahedron stores it.
    pub(crate) const BEHIND: usize = 2;
    /// The first of the three vertices of the entered face.
    pub(crate) const FACE: usize = 3;
    /// The axis of the depth.
    pub(crate) const AXIS: usize = 6;
    /// Sign bit of the direction along the axis of the depth.
    pub(crate) const SIGN: usize = 7;
    /// Index of the ray in the batch.
    pub(crate) const SLOT: usize = 8;
    pub(crate) const COUNT: usize = 9;
}

/// Indices of the f32 values of a lane; for arrays the index of the first element.
pub(super) mod float {
    /// Three elements: the ray's origin along the axes of the lane.
    pub(crate) const ORIGIN: usize = 0;
    /// Two elements: the direction in the plane of projection, divided by its |component| along the axis of the depth.
    pub(crate) const SHEAR: usize = 3;
    /// Three elements: x of the projected corners of the entered face.
    pub(crate) const X: usize = 5;
    /// Three elements: y of these corners.
    pub(crate) const Y: usize = 8;
    /// Three elements: the depths of these corners, increasing along the ray.
    pub(crate) const DEPTH: usize = 11;
    /// B of the error bound.
    pub(crate) const REACH: usize = 14;
    /// T of the error bound.
    pub(crate) const SIZE: usize = 15;
    /// Upper bound of the depth of tmax.
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

/// B and T of the error bound.
#[derive(Clone, Copy)]
pub(super) struct Extent<S: Simd> {
    pub(super) reach: S::F,
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
    /// E for the cross product of a point with the given S and any of the points of the extent.
    #[inline(always)]
    pub(super) fn bound(&self, s: S, size: S::F) -> S::F {
        let factor = s.mul(s.mul(self.reach, s.splat(TO_INFINITY)), s.splat(6.0 * U / TO_INFINITY));
        s.mul(factor, s.add(size, s.fma(s.splat(8.0 * U), self.reach, self.size)))
    }
}

/// Twice the signed area of the triangle (line, a, b) in the plane of projection, with an error below E.
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

    /// Vertices relative to the rays' origins, along the axes of the lanes. `vertices` are rows of x, y, z and an unused word.
    #[inline(always)]
    pub(super) fn gather(&self, s: S, m: S::M, vertices: &[[f32; 4]], vertex: S::U) -> [S::F; 3] {
        let [x, y, z, _] = s.rows4(m, vertices, vertex);
        let along = self.permute(s, [x, y, z]);
        three!(|k| s.sub(along[k], self.floats[float::ORIGIN + k]))
    }

    /// Permutes coordinates to the axes of the lanes: the two axes of the plane, which follow the axis of the depth cyclically and are
    /// swapped for rays with a negative direction along it, then the axis of the depth.
    #[inline(always)]
    pub(super) fn permute(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let axis = self.words[word::AXIS];
        let (is_x, is_y) = (s.eq_u(axis, s.splat_u(0)), s.eq_u(axis, s.splat_u(1)));
        let down = s.lt_u(s.splat_u(0), self.words[word::SIGN]);
        let next = s.select(is_x, y, s.select(is_y, z, x));
        let last = s.select(is_x, z, s.select(is_y, x, y));
        let depth = s.select(is_x, x, s.select(is_y, y, z));
        [s.select(down, last, next), s.select(down, next, last), depth]
    }

    /// Projects points that are relative to the origins, along the axes of the lanes.
    #[inline(always)]
    pub(super) fn project(&self, s: S, [x, y, z]: [S::F; 3]) -> ProjectedLanes<S> {
        let depth = s.floats(s.xor_u(s.bits(z), self.words[word::SIGN]));
        let x = s.fnma(self.floats[float::SHEAR], depth, x);
        let y = s.fnma(self.floats[float::SHEAR + 1], depth, y);
        ProjectedLanes { x, y, depth }
    }
}

/// Intermediate results of a step. A step has three parts, so that the gathers of several groups of lanes can overlap.
#[derive(Clone, Copy)]
pub(super) struct Step<S: Simd> {
    apex: S::U,
    position: [S::F; 3],
    /// The lanes whose signs are certain.
    certain: S::M,
    /// The vertex opposite to the face of exit.
    left: S::U,
    /// The vertices of the entered face.
    face: [S::U; 3],
}

impl<S: Simd> Step<S> {
    #[inline(always)]
    pub(super) fn none(s: S) -> Self {
        let (u, f) = (s.splat_u(0), s.splat(0.0));
        Step { apex: u, position: [f; 3], certain: s.mask(0), left: u, face: [u; 3] }
    }
}

impl<S: Simd> Lanes<S> {
    /// How the walks entered their tetrahedra; `one` is [`EnteredLanes::one`].
    #[inline(always)]
    fn entered(&self, one: S::U) -> EnteredLanes<S> {
        let w = &self.words;
        EnteredLanes {
            tet: w[word::TET],
            face: three!(|i| w[word::FACE + i]),
            apex: w[word::APEX],
            behind: w[word::BEHIND],
            one,
        }
    }

    /// First part of a step: fetches the fourth vertex of each active lane's tetrahedron.
    #[inline(always)]
    pub(super) fn fetch(
        &self,
        s: S,
        one: S::U,
        step: &mut Step<S>,
        records: &LaneRecords<'_>,
        vertices: &[[f32; 4]],
    ) {
        let active = self.active(s);
        step.apex = records.apex(s, active, &self.entered(one));
        step.position = self.gather(s, active, vertices, step.apex);
    }

    /// Second part of a step: finds the face through which the line leaves, and makes it the entered face. With `DEPTHS` the depths of
    /// its corners are kept.
    #[inline(always)]
    pub(super) fn choose<const DEPTHS: bool>(&mut self, s: S, step: &mut Step<S>) {
        let apex = self.project(s, step.position);
        let extent = Extent { reach: self.floats[float::REACH], size: self.floats[float::SIZE] };
        let (extent, size) = extent.with(s, &apex);
        let bound = extent.bound(s, size);
        let minus = s.sub(s.splat(0.0), bound);
        let side = three!(|i| cross(s, &apex, &self.corner(i)));
        let positive = three!(|i| s.lt(bound, side[i]));
        let negative = three!(|i| s.lt(side[i], minus));
        let active = self.active(s);
        let out = [
            s.and(active, s.and(positive[1], negative[2])),
            s.and(active, s.and(positive[2], negative[0])),
            s.and(active, s.and(positive[0], negative[1])),
        ];
        step.certain = s.or(out[0], s.or(out[1], out[2]));
        step.face = three!(|i| self.words[word::FACE + i]);
        step.left = s.select_u(out[2], step.face[2], s.select_u(out[1], step.face[1], step.face[0]));
        self.floats[float::REACH] = extent.reach;
        self.floats[float::SIZE] = extent.size;
        for (i, &out) in out.iter().enumerate() {
            let word = &mut self.words[word::FACE + i];
            *word = s.select_u(out, step.apex, *word);
            let corner = self.corner(i);
            self.floats[float::X + i] = s.select(out, apex.x, corner.x);
            self.floats[float::Y + i] = s.select(out, apex.y, corner.y);
            if DEPTHS {
                self.floats[float::DEPTH + i] = s.select(out, apex.depth, corner.depth);
            }
        }
    }

    /// Third part of a step: moves to the tetrahedron behind that face. A walk stops with a link that has [`FACE_BIT`] in `TET` where it
    /// reaches a constrained face, leaves the hull or, with `DEPTHS`, passes its limit. A walk with an uncertain sign stops with
    /// [`DOUBT`] in `TET` and is otherwise unchanged.
    #[inline(always)]
    pub(super) fn follow<const DEPTHS: bool>(
        &mut self,
        s: S,
        one: S::U,
        step: &Step<S>,
        records: &LaneRecords<'_>,
    ) {
        let (tet, behind) = (self.words[word::TET], self.words[word::BEHIND]);
        let at = EnteredLanes { tet, face: step.face, apex: step.apex, behind, one };
        let (mut next, opposite) = records.link(s, step.certain, &at, step.left);
        if DEPTHS {
            let f = &self.floats;
            let nearest = s.min(s.min(f[float::DEPTH], f[float::DEPTH + 1]), f[float::DEPTH + 2]);
            next = s.select_u(s.lt(f[float::LIMIT], nearest), s.splat_u(NONE), next);
        }
        if records.needs_behind() {
            self.words[word::BEHIND] = s.select_u(step.certain, tet, behind);
        }
        let next = s.select_u(step.certain, next, s.or_u(tet, s.splat_u(DOUBT)));
        self.words[word::TET] = s.select_u(self.active(s), next, tet);
        self.words[word::APEX] = s.select_u(step.certain, opposite, self.words[word::APEX]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::line::Line;
    use crate::rays::Ray;
    use crate::simd::{Isa, Kernel, LANES};
    use crate::tets::queue::Ready;
    use bth_random::Rng;

    /// For each of sixteen rays the cross products of its three points in cyclic order, their bound, and the bits of usable rays.
    struct Crosses<'a>(&'a [Ray], &'a [[f32; 4]]);

    impl Kernel for Crosses<'_> {
        type Output = ([[f32; LANES]; 3], [f32; LANES], u32);
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let lane = s.load_u(&std::array::from_fn(|i| i as u32));
            let first = s.add_u(lane, s.shl_u::<1>(lane));
            let vertex = three!(|k| s.add_u(first, s.splat_u(k)));
            let ready = Ready::new(s, s.mask(0xffff), self.0, self.1, lane, vertex);
            let lanes = &ready.lanes;
            let extent = Extent { reach: lanes.floats[float::REACH], size: lanes.floats[float::SIZE] };
            let (mut out, mut bound) = ([[0.0; LANES]; 3], [0.0; LANES]);
            s.store(cross(s, &lanes.corner(0), &lanes.corner(1)), &mut out[0]);
            s.store(cross(s, &lanes.corner(1), &lanes.corner(2)), &mut out[1]);
            s.store(cross(s, &lanes.corner(2), &lanes.corner(0)), &mut out[2]);
            s.store(extent.bound(s, extent.size), &mut bound);
            (out, bound, s.mask_bits(ready.able))
        }
    }

    #[test]
    fn cross_products_are_off_by_less_than_their_bound_at_any_scale() {
        let mut rng = Rng::new(51);
        let (mut certain, mut tried) = (0, 0);
        for round in 0..4_000 {
            let scale = 2f32.powi(rng.below(180) as i32 - 95);
            let unit = |rng: &mut Rng| (rng.below(1 << 24) as f32 / (1 << 23) as f32) - 1.0;
            let near = [1.0, 1e-3, 1e-6][round % 3];
            let rays: [Ray; LANES] = std::array::from_fn(|_| Ray {
                origin: [(); 3].map(|()| unit(&mut rng) * scale),
                tmin: 0.0,
                direction: [(); 3].map(|()| unit(&mut rng)),
                tmax: f32::INFINITY,
            });
            // Triangles near points of the rays' lines.
            let vertices: Vec<[f32; 4]> = (0..3 * LANES)
                .map(|i| {
                    let (ray, t) = (&rays[i / 3], unit(&mut rng) * scale);
                    let p = [0, 1, 2]
                        .map(|k| ray.origin[k] + ray.direction[k] * t + unit(&mut rng) * near * scale);
                    [p[0], p[1], p[2], 0.0]
                })
                .collect();
            for isa in Isa::ALL {
                let (crosses, bound, able) = isa.run(Crosses(&rays, &vertices));
                for lane in (0..LANES).filter(|i| able >> i & 1 != 0) {
                    let line = Line::new(&rays[lane]).expect("a direction");
                    let p = [0, 1, 2].map(|k| {
                        let [x, y, z, _] = vertices[3 * lane + k];
                        line.project([x, y, z])
                    });
                    for k in 0..3 {
                        let (a, b) = (p[k], p[(k + 1) % 3]);
                        let exactly = a.x * b.y - a.y * b.x;
                        let error = (f64::from(crosses[k][lane]) - exactly).abs();
                        let bound = f64::from(bound[lane]);
                        assert!(
                            bound == f64::INFINITY || error <= bound,
                            "{isa}: {error:e} exceeds {bound:e}: {:?}",
                            rays[lane]
                        );
                        certain += u32::from(f64::from(crosses[k][lane]).abs() > bound);
                        tried += 1;
                    }
                }
            }
        }
        assert!(certain * 2 > tried, "{certain} of {tried} signs are certain");
    }
}
