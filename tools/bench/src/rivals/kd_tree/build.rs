//! Builds the tree: at each node the plane of least expected cost, by a sweep over the sorted bounds.

use super::{KdNode, KdTree};

/// Cost of a triangle test in units of that of a step (pbrt, 4th edition, §7.3 of the 3rd edition's text).
const TEST_COST: f32 = 5.0;
/// Cost of a step.
const STEP_COST: f32 = 1.0;
/// By how much a plane is favoured that cuts off empty space (Wald and Havran 2006, equation 8).
const EMPTY_BONUS: f32 = 0.5;
/// How often a node on a path may be split although that costs more than a leaf.
const BAD_SPLITS: u32 = 3;

#[derive(Clone, Copy)]
struct Cell {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl Cell {
    fn of<'a>(points: impl Iterator<Item = &'a [f32; 3]>) -> Cell {
        let empty = Cell { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };
        points.fold(empty, |b, p| Cell {
            lower: std::array::from_fn(|k| b.lower[k].min(p[k])),
            upper: std::array::from_fn(|k| b.upper[k].max(p[k])),
        })
    }

    /// Half the surface area.
    fn area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|k| self.upper[k] - self.lower[k]);
        x * y + y * z + z * x
    }

    fn below(mut self, axis: usize, split: f32) -> Cell {
        self.upper[axis] = split;
        self
    }

    fn above(mut self, axis: usize, split: f32) -> Cell {
        self.lower[axis] = split;
        self
    }
}

/// Where a triangle's bounds begin or end along an axis.
#[derive(Clone, Copy)]
struct Event {
    at: f32,
    ends: bool,
    triangle: u32,
}

struct KdPlane {
    cost: f32,
    axis: usize,
    /// Row of the event in the sorted list of its axis.
    event: usize,
}

struct KdBuilder {
    bounds: Vec<Cell>,
    nodes: Vec<KdNode>,
    lists: Vec<u32>,
}

impl KdTree {
    /// Builds the tree of these triangles.
    pub(super) fn build(corners: Vec<[[f32; 3]; 3]>) -> KdTree {
        let bounds: Vec<Cell> = corners.iter().map(|c| Cell::of(c.iter())).collect();
        let all = Cell::of(corners.iter().flatten());
        let depth = (8.0 + 1.3 * (corners.len().max(1) as f32).log2()).round() as u32;
        let mut builder = KdBuilder { bounds, nodes: Vec::new(), lists: Vec::new() };
        builder.node((0..corners.len() as u32).collect(), all, depth, 0);
        let KdBuilder { nodes, lists, .. } = builder;
        KdTree { nodes, lists, corners, lower: all.lower, upper: all.upper }
    }
}

impl KdBuilder {
    fn node(&mut self, triangles: Vec<u32>, bounds: Cell, depth: u32, bad: u32) {
        let leaf_cost = TEST_COST * triangles.len() as f32;
        let events = [0, 1, 2].map(|axis| self.events(&triangles, axis));
        let best = if triangles.len() <= 1 || depth == 0 { None } else { best_plane(&events, &bounds) };
        let Some(plane) = best else { return self.leaf(&triangles) };
        let bad = bad + u32::from(plane.cost > leaf_cost);
        let hopeless = plane.cost > 4.0 * leaf_cost && triangles.len() < 16;
        if hopeless || bad == BAD_SPLITS {
            return self.leaf(&triangles);
        }

        // A triangle that lies in the plane goes to the one side on which its event was counted.
        let (axis, events) = (plane.axis, &events[plane.axis]);
        let split = events[plane.event].at;
        let below = events[..plane.event].iter().filter(|e| !e.ends).map(|e| e.triangle).collect();
        let above = events[plane.event + 1..].iter().filter(|e| e.ends).map(|e| e.triangle).collect();
        drop(triangles);
        let at = self.nodes.len();
        self.nodes.push(KdNode::Inner { axis: axis as u8, split, upper: 0 });
        self.node(below, bounds.below(axis, split), depth - 1, bad);
        let next = self.nodes.len() as u32;
        if let KdNode::Inner { upper, .. } = &mut self.nodes[at] {
            *upper = next;
        }
        self.node(above, bounds.above(axis, split), depth - 1, bad);
    }

    fn leaf(&mut self, triangles: &[u32]) {
        self.nodes.push(KdNode::Leaf { first: self.lists.len() as u32, count: triangles.len() as u32 });
        self.lists.extend_from_slice(triangles);
    }

    /// Sorted; at the same place beginnings come first.
    fn events(&self, triangles: &[u32], axis: usize) -> Vec<Event> {
        let ends = |t: &u32| {
            let bounds = &self.bounds[*t as usize];
            [
                Event { at: bounds.lower[axis], ends: false, triangle: *t },
                Event { at: bounds.upper[axis], ends: true, triangle: *t },
            ]
        };
        let mut events: Vec<Event> = triangles.iter().flat_map(ends).collect();
        events.sort_unstable_by(|a, b| {
            a.at.total_cmp(&b.at).then(a.ends.cmp(&b.ends)).then(a.triangle.cmp(&b.triangle))
        });
        events
    }
}

/// The plane of least cost inside the bounds, if there is any.
fn best_plane(events: &[Vec<Event>; 3], bounds: &Cell) -> Option<KdPlane> {
    let whole = bounds.area();
    let mut best: Option<KdPlane> = None;
    for (axis, events) in events.iter().enumerate() {
        let (mut below, mut above) = (0usize, events.len() / 2);
        for (i, event) in events.iter().enumerate() {
            above -= usize::from(event.ends);
            if event.at > bounds.lower[axis] && event.at < bounds.upper[axis] {
                let share = |b: Cell| b.area() / whole;
                let empty = if below == 0 || above == 0 { EMPTY_BONUS } else { 0.0 };
                let tests = share(bounds.below(axis, event.at)) * below as f32
                    + share(bounds.above(axis, event.at)) * above as f32;
                let cost = STEP_COST + TEST_COST * (1.0 - empty) * tests;
                if best.as_ref().is_none_or(|b| cost < b.cost) {
                    best = Some(KdPlane { cost, axis, event: i });
                }
            }
            below += usize::from(!event.ends);
        }
    }
    best
}
