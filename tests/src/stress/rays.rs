//! Rays that are aimed exactly at vertices, at edges, and along faces.

use super::grid::{GridRay, LIMIT, Point};
use super::shapes::Shape;
use bth_random::Rng;

/// How a ray was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// At a vertex.
    Vertex,
    /// At the middle of an edge.
    Edge,
    /// Along an edge, from beyond its end.
    AlongEdge,
    /// In the plane of a face, at one of its corners.
    InPlane,
    /// Along an axis, with zeros of either sign.
    Axis,
    /// At a vertex, with a direction of 2^±60, or of 2^-149 times an axis.
    Stretched,
    /// At a vertex, with a range that ends or begins at, just before or just behind it.
    Range,
    /// From a vertex or the middle of an edge.
    OnSurface,
    /// From inside.
    Inside,
    /// From anywhere to anywhere.
    Anywhere,
}

impl Kind {
    /// All.
    pub const ALL: [Kind; 10] = [
        Kind::Vertex,
        Kind::Edge,
        Kind::AlongEdge,
        Kind::InPlane,
        Kind::Axis,
        Kind::Stretched,
        Kind::Range,
        Kind::OnSurface,
        Kind::Inside,
        Kind::Anywhere,
    ];
}

/// A ray and what is known about its hits.
#[derive(Clone, Debug)]
pub struct Aimed {
    /// How it was made.
    pub kind: Kind,
    /// The ray.
    pub ray: GridRay,
    /// A vertex or edge that its line passes through exactly, if any.
    pub through: Option<Target>,
}

/// What a line passes through exactly.
#[derive(Clone, Copy, Debug)]
pub enum Target {
    /// A vertex.
    Vertex(u32),
    /// A point of an edge.
    Edge([u32; 2]),
}

fn sub(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// `count` rays, of the kinds in turn.
pub fn rays(shape: &Shape, count: usize, seed: u64) -> Vec<Aimed> {
    let mut rng = Rng::new(seed);
    // A ray outside the grid, or with a zero direction, is drawn again.
    let draw = |i: usize| loop {
        let aimed = ray(shape, Kind::ALL[i % Kind::ALL.len()], &mut rng);
        let ray = &aimed.ray;
        let representable =
            |x: i32| x.abs() < LIMIT || x.trailing_zeros() + 24 >= 32 - x.abs().leading_zeros();
        if ray.direction != [0; 3]
            && ray.origin.iter().all(|x| x.abs() < LIMIT)
            && ray.direction.iter().all(|x| representable(*x))
        {
            return aimed;
        }
    };
    (0..count).map(draw).collect()
}

fn ray(shape: &Shape, kind: Kind, rng: &mut Rng) -> Aimed {
    let grid = &shape.grid;
    let row = rng.below(grid.triangles.len() as u64) as u32;
    let turn = rng.below(3) as usize;
    let [vertex, next, last] = [0, 1, 2].map(|i| grid.triangles[row as usize][(turn + i) % 3]);
    let [a, b, c] = [vertex, next, last].map(|v| grid.positions[v as usize]);
    let middle = [0, 1, 2].map(|k| (b[k] + c[k]) / 2);
    // Where the middle is not a point of the grid, a corner is used instead.
    let middle = if (0..3).all(|k| 2 * middle[k] == b[k] + c[k]) { middle } else { b };
    let somewhere = about(shape, rng);
    let mut ray = GridRay {
        origin: somewhere,
        direction: sub(a, somewhere),
        exponent: grid.exponent,
        range: [0.0, f32::INFINITY],
        negative_zero: rng.below(2) == 0,
    };
    let mut through = Some(Target::Vertex(vertex));
    match kind {
        Kind::Vertex => {}
        Kind::Edge => {
            ray.direction = sub(middle, somewhere);
            through = Some(Target::Edge([next, last]));
        }
        Kind::AlongEdge => {
            ray.direction = sub(b, a);
            ray.origin = sub(a, ray.direction);
        }
        Kind::InPlane => {
            ray.direction = sub(middle, a);
            ray.origin = sub(a, ray.direction);
        }
        Kind::Axis => {
            let axis = rng.below(3) as usize;
            let step = [1, -1][rng.below(2) as usize] << rng.below(8);
            ray.direction = [0; 3];
            ray.direction[axis] = step;
            ray.origin = a;
            ray.origin[axis] -= step * (1 + rng.below(64) as i32);
        }
        Kind::Stretched => match rng.below(3) {
            0 => ray.exponent = (ray.exponent + 60).min(100),
            1 => ray.exponent = (ray.exponent - 60).max(-149),
            _ => {
                ray.direction = [0, 0, 1];
                ray.direction.rotate_left(turn);
                ray.origin = sub(a, ray.direction.map(|x| 64 * x));
                ray.exponent = -149;
            }
        },
        Kind::Range => ray.range = range_about_one(rng),
        Kind::OnSurface => {
            ray.direction = sub(somewhere, a);
            ray.origin = a;
            if rng.below(2) == 0 {
                ray.direction = sub(somewhere, middle);
                ray.origin = middle;
                through = Some(Target::Edge([next, last]));
            }
        }
        Kind::Inside => {
            let inside = shape.inside.get(rng.below(shape.inside.len().max(1) as u64) as usize);
            ray.origin = *inside.unwrap_or(&somewhere);
            ray.direction = if rng.below(2) == 0 { sub(a, ray.origin) } else { sub(somewhere, ray.origin) };
            through = None;
        }
        Kind::Anywhere => {
            ray.direction = sub(about(shape, rng), somewhere);
            through = None;
        }
    }
    Aimed { kind, ray, through }
}

/// A range that begins or ends at t = 1, where the target is, or next to it.
fn range_about_one(rng: &mut Rng) -> [f32; 2] {
    let one = 1.0f32;
    let ranges = [
        [0.0, one],
        [one, f32::INFINITY],
        [one, one],
        [0.0, one.next_down()],
        [one.next_up(), f32::INFINITY],
        [-one, one],
        [f32::NEG_INFINITY, f32::INFINITY],
    ];
    ranges[rng.below(ranges.len() as u64) as usize]
}

/// A point of the grid in a box three times as wide as the shape, often in its middle planes or at
/// its bounds.
fn about(shape: &Shape, rng: &mut Rng) -> Point {
    let [lower, upper] = shape.bounds;
    [0, 1, 2].map(|k| {
        let width = i64::from(upper[k]) - i64::from(lower[k]);
        let offset = match rng.below(8) {
            0 => width / 2,
            1 => [0, width][rng.below(2) as usize],
            _ => rng.below(3 * width as u64 + 3) as i64 - width - 1,
        };
        (i64::from(lower[k]) + offset).clamp(1 - i64::from(LIMIT), i64::from(LIMIT) - 1) as i32
    })
}
