//! A k-d tree, the structure that the BTH paper compares itself with: built by the surface area heuristic
//! (Wald and Havran 2006, "On building fast kd-trees for ray tracing, and on doing that in O(N log N)",
//! costs of their equation 8), traversed with a stack of far children (Havran 2000). It is not optimized further.

mod build;
mod walk;

use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::Result;
use bth::rays::Hit;
use std::time::Instant;

/// An inner node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
enum KdNode {
    /// Its lower child follows it.
    Inner { axis: u8, split: f32, upper: u32 },
    /// A range of `KdTree::lists`.
    Leaf { first: u32, count: u32 },
}

/// A built tree.
#[derive(Clone, Debug)]
pub struct KdTree {
    nodes: Vec<KdNode>,
    /// Rows of `corners`, leaf by leaf.
    lists: Vec<u32>,
    corners: Vec<[[f32; 3]; 3]>,
    lower: [f32; 3],
    upper: [f32; 3],
}

/// Builds the tree of a model.
///
/// # Errors
/// If the model has too many triangles for the tree.
pub fn contender(model: &Model, name: &str) -> Result<Contender> {
    let corners = (0..u32::try_from(model.triangles())?).map(|t| model.mesh.corners(t)).collect();
    let start = Instant::now();
    let tree = KdTree::build(corners);
    let build_s = start.elapsed().as_secs_f64();
    let bytes = size_of_val(tree.nodes.as_slice())
        + size_of_val(tree.lists.as_slice())
        + size_of_val(tree.corners.as_slice());
    let tracer = Box::new(tree);
    Ok(Contender { name: name.to_owned(), ours: false, tracer, build_s, bytes: Some(bytes as u64) })
}

impl Tracer for KdTree {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let mut stack = Vec::new();
        for (ray, hit) in batch.rays.iter().zip(hits) {
            *hit = self.walk::<false>(ray, &mut stack);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        let mut stack = Vec::new();
        for (ray, found) in batch.rays.iter().zip(found) {
            *found = self.walk::<true>(ray, &mut stack).is_hit();
        }
    }
}

const _: () = assert!(size_of::<KdNode>() == 12);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::on_sphere;
    use bth::rays::Ray;
    use bth_random::Rng;

    fn soup(count: usize, rng: &mut Rng) -> Vec<[[f32; 3]; 3]> {
        let mut corner = |middle: [f64; 3]| middle.map(|x| (x + 0.1 * (rng.unit_f64() - 0.5)) as f32);
        let mut middles = Rng::new(17);
        (0..count)
            .map(|_| {
                let middle = [middles.unit_f64(), middles.unit_f64(), middles.unit_f64()];
                [corner(middle), corner(middle), corner(middle)]
            })
            .collect()
    }

    fn grid() -> Vec<[[f32; 3]; 3]> {
        // Axis-aligned faces that lie in the planes that the tree splits at.
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for (i, j, k) in (0..64).map(|n| (n / 16, n / 4 % 4, n % 4)) {
                let corner = |u: i32, v: i32| {
                    let mut p = [k as f32; 3];
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) = ((i + u) as f32, (j + v) as f32);
                    p
                };
                triangles.push([corner(0, 0), corner(1, 0), corner(0, 1)]);
            }
        }
        triangles
    }

    fn agrees_with_all_triangles(corners: Vec<[[f32; 3]; 3]>, extent: f64) {
        let tree = KdTree::build(corners.clone());
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        let mut rng = Rng::new(3);
        let mut hits = 0;
        for _ in 0..3000 {
            let point = |r: &mut Rng| [r.unit_f64(), r.unit_f64(), r.unit_f64()].map(|x| (x * extent) as f32);
            let origin = point(&mut rng);
            let direction = on_sphere(&mut rng).to_array().map(|x| x as f32);
            let tmax =
                if rng.unit_f64() < 0.5 { f32::INFINITY } else { (0.5 * extent * rng.unit_f64()) as f32 };
            let ray = Ray { origin, tmin: 0.0, direction, tmax };
            let (found, expected) = (tree.walk::<false>(&ray, &mut Vec::new()), tree.nearest_of(&ray, &all));
            assert_eq!(found.t, expected.t, "{ray:?}");
            assert_eq!(tree.walk::<true>(&ray, &mut Vec::new()).is_hit(), expected.is_hit(), "{ray:?}");
            hits += usize::from(expected.is_hit());
        }
        assert!(hits > 300, "{hits} rays hit");
    }

    #[test]
    fn the_walk_finds_the_nearest_of_all_triangles_of_a_soup() {
        agrees_with_all_triangles(soup(700, &mut Rng::new(5)), 1.0);
    }

    #[test]
    fn faces_in_splitting_planes_are_found() {
        agrees_with_all_triangles(grid(), 4.0);
    }

    #[test]
    fn splits_follow_the_surface_area() {
        let tree = KdTree::build(soup(2000, &mut Rng::new(5)));
        let inner = tree.nodes.iter().filter(|n| matches!(n, KdNode::Inner { .. })).count();
        assert!(inner > 500, "{inner} inner nodes");
        assert!(tree.lists.len() < 20 * tree.corners.len(), "{} references", tree.lists.len());
    }
}
