//! The poses of a mesh that deforms: positions of all vertices at sampled times.

use super::bounds::Bounds;
use super::{BinaryBvh, MAX_POSES};
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use rayon::prelude::*;

/// Positions of all vertices of a mesh in several poses.
#[derive(Clone, Copy, Debug)]
pub struct Poses<'a> {
    positions: &'a [Vec<[f32; 3]>],
}

impl<'a> Poses<'a> {
    /// One to [`MAX_POSES`] poses, each with a finite position for each row of the mesh's
    /// positions.
    ///
    /// # Errors
    /// [`Error::Internal`] when they are not.
    pub fn new(mesh: &Mesh, positions: &'a [Vec<[f32; 3]>]) -> Result<Self> {
        let internal = |message: String| Err(Error::Internal { code: "BTH-X203", message });
        if positions.is_empty() || positions.len() > MAX_POSES {
            return internal(format!("expected 1 to {MAX_POSES} poses, found {}", positions.len()));
        }
        for (pose, rows) in positions.iter().enumerate() {
            if rows.len() != mesh.positions.len() {
                let (expected, found) = (mesh.positions.len(), rows.len());
                return internal(format!("pose {pose}: expected {expected} positions, found {found}"));
            }
            if let Some(row) = rows.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
                return internal(format!("pose {pose}: position {row} is not finite"));
            }
        }
        Ok(Poses { positions })
    }

    /// Number of poses.
    #[allow(clippy::len_without_is_empty, reason = "there is at least one pose")]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// The positions of a pose.
    pub fn positions(&self, pose: usize) -> &'a [[f32; 3]] {
        &self.positions[pose]
    }

    /// The boxes of all nodes of a BVH in a pose.
    fn boxes(&self, mesh: &Mesh, bvh: &BinaryBvh, pose: usize) -> Vec<Bounds> {
        let positions = self.positions(pose);
        let mut boxes = vec![Bounds::EMPTY; bvh.nodes.len()];
        for (at, node) in bvh.nodes.iter().enumerate().rev() {
            boxes[at] = if node.is_leaf() {
                let corners = mesh.triangles[bvh.order[node.first as usize] as usize];
                Bounds::of_points(&corners.map(|row| positions[row as usize]))
            } else {
                boxes[at + 1].union(&boxes[node.right as usize])
            };
        }
        boxes
    }

    /// For each node of a BVH the probability that a random line through the root enters it, as the
    /// mean over the poses (Bittner and Meister 2015, equation 4, with equal weights). Poses in
    /// which the root has no area do not count.
    pub fn probabilities(&self, mesh: &Mesh, bvh: &BinaryBvh) -> Vec<f64> {
        let mut sum = vec![0.0; bvh.nodes.len()];
        let mut counted = 0u32;
        for pose in 0..self.len() {
            let boxes = self.boxes(mesh, bvh, pose);
            let root = boxes.first().map_or(0.0, Bounds::half_area);
            if root > 0.0 {
                counted += 1;
                let inverse = 1.0 / root;
                sum.par_iter_mut().zip(&boxes).for_each(|(sum, node)| *sum += node.half_area() * inverse);
            }
        }
        let each = 1.0 / f64::from(counted.max(1));
        sum.par_iter_mut().for_each(|sum| *sum *= each);
        sum
    }
}

/// A BVH with the probabilities that a ray enters its nodes.
#[derive(Clone, Copy)]
pub struct Weighed<'a> {
    /// The BVH.
    pub bvh: &'a BinaryBvh,
    /// For each node the probability that a sample ray enters it ([`crate::sampling::visits`]), or
    /// the mean probability of lines over poses ([`Poses::probabilities`]); `None` to use the areas
    /// of the boxes.
    pub probabilities: Option<&'a [f64]>,
}

impl<'a> From<&'a BinaryBvh> for Weighed<'a> {
    fn from(bvh: &'a BinaryBvh) -> Self {
        Weighed { bvh, probabilities: None }
    }
}

impl Weighed<'_> {
    /// The half area of a node, or its probability.
    pub(super) fn area(&self, at: u32) -> f64 {
        match self.probabilities {
            Some(probabilities) => probabilities[at as usize],
            None => Bounds::of_node(&self.bvh.nodes[at as usize]).half_area(),
        }
    }

    /// The sum of [`Self::area`] over all nodes.
    pub(super) fn total(&self) -> f64 {
        super::sum(self.bvh.nodes.len(), |at| self.area(at))
    }
}

/// Computes the boxes of a BVH from the mesh's own positions.
pub(super) fn refit(mesh: &Mesh, bvh: &mut BinaryBvh) {
    for at in (0..bvh.nodes.len()).rev() {
        let node = bvh.nodes[at];
        let bounds = if node.is_leaf() {
            Bounds::of_points(&mesh.corners(bvh.order[node.first as usize]))
        } else {
            let right = Bounds::of_node(&bvh.nodes[node.right as usize]);
            Bounds::of_node(&bvh.nodes[at + 1]).union(&right)
        };
        (bvh.nodes[at].lower, bvh.nodes[at].upper) = (bounds.lower(), bounds.upper());
    }
}
