//! The part of [`Scene`] that gives the vertices of objects at the scene's time.

use super::Scene;
use crate::deformers::normals::corner_normal;

impl Scene {
    /// The positions of an object's vertices at the scene's time: those of the file, or those that skins and morph targets or
    /// [`Self::set_positions`] have given the object. They are in the space of the object, of an object with a skin in world space.
    /// [`ObjectView::triangles`](bth_format::ObjectView::triangles) refers to them. Empty if the file does not keep them (it was
    /// compiled with `--no-geometry`).
    ///
    /// # Panics
    /// If there is no such object.
    pub fn positions(&self, object: u32) -> &[[f32; 3]] {
        self.view(object).positions
    }

    /// The normals at the corners of a triangle, given those of the file, as the deformer of its object turns them; of any length.
    /// `None` if none deforms the object.
    pub(crate) fn deformed_normals(
        &self,
        object: u32,
        triangle: u32,
        normals: [[f32; 3]; 3],
    ) -> Option<[[f64; 3]; 3]> {
        let pose = self.world()?.deformers.pose_of(object)?;
        let (file, row) = self.file_of(object);
        let view = self.view(object);
        let (corners, vertices) =
            (view.corners.get(triangle as usize)?, view.triangles.get(triangle as usize)?);
        let deformation = file.deformation(row);
        Some([0, 1, 2].map(|k| corner_normal(&deformation, pose, (corners[k], normals[k]), vertices[k])))
    }
}
