//! Which texture coordinates of a primitive are kept, and how a texture changes them
//! (KHR_texture_transform).
//!
//! A mesh keeps one set for all purposes. The base colour texture decides, since it is what most
//! renderers show; without it the next texture of the material in the order of the specification.
//! Without any texture it is `TEXCOORD_0`, unchanged. Where another kept texture needs another set,
//! that is kept with the materials.

use glam::DAffine2;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::gltf::extensions::TEXTURE_TRANSFORM;
use crate::gltf::file::GltfFile;
use crate::gltf::material::{Material, Textures, UsedTexture};
use crate::source::MALFORMED;

/// A set of texture coordinates and its transform.
#[derive(Clone, Default)]
pub(super) struct UvSet {
    /// The number n of `TEXCOORD_n`.
    pub(super) number: u32,
    /// `None` where coordinates stay as they are.
    transform: Option<UvTransform>,
}

/// KHR_texture_transform of a texture.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct TextureTransform {
    offset: [f64; 2],
    /// Radians, counter-clockwise in the image, whose second coordinate grows downwards.
    rotation: f64,
    scale: [f64; 2],
    /// Replaces the texture's own set of coordinates.
    tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

impl UvSet {
    /// Returns the set of a texture.
    pub(super) fn of(texture: &UsedTexture) -> serde_json::Result<Self> {
        let transform = match texture.extensions.get(TEXTURE_TRANSFORM) {
            Some(value) => TextureTransform::deserialize(value)?,
            None => TextureTransform::default(),
        };
        let number = transform.tex_coord.unwrap_or(texture.tex_coord);
        Ok(UvSet { number, transform: UvTransform::new(&transform) })
    }

    /// Returns the set that is kept for a material.
    pub(super) fn of_material(textures: &Textures) -> serde_json::Result<Self> {
        let pbr = textures.pbr_metallic_roughness.as_ref();
        let in_order = [
            pbr.and_then(|pbr| pbr.base_color_texture.as_ref()),
            pbr.and_then(|pbr| pbr.metallic_roughness_texture.as_ref()),
            textures.normal_texture.as_ref(),
            textures.occlusion_texture.as_ref(),
            textures.emissive_texture.as_ref(),
        ];
        in_order.into_iter().flatten().next().map_or(Ok(UvSet::default()), UvSet::of)
    }

    /// Returns the name of the attribute.
    pub(super) fn attribute(&self) -> String {
        format!("TEXCOORD_{}", self.number)
    }

    /// Transforms coordinates of the set in place.
    pub(super) fn apply(&self, uvs: &mut [[f32; 2]]) {
        if let Some(transform) = &self.transform {
            uvs.iter_mut().for_each(|uv| *uv = transform.apply(*uv));
        }
    }

    fn matrix(&self) -> DAffine2 {
        self.transform.as_ref().map_or(DAffine2::IDENTITY, UvTransform::matrix)
    }

    /// Returns the rows of the transform, if they are finite.
    pub(super) fn rows(&self) -> Option<[[f32; 3]; 2]> {
        rows(self.matrix())
    }

    /// Returns the rows of the transform from these coordinates, transformed, to another set's;
    /// `None` if there is no such transform.
    pub(super) fn relative(&self, other: &UvSet) -> Option<[[f32; 3]; 2]> {
        if other.number != self.number {
            return None;
        }
        rows(match other.transform == self.transform {
            true => DAffine2::IDENTITY,
            false => other.matrix() * self.matrix().inverse(),
        })
    }
}

/// Returns the rows of a transform, if they are finite.
fn rows(transform: DAffine2) -> Option<[[f32; 3]; 2]> {
    let [x, y, z] = transform.to_cols_array_2d();
    let rows = [0, 1].map(|k| [x[k], y[k], z[k]].map(|number| number as f32));
    rows.as_flattened().iter().all(|x| x.is_finite()).then_some(rows)
}

impl Material {
    /// Returns the number of the second set of texture coordinates: the set of the first kept
    /// texture that cannot use the first set.
    pub(super) fn second_set(&self) -> Option<u32> {
        let first = UvSet::of_material(&self.textures).ok()?;
        let is_lit = self.emissive_factor.is_some_and(|factor| factor != [0.0; 3]);
        let base = self.base().ok().and_then(|base| base.texture);
        let emissive = self.textures.emissive_texture.clone().filter(|_| is_lit);
        [base, emissive].into_iter().chain(self.gloss_textures()).flatten().find_map(|used| {
            let set = UvSet::of(&used).ok()?;
            (first.relative(&set).is_none() && set.rows().is_some()).then_some(set.number)
        })
    }
}

impl GltfFile<'_> {
    /// Returns the set of texture coordinates that is kept for a primitive of this material.
    ///
    /// # Errors
    /// `BTH-I002` where the material is malformed or does not exist.
    pub(super) fn kept_uvs(&self, material: Option<usize>) -> Result<UvSet> {
        let Some(index) = material else { return Ok(UvSet::default()) };
        let error = |message: String| -> Error {
            let hint =
                "export the model again, or compile without texture coordinates (--attributes normals)";
            self.source.error_in_part(MALFORMED, format!("material {index}"), message, hint)
        };
        let value =
            self.document.materials.get(index).ok_or_else(|| error("it does not exist".to_owned()))?;
        let set = Textures::deserialize(value).and_then(|textures| UvSet::of_material(&textures));
        set.map_err(|e| error(format!("expected a glTF material, found: {e}")))
    }
}

/// Scale, then rotation, then offset, in f64.
#[derive(Clone, PartialEq)]
struct UvTransform {
    /// Rows of the linear part.
    linear: [[f64; 2]; 2],
    offset: [f64; 2],
}

impl UvTransform {
    /// Returns `None` for the identity, which leaves the coordinates' bits alone.
    ///
    /// A positive angle turns coordinates counter-clockwise in the image, from +u to -v, because v
    /// grows downwards. So do three.js, Babylon.js and cesium-native; the shader in the extension's
    /// text has the other sign (KhronosGroup/glTF issue 1563).
    fn new(transform: &TextureTransform) -> Option<Self> {
        let TextureTransform { offset, rotation, scale: [su, sv], .. } = *transform;
        if offset == [0.0; 2] && rotation == 0.0 && [su, sv] == [1.0; 2] {
            return None;
        }
        let (sin, cos) = rotation.sin_cos();
        Some(UvTransform { linear: [[cos * su, sin * sv], [-sin * su, cos * sv]], offset })
    }

    fn matrix(&self) -> DAffine2 {
        let [[a, b], [c, d]] = self.linear;
        DAffine2::from_cols_array(&[a, c, b, d, self.offset[0], self.offset[1]])
    }

    fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        let [u, v] = uv.map(f64::from);
        [0, 1].map(|k| (self.linear[k][0] * u + self.linear[k][1] * v + self.offset[k]) as f32)
    }
}
