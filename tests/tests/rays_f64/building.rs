//! A closed building in national coordinates, in f64 and, so that the tests are known to see it,
//! rounded to f32.

use bth::Scene;
use bth::rays::{PrimitiveRef, Ray64, StartRay};
use bth_compile::Silent;
use bth_compile::memory::{PositionRows, TriangleMesh, open};
use bth_compile::pipeline::CompileOptions;
use bth_import::Positions;
use bth_random::Rng;
use bth_tests::oracle::{self, to_f64};
use std::collections::HashMap;

/// Where it is.
const AWAY: [f64; 3] = [5.5e6, 4.2e5, 300.0];
/// Cells along each edge.
const CELLS: u32 = 5;
/// What positions and distances may be off, in metres.
const CLOSE: f64 = 1e-9;

/// Point of the building, each coordinate from 0 to 1: 24.3 by 11.7 metres, 3.2 high, with a gable
/// roof, turned by 23.4 degrees. It is convex.
fn place([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = 23.4f64.to_radians().sin_cos();
    let (x, y, z) = (24.3 * x, 11.7 * y, z * (3.2 + 2.9 * (1.0 - (2.0 * y - 1.0).abs())));
    [AWAY[0] + cos * x - sin * y, AWAY[1] + sin * x + cos * y, AWAY[2] + z]
}

/// The building; its vertices are shared.
fn building() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles, mut rows) = (Vec::new(), Vec::new(), HashMap::new());
    for (axis, end, i, j) in (0..3)
        .flat_map(|axis| (0..2 * CELLS * CELLS).map(move |k| (axis, k % 2, k / 2 % CELLS, k / 2 / CELLS)))
    {
        let mut row = |i: u32, j: u32| {
            let mut at = [end * CELLS; 3];
            (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (i, j);
            *rows.entry(at).or_insert_with(|| {
                positions.push(place(at.map(|k| f64::from(k) / f64::from(CELLS))));
                positions.len() as u32 - 1
            })
        };
        let [a, b, c, d] = [row(i, j), row(i + 1, j), row(i + 1, j + 1), row(i, j + 1)];
        triangles.extend(if end == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
    }
    (positions, triangles)
}

/// What the building loses in a scene.
#[derive(Debug, Default)]
struct Loss {
    /// Rays and starts that leave it.
    leaks: usize,
    /// Points in it that are outside.
    outside: usize,
    /// Largest errors in metres: of vertices, of closest points, of hits and of distances.
    vertex: f64,
    position: f64,
    t: f64,
    distance: f64,
}

/// A point inside, a quarter of the size off the walls.
fn inside(rng: &mut Rng) -> [f64; 3] {
    place([(); 3].map(|()| rng.between(0.25, 0.75)))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Compares a scene of the building with exact arithmetic about its numbers.
fn measure(scene: &Scene, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Loss {
    let corners: Vec<_> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
    let mut exact = oracle::World::default();
    let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    exact.place(0, identity, (0..).zip(corners.iter().copied()));
    let (rng, mut loss) = (&mut Rng::new(1), Loss::default());
    for (triangle, corners) in (0..).zip(&corners) {
        let kept = scene.triangle(PrimitiveRef { instance: 0, triangle }).expect("a triangle");
        let off = kept.iter().zip(corners).map(|(p, q)| length(sub(*p, *q)));
        loss.vertex = off.fold(loss.vertex, f64::max);
        let [a, b, c] = *corners;
        for target in [a, [0, 1, 2].map(|k| a[k].midpoint(b[k])), [0, 1, 2].map(|k| b[k].midpoint(c[k]))] {
            // Of so few digits that the ray passes through the target exactly, at t = 1.
            let direction = sub(target, inside(rng)).map(|x| (x * 1024.0).round() / 1024.0);
            let ray = Ray64::new(sub(target, direction), direction);
            let truth = exact.nearest(ray).expect("a wall").t_f64();
            loss.outside += usize::from(!scene.contains_f64(ray.origin));
            let Some(hit) = scene.nearest(&ray) else {
                loss.leaks += 1;
                continue;
            };
            let off = (scene.hit_f64(&ray, &hit).t - truth) * length(direction);
            loss.t = loss.t.max(off.abs());
            // From there back inside; f32 has the direction well enough.
            let point = scene.surface(&hit).expect("a wall").position;
            let back = StartRay::from_hit(&hit, sub(inside(rng), point).map(|x| x as f32));
            loss.leaks += usize::from(scene.nearest(&back).is_none());
        }
    }
    for _ in 0..40 {
        let point = place([(); 3].map(|()| rng.between(-0.5, 1.5)));
        let squared = corners.iter().map(|of| oracle::squared_distance(point, *of)).min();
        let truth = to_f64(&squared.expect("a wall")).sqrt();
        let found = scene.closest_f64(point, f64::INFINITY).expect("a wall");
        loss.distance = loss.distance.max((found.distance - truth).abs());
        loss.position = loss.position.max((length(sub(found.point, point)) - truth).abs());
    }
    loss
}

#[test]
fn a_building_in_national_coordinates_loses_nothing_in_f64_and_much_in_f32() {
    let (positions, triangles) = building();
    let mesh = TriangleMesh { positions: PositionRows::F64(&positions), triangles: &triangles };
    let scene = |positions| {
        open(mesh, &CompileOptions { positions, ..CompileOptions::default() }, &Silent).expect("a building")
    };
    // `auto` sees that f32 would not do.
    let loss = measure(&scene(Positions::Auto), &positions, &triangles);
    assert_eq!((loss.leaks, loss.outside, loss.vertex), (0, 0, 0.0), "{loss:?}");
    assert!([loss.position, loss.t, loss.distance].iter().all(|off| *off <= CLOSE), "{loss:?}");
    // f32 has steps of half a metre there.
    let loss = measure(&scene(Positions::F32), &positions, &triangles);
    assert!([loss.vertex, loss.position, loss.t, loss.distance].iter().all(|off| *off > 0.1), "{loss:?}");
}
