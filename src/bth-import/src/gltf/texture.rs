//! Which texture coordinates of a primitive are kept, and how a texture changes them (KHR_texture_transform).
//!
//! A mesh keeps one set for all purposes. The base colour texture decides, since it is what most renderers show; where a material has none,
//! the next of its textures in the order of the specification does. Without any texture it is `TEXCOORD_0`, unchanged. Where
//! another texture that a file keeps needs another set, that is kept beside it, with the materials.

use glam::DAffine2;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::gltf::extensions::TEXTURE_TRANSFORM;
use crate::gltf::schema::{GltfDocument, Material, Primitive, TextureReference, TextureTransform};
use crate::source::{MALFORMED, Source};

/// A set of texture coordinates and its transform.
#[derive(Clone)]
pub(super) struct TextureCoordinates {
    /// Name of the attribute, such as `TEXCOORD_0`.
    pub(super) attribute: String,
    /// `None` where coordinates stay as they are.
    transform: Option<UvTransform>,
}

impl TextureCoordinates {
    /// Those that a primitive's material samples its deciding texture with.
    ///
    /// # Errors
    /// `BTH-I002` where the material is malformed or does not exist.
    pub(super) fn of(source: &Source<'_>, document: &GltfDocument, primitive: &Primitive) -> Result<Self> {
        let plain = TextureCoordinates { attribute: "TEXCOORD_0".to_owned(), transform: None };
        let Some(index) = primitive.material else { return Ok(plain) };
        let part = format!("material {index}");
        let Some(value) = document.materials.get(index) else {
            return Err(error(source, &part, "it does not exist".to_owned()));
        };
        let parsed =
            |e: serde_json::Error| error(source, &part, format!("expected a glTF material, found: {e}"));
        let material = Material::deserialize(value).map_err(parsed)?;
        let Some(texture) = deciding_texture(&material) else { return Ok(plain) };
        Self::of_texture(texture).map_err(parsed)
    }

    /// Those of one texture of a material.
    pub(super) fn of_texture(texture: &TextureReference) -> serde_json::Result<Self> {
        let (set, transform) = set_of(texture)?;
        Ok(TextureCoordinates { attribute: format!("TEXCOORD_{set}"), transform })
    }

    /// Transforms the kept coordinates in place.
    pub(super) fn apply(&self, uvs: &mut [[f32; 2]]) {
        if let Some(transform) = &self.transform {
            uvs.iter_mut().for_each(|uv| *uv = transform.apply(*uv));
        }
    }
}

fn deciding_texture(material: &Material) -> Option<&TextureReference> {
    let pbr = &material.pbr_metallic_roughness;
    [
        &pbr.base_color_texture,
        &pbr.metallic_roughness_texture,
        &material.normal_texture,
        &material.occlusion_texture,
        &material.emissive_texture,
    ]
    .into_iter()
    .find_map(Option::as_ref)
}

/// The set of texture coordinates of a material that is kept, and the transform that is applied to it.
pub(super) struct KeptSet {
    set: u32,
    transform: Option<UvTransform>,
}

/// The set that is kept for a material.
pub(super) fn kept_set(material: &serde_json::Value) -> serde_json::Result<KeptSet> {
    let material = Material::deserialize(material)?;
    match deciding_texture(&material) {
        None => Ok(KeptSet { set: 0, transform: None }),
        Some(texture) => {
            let (set, transform) = set_of(texture)?;
            Ok(KeptSet { set, transform })
        }
    }
}

/// The set of a texture's coordinates and their transform.
fn set_of(texture: &TextureReference) -> serde_json::Result<(u32, Option<UvTransform>)> {
    let transform = match texture.extensions.get(TEXTURE_TRANSFORM) {
        Some(value) => TextureTransform::deserialize(value)?,
        None => TextureTransform::default(),
    };
    Ok((transform.tex_coord.unwrap_or(texture.tex_coord), UvTransform::new(&transform)))
}

/// The set of a texture's coordinates, and the rows of their transform.
pub(super) fn own_set(texture: &TextureReference) -> serde_json::Result<(u32, Option<[[f32; 3]; 2]>)> {
    let (set, transform) = set_of(texture)?;
    Ok((set, rows(transform.as_ref().map_or(DAffine2::IDENTITY, UvTransform::matrix))))
}

/// The rows of a transform, if they are finite.
fn rows(transform: DAffine2) -> Option<[[f32; 3]; 2]> {
    let [x, y, z] = transform.to_cols_array_2d();
    let rows = [0, 1].map(|k| [x[k], y[k], z[k]].map(|number| number as f32));
    rows.as_flattened().iter().all(|x| x.is_finite()).then_some(rows)
}

impl KeptSet {
    /// Rows of the transform from kept coordinates to those of a texture; `None` where they cannot be had from them.
    pub(super) fn relative(&self, texture: &TextureReference) -> serde_json::Result<Option<[[f32; 3]; 2]>> {
        let (set, transform) = set_of(texture)?;
        let matrix = |t: &Option<UvTransform>| t.as_ref().map_or(DAffine2::IDENTITY, UvTransform::matrix);
        if set != self.set {
            return Ok(None);
        }
        let relative = match transform == self.transform {
            true => DAffine2::IDENTITY,
            false => matrix(&transform) * matrix(&self.transform).inverse(),
        };
        Ok(rows(relative))
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
    /// `None` for the identity, which leaves the coordinates' bits alone.
    ///
    /// A positive angle turns coordinates counter-clockwise in the image, that is from +u to -v, because v grows downwards.
    /// So do three.js, Babylon.js and cesium-native; the shader in the extension's text has the other sign
    /// (KhronosGroup/glTF issue 1563).
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

fn error(source: &Source<'_>, part: &str, message: String) -> Error {
    let hint = "export the model again, or compile without texture coordinates (--attributes normals)";
    source.error_in_part(MALFORMED, part, message, hint)
}
