//! Steps of a ray through a tetrahedralization that does not exist yet: N_avg of the paper's §3.3.
//!
//! The paper's appendices with its formulas are not public; the derivations here are ours. Both
//! hold for a constrained tetrahedralization with free-space points at the centres of the empty
//! cells of an octree (what the `tets` stage builds), and for rays that end at the first surface.

use serde::Serialize;

/// How to estimate the steps of a ray through a node's tetrahedralization.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// From the number of triangles, as if they were spread evenly over a surface.
    #[default]
    FaceCount,
    /// From the average depth of the leaves of the node's binary BVH.
    AverageDepth,
}

/// Steps that even the smallest tetrahedralization takes: in through the hull and to a face.
const STEPS_AT_LEAST: f64 = 2.0;
/// Tetrahedra that a ray crosses per level of the octree between the box and the mesh width, on its
/// way to a surface and along it. Fitted to one measurement, with free-space points: 31 steps a
/// camera ray and 32 a diffuse bounce on the Stanford bunny as one tetrahedralization (69,451
/// triangles, 8.04 levels). Timings from 20k to 269k triangles grow no faster than it says.
const STEPS_PER_LEVEL: f64 = 3.6;

impl Estimator {
    /// Average steps of a ray through a node of `triangles` triangles, whose leaves lie
    /// `average_depth` edges below it.
    ///
    /// A tetrahedron at distance r from the surface has the size of the octree's cell there, which
    /// is about r but at least the mesh width h. A ray crosses ∫ ds / max(h, r(s)) of them, which
    /// is proportional to the logarithm of L/h for a box of size L: a constant number for each
    /// level of the octree, of which there are log2(L/h).
    ///
    /// - *Face count*: n triangles on a surface of about L² have h = L n^(-1/2), which makes
    ///   log2(L/h) = log2(n) / 2 levels.
    /// - *Average depth*: two levels of a binary BVH over a surface halve its patches along both of
    ///   their directions, so levels = depth / 2. On an even mesh that is the face count again; on
    ///   an uneven one, and under a poor tree, the depth is larger.
    ///
    /// Without free-space points the tetrahedra in front of a fine mesh are long slivers and the
    /// steps more than twice as many (69 on the bunny); that case is not estimated.
    ///
    /// Both assume the even spread of a scan; large flat faces beside fine detail are outside of what
    /// they were fitted to.
    pub fn steps(self, triangles: u32, average_depth: f64) -> f64 {
        let levels = match self {
            Estimator::FaceCount => f64::from(triangles.max(1)).log2() / 2.0,
            Estimator::AverageDepth => average_depth / 2.0,
        };
        STEPS_AT_LEAST + STEPS_PER_LEVEL * levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_measured_bunny_takes_about_its_measured_steps() {
        let steps = Estimator::FaceCount.steps(69_451, 0.0);
        assert!((steps - 31.0).abs() < 1.0, "{steps}");
    }

    #[test]
    fn a_balanced_tree_gives_both_estimators_the_same_answer() {
        for levels in 0..30u32 {
            let (count, depth) = (1u32 << levels, f64::from(levels));
            let (a, b) = (Estimator::FaceCount.steps(count, 0.0), Estimator::AverageDepth.steps(0, depth));
            assert!((a - b).abs() < 1e-9, "{levels}");
        }
    }
}
