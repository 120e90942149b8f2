//! Steps through a tetrahedralization from the area of its faces alone, after Cauchy and Crofton.
//!
//! A uniform line that hits a convex body of surface S hits a surface of area A within it 2A/S
//! times on average. For a node's box and the input's triangles in it, of area A_c, that is λ =
//! 2A_c/S hits; for the other faces between tetrahedra, of area A_f, it is F = 2A_f/S crossings. A
//! line with n hits consists of n + 1 gaps. In each gap it visits one tetrahedron more than it
//! crosses faces: all gaps of a line together have F + 1 + λ tetrahedra on average.
//!
//! A ray is a gap with a direction. Each gap is two rays. Rays that begin at the box are rays from
//! outside (two a line, N_out steps each on average). Rays that begin at a hit are rays from a
//! surface: 2λ a line, N_surf steps each. Directions at a surface have the density of uniform
//! lines, which is cosine-weighted. So
//!
//! ```text
//! N_out + λ N_surf = 1 + λ + F
//! ```
//!
//! exactly, on average over both sides of all triangles: the correction for rays that end at
//! surfaces. What remains unknown is the ratio r = N_out / N_surf, which is measured.

use super::Start;
use crate::{Behind, TetMesh};
use bth_bvh::vectors::double_area;

/// r: steps of a ray from outside over steps of a ray from a surface, fitted to sampled steps.
const OUTSIDE_OVER_SURFACE: f64 = 1.3;

/// The estimate of N_avg.
pub fn area_steps(mesh: &TetMesh, start: Start) -> f64 {
    let (mut free, mut hit) = (0.0, 0.0);
    let corner = |v: u32| mesh.vertices[v as usize].map(f64::from);
    for (t, (tet, behind)) in mesh.tets.iter().zip(&mesh.behind).enumerate() {
        for k in 0..4 {
            let area = 0.5 * double_area([1, 2, 3].map(|i| corner(tet[(k + i) % 4]).into())).length();
            match behind[k] {
                // Every inner face is listed by the tetrahedra on both of its sides and is counted
                // once.
                Behind::Tet(next) if (t as u32) < next => free += area,
                Behind::Tet(_) | Behind::Hull => {}
                Behind::Face(_) => hit += 0.5 * area,
            }
        }
    }
    let [x, y, z] = [0, 1, 2].map(|k| f64::from(mesh.upper[k]) - f64::from(mesh.lower[k]));
    let surface = 2.0 * (x * y + y * z + z * x);
    let (crossings, hits) = (2.0 * free / surface, 2.0 * hit / surface);
    let from_surface = (1.0 + hits + crossings) / (OUTSIDE_OVER_SURFACE + hits);
    match start {
        Start::Outside => OUTSIDE_OVER_SURFACE * from_surface,
        Start::Surface => from_surface,
    }
}
