//! Exact tests of the side of a plane on which a point lies.

use robust::{Coord3D, orient3d};

/// Six times the signed volume; its sign is exact (Shewchuk 1997).
pub(super) fn orientation(vertices: &[[f32; 3]], tet: [u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|v| coordinates(vertices[v as usize]));
    orient3d(a, b, c, d)
}

/// Returns true if the point lies on the side that (v1-v0)x(v2-v0) points to; exact, false on the
/// plane.
pub(super) fn in_front(triangle: [[f32; 3]; 3], point: [f32; 3]) -> bool {
    let [a, b, c] = triangle.map(coordinates);
    // Shewchuk's sign is positive for points below a plane seen counterclockwise from above.
    orient3d(a, b, c, coordinates(point)) < 0.0
}

fn coordinates([x, y, z]: [f32; 3]) -> Coord3D<f64> {
    Coord3D { x: f64::from(x), y: f64::from(y), z: f64::from(z) }
}
