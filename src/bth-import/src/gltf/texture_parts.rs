//! Textures, samplers and images of a document, and the materials that refer to them (glTF 2.0 specification, §3.8).
//!
//! These parts are read for cut-outs and materials only, so that a document in which they are malformed is imported without them.

use std::borrow::Cow;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, from_slice};

use crate::cutout::Wrap;
use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::container::split;
use crate::gltf::schema::Extensions;
use crate::gltf::uri::{beside, decode_base64, refusal};
use crate::image_file;
use crate::source::{IMAGE, MALFORMED, MALFORMED_HINT, Source};

/// Gives a texture a WebP image in the place of its own.
const WEBP: &str = "EXT_texture_webp";

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
    pub(super) materials: Vec<Value>,
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

/// A texture with its sampler.
pub(super) struct SampledTexture {
    /// Number of its image; `None` where it has none in a format that is read.
    pub(super) image: Option<usize>,
    pub(super) wrap: [Wrap; 2],
    /// Whether the nearest texel is taken.
    pub(super) nearest: bool,
}

impl TextureParts {
    /// The parts of a document.
    pub(super) fn of(source: &Source<'_>) -> Result<Self> {
        from_slice(split(source)?.0).map_err(|e| {
            let message = format!("expected a glTF document, found: {e}");
            source.error_in_part(MALFORMED, "JSON", message, MALFORMED_HINT)
        })
    }

    /// The file beside the document that the image of a texture is in. `None` for what is malformed, which reading it reports.
    pub(super) fn file(&self, texture: usize) -> Option<String> {
        let texture = Texture::deserialize(self.textures.get(texture)?).ok()?;
        let image = Image::deserialize(self.images.get(source_of(&texture)?)?).ok()?;
        image.uri.filter(|uri| !uri.starts_with("data:"))
    }
}

/// The image of a texture, if it is in a format that is read.
fn source_of(texture: &Texture) -> Option<usize> {
    let webp = texture.extensions.get(WEBP).and_then(|value| WebpTexture::deserialize(value).ok());
    webp.map(|extension| extension.source).or(texture.source)
}

/// How to compile where images are missing.
pub(super) const LENIENT: &str = "with --lenient-materials";

/// Reads textures, and names in errors how to do without them.
pub(super) struct TextureReader<'m, 'a> {
    pub(super) accessors: &'m Accessors<'a>,
    pub(super) parts: &'m TextureParts,
    /// How to compile without what is read, such as `without cut-outs (--alpha none)`.
    pub(super) without: &'static str,
}

impl TextureReader<'_, '_> {
    /// A texture and its sampler.
    ///
    /// # Errors
    /// `BTH-I002` where they do not exist or are malformed.
    pub(super) fn texture(&self, index: usize) -> Result<SampledTexture> {
        let name = format!("texture {index}");
        let texture: Texture = self.part(&self.parts.textures, index, &name)?;
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
        let nearest = sampler.mag_filter == Some(NEAREST);
        Ok(SampledTexture { image: source_of(&texture), wrap: [s, t], nearest })
    }

    /// The bytes of an image file.
    ///
    /// # Errors
    /// `BTH-I002` where it does not exist or is malformed, `BTH-I014` and `BTH-I016` where its bytes cannot be found or read,
    /// `BTH-L003` where its file is too large.
    pub(super) fn image(&self, index: usize) -> Result<Cow<'_, [u8]>> {
        let part = format!("image {index}");
        let image: Image = self.part(&self.parts.images, index, &part)?;
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                let bytes = uri.split_once(";base64,").and_then(|(_, text)| decode_base64(text.as_bytes()));
                let missing = || self.unreadable(&part, "expected base64 in its data: URI".to_owned());
                Ok(Cow::Owned(bytes.ok_or_else(missing)?))
            }
            (Some(uri), _) => self.file(&part, uri).map(Cow::Owned),
            (None, Some(view)) => Ok(Cow::Borrowed(self.accessors.buffers.view(view)?.0)),
            (None, None) => Err(self.unreadable(&part, "it has neither a uri nor a buffer view".to_owned())),
        }
    }

    fn file(&self, part: &str, uri: &str) -> Result<Vec<u8>> {
        let Some(path) = beside(self.accessors.source.path, uri) else {
            let (message, hint) = refusal(uri);
            let hint = format!("{hint}, or compile {LENIENT} or {}", self.without);
            return Err(self.accessors.source.error_in_part(IMAGE, part, message, &hint));
        };
        image_file::read(&path).map_err(|e| match e {
            Error::File { message, path, .. } => {
                let hint = format!("put the image there, or compile {LENIENT} or {}", self.without);
                let message = format!("expected the image {}: {message}", path.display());
                self.accessors.source.error_in_part(IMAGE, part, message, &hint)
            }
            other => other,
        })
    }

    /// A row of a list of the document, parsed.
    pub(super) fn part<T: DeserializeOwned>(&self, list: &[Value], index: usize, part: &str) -> Result<T> {
        let value = list.get(index).ok_or_else(|| self.malformed(part, "it does not exist".to_owned()))?;
        T::deserialize(value)
            .map_err(|e| self.malformed(part, format!("expected what glTF defines, found: {e}")))
    }

    pub(super) fn malformed(&self, part: &str, message: String) -> Error {
        let hint = format!("export the model again, or compile {}", self.without);
        self.accessors.source.error_in_part(MALFORMED, part, message, &hint)
    }

    pub(super) fn unreadable(&self, part: &str, message: String) -> Error {
        let hint = format!("save the image as PNG, JPEG or WebP, or compile {LENIENT} or {}", self.without);
        self.accessors.source.error_in_part(IMAGE, part, message, &hint)
    }
}
