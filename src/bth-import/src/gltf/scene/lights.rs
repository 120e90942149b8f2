//! Lights of a glTF scene (KHR_lights_punctual).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use bth_scene::{Light, LightKind};

use crate::error::Result;
use crate::gltf::scene::importer::Importer;
use crate::gltf::schema::{GltfLight, Spot};

impl Importer<'_> {
    /// Adds a light at a row of the manifest's nodes.
    pub(super) fn light(&mut self, index: usize, node: usize, part: &str) -> Result<()> {
        let lights =
            self.document.extensions.get("KHR_lights_punctual").and_then(|value| value.get("lights"));
        let value = lights.and_then(|lights| lights.get(index));
        let value = value.ok_or_else(|| self.error(part, format!("its light {index} does not exist")))?;
        let light_part = format!("light {index}");
        let light: GltfLight = self.typed(value, &light_part)?;
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
            return Err(self.error(light_part, message));
        }
        let name = self.light_names.unique(&light.name, light_part);
        self.manifest.lights.push(Light { name, node, kind, color, intensity, range: light.range });
        Ok(())
    }
}

/// The angles in radians at which a spot begins to fade and ends. Programs that compute in f32 write a right angle a little greater
/// than it is. For a cone without a soft edge Blender writes the same angle twice, where a scene needs a lesser one to
/// begin with: that is the next f32 below.
fn cone_angles(spot: &Spot) -> [f64; 2] {
    let (inner, outer) = (spot.inner_cone_angle.unwrap_or(0.0), spot.outer_cone_angle.unwrap_or(FRAC_PI_4));
    let inner = if inner == outer { f64::from((outer as f32).next_down()) } else { inner };
    [inner, if outer as f32 == FRAC_PI_2 as f32 { FRAC_PI_2 } else { outer }]
}
