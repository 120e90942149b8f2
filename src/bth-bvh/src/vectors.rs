//! Vectors in double precision that several stages share.
//!
//! [`DVec3`] computes products and sums one by one, in the order x, y, z and unfused, so results
//! are the same on every machine.

use bth_import::Mesh;
use bth_random::Rng;
use glam::DVec3;

/// Corners of a triangle.
pub fn corners(mesh: &Mesh, triangle: u32) -> [DVec3; 3] {
    mesh.corners(triangle).map(|p| DVec3::from(p.map(f64::from)))
}

/// The vector of twice a triangle's area along its normal.
pub fn double_area([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// A vector divided by its length. `DVec3::normalize` multiplies by the reciprocal, which rounds
/// twice.
pub fn unit(v: DVec3) -> DVec3 {
    v / v.length()
}

/// A direction that is uniform on the sphere. The length divides, as in [`unit()`]: compiled files
/// depend on the last bits of sampled rays, in which `Rng::unit_vector` differs.
pub fn uniform_direction(random: &mut Rng) -> DVec3 {
    unit(random.point_in_ball().into())
}
