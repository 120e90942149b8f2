//! A bumpy sphere. It is star-shaped, and therefore closed and free of self-intersections.

use std::collections::HashMap;

use crate::Model;
use crate::math::{resolution_for, sin_cos};
use glam::DVec3;

/// A bumpy sphere of 8·n² faces for the n that comes nearest to `faces`.
pub fn blob(faces: u32) -> Model {
    let n = resolution_for(faces, 8, 1) as i32;
    let mut model = Model::default();
    let mut rows = HashMap::new();
    // The vertices are the points with whole coordinates of the octahedron |x| + |y| + |z| = n,
    // moved outwards.
    let mut row = |model: &mut Model, p: [i32; 3]| {
        *rows.entry(p).or_insert_with(|| {
            let direction = DVec3::from_array(p.map(f64::from)).normalize();
            model.push(direction * radius(direction))
        })
    };
    for octant in 0..8 {
        let sign = [octant & 1, octant >> 1 & 1, octant >> 2].map(|b| 1 - 2 * b);
        let mirrored = sign[0] * sign[1] * sign[2] < 0;
        let mut face = |model: &mut Model, corners: [[i32; 2]; 3]| {
            let mut t = corners.map(|[i, j]| row(model, [sign[0] * i, sign[1] * j, sign[2] * (n - i - j)]));
            if mirrored {
                t.swap(1, 2);
            }
            model.triangles.push(t);
        };
        for i in 0..n {
            for j in 0..n - i {
                face(&mut model, [[i, j], [i + 1, j], [i, j + 1]]);
                if i + j + 2 <= n {
                    face(&mut model, [[i + 1, j], [i + 1, j + 1], [i, j + 1]]);
                }
            }
        }
    }
    model
}

/// Distance of the surface from the centre along a unit direction.
fn radius(direction: DVec3) -> f64 {
    let DVec3 { x, y, z } = direction;
    let wave = |turns: f64| sin_cos(turns).0;
    1.0 + 0.12 * wave(0.7 * x + 0.3) * wave(0.8 * y + 0.1)
        + 0.07 * wave(1.3 * z + 0.4 * x)
        + 0.03 * wave(2.1 * x - 1.7 * y + 0.9 * z)
        + 0.015 * wave(4.3 * y + 3.1 * z)
}
