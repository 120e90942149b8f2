//! Rays with a time of their own, as a plain function: boxes and corners are interpolated between two refits for each ray. What that
//! would cost beside trees that are refitted for each time is measured with it; it is no part of the runtime.
//!
//! The tree is the same at both times, so that box i of a node at a time lies within the interpolation of its boxes at both: the
//! interpolation of lower (upper) ends is at most (at least) the interpolated coordinate of each vertex.

// Rows of coordinates are loops over lanes by index.
#![allow(clippy::needless_range_loop)]

use bth::Scene;
use bth::rays::Ray;
use bth_format::layout::{
    CacheLine, Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, NONE, RAW_LINES, RawLeaf, WIDTH, WideNode,
};
use zerocopy::{FromBytes, IntoBytes};

/// The nodes and leaves of an object at one or two times.
pub(super) struct Tree {
    root: u32,
    lines: Vec<CacheLine>,
    /// The same nodes and leaves at the second time, if rays have times of their own.
    later: Option<Vec<CacheLine>>,
}

/// What rays visited.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Visits {
    pub(super) nodes: u64,
    pub(super) triangles: u64,
}

/// Ends or corners of sixteen boxes or triangles: rows of one coordinate.
type Row = [f32; WIDTH];

impl Tree {
    /// The tree of an object of a scene as it is now.
    pub(super) fn of(scene: &Scene, object: u32) -> Tree {
        let view = scene.object(object);
        Tree { root: view.header.root, lines: view.lines.to_vec(), later: None }
    }

    /// The tree between two times.
    pub(super) fn between(open: Tree, close: Tree) -> Tree {
        Tree { later: Some(close.lines), ..open }
    }

    /// The least distance at which a ray hits a triangle, in f32; infinity for none. `share` is the ray's time.
    pub(super) fn nearest(&self, ray: &Ray, share: f32, visits: &mut Visits) -> f32 {
        let inverse = ray.direction.map(|x| 1.0 / x);
        let mut limit = ray.tmax;
        let mut hit = f32::INFINITY;
        let mut stack = vec![(ray.tmin, self.root)];
        while let Some((near, code)) = stack.pop() {
            if near > limit {
                continue;
            }
            match Child::from_code(code) {
                Some(Child::Indexed(_) | Child::Raw(_)) => {
                    let found = self.leaf(code, ray, share, visits);
                    if found < limit {
                        (limit, hit) = (found, found);
                    }
                }
                _ => {
                    visits.nodes += 1;
                    self.children(code, ray, inverse, (share, limit), &mut stack);
                }
            }
        }
        hit
    }

    /// Puts the children that a ray meets before its limit on the stack, the nearest last.
    fn children(
        &self,
        at: u32,
        ray: &Ray,
        inverse: [f32; 3],
        (share, limit): (f32, f32),
        stack: &mut Vec<(f32, u32)>,
    ) {
        let node: &WideNode = block(&self.lines, at, NODE_LINES);
        let later = self.later.as_ref().map(|lines| block::<WideNode>(lines, at, NODE_LINES));
        let (mut near, mut far) = ([ray.tmin; WIDTH], [limit; WIDTH]);
        for k in 0..3 {
            let [mut lower, mut upper] = node.bounds[k];
            if let Some(later) = later {
                lower = towards(&lower, &later.bounds[k][0], share);
                upper = towards(&upper, &later.bounds[k][1], share);
            }
            for i in 0..WIDTH {
                let (a, b) =
                    ((lower[i] - ray.origin[k]) * inverse[k], (upper[i] - ray.origin[k]) * inverse[k]);
                near[i] = near[i].max(a.min(b));
                far[i] = far[i].min(a.max(b));
            }
        }
        let first = stack.len();
        for i in 0..WIDTH {
            if node.child[i] == NONE {
                break;
            }
            // A few roundings of slabs and interpolation.
            if near[i] <= far[i] * 1.000_001 + f32::MIN_POSITIVE {
                stack.push((near[i], node.child[i]));
            }
        }
        stack[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// The least distance to a triangle of a leaf (Möller and Trumbore 1997).
    fn leaf(&self, code: u32, ray: &Ray, share: f32, visits: &mut Visits) -> f32 {
        let (corners, count) = corners(&self.lines, code);
        let corners = match &self.later {
            None => corners,
            Some(lines) => {
                let (to, _) = self::corners(lines, code);
                [0, 1, 2].map(|c| [0, 1, 2].map(|k| towards(&corners[c][k], &to[c][k], share)))
            }
        };
        visits.triangles += count as u64;
        let mut best = f32::INFINITY;
        for i in 0..count {
            let [a, b, c] = [0, 1, 2].map(|c| glam::Vec3::from_array([0, 1, 2].map(|k| corners[c][k][i])));
            let (origin, direction) = (glam::Vec3::from(ray.origin), glam::Vec3::from(ray.direction));
            let (e, f) = (b - a, c - a);
            let p = direction.cross(f);
            let determinant = e.dot(p);
            let s = (origin - a) / determinant;
            let (u, q) = (s.dot(p), s.cross(e));
            let (v, t) = (direction.dot(q), f.dot(q));
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.tmin && t < best {
                best = t;
            }
        }
        best
    }
}

/// A row at a share of the way to another.
fn towards(a: &Row, b: &Row, share: f32) -> Row {
    std::array::from_fn(|i| (1.0 - share) * a[i] + share * b[i])
}

fn block<T: FromBytes + zerocopy::KnownLayout + zerocopy::Immutable>(
    lines: &[CacheLine],
    at: u32,
    count: usize,
) -> &T {
    T::ref_from_bytes(lines[at as usize..][..count].as_bytes()).expect("a block of whole lines")
}

/// The corners of a leaf's triangles, `[corner][axis][triangle]`, and their number.
fn corners(lines: &[CacheLine], code: u32) -> ([[Row; 3]; 3], usize) {
    let at = code & (Child::INDEX_LIMIT - 1);
    if let Some(Child::Indexed(_)) = Child::from_code(code) {
        let leaf: &IndexedLeaf = block(lines, at, INDEXED_LINES);
        let rows =
            leaf.corner.map(|vertices| leaf.vertex.map(|row| vertices.map(|v| row[usize::from(v) % WIDTH])));
        return (rows, leaf.triangles as usize);
    }
    let leaf: &RawLeaf = block(lines, at, RAW_LINES);
    (leaf.corner, leaf.triangles as usize)
}
