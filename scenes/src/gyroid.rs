//! A gyroid clipped to a ball, by marching tetrahedra.
//!
//! Each triangle lies inside one tetrahedron of the grid and its corners on that tetrahedron's
//! edges, shared with the neighbours: the surface is closed, manifold and free of
//! self-intersections whatever the field. Corners keep off the grid's vertices, so that
//! no triangle degenerates when positions are rounded to `f32`.

use std::collections::HashMap;

use crate::Model;
use crate::math::sin_cos;
use glam::DVec3;

/// Faces for a grid of n³ cubes are about this times n².
const FACES_PER_CELL_AREA: f64 = 32.0;
/// Corners lie between this and one minus this along an edge of the grid.
const MARGIN: f64 = 0.01;
/// Periods of the gyroid across the ball.
const PERIODS: f64 = 2.0;

/// A gyroid in a ball of radius 1, with about `faces` faces.
pub fn gyroid(faces: u32) -> Model {
    let n = ((f64::from(faces) / FACES_PER_CELL_AREA).sqrt() + 0.5).floor().max(8.0) as u32;
    marching_tetrahedra(n, field)
}

/// Negative inside: one of the two labyrinths of the gyroid, within the ball.
fn field(p: DVec3) -> f64 {
    let [(sx, cx), (sy, cy), (sz, cz)] = p.to_array().map(|x| sin_cos(x * PERIODS / 2.0));
    let labyrinth = (sx * cy + sy * cz + sz * cx) / 4.0;
    // The max of both, rounded near where they are equal.
    let ball = p.length() - 1.0;
    let apart = labyrinth - ball;
    0.5 * (labyrinth + ball + (apart * apart + 0.01).sqrt())
}

/// The zero surface of `field` in the cube from -1.1 to 1.1, cut into n³ cubes of six
/// tetrahedra each (Kuhn's subdivision, which fits across the cubes' faces).
fn marching_tetrahedra(n: u32, field: impl Fn(DVec3) -> f64) -> Model {
    let side = n + 1;
    let point = |g: [u32; 3]| DVec3::from_array(g.map(|k| -1.1 + 2.2 * f64::from(k) / f64::from(n)));
    let row = |g: [u32; 3]| (g[2] * side + g[1]) * side + g[0];
    let mut values = Vec::with_capacity((side * side * side) as usize);
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                values.push(field(point([x, y, z])));
            }
        }
    }
    let value = |g: [u32; 3]| values[row(g) as usize];
    let mut model = Model::default();
    let mut on_edge = HashMap::new();
    let mut corner = |model: &mut Model, a: [u32; 3], b: [u32; 3]| {
        let (a, b) = if row(a) < row(b) { (a, b) } else { (b, a) };
        *on_edge.entry((row(a), row(b))).or_insert_with(|| {
            let t = (value(a) / (value(a) - value(b))).clamp(MARGIN, 1.0 - MARGIN);
            model.push(point(a) + (point(b) - point(a)) * t)
        })
    };
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut tet = [[x, y, z]; 4];
                    for k in 1..4 {
                        tet[k] = tet[k - 1];
                        tet[k][order[k - 1]] += 1;
                    }
                    let inside: Vec<_> = tet.into_iter().filter(|g| value(*g) < 0.0).collect();
                    let outside: Vec<_> = tet.into_iter().filter(|g| value(*g) >= 0.0).collect();
                    let polygon: Vec<u32> = match (inside[..].as_ref(), outside[..].as_ref()) {
                        ([a], others) | (others, [a]) if others.len() == 3 => {
                            others.iter().map(|b| corner(&mut model, *a, *b)).collect()
                        }
                        ([a, b], [c, d]) => {
                            [(a, c), (a, d), (b, d), (b, c)].map(|(p, q)| corner(&mut model, *p, *q)).to_vec()
                        }
                        _ => continue,
                    };
                    let outwards = point(outside[0]) - point(inside[0]);
                    orient_and_push(&mut model, polygon, outwards);
                }
            }
        }
    }
    model
}

/// Adds a triangle or quadrilateral so that its normal goes with `outwards`, which crosses it.
fn orient_and_push(model: &mut Model, mut polygon: Vec<u32>, outwards: DVec3) {
    let p = |k: usize| model.position(polygon[k]);
    // The diagonals of a quadrilateral, or two edges of a triangle: their product is its normal.
    let normal = match polygon.len() {
        3 => (p(1) - p(0)).cross(p(2) - p(0)),
        _ => (p(2) - p(0)).cross(p(3) - p(1)),
    };
    if normal.dot(outwards) < 0.0 {
        polygon.reverse();
    }
    match polygon[..] {
        [a, b, c] => model.triangles.push([a, b, c]),
        [a, b, c, d] => model.quad([a, b, c, d]),
        _ => unreachable!("a plane cuts a tetrahedron in three or four edges"),
    }
}
