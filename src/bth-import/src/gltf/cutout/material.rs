//! Materials with alpha modes MASK and BLEND, and the textures, samplers and images that they refer to (glTF 2.0
//! specification, §3.8 and §3.9.4).
//!
//! These parts are read for cut-outs only, so that a document whose materials are malformed is imported without them.

use std::collections::HashMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::image::{self, ImageError, MAX_TEXELS};
use crate::cutout::{AlphaImage, AlphaMode, CutoutMaterial, Wrap};
use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::schema::Extensions;
use crate::gltf::uri::{beside, decode_base64, read_at_most};
use crate::source::MALFORMED;

/// A code for a texture or image that cannot be read.
const IMAGE: &str = "BTH-I016";

/// Gives a texture a WebP image in the place of its own.
const WEBP: &str = "EXT_texture_webp";

/// Greatest number of bytes of an image file.
const MAX_FILE: u64 = 1 << 28;

/// Filters of samplers (§5.26) that take the nearest texel of an image. Minification is not looked at: whether there is a
/// surface must not depend on the distance.
const NEAREST: u64 = 9728;

/// The parts of a document that textures are made of, each parsed when it is used.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureParts {
    textures: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    materials: Vec<Value>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct AlphaMaterial {
    alpha_mode: Option<String>,
    alpha_cutoff: Option<f64>,
    pbr_metallic_roughness: BaseColor,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct BaseColor {
    base_color_factor: Option<[f64; 4]>,
    base_color_texture: Option<IndexedTexture>,
}

#[derive(Deserialize)]
struct IndexedTexture {
    index: usize,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Texture {
    sampler: Option<usize>,
    source: Option<usize>,
    extensions: Extensions,
}

/// EXT_texture_webp of a texture.
#[derive(Deserialize)]
struct WebpTexture {
    source: usize,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct Sampler {
    mag_filter: Option<u64>,
    wrap_s: Option<u64>,
    wrap_t: Option<u64>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct Image {
    uri: Option<String>,
    buffer_view: Option<usize>,
}

impl TextureParts {
    /// Whether the alpha of a material makes holes, and its cutoff.
    fn cutoff(&self, material: &AlphaMaterial, mode: AlphaMode) -> Option<f64> {
        match (material.alpha_mode.as_deref()?, mode) {
            ("MASK", AlphaMode::Mask | AlphaMode::Blend) => Some(material.alpha_cutoff.unwrap_or(0.5)),
            ("BLEND", AlphaMode::Blend) => Some(0.5),
            _ => None,
        }
    }

    /// The files beside the document that images of cut-out materials are in, in order of the materials. What is malformed
    /// is left out; reading it reports an error.
    pub(super) fn files(&self, mode: AlphaMode) -> Vec<String> {
        let mut uris = Vec::new();
        for material in self.materials.iter().filter_map(|value| AlphaMaterial::deserialize(value).ok()) {
            let uri = || {
                self.cutoff(&material, mode)?;
                let texture = self.textures.get(material.pbr_metallic_roughness.base_color_texture?.index)?;
                let texture = Texture::deserialize(texture).ok()?;
                let image = Image::deserialize(self.images.get(source_of(&texture)?)?).ok()?;
                image.uri.filter(|uri| !uri.starts_with("data:"))
            };
            uris.extend(uri().filter(|uri| !uris.contains(uri)));
        }
        uris
    }
}

/// The image of a texture, if it is in a format that is read.
fn source_of(texture: &Texture) -> Option<usize> {
    let webp = texture.extensions.get(WEBP).and_then(|value| WebpTexture::deserialize(value).ok());
    webp.map(|extension| extension.source).or(texture.source)
}

/// Reads the cut-out materials of a document, each when it is first used.
pub(super) struct Materials<'m, 'a> {
    accessors: &'m Accessors<'a>,
    parts: TextureParts,
    mode: AlphaMode,
    /// Rows of `read` by the document's materials; `None` for materials without holes.
    rows: HashMap<usize, Option<usize>>,
    /// Rows of `images` by the document's images; `None` for images without alpha.
    image_rows: HashMap<usize, Option<usize>>,
    pub(super) read: Vec<CutoutMaterial>,
    pub(super) images: Vec<AlphaImage>,
}

impl<'m, 'a> Materials<'m, 'a> {
    pub(super) fn new(accessors: &'m Accessors<'a>, parts: TextureParts, mode: AlphaMode) -> Self {
        let (rows, image_rows) = (HashMap::new(), HashMap::new());
        Materials { accessors, parts, mode, rows, image_rows, read: Vec::new(), images: Vec::new() }
    }

    /// The row of a material of the document; `None` where its alpha makes no holes.
    ///
    /// # Errors
    /// `BTH-I002` for a malformed material, `BTH-I014` and `BTH-I016` for a texture that cannot be read, `BTH-L003` for one
    /// that is too large.
    pub(super) fn row(&mut self, index: usize) -> Result<Option<usize>> {
        if let Some(known) = self.rows.get(&index) {
            return Ok(*known);
        }
        let part = format!("material {index}");
        let material: AlphaMaterial = self.part(&self.parts.materials, index, &part)?;
        let row = match self.parts.cutoff(&material, self.mode) {
            Some(cutoff) => {
                let read = self.cutout(&material, cutoff, &part)?;
                self.read.push(read);
                Some(self.read.len() - 1)
            }
            None => None,
        };
        self.rows.insert(index, row);
        Ok(row)
    }

    fn cutout(&mut self, material: &AlphaMaterial, cutoff: f64, part: &str) -> Result<CutoutMaterial> {
        let base = &material.pbr_metallic_roughness;
        let factor = base.base_color_factor.map_or(1.0, |factor| factor[3]);
        let is_valid = (0.0..=1.0).contains(&factor) && cutoff >= 0.0 && cutoff.is_finite();
        if !is_valid {
            let message = format!(
                "expected an alpha factor from 0 to 1 and a cutoff from 0, found {factor} and {cutoff}"
            );
            return Err(self.malformed(part, message));
        }
        let plain = CutoutMaterial { image: None, wrap: [Wrap::Repeat; 2], nearest: false, factor, cutoff };
        let Some(reference) = &base.base_color_texture else { return Ok(plain) };
        let name = format!("texture {}", reference.index);
        let texture: Texture = self.part(&self.parts.textures, reference.index, &name)?;
        let sampler: Sampler = match texture.sampler {
            Some(sampler) => self.part(&self.parts.samplers, sampler, &format!("sampler {sampler}"))?,
            None => Sampler::default(),
        };
        let wrap = |code: Option<u64>| match code {
            None | Some(10497) => Some(Wrap::Repeat),
            Some(33648) => Some(Wrap::Mirror),
            Some(33071) => Some(Wrap::Clamp),
            Some(_) => None,
        };
        let (Some(s), Some(t)) = (wrap(sampler.wrap_s), wrap(sampler.wrap_t)) else {
            return Err(self.malformed(&name, "expected wrap modes of glTF".to_owned()));
        };
        let Some(source) = source_of(&texture) else {
            return Err(self.unreadable(&name, "expected a PNG, JPEG or WebP image, found none".to_owned()));
        };
        let nearest = sampler.mag_filter == Some(NEAREST);
        Ok(CutoutMaterial { image: self.image(source)?, wrap: [s, t], nearest, ..plain })
    }

    /// The row of an image of the document; `None` where its alpha is 1 everywhere.
    fn image(&mut self, index: usize) -> Result<Option<usize>> {
        if let Some(known) = self.image_rows.get(&index) {
            return Ok(*known);
        }
        let part = format!("image {index}");
        let image: Image = self.part(&self.parts.images, index, &part)?;
        let decoded = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                let bytes = uri.split_once(";base64,").and_then(|(_, text)| decode_base64(text.as_bytes()));
                let bytes = bytes
                    .ok_or_else(|| self.unreadable(&part, "expected base64 in its data: URI".to_owned()))?;
                image::decode(&bytes)
            }
            (Some(uri), _) => image::decode(&self.file(&part, uri)?),
            (None, Some(view)) => image::decode(self.accessors.buffers.view(view)?.0),
            (None, None) => {
                return Err(self.unreadable(&part, "it has neither a uri nor a buffer view".to_owned()));
            }
        };
        let decoded = decoded.map_err(|e| match e {
            ImageError::Malformed(message) => self.unreadable(&part, message),
            ImageError::TooLarge(texels) => Error::Limit {
                code: "BTH-L003",
                message: format!("{part} has {texels} texels; up to {MAX_TEXELS} are read"),
            },
        })?;
        let row = decoded.map(|image| {
            self.images.push(image);
            self.images.len() - 1
        });
        self.image_rows.insert(index, row);
        Ok(row)
    }

    fn file(&self, part: &str, uri: &str) -> Result<Vec<u8>> {
        let Some(path) = beside(self.accessors.source.path, uri) else {
            let message = format!("expected a relative file name or a data: URI, found \"{uri}\"");
            return Err(self.unreadable(part, message));
        };
        read_at_most(&path, MAX_FILE)
    }

    /// A row of a list of the document, parsed.
    fn part<T: DeserializeOwned>(&self, list: &[Value], index: usize, part: &str) -> Result<T> {
        let value = list.get(index).ok_or_else(|| self.malformed(part, "it does not exist".to_owned()))?;
        T::deserialize(value)
            .map_err(|e| self.malformed(part, format!("expected what glTF defines, found: {e}")))
    }

    fn malformed(&self, part: &str, message: String) -> Error {
        let hint = "export the model again, or compile without cut-outs (--alpha none)";
        self.accessors.source.error_in_part(MALFORMED, part, message, hint)
    }

    fn unreadable(&self, part: &str, message: String) -> Error {
        let hint = "save the image as PNG or WebP, or compile without cut-outs (--alpha none)";
        self.accessors.source.error_in_part(IMAGE, part, message, hint)
    }

    /// Whether the texture coordinates of a material decide about its alpha.
    pub(super) fn needs_uvs(&self, row: usize) -> bool {
        self.read[row].image.is_some()
    }
}
