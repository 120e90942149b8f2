//! Steps of a ray through a tetrahedralization that does not exist yet: N_avg of the paper's §3.3.
//!
//! The paper's appendices with its formulas are not public; the derivation here is independent of
//! them. It holds for a constrained tetrahedralization with free-space points at the centres of the
//! empty cells of an octree (what the `tets` stage builds), and for rays that end at the first
//! surface.

use serde::Serialize;

/// Where rays begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// Outside of the box.
    Outside,
    /// On a triangle.
    Surface,
}

/// How the steps of a ray through a node's tetrahedralization are estimated before it exists, as
/// provenance and cache keys name it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// From the number of triangles, as if they were spread evenly over a surface.
    #[default]
    FaceCount,
}

/// Steps at level 0 and steps for each level, of rays from outside and from surfaces. Fitted to
/// sampled steps on nodes of 1,024 to 80,000 triangles of five models.
const BY_FACE_COUNT: [[f64; 2]; 2] = [[0.68, 4.17], [-10.84, 5.30]];
/// Min number of steps of a walk.
const LEAST: f64 = 1.0;

/// Average steps of a ray through a node of `triangles` triangles.
///
/// A tetrahedron at distance r from the surface has the size of the octree's cell there, which is
/// about r but at least the mesh width h. A ray crosses ∫ ds / max(h, r(s)) of them, which is
/// proportional to the logarithm of L/h for a box of size L: a constant number for each level of
/// the octree, log2(L/h) levels in all. n triangles on a surface of about L² have h = L n^(-1/2),
/// which makes log2(L/h) = log2(n) / 2 levels.
///
/// Without free-space points the tetrahedra in front of a fine mesh are long slivers and the number
/// of steps more than doubles (69 on the bunny); that case is not estimated.
///
/// It assumes the even spread of a scan; large flat faces next to fine detail are outside of what
/// it was fitted to.
pub(super) fn steps(start: Start, triangles: u32) -> f64 {
    let [without, per_level] = BY_FACE_COUNT[usize::from(start == Start::Surface)];
    (without + per_level * f64::from(triangles.max(1)).log2() / 2.0).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_triangles_take_more_steps() {
        for start in [Start::Outside, Start::Surface] {
            assert!((10..20).all(|levels| steps(start, 1 << levels) < steps(start, 2 << levels)));
        }
        // On the bunny 31 and 32 steps were counted.
        let bunny = [Start::Outside, Start::Surface].map(|start| steps(start, 69_451));
        assert!((bunny[0] - 31.0).abs() < 4.0 && (bunny[1] - 32.0).abs() < 4.0, "{bunny:?}");
    }
}
