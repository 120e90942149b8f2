//! Cameras and lights (KHR_lights_punctual) of a glTF scene.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use bth_scene::{Camera, Lens, Light, LightKind};

use crate::error::Result;
use crate::gltf::scene::importer::Importer;
use crate::gltf::schema::{GltfCamera, GltfLight, Spot};

impl Importer<'_, '_> {
    /// Adds a camera at a row of the manifest's nodes.
    pub(super) fn camera(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let value = self.file.document.cameras.get(index);
        let value =
            value.ok_or_else(|| self.file.graph_error(part, format!("its camera {index} does not exist")))?;
        let camera_part = format!("camera {index}");
        let camera: GltfCamera = self.file.typed(value, &camera_part)?;
        let (lens, aspect, near, far) = match (&camera.perspective, &camera.orthographic) {
            (Some(p), _) => (Lens::Perspective(p.yfov.to_degrees()), p.aspect_ratio, p.znear, p.zfar),
            (None, Some(o)) => {
                (Lens::Orthographic(2.0 * o.ymag), Some(o.xmag / o.ymag), o.znear, Some(o.zfar))
            }
            (None, None) => return Err(self.file.graph_error(camera_part, "it has no projection")),
        };
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let lens_good = match lens {
            Lens::Perspective(fov) => positive(fov) && fov < 180.0,
            Lens::Orthographic(height) => positive(height),
        };
        let depths = near.is_finite() && near >= 0.0 && far.is_none_or(|far| positive(far) && far > near);
        if !(lens_good && depths && aspect.is_none_or(positive)) {
            let message = "expected a field of view or height above 0, and znear below zfar";
            return Err(self.file.graph_error(camera_part, message));
        }
        let given =
            if camera.name.is_empty() { self.manifest.nodes.name(node).to_owned() } else { camera.name };
        let name = self.names.cameras.unique(&given, camera_part);
        self.manifest.cameras.push(Camera { name, node, lens, aspect, near: Some(near), far });
        self.manifest.camera = Some(0);
        Ok(())
    }

    /// Adds a light at a row of the manifest's nodes.
    pub(super) fn light(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let lights =
            self.file.document.extensions.get("KHR_lights_punctual").and_then(|value| value.get("lights"));
        let value = lights.and_then(|lights| lights.get(index));
        let value =
            value.ok_or_else(|| self.file.graph_error(part, format!("its light {index} does not exist")))?;
        let light_part = format!("light {index}");
        let light: GltfLight = self.file.typed(value, &light_part)?;
        let kind = match light.kind.as_str() {
            "directional" => LightKind::Directional,
            "point" => LightKind::Point,
            "spot" => {
                let [inner, outer] = cone_angles(&light.spot).map(f64::to_degrees);
                LightKind::Spot { inner, outer }
            }
            other => {
                return self.ignore(&light_part, format!("lights of kind \"{other}\" are ignored"));
            }
        };
        let (color, intensity) = (light.color.unwrap_or([1.0; 3]), light.intensity.unwrap_or(1.0));
        let from_zero = |x: f64| x.is_finite() && x >= 0.0;
        let cone = match kind {
            LightKind::Spot { inner, outer } => from_zero(inner) && inner < outer && outer <= 90.0,
            _ => true,
        };
        let range = light.range.is_none_or(|r| from_zero(r) && r > 0.0);
        if !(cone && range && color.iter().chain([&intensity]).all(|x| from_zero(*x))) {
            let message = "expected a color, intensity, range and cone that glTF allows";
            return Err(self.file.graph_error(light_part, message));
        }
        let name = self.names.lights.unique(&light.name, light_part);
        self.manifest.lights.push(Light { name, node, kind, color, intensity, range: light.range });
        Ok(())
    }
}

/// Returns the angles in radians at which a spot begins to fade and ends. Programs that compute in
/// f32 write a right angle a little larger than it is. For a cone without a soft edge Blender
/// writes the same angle twice, where a scene needs a smaller one to begin with: the next f32
/// below.
fn cone_angles(spot: &Spot) -> [f64; 2] {
    let (inner, outer) = (spot.inner_cone_angle.unwrap_or(0.0), spot.outer_cone_angle.unwrap_or(FRAC_PI_4));
    let inner = if inner == outer { f64::from((outer as f32).next_down()) } else { inner };
    [inner, if outer as f32 == FRAC_PI_2 as f32 { FRAC_PI_2 } else { outer }]
}
