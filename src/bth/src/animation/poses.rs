//! The poses of an object outside of a scene: for compilers, which choose hierarchies by all poses
//! of an animation.

use super::pose::{Pose, SkinMatrices};
use super::positions::{self, Vertices};
use crate::nodes::NodeHierarchy;
use bth_format::layout::*;
use bth_format::{DeformationView, SceneView};

/// What a deformer makes of the vertices of its object at any time, as scenes that have it do.
#[derive(Clone, Copy, Debug)]
pub struct DeformerPoses<'a> {
    /// The sections of a scene that the specification permits (F150 to F159 and F180 to F186).
    pub view: SceneView<'a>,
    /// A deformer of the scene.
    pub deformer: Deformer,
    /// Positions of the object before anything moves them; object space.
    pub base: &'a [[f32; 3]],
    /// What moves them; it fits the deformer (F173 to F179, F181, F182).
    pub deformation: DeformationView<'a>,
}

impl DeformerPoses<'_> {
    /// The positions of all vertices at a time in seconds, in the space of the object; in world
    /// space where the deformer has a skin. They may be infinite or NaN. Their bits do not depend
    /// on the instruction set and the number of threads.
    ///
    /// # Panics
    /// If the sections do not fit each other.
    pub fn positions_at(&self, seconds: f64) -> Vec<[f32; 3]> {
        let mut hierarchy = NodeHierarchy::new(&self.view, 0);
        hierarchy.update(&self.view, seconds, true);
        let pose = Pose::of(&mut SkinMatrices::new(&self.view, &hierarchy), &self.deformer, seconds);
        let vertices = Vertices { base: self.base, deformation: self.deformation };
        let mut moved = vec![[0.0; 3]; self.base.len()];
        positions::compute(vertices, &pose, &mut moved);
        moved
    }
}
