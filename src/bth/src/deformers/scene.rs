//! The part of [`Scene`] that gives the vertices of deforming objects at the scene's time.

use super::evaluate::{self, Vertices};
use super::pose::Pose;
use crate::scene::Scene;

impl Scene {
    /// The pose that a deformer of the file gives an object at the scene's time; `None` if none deforms it.
    pub(crate) fn pose_of(&self, object: u32) -> Option<Pose> {
        let view = self.description()?;
        let deformer = view.deformers.iter().find(|deformer| deformer.object == object)?;
        let world = self.world()?;
        Some(Pose::of(&view, deformer, world.hierarchy()?, world.seconds))
    }

    /// The positions of the source's vertices of an object at the scene's time, which deformers of the file move: in the space of the
    /// object, with a skin in world space. Empty if the file does not keep them (it was compiled with `--no-geometry`).
    ///
    /// # Panics
    /// If there is no such object.
    pub fn positions(&self, object: u32) -> Vec<[f32; 3]> {
        let base = self.view(object).positions;
        let Some(pose) = self.pose_of(object) else { return base.to_vec() };
        let (file, row) = self.file_of(object);
        let mut out = vec![[0.0; 3]; base.len()];
        evaluate::positions(Vertices { base, deformation: file.deformation(row) }, &pose, &mut out);
        out
    }
}
