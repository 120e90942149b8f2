//! Steps of a ray through a tetrahedralization that does not exist yet: N_avg of the paper's §3.3.
//!
//! The paper's appendices with its formulas are not public; the derivations here are independent of
//! them. Both hold for a constrained tetrahedralization with free-space points at the centres of
//! the empty cells of an octree (what the `tets` stage builds), and for rays that end at the first
//! surface. Once the tetrahedra exist, [`super::mean_steps`] samples them and [`super::area_steps`]
//! adds up their faces.

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

/// How to estimate the steps of a ray through a node's tetrahedralization before it exists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// From the number of triangles, as if they were spread evenly over a surface.
    #[default]
    FaceCount,
    /// From the average depth of the leaves of the node's binary BVH.
    AverageDepth,
}

/// Steps at level 0 and steps for each level, of rays from outside and from surfaces, for
/// [`Estimator::FaceCount`]. Fitted to sampled steps on nodes of 1,024 to 80,000 triangles of five
/// models.
const BY_FACE_COUNT: [[f64; 2]; 2] = [[0.68, 4.17], [-10.84, 5.30]];
/// The same for [`Estimator::AverageDepth`].
const BY_DEPTH: [[f64; 2]; 2] = [[1.32, 3.96], [-8.93, 4.83]];
/// Min number of steps of a walk.
const LEAST: f64 = 1.0;

impl Estimator {
    /// Average steps of a ray through a node of `triangles` triangles, whose leaves lie
    /// `average_depth` edges below it.
    ///
    /// A tetrahedron at distance r from the surface has the size of the octree's cell there, which
    /// is about r but at least the mesh width h. A ray crosses ∫ ds / max(h, r(s)) of them, which
    /// is proportional to the logarithm of L/h for a box of size L: a constant number for each
    /// level of the octree, log2(L/h) levels in all.
    ///
    /// - *Face count*: n triangles on a surface of about L² have h = L n^(-1/2), which makes
    ///   log2(L/h) = log2(n) / 2 levels.
    /// - *Average depth*: two levels of a binary BVH over a surface halve its patches along both of
    ///   their directions, so levels = depth / 2. On an even mesh that is the face count again; on
    ///   an uneven one, and under a poor tree, the depth is larger.
    ///
    /// Without free-space points the tetrahedra in front of a fine mesh are long slivers and the
    /// number of steps more than doubles (69 on the bunny); that case is not estimated.
    ///
    /// Both assume the even spread of a scan; large flat faces next to fine detail are outside of
    /// what they were fitted to.
    pub fn steps(self, start: Start, triangles: u32, average_depth: f64) -> f64 {
        let constants = match self {
            Estimator::FaceCount => BY_FACE_COUNT,
            Estimator::AverageDepth => BY_DEPTH,
        };
        let [without, per_level] = constants[usize::from(start == Start::Surface)];
        (without + per_level * self.levels(triangles, average_depth)).max(LEAST)
    }

    /// Levels of the octree between the node's box and its mesh width.
    pub fn levels(self, triangles: u32, average_depth: f64) -> f64 {
        match self {
            Estimator::FaceCount => f64::from(triangles.max(1)).log2() / 2.0,
            Estimator::AverageDepth => average_depth / 2.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_balanced_tree_gives_both_estimators_the_same_levels() {
        for levels in 0..30u32 {
            let (count, depth) = (1u32 << levels, f64::from(levels));
            let a = Estimator::FaceCount.levels(count, 0.0);
            let b = Estimator::AverageDepth.levels(0, depth);
            assert!((a - b).abs() < 1e-9, "{levels}");
        }
    }

    #[test]
    fn more_triangles_take_more_steps_and_both_estimators_say_about_the_same() {
        for start in [Start::Outside, Start::Surface] {
            let mut last = 0.0;
            for levels in 10..21u32 {
                let a = Estimator::FaceCount.steps(start, 1 << levels, 0.0);
                let b = Estimator::AverageDepth.steps(start, 0, f64::from(levels));
                assert!(a > last && (a - b).abs() < 0.1 * a, "{levels}: {a} and {b}");
                last = a;
            }
        }
        // On the bunny 31 and 32 steps were counted.
        let bunny = [Start::Outside, Start::Surface].map(|s| Estimator::FaceCount.steps(s, 69_451, 0.0));
        assert!((bunny[0] - 31.0).abs() < 4.0 && (bunny[1] - 32.0).abs() < 4.0, "{bunny:?}");
    }
}
