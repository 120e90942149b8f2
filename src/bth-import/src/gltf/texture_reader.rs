//! Reads materials and their textures, samplers and images (glTF 2.0 specification, §3.8), for
//! cut-outs and materials only: a document in which they are malformed is imported without them.

use std::borrow::Cow;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::cutout::Wrap;
use crate::error::{Error, Result};
use crate::gltf::file::GltfFile;
use crate::gltf::material::{BaseColor, Material, SPECULAR_GLOSSINESS};
use crate::gltf::schema::{Extensions, GltfDocument};
use crate::gltf::uri::{beside, decode_data, refusal};
use crate::image_file::{self, Refused};
use crate::source::{IMAGE, MALFORMED};

/// Replaces the image of a texture by a WebP image.
const WEBP: &str = "EXT_texture_webp";
/// The filter of samplers (§5.26) that takes the nearest texel. Minification is not looked at:
/// whether there is a surface must not depend on the distance.
const NEAREST: u64 = 9728;
/// How to compile where images are missing.
const LENIENT: &str = "with --lenient-materials";

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
struct TextureSampler {
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

/// A texture with its sampler.
pub(super) struct SampledTexture {
    /// Number of its image; `None` where it has none in a format that is read.
    pub(super) image: Option<usize>,
    pub(super) wrap: [Wrap; 2],
    /// True if the nearest texel is taken.
    pub(super) nearest: bool,
}

impl Texture {
    /// Returns the number of its image, if that is in a format that is read.
    fn image(&self) -> Option<usize> {
        let webp = self.extensions.get(WEBP).and_then(|value| WebpTexture::deserialize(value).ok());
        webp.map(|extension| extension.source).or(self.source)
    }
}

impl GltfDocument {
    /// Returns the materials that are well-formed.
    pub(super) fn well_formed_materials(&self) -> impl Iterator<Item = Material> {
        self.materials.iter().filter_map(|value| Material::deserialize(value).ok())
    }

    /// Returns the URI of the file that the image of a texture is in. `None` for what is malformed,
    /// which reading it reports.
    pub(super) fn texture_file(&self, texture: usize) -> Option<String> {
        let texture = Texture::deserialize(self.textures.get(texture)?).ok()?;
        let image = Image::deserialize(self.images.get(texture.image()?)?).ok()?;
        image.uri.filter(|uri| !uri.starts_with("data:"))
    }
}

/// Reads textures, and names in errors how to do without them.
pub(super) struct TextureReader<'m, 'a> {
    pub(super) file: &'m GltfFile<'a>,
    /// How to compile without what is read, such as `without cut-outs (--alpha none)`.
    pub(super) without: &'static str,
}

impl TextureReader<'_, '_> {
    /// Reads a material and its base colour.
    ///
    /// # Errors
    /// `BTH-I002` where it does not exist or is malformed.
    pub(super) fn material(&self, index: usize) -> Result<(Material, BaseColor)> {
        let part = format!("material {index}");
        let material: Material = self.part(self.file.document.materials.get(index), &part)?;
        let base = material.base().map_err(|e| match material.textures.pbr_metallic_roughness {
            None => self.malformed(&part, format!("expected what {SPECULAR_GLOSSINESS} defines, found: {e}")),
            Some(_) => self.malformed(&part, format!("expected what glTF defines, found: {e}")),
        })?;
        Ok((material, base))
    }

    /// Reads a texture and its sampler.
    ///
    /// # Errors
    /// `BTH-I002` where they do not exist or are malformed.
    pub(super) fn texture(&self, index: usize) -> Result<SampledTexture> {
        let name = format!("texture {index}");
        let document = &self.file.document;
        let texture: Texture = self.part(document.textures.get(index), &name)?;
        let sampler: TextureSampler = match texture.sampler {
            Some(sampler) => self.part(document.samplers.get(sampler), &format!("sampler {sampler}"))?,
            None => TextureSampler::default(),
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
        let nearest = sampler.mag_filter == Some(NEAREST);
        Ok(SampledTexture { image: texture.image(), wrap: [s, t], nearest })
    }

    /// Reads the bytes of an image file and decodes or checks them.
    ///
    /// # Errors
    /// `BTH-I002` where it does not exist or is malformed, `BTH-I014` and `BTH-I016` where its
    /// bytes cannot be found or read, `BTH-L003` where it is too large.
    pub(super) fn image<T>(
        &self,
        index: usize,
        decode: impl FnOnce(Cow<'_, [u8]>) -> std::result::Result<T, Refused>,
    ) -> Result<T> {
        let part = format!("image {index}");
        let image: Image = self.part(self.file.document.images.get(index), &part)?;
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                let missing = || self.unreadable(&part, "expected base64 in its data: URI".to_owned());
                Cow::Owned(decode_data(uri).ok_or_else(missing)?)
            }
            (Some(uri), _) => Cow::Owned(self.image_file(&part, uri)?),
            (None, Some(view)) => Cow::Borrowed(self.file.view(view)?.0),
            (None, None) => {
                return Err(self.unreadable(&part, "it has neither a uri nor a buffer view".to_owned()));
            }
        };
        decode(bytes).map_err(|refused| match refused {
            Refused::Malformed(message) => self.unreadable(&part, message),
            Refused::TooLarge(texels) => image_file::too_large(part, texels),
        })
    }

    fn image_file(&self, part: &str, uri: &str) -> Result<Vec<u8>> {
        let error = |message: String, hint: &str| {
            let hint = format!("{hint}, or compile {LENIENT} or {}", self.without);
            self.file.source.error_in_part(IMAGE, part, message, &hint)
        };
        let Some(path) = beside(self.file.source.path, uri) else {
            let (message, hint) = refusal(uri);
            return Err(error(message, hint));
        };
        image_file::read(&path).map_err(|e| match e {
            Error::File { message, path, .. } => {
                let message = format!("expected the image {}: {message}", path.display());
                error(message, "put the image there")
            }
            other => other,
        })
    }

    /// Parses a part of the document.
    fn part<T: DeserializeOwned>(&self, value: Option<&Value>, part: &str) -> Result<T> {
        let value = value.ok_or_else(|| self.malformed(part, "it does not exist".to_owned()))?;
        T::deserialize(value)
            .map_err(|e| self.malformed(part, format!("expected what glTF defines, found: {e}")))
    }

    pub(super) fn malformed(&self, part: &str, message: String) -> Error {
        let hint = format!("export the model again, or compile {}", self.without);
        self.file.source.error_in_part(MALFORMED, part, message, &hint)
    }

    pub(super) fn unreadable(&self, part: &str, message: String) -> Error {
        let hint = format!("save the image as PNG, JPEG or WebP, or compile {LENIENT} or {}", self.without);
        self.file.source.error_in_part(IMAGE, part, message, &hint)
    }
}
