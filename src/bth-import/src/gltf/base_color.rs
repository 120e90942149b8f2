//! The base colour of a material: that of its metallic-roughness model, or where it has none the diffuse colour of an older model
//! (KHR_materials_pbrSpecularGlossiness).

use serde::Deserialize;
use serde_json::Value;

use crate::gltf::schema::{Extensions, TextureReference};

/// The extension with the older model.
pub(super) const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// What is read of the metallic-roughness model.
#[derive(Deserialize, Default, Clone)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct BaseColor {
    pub(super) base_color_factor: Option<[f64; 4]>,
    pub(super) base_color_texture: Option<UsedTexture>,
    pub(super) metallic_roughness_texture: Option<Value>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct SpecularGlossiness {
    diffuse_factor: Option<[f64; 4]>,
    diffuse_texture: Option<UsedTexture>,
}

/// A material's use of a texture.
#[derive(Deserialize, Clone)]
pub(super) struct UsedTexture {
    pub(super) index: usize,
    #[serde(flatten)]
    pub(super) reference: TextureReference,
}

/// The base colour of a material with this metallic-roughness model, if any, and these extensions.
///
/// # Errors
/// For a malformed extension.
pub(super) fn base_color(own: Option<&BaseColor>, extensions: &Extensions) -> serde_json::Result<BaseColor> {
    let Some(value) = extensions.get(SPECULAR_GLOSSINESS).filter(|_| own.is_none()) else {
        return Ok(own.cloned().unwrap_or_default());
    };
    let SpecularGlossiness { diffuse_factor, diffuse_texture } = SpecularGlossiness::deserialize(value)?;
    Ok(BaseColor {
        base_color_factor: diffuse_factor,
        base_color_texture: diffuse_texture,
        metallic_roughness_texture: None,
    })
}
