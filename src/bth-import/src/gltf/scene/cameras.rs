//! Cameras of a glTF scene.

use bth_scene::{Camera, Lens};

use crate::error::Result;
use crate::gltf::scene::importer::Importer;
use crate::gltf::schema::GltfCamera;

impl Importer<'_> {
    /// Adds a camera at a row of the manifest's nodes.
    pub(super) fn camera(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let value = self.document.cameras.get(index);
        let value = value.ok_or_else(|| self.error(part, format!("its camera {index} does not exist")))?;
        let camera_part = format!("camera {index}");
        let camera: GltfCamera = self.typed(value, &camera_part)?;
        let (lens, aspect, near, far) = match (&camera.perspective, &camera.orthographic) {
            (Some(p), _) => (Lens::Perspective(p.yfov.to_degrees()), p.aspect_ratio, p.znear, p.zfar),
            (None, Some(o)) => {
                (Lens::Orthographic(2.0 * o.ymag), Some(o.xmag / o.ymag), o.znear, Some(o.zfar))
            }
            (None, None) => return Err(self.error(camera_part, "it has no projection")),
        };
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let lens_good = match lens {
            Lens::Perspective(fov) => positive(fov) && fov < 180.0,
            Lens::Orthographic(height) => positive(height),
        };
        let depths = near.is_finite() && near >= 0.0 && far.is_none_or(|far| positive(far) && far > near);
        if !(lens_good && depths && aspect.is_none_or(positive)) {
            let message = "expected a field of view or height above 0, and znear below zfar";
            return Err(self.error(camera_part, message));
        }
        let given = if camera.name.is_empty() { self.manifest.nodes[node].name.clone() } else { camera.name };
        let name = self.camera_names.unique(&given, camera_part);
        self.manifest.cameras.push(Camera { name, node, lens, aspect, near: Some(near), far });
        self.manifest.camera = Some(0);
        Ok(())
    }
}
