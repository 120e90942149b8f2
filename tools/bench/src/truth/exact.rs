//! Exact answers, by rational arithmetic on the numbers that everybody is given. A simple BVH over
//! padded f64 boxes finds the triangles near a line; `bth-oracle` decides about each of them.

use bth::SegmentEnd;
use bth::rays::{PrimitiveRef, Start, StartRay};
use bth_oracle::{LineHit, line_hit, nearest, starts, to_f64};
use bth_random::Rng;
use glam::DVec3;

/// The exact answer to a query.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ExactAnswer {
    /// The ray hits nothing.
    Miss,
    /// The ray hits first, at the same t, all of these triangles.
    Hit {
        /// t, rounded to f64.
        t: f64,
        /// Weights of the second and third corner of the first of the triangles.
        weights: [f64; 2],
        /// Ids, ascending.
        triangles: Vec<u32>,
    },
    /// The point is inside, or the points see each other.
    Flag(bool),
}

/// A surface whose triangles can be found along lines.
pub(super) struct Surface {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Ids in the order of the leaves.
    order: Vec<u32>,
    nodes: Vec<Node>,
    /// The largest coordinate.
    largest: f64,
}

/// A box with a range of `order`, and its children if there are any.
struct Node {
    lower: [f64; 3],
    upper: [f64; 3],
    range: std::ops::Range<usize>,
    children: Option<[usize; 2]>,
}

/// Most triangles of a leaf.
const LEAF: usize = 4;
/// Directions that are tried for a point, as a ray through an edge proves nothing.
const DIRECTIONS: usize = 20;

impl Surface {
    /// The surface of these triangles.
    pub(super) fn new(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Surface {
        let order = (0..triangles.len() as u32).collect();
        let largest = positions.as_flattened().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let mut surface = Surface { positions, triangles, order, nodes: Vec::new(), largest };
        surface.build(0..surface.order.len());
        surface
    }

    /// Builds the node of a range and those below it, halved at the median along the longest axis;
    /// returns its index.
    fn build(&mut self, range: std::ops::Range<usize>) -> usize {
        let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.order[range.clone()].iter().flat_map(|id| self.corners(*id)) {
            lower = [0, 1, 2].map(|k| lower[k].min(corner[k]));
            upper = [0, 1, 2].map(|k| upper[k].max(corner[k]));
        }
        let index = self.nodes.len();
        self.nodes.push(Node { lower, upper, range: range.clone(), children: None });
        if range.len() > LEAF {
            let width = |k: &usize| upper[*k] - lower[*k];
            let axis = (0..3).max_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
            let half = range.len() / 2;
            let mut order = std::mem::take(&mut self.order);
            let middle = |id: &u32| self.corners(*id).iter().map(|p| p[axis]).sum::<f64>();
            order[range.clone()].select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            self.order = order;
            let split = range.start + half;
            let children = [self.build(range.start..split), self.build(split..range.end)];
            self.nodes[index].children = Some(children);
        }
        index
    }

    /// The triangles whose box the ray may cross at t ≥ 0. Boxes are padded by far more than all
    /// rounding errors.
    fn near(&self, origin: [f64; 3], direction: [f64; 3]) -> Vec<u32> {
        let reach = origin.iter().fold(self.largest, |most, x| most.max(x.abs()));
        let pad = 1e-12 * reach;
        let crosses = |node: &Node| {
            let (mut near, mut far) = (0.0f64, f64::INFINITY);
            for k in 0..3 {
                let (lower, upper) = (node.lower[k] - pad - origin[k], node.upper[k] + pad - origin[k]);
                if direction[k] == 0.0 {
                    if lower > 0.0 || upper < 0.0 {
                        return false;
                    }
                } else {
                    let (a, b) = (lower / direction[k], upper / direction[k]);
                    (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
                }
            }
            near * (1.0 - 1e-12) <= far * (1.0 + 1e-12)
        };
        let (mut found, mut stack) = (Vec::new(), vec![0]);
        while let Some(node) = stack.pop().map(|index: usize| &self.nodes[index]) {
            match node.children {
                _ if !crosses(node) => {}
                Some(children) => stack.extend(children),
                None => found.extend(&self.order[node.range.clone()]),
            }
        }
        found.sort_unstable();
        found
    }

    /// The nearest hit of a ray; `None` where the definition of a hit would decide: the ray starts
    /// on a triangle, or runs in the plane of one near it.
    pub(super) fn nearest(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<ExactAnswer> {
        let mut best: Option<(_, ExactAnswer)> = None;
        for id in self.near(origin, direction) {
            let at = match line_hit(origin, direction, self.corners(id)) {
                LineHit::Missed => continue,
                LineHit::InPlane => return None,
                LineHit::At(at) => at,
            };
            let t = to_f64(&at.t);
            if t == 0.0 {
                return None;
            } else if t < 0.0 {
                continue;
            }
            match &mut best {
                Some((nearest, _)) if at.t > *nearest => {}
                Some((nearest, ExactAnswer::Hit { triangles, .. })) if at.t == *nearest => triangles.push(id),
                _ => {
                    let hit =
                        ExactAnswer::Hit { t, weights: [&at.u, &at.v].map(to_f64), triangles: vec![id] };
                    best = Some((at.t, hit));
                }
            }
        }
        Some(best.map_or(ExactAnswer::Miss, |(_, hit)| hit))
    }

    /// Is a point inside of the surface, which must be closed? By the parity of a ray that touches
    /// no edge; `None` for a point of the surface.
    pub(super) fn inside(&self, point: [f64; 3]) -> Option<ExactAnswer> {
        let mut rng = Rng::new(17);
        'directions: for _ in 0..DIRECTIONS {
            let direction = [(); 3].map(|()| rng.unit_f64() - 0.5);
            let mut inside = false;
            for id in self.near(point, direction) {
                match line_hit(point, direction, self.corners(id)) {
                    LineHit::Missed => {}
                    LineHit::InPlane => continue 'directions,
                    LineHit::At(at) => {
                        let [t, u, v] = [&at.t, &at.u, &at.v].map(to_f64);
                        if t == 0.0 {
                            return None;
                        } else if u == 0.0 || v == 0.0 || u + v == 1.0 {
                            continue 'directions;
                        }
                        inside ^= t > 0.0;
                    }
                }
            }
            return Some(ExactAnswer::Flag(inside));
        }
        None
    }

    /// The nearest hit at t > 0 of a ray from the exact point of a triangle. The coordinates must
    /// be f32.
    pub(super) fn nearest_from_start(&self, start: &Start, direction: [f64; 3]) -> ExactAnswer {
        let own = start.primitive.triangle;
        let ids = self.with_near([own], self.point(start), direction);
        let primitive = PrimitiveRef { instance: 0, triangle: 0 };
        let ray = StartRay { start: Start { primitive, ..*start }, ..start.ray(direction.map(|x| x as f32)) };
        nearest(&self.narrow(&ids), ray).map_or(ExactAnswer::Miss, |hit| {
            let mut triangles: Vec<u32> = hit.triangles.iter().map(|row| ids[*row as usize]).collect();
            triangles.sort_unstable();
            triangles.dedup();
            ExactAnswer::Hit { t: hit.t_f64(), weights: [&hit.at.u, &hit.at.v].map(to_f64), triangles }
        })
    }

    /// Do the exact points of two triangles see each other? The coordinates must be f32.
    pub(super) fn visible(&self, a: &Start, b: &Start) -> ExactAnswer {
        let (from, to) = (self.point(a), self.point(b));
        let own = [a, b].map(|start| start.primitive.triangle);
        let corners = self.narrow(&self.with_near(own, from, [0, 1, 2].map(|k| to[k] - from[k])));
        let [a, b] = [(a, 0), (b, 1)].map(|(start, triangle)| {
            SegmentEnd::Start(Start { primitive: PrimitiveRef { instance: 0, triangle }, ..*start })
        });
        ExactAnswer::Flag(starts::visible(&corners, a, b))
    }

    /// Some triangles, and those near a ray.
    fn with_near<const N: usize>(&self, own: [u32; N], from: [f64; 3], direction: [f64; 3]) -> Vec<u32> {
        own.into_iter().chain(self.near(from, direction)).collect()
    }

    fn narrow(&self, ids: &[u32]) -> Vec<[[f32; 3]; 3]> {
        ids.iter().map(|id| self.corners(*id).map(|p| p.map(|x| x as f32))).collect()
    }

    /// The point of a start, rounded to f64.
    pub(super) fn point(&self, start: &Start) -> [f64; 3] {
        let [a, b, c] = self.corners(start.primitive.triangle);
        let (u, v) = (f64::from(start.u), f64::from(start.v));
        let (u, v) = if u + v > 1.0 { (u / (u + v), v / (u + v)) } else { (u, v) };
        [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, id: u32) -> [[f64; 3]; 3] {
        self.triangles[id as usize].map(|v| self.positions[v as usize])
    }

    /// The unit normal of a triangle.
    pub(super) fn normal(&self, id: u32) -> DVec3 {
        let [a, b, c] = self.corners(id).map(DVec3::from_array);
        (b - a).cross(c - a).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_scenes::catalogue;

    /// The BVH skips nothing.
    #[test]
    fn the_answers_are_those_of_all_triangles() {
        let model = (catalogue::find("gyroid").unwrap().make)(2000);
        let positions = model.positions.iter().map(|p| p.map(f64::from)).collect();
        let surface = Surface::new(positions, model.triangles.clone());
        let all: Vec<_> = (0..model.triangles.len()).map(|id| model.corners(id)).collect();
        let mut rng = Rng::new(1);
        let mut hits = 0;
        for _ in 0..200 {
            let mut point = || [(); 3].map(|()| rng.between(-1.2, 1.2) as f32);
            let (origin, direction) = (point(), point());
            let expected = bth_oracle::nearest(&all, bth::rays::Ray::new(origin, direction));
            let found = surface.nearest(origin.map(f64::from), direction.map(f64::from));
            match (found, expected) {
                (Some(ExactAnswer::Hit { t, triangles, .. }), Some(hit)) => {
                    hits += 1;
                    assert_eq!((t, triangles), (hit.t_f64(), hit.triangles));
                }
                (found, expected) => assert!(found == Some(ExactAnswer::Miss) && expected.is_none()),
            }
            let winding = bth_oracle::winding(&all, origin, direction);
            assert_eq!(surface.inside(origin.map(f64::from)), Some(ExactAnswer::Flag(winding != 0)));
        }
        assert!(hits > 50, "{hits}");
    }
}
