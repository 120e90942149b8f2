//! How the surface at a hit looks: base colour, alpha and emission, from factors, textures and vertex colours.

use super::texels::Texels;
use bth::rays::Hit;
use bth::{Alpha, Material, Scene, Wrap};
use bth_format::object::ObjectView;
use glam::{Vec3, Vec4};
use std::sync::Arc;

/// The materials of all objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneMaterials {
    pub(super) objects: Vec<ObjectMaterials>,
    /// Whether no object has any material or vertex colour.
    pub(super) is_empty: bool,
    /// Whether some material lets rays pass by its alpha.
    pub(super) has_alpha: bool,
    /// Whether some material is seen from the front only.
    pub(super) has_single_sided: bool,
}

/// The materials of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectMaterials {
    /// `None` for materials of which no more than the name is known.
    pub(super) materials: Vec<Option<Material>>,
    /// `None` for textures whose image cannot be decoded.
    pub(super) textures: Vec<Option<LoadedTexture>>,
    pub(super) has_colors: bool,
}

/// A texture that can be sampled.
#[derive(Clone, Debug)]
pub(super) struct LoadedTexture {
    pub(super) texels: Arc<Texels>,
    pub(super) wrap: [Wrap; 2],
    pub(super) nearest: bool,
    pub(super) uv_set: u32,
    pub(super) transform: [[f32; 3]; 2],
}

/// How a point of a surface looks. Colours are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    /// The share of light that it reflects.
    pub(crate) base_color: Vec3,
    /// Radiance that it emits.
    pub(crate) emissive: Vec3,
    /// Whether the base colour is shown as it is, without light.
    pub(crate) unlit: bool,
}

impl ObjectMaterials {
    pub(super) fn is_empty(&self) -> bool {
        !self.has_colors && self.materials.iter().all(Option::is_none)
    }

    /// The linear texel of a texture at a hit; white without one.
    fn texel(&self, texture: Option<u32>, scene: &Scene, hit: &Hit) -> Vec4 {
        let texture = texture.and_then(|row| self.textures.get(row as usize)?.as_ref());
        let Some(LoadedTexture { texels, wrap, nearest, uv_set, transform }) = texture else {
            return Vec4::ONE;
        };
        // Zeros where the file keeps none.
        let [u, v] = scene.texture_coordinates(hit, *uv_set).unwrap_or_default().map(f64::from);
        let at = transform.map(|[a, b, c]| (f64::from(a) * u + f64::from(b) * v + f64::from(c)) as f32);
        texels.at(at, *wrap, *nearest)
    }
}

/// A material of a scene that has no material, but vertex colours.
const WHITE: Material = Material {
    base_color: [1.0; 4],
    base_color_texture: None,
    emissive: [0.0; 3],
    emissive_texture: None,
    alpha: Alpha::Opaque,
    double_sided: true,
    unlit: false,
};

impl SceneMaterials {
    /// Whether nothing has a material or a vertex colour.
    pub(crate) fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// Whether rays may pass where a surface is hit: by alpha, and those of the camera at the backs of surfaces.
    pub(crate) fn lets_pass(&self, camera: bool) -> bool {
        self.has_alpha || camera && self.has_single_sided
    }

    /// The material of a hit; `None` where nothing but a name is known of it.
    pub(crate) fn material(&self, scene: &Scene, view: &ObjectView<'_>, hit: &Hit) -> Option<&Material> {
        let object = &self.objects.get(scene.object_of(hit.primitive.instance) as usize)?;
        let material = view.material_of(view.group_of(hit.primitive.triangle))?;
        object.materials.get(material as usize)?.as_ref()
    }

    /// The base colour with alpha at a hit.
    fn base_color(&self, scene: &Scene, hit: &Hit, material: &Material) -> Vec4 {
        let object = &self.objects[scene.object_of(hit.primitive.instance) as usize];
        let factor = Vec4::from_array(material.base_color);
        let vertex = if object.has_colors { scene.vertex_color(hit) } else { None };
        let texel = object.texel(material.base_color_texture, scene, hit);
        factor * texel * vertex.map_or(Vec4::ONE, Vec4::from_array)
    }

    /// The alpha of a material's surface at a hit.
    pub(crate) fn alpha(&self, scene: &Scene, hit: &Hit, material: &Material) -> f32 {
        self.base_color(scene, hit, material).w
    }

    /// How the surface at a hit looks; `None` where it has neither material nor vertex colour.
    pub(crate) fn look(&self, scene: &Scene, view: &ObjectView<'_>, hit: &Hit) -> Option<Look> {
        let object = self.objects.get(scene.object_of(hit.primitive.instance) as usize)?;
        let material = match self.material(scene, view, hit) {
            Some(material) => material,
            None if object.has_colors => &WHITE,
            None => return None,
        };
        let base_color = self.base_color(scene, hit, material).truncate();
        let emissive = Vec3::from_array(material.emissive);
        let emissive = match material.emissive_texture {
            Some(_) if emissive != Vec3::ZERO => {
                emissive * object.texel(material.emissive_texture, scene, hit).truncate()
            }
            _ => emissive,
        };
        Some(Look { base_color, emissive, unlit: material.unlit })
    }
}
