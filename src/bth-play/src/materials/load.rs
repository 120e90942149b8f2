//! Reads the materials of a file and decodes their images.

use super::decode::decode;
use super::look::{LoadedTexture, ObjectMaterials, SceneMaterials};
use super::texels::Texels;
use crate::messages::warn;
use bth::{Alpha, Material, Scene};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

impl SceneMaterials {
    /// The materials of all objects of a scene. An image that cannot be decoded is left out with a warning.
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
