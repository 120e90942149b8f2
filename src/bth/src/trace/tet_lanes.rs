//! Sixteen tet walks side by side: the step from one tetrahedron to the next, in f32.
//!
//! As [`super::tet_walk`], but a sign counts only where f32 makes it certain. With u = 2^-24, the computed projection
//! (x, y, z) of a point, z its depth, and W = |x| + |y| + |z|: the differences from the origin are off by a factor of
//! 1 + u, the shear, at most 1, too, and with the roundings of the product and the last difference x and y are off by
//! u (2|x| + 4|z|), less than δ = 4.1 u W. For two points a and b with S = |x| + |y| the cross product is then off
//! by δa Sb + δb Sa + 2 δa δb, and by 2 u Sa Sb for its own roundings; where B is at least the W of both, that is
//! less than 5.1 u B (Sa + Sb) + 34 u² B². What is computed is a bound of E = 6 u B (Sa + Sb + 8 u B).
//!
//! B is the greatest W that the lane has met, and at least 2^-38: so E exceeds 2^-119 and with it whatever
//! underflow does. From 2^61 on, where products might overflow, B makes E infinite and nothing is certain.
//!
//! The two signs that name the exit of the line are all that a step needs: the face left behind was crossed with certain
//! signs, so those of the face ahead are certain too.

use super::records::{EnteredLanes, LaneRecord};
use crate::layout::{FACE_BIT, NONE};
use crate::simd::Simd;

/// 2^-24.
const U: f32 = 1.0 / (1 << 24) as f32;
/// Least B; see above.
const LEAST_REACH: f32 = 1.0 / (1u64 << 38) as f32;
/// Turns a B of 2^61 into infinity.
const TO_INFINITY: f32 = (1u128 << 67) as f32;

/// An array of three, without the closure that keeps `array::map` from being compiled for the instruction set.
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

/// Names of the u32 of a lane.
pub(super) mod word {
    /// The tetrahedron; once the lane has stopped, what lies behind the face that stopped it, as in a link.
    pub(crate) const TET: usize = 0;
    /// The vertex that the link hither named.
    pub(crate) const APEX: usize = 1;
    /// What lies behind the face entered, as the record of the tetrahedron stores it.
    pub(crate) const BEHIND: usize = 2;
    /// The first of three vertices of the face entered.
    pub(crate) const FACE: usize = 3;
    /// The first of three axes: two of the plane of projection, and the depth.
    pub(crate) const AXIS: usize = 6;
    /// Sign bit of the direction along the depth.
    pub(crate) const SIGN: usize = 9;
    /// Which of the batch's rays it is.
    pub(crate) const SLOT: usize = 10;
    pub(crate) const COUNT: usize = 11;
}

/// Names of the f32 of a lane. What has three elements is named by the first.
pub(super) mod float {
    /// The ray's origin along the three axes.
    pub(crate) const ORIGIN: usize = 0;
    /// Two: the direction over the absolute of its depth.
    pub(crate) const SHEAR: usize = 3;
    /// The projected face: x, y, depth in the ray's direction, |x| + |y|.
    pub(crate) const X: usize = 5;
    pub(crate) const Y: usize = 8;
    pub(crate) const DEPTH: usize = 11;
    pub(crate) const SIZE: usize = 14;
    /// B.
    pub(crate) const REACH: usize = 17;
    /// Depth beyond which nothing is of interest.
    pub(crate) const LIMIT: usize = 18;
    pub(crate) const COUNT: usize = 19;
}

/// The state of sixteen walks.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    pub(super) words: [S::U; word::COUNT],
    pub(super) floats: [S::F; float::COUNT],
    /// Walks under way.
    pub(super) active: S::M,
}

/// Points as seen along the rays of the lanes.
#[derive(Clone, Copy)]
pub(super) struct ProjectedLanes<S: Simd> {
    pub(super) x: S::F,
    pub(super) y: S::F,
    pub(super) depth: S::F,
    /// |x| + |y|.
    pub(super) size: S::F,
}

/// Products and sums that E is made of.
#[derive(Clone, Copy)]
pub(super) struct Doubt<S: Simd> {
    factor: S::F,
    addend: S::F,
}

impl<S: Simd> Doubt<S> {
    /// For cross products of a point with others, given B.
    #[inline(always)]
    pub(super) fn new(s: S, of: &ProjectedLanes<S>, reach: S::F) -> Self {
        let factor = s.mul(s.mul(reach, s.splat(TO_INFINITY)), s.splat(6.0 * U / TO_INFINITY));
        let addend = s.mul(factor, s.fma(s.splat(8.0 * U), reach, of.size));
        Doubt { factor, addend }
    }
    /// E with a point of this size.
    #[inline(always)]
    pub(super) fn bound(&self, s: S, size: S::F) -> S::F {
        s.fma(self.factor, size, self.addend)
    }
}

/// Where the cross product of two points is certainly positive, and where certainly negative; and what it is.
#[inline(always)]
pub(super) fn side<S: Simd>(
    s: S,
    a: &ProjectedLanes<S>,
    b: &ProjectedLanes<S>,
    bound: S::F,
) -> (S::M, S::M, S::F) {
    let value = s.fnma(a.y, b.x, s.mul(a.x, b.y));
    (s.lt(bound, value), s.lt(value, s.sub(s.splat(0.0), bound)), value)
}

impl<S: Simd> Lanes<S> {
    /// No walk at all.
    #[inline(always)]
    pub(super) fn idle(s: S) -> Self {
        Lanes { words: [s.splat_u(0); word::COUNT], floats: [s.splat(0.0); float::COUNT], active: s.mask(0) }
    }

    #[inline(always)]
    pub(super) fn corner(&self, i: usize) -> ProjectedLanes<S> {
        let f = &self.floats;
        ProjectedLanes {
            x: f[float::X + i],
            y: f[float::Y + i],
            depth: f[float::DEPTH + i],
            size: f[float::SIZE + i],
        }
    }

    #[inline(always)]
    pub(super) fn set_corner(&mut self, i: usize, p: &ProjectedLanes<S>) {
        self.floats[float::X + i] = p.x;
        self.floats[float::Y + i] = p.y;
        self.floats[float::DEPTH + i] = p.depth;
        self.floats[float::SIZE + i] = p.size;
    }

    /// Projects vertices, given as rows of x, y, z and one more.
    #[inline(always)]
    pub(super) fn project(&self, s: S, m: S::M, vertices: &[f32], vertex: S::U) -> ProjectedLanes<S> {
        let row = s.shl_u::<2>(vertex);
        let [x, y, z] = three!(|k| {
            let at = s.gather(m, vertices, s.add_u(row, self.words[word::AXIS + k]));
            s.sub(at, self.floats[float::ORIGIN + k])
        });
        let depth = s.from_bits(s.xor_u(s.bits(z), self.words[word::SIGN]));
        let x = s.fnma(self.floats[float::SHEAR], depth, x);
        let y = s.fnma(self.floats[float::SHEAR + 1], depth, y);
        ProjectedLanes { x, y, depth, size: s.add(s.abs(x), s.abs(y)) }
    }

    /// B once it has met a point.
    #[inline(always)]
    pub(super) fn reach(s: S, reach: S::F, p: &ProjectedLanes<S>) -> S::F {
        s.max(s.add(p.size, s.abs(p.depth)), reach)
    }

    #[inline(always)]
    pub(super) fn least_reach(s: S) -> S::F {
        s.splat(LEAST_REACH)
    }

    /// Takes every active walk one tetrahedron on. Those that come to a constrained face, leave the hull or pass their
    /// limit stop with a link of [`FACE_BIT`] in `TET`, those in doubt with the tetrahedron where they are, all
    /// else as it was.
    #[inline(always)]
    pub(super) fn step<R: LaneRecord>(&mut self, s: S, words: &[R::Word], vertices: &[f32]) {
        let w = &self.words;
        let mut at = EnteredLanes::<S> {
            tet: w[word::TET],
            face: [w[word::FACE], w[word::FACE + 1], w[word::FACE + 2]],
            apex: w[word::APEX],
            behind: w[word::BEHIND],
        };
        at.apex = R::apex_lanes(s, words, self.active, &at);
        let apex = self.project(s, self.active, vertices, at.apex);
        let reach = Self::reach(s, self.floats[float::REACH], &apex);
        let doubt = Doubt::new(s, &apex, reach);
        let [(pos0, neg0, _), (pos1, neg1, _), (pos2, neg2, _)] = three!(|i| {
            let corner = self.corner(i);
            side(s, &apex, &corner, doubt.bound(s, corner.size))
        });
        let out = [
            s.and(self.active, s.and(pos1, neg2)),
            s.and(self.active, s.and(pos2, neg0)),
            s.and(self.active, s.and(pos0, neg1)),
        ];
        let go = s.or(out[0], s.or(out[1], out[2]));
        let left = s.select_u(out[2], at.face[2], s.select_u(out[1], at.face[1], at.face[0]));
        let (next, opposite) = R::link_lanes(s, words, go, &at, left);
        for (i, &out) in out.iter().enumerate() {
            let word = &mut self.words[word::FACE + i];
            *word = s.select_u(out, at.apex, *word);
            let pairs = [
                (float::X, apex.x),
                (float::Y, apex.y),
                (float::DEPTH, apex.depth),
                (float::SIZE, apex.size),
            ];
            for (name, value) in pairs {
                let float = &mut self.floats[name + i];
                *float = s.select(out, value, *float);
            }
        }
        let f = &self.floats;
        let nearest = s.min(s.min(f[float::DEPTH], f[float::DEPTH + 1]), f[float::DEPTH + 2]);
        let past = s.and(go, s.lt(f[float::LIMIT], nearest));
        let next = s.select_u(past, s.splat_u(NONE), next);
        self.floats[float::REACH] = reach;
        self.words[word::BEHIND] = s.select_u(go, at.tet, at.behind);
        self.words[word::TET] = s.select_u(go, next, at.tet);
        self.words[word::APEX] = s.select_u(go, opposite, self.words[word::APEX]);
        self.active = s.and(go, s.lt_u(next, s.splat_u(FACE_BIT)));
    }
}
