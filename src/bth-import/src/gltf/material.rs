//! Materials of a document: base colour, emission, alpha, sidedness and textures (glTF 2.0
//! specification, §3.9), and the diffuse colour of KHR_materials_pbrSpecularGlossiness.

use serde::Deserialize;
use serde_json::Value;

use crate::gltf::schema::Extensions;

/// The extension with the older model of materials.
pub(super) const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
/// Materials without light.
pub(super) const UNLIT: &str = "KHR_materials_unlit";
/// The factor of emission.
pub(super) const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";
/// The alpha modes of materials; others count as the first.
pub(super) const ALPHA_MODES: [&str; 3] = ["OPAQUE", "MASK", "BLEND"];

/// What is read of a material.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    #[serde(flatten)]
    pub(super) textures: Textures,
    pub(super) alpha_mode: Option<String>,
    pub(super) alpha_cutoff: Option<f64>,
    pub(super) double_sided: bool,
    pub(super) emissive_factor: Option<[f64; 3]>,
    pub(super) extensions: Extensions,
}

/// The textures of a material. Which texture coordinates are kept depends on nothing else.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Textures {
    pub(super) pbr_metallic_roughness: Option<MetallicRoughness>,
    pub(super) normal_texture: Option<UsedTexture>,
    pub(super) occlusion_texture: Option<UsedTexture>,
    pub(super) emissive_texture: Option<UsedTexture>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub(super) base_color_factor: Value,
    pub(super) base_color_texture: Option<UsedTexture>,
    pub(super) metallic_factor: Value,
    pub(super) roughness_factor: Value,
    pub(super) metallic_roughness_texture: Option<UsedTexture>,
}

/// A material's use of a texture.
#[derive(Deserialize, Clone)]
#[serde(rename_all = "camelCase")]
pub(super) struct UsedTexture {
    pub(super) index: usize,
    /// Number of the set of texture coordinates: n for `TEXCOORD_n`.
    #[serde(default)]
    pub(super) tex_coord: u32,
    /// Of a normal texture.
    #[serde(default)]
    pub(super) scale: Value,
    /// Of an occlusion texture.
    #[serde(default)]
    pub(super) strength: Value,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

/// The base colour of a material: a factor and a texture.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct BaseColor {
    #[serde(rename = "diffuseFactor")]
    pub(super) factor: Option<[f64; 4]>,
    #[serde(rename = "diffuseTexture")]
    pub(super) texture: Option<UsedTexture>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct EmissiveStrength {
    emissive_strength: Option<f64>,
}

impl Material {
    /// Returns the base colour: the diffuse colour of the older model where there is no other
    /// model.
    ///
    /// # Errors
    /// For a malformed extension or factor.
    pub(super) fn base(&self) -> serde_json::Result<BaseColor> {
        let Some(own) = &self.textures.pbr_metallic_roughness else {
            let older = self.extensions.get(SPECULAR_GLOSSINESS);
            return older.map_or(Ok(BaseColor::default()), BaseColor::deserialize);
        };
        let factor = Option::deserialize(&own.base_color_factor)?;
        Ok(BaseColor { factor, texture: own.base_color_texture.clone() })
    }

    /// Returns the factor of emission.
    ///
    /// # Errors
    /// For a malformed extension.
    pub(super) fn emissive_strength(&self) -> serde_json::Result<f64> {
        let Some(value) = self.extensions.get(EMISSIVE_STRENGTH) else { return Ok(1.0) };
        Ok(EmissiveStrength::deserialize(value)?.emissive_strength.unwrap_or(1.0))
    }

    /// Returns the alpha mode if glTF does not know it.
    pub(super) fn unknown_alpha_mode(&self) -> Option<&str> {
        self.alpha_mode.as_deref().filter(|mode| !ALPHA_MODES.contains(mode))
    }

    /// Returns the textures that files keep.
    pub(super) fn kept_textures(&self) -> impl Iterator<Item = UsedTexture> + use<> {
        let base = self.base().ok().and_then(|base| base.texture);
        [base, self.textures.emissive_texture.clone()].into_iter().chain(self.gloss_textures()).flatten()
    }

    /// Returns the metallic-roughness, normal and occlusion textures; none where no light falls.
    pub(super) fn gloss_textures(&self) -> [Option<UsedTexture>; 3] {
        if self.extensions.contains_key(UNLIT) {
            return [None, None, None];
        }
        let Textures { pbr_metallic_roughness: pbr, normal_texture, occlusion_texture, .. } = &self.textures;
        let gloss = pbr.as_ref().and_then(|pbr| pbr.metallic_roughness_texture.clone());
        [gloss, normal_texture.clone(), occlusion_texture.clone()]
    }

    /// Returns the names of what it has and no file keeps.
    pub(super) fn left_out(&self) -> impl Iterator<Item = String> {
        let known = [UNLIT, EMISSIVE_STRENGTH, SPECULAR_GLOSSINESS];
        let others = self.extensions.keys().filter(move |name| !known.contains(&name.as_str()));
        others.cloned()
    }
}
