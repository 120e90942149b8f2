//! Meshes for the tests of all crates that compile.

use bth_import::Mesh;
use bth_random::Rng;
use std::borrow::Borrow;
use std::collections::HashMap;

/// Welds corners by their bits, with -0 as +0.
pub fn weld(corners: impl IntoIterator<Item: Borrow<[[f32; 3]; 3]>>) -> Mesh {
    let mut mesh = Mesh::default();
    let mut rows = HashMap::new();
    for t in corners {
        let t = t.borrow().map(|p| {
            let p = p.map(|x| x + 0.0);
            *rows.entry(p.map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(p);
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.push(t);
    }
    mesh
}

/// A random mesh on a small grid of points: connected fans and loose triangles. Many of them touch.
pub fn patch(seed: u64, triangles: usize) -> Mesh {
    let mut random = Rng::new(seed);
    let side = 3 + random.below(12);
    let mut point = || [0; 3].map(|_: i32| random.below(side) as f32);
    let mut corners: Vec<[[f32; 3]; 3]> = Vec::new();
    while corners.len() < triangles {
        let (a, b, c) = (point(), point(), point());
        corners.push([a, b, c]);
        // Add a neighbour across an edge and one at a corner.
        let (d, e) = (point(), point());
        corners.extend([[b, a, d], [a, d, e]]);
    }
    weld(&corners)
}

/// A latitude-longitude sphere of `2 n (n - 1)` triangles, closed and free of contacts.
pub fn sphere(n: u32, centre: [f32; 3]) -> Mesh {
    let at = |i: u32, j: u32| {
        let (theta, phi) = (
            std::f64::consts::PI * f64::from(i) / f64::from(n),
            std::f64::consts::TAU * f64::from(j % n) / f64::from(n),
        );
        let s = if i == 0 || i == n { 0.0 } else { theta.sin() };
        let p = [s * phi.cos(), s * phi.sin(), theta.cos()];
        [0, 1, 2].map(|k| p[k] as f32 + centre[k])
    };
    let mut corners = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i + 1 < n {
                corners.push([a, b, c]);
            }
            if i > 0 {
                corners.push([a, c, d]);
            }
        }
    }
    weld(&corners)
}
