//! How the surface at a hit looks: base colour, alpha and emission, from factors, textures and
//! vertex colours.

use super::texels::{Texels, decode};
use crate::messages::warn;
use bth::rays::Hit;
use bth::{Alpha, Material, Scene, Wrap};
use bth_format::object::ObjectView;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The materials of all objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneMaterials {
    pub(super) objects: Vec<ObjectMaterials>,
    /// True if no object has any material or vertex colour.
    pub(super) is_empty: bool,
    /// True if some material lets rays pass by its alpha.
    pub(super) has_alpha: bool,
    /// True if some material is seen from the front only.
    pub(super) has_single_sided: bool,
}

/// The materials of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectMaterials {
    /// `None` for materials with nothing but a name.
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
    /// True if the base colour is shown as it is, without light.
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
    /// Returns true if nothing has a material or a vertex colour.
    pub(crate) fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// Returns true if rays may pass where a surface is hit: by alpha, and rays of the camera from
    /// the back.
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

impl SceneMaterials {
    /// Loads the materials of all objects of a scene. Skips an image that cannot be decoded, with a
    /// warning.
    pub(crate) fn load(scene: &Scene, file: &Path) -> Self {
        let images = decoded_images(scene, file);
        let objects: Vec<ObjectMaterials> =
            (0..scene.object_count()).map(|object| object_materials(scene, object, &images)).collect();
        let all = || objects.iter().flat_map(|object| &object.materials).flatten();
        let has = |holds: fn(&Material) -> bool| all().any(holds);
        Self {
            is_empty: objects.iter().all(ObjectMaterials::is_empty),
            has_alpha: has(|material| material.alpha != Alpha::Opaque),
            has_single_sided: has(|material| !material.double_sided),
            objects,
        }
    }
}

/// The images of all textures, by their indices, decoded in parallel.
fn decoded_images(scene: &Scene, file: &Path) -> BTreeMap<u32, Arc<Texels>> {
    let mut files: BTreeMap<u32, &[u8]> = BTreeMap::new();
    for object in 0..scene.object_count() {
        for texture in (0..scene.texture_count(object)).filter_map(|row| scene.texture(object, row)) {
            files.insert(texture.image, texture.bytes);
        }
    }
    let files: Vec<(u32, &[u8])> = files.into_iter().collect();
    let decoded: Vec<_> = files.par_iter().map(|(image, bytes)| (*image, decode(bytes))).collect();
    let mut images = BTreeMap::new();
    for (image, decoded) in decoded {
        match decoded {
            Ok(texels) => {
                images.insert(image, Arc::new(texels));
            }
            Err(what) => warn(&format!(
                "{}: image {image}: BTH-P005: it cannot be decoded and is left out: {what} (hint: save it again as PNG, or use \
                 --mode clay)",
                file.display()
            )),
        }
    }
    images
}

fn object_materials(scene: &Scene, object: u32, images: &BTreeMap<u32, Arc<Texels>>) -> ObjectMaterials {
    let texture = |row: u32| {
        let texture = scene.texture(object, row)?;
        Some(LoadedTexture {
            texels: images.get(&texture.image)?.clone(),
            wrap: texture.wrap,
            nearest: texture.nearest,
            uv_set: texture.uv_set,
            transform: texture.transform,
        })
    };
    let (file, row) = scene.file_of(object);
    ObjectMaterials {
        materials: (0..scene.material_count(object)).map(|row| scene.material(object, row)).collect(),
        textures: (0..scene.texture_count(object)).map(texture).collect(),
        has_colors: !file.materials(row).colors.is_empty(),
    }
}
