//! Materials with alpha modes MASK and BLEND, and the textures, samplers and images that they refer to (glTF 2.0
//! specification, §3.8 and §3.9.4).
//!
//! These parts are read for cut-outs only, so that a document whose materials are malformed is imported without them.

use std::collections::HashMap;

use serde::Deserialize;

use super::image::{self, ImageError, MAX_TEXELS};
use crate::cutout::{AlphaImage, AlphaMode, CutoutMaterial, Wrap};
use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::base_color::{BaseColor, SPECULAR_GLOSSINESS, base_color};
use crate::gltf::materials::ALPHA_MODES;
use crate::gltf::schema::Extensions;
use crate::gltf::texture::TextureCoordinates;
use crate::gltf::texture_parts::{TextureParts, TextureReader};
use crate::materials::Looks;
use crate::number::shown;

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct AlphaMaterial {
    alpha_mode: Option<String>,
    alpha_cutoff: Option<f64>,
    pbr_metallic_roughness: Option<BaseColor>,
    extensions: Extensions,
}

impl AlphaMaterial {
    fn base(&self) -> serde_json::Result<BaseColor> {
        base_color(self.pbr_metallic_roughness.as_ref(), &self.extensions)
    }
}

/// Whether the alpha of a material makes holes, and its cutoff.
fn cutoff(material: &AlphaMaterial, mode: AlphaMode) -> Option<f64> {
    match (material.alpha_mode.as_deref()?, mode) {
        ("MASK", AlphaMode::Mask | AlphaMode::Blend) => Some(material.alpha_cutoff.unwrap_or(0.5)),
        ("BLEND", AlphaMode::Blend) => Some(0.5),
        _ => None,
    }
}

/// The files beside the document that images of cut-out materials are in, in order of the materials. What is malformed
/// is left out; reading it reports an error.
pub(super) fn files(parts: &TextureParts, mode: AlphaMode) -> Vec<String> {
    let mut uris = Vec::new();
    for material in parts.materials.iter().filter_map(|value| AlphaMaterial::deserialize(value).ok()) {
        let uri = || {
            cutoff(&material, mode)?;
            parts.file(material.base().ok()?.base_color_texture?.index)
        };
        uris.extend(uri().filter(|uri| !uris.contains(uri)));
    }
    uris
}

/// Reads the cut-out materials of a document, each when it is first used.
pub(super) struct Materials<'m, 'a> {
    reader: TextureReader<'m, 'a>,
    looks: Looks,
    /// Rows of `read` by the document's materials; `None` for materials without holes.
    rows: HashMap<usize, Option<usize>>,
    /// Rows of `images` by the document's images; `None` for images without alpha.
    image_rows: HashMap<usize, Option<usize>>,
    pub(super) read: Vec<CutoutMaterial>,
    /// For each row of `read` the coordinates of its texture; `None` without one.
    coordinates: Vec<Option<TextureCoordinates>>,
    pub(super) images: Vec<AlphaImage>,
}

impl<'m, 'a> Materials<'m, 'a> {
    pub(super) fn new(accessors: &'m Accessors<'a>, parts: &'m TextureParts, looks: Looks) -> Self {
        let (rows, image_rows) = (HashMap::new(), HashMap::new());
        let reader = TextureReader { accessors, parts, without: "without cut-outs (--alpha none)" };
        let (read, coordinates, images) = (Vec::new(), Vec::new(), Vec::new());
        Materials { reader, looks, rows, image_rows, read, coordinates, images }
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
        let material: AlphaMaterial = self.reader.part(&self.reader.parts.materials, index, &part)?;
        if let Some(mode) = material.alpha_mode.as_deref().filter(|mode| !ALPHA_MODES.contains(mode)) {
            let expected = ALPHA_MODES.join(", ");
            let message = format!(
                "{part}: expected an alphaMode of {expected}, found \"{}\"; it has no holes",
                shown(mode.as_bytes())
            );
            self.reader.accessors.source.monitor.warn(&message);
        }
        let row = match cutoff(&material, self.looks.alpha) {
            Some(cutoff) => {
                let (read, coordinates) = self.cutout(&material, cutoff, &part)?;
                self.read.push(read);
                self.coordinates.push(coordinates);
                Some(self.read.len() - 1)
            }
            None => None,
        };
        self.rows.insert(index, row);
        Ok(row)
    }

    fn cutout(
        &mut self,
        material: &AlphaMaterial,
        cutoff: f64,
        part: &str,
    ) -> Result<(CutoutMaterial, Option<TextureCoordinates>)> {
        let base = material.base().map_err(|e| {
            self.reader.malformed(part, format!("expected what {SPECULAR_GLOSSINESS} defines, found: {e}"))
        })?;
        let factor = base.base_color_factor.map_or(1.0, |factor| factor[3]);
        let is_valid = (0.0..=1.0).contains(&factor) && cutoff >= 0.0 && cutoff.is_finite();
        if !is_valid {
            let message = format!(
                "expected an alpha factor from 0 to 1 and a cutoff from 0, found {factor} and {cutoff}"
            );
            return Err(self.reader.malformed(part, message));
        }
        let plain = CutoutMaterial { image: None, wrap: [Wrap::Repeat; 2], nearest: false, factor, cutoff };
        let Some(used) = &base.base_color_texture else { return Ok((plain, None)) };
        let coordinates = TextureCoordinates::of_texture(&used.reference)
            .map_err(|e| self.reader.malformed(part, format!("expected a texture, found: {e}")))?;
        let texture = self.reader.texture(used.index)?;
        let Some(source) = texture.image else {
            let name = format!("texture {}", used.index);
            let message = "expected a PNG, JPEG or WebP image, found none";
            let refused = Err(self.reader.unreadable(&name, message.to_owned()));
            self.looks.unreadable.check::<()>(refused, self.reader.accessors.source.monitor)?;
            return Ok((plain, None));
        };
        let image = self.image(source)?;
        let read = CutoutMaterial { image, wrap: texture.wrap, nearest: texture.nearest, ..plain };
        Ok((read, Some(coordinates)))
    }

    /// The row of an image of the document; `None` where its alpha is 1 everywhere, and where it is left out.
    fn image(&mut self, index: usize) -> Result<Option<usize>> {
        if let Some(known) = self.image_rows.get(&index) {
            return Ok(*known);
        }
        let monitor = self.reader.accessors.source.monitor;
        let decoded = self.looks.unreadable.check(self.decoded(index), monitor)?.flatten();
        let row = decoded.map(|image| {
            self.images.push(image);
            self.images.len() - 1
        });
        self.image_rows.insert(index, row);
        Ok(row)
    }

    /// The alpha of an image of the document; `None` where it is 1 everywhere.
    fn decoded(&self, index: usize) -> Result<Option<AlphaImage>> {
        let part = format!("image {index}");
        image::decode(&self.reader.image(index)?).map_err(|e| match e {
            ImageError::Malformed(message) => self.reader.unreadable(&part, message),
            ImageError::TooLarge(texels) => Error::Limit {
                code: "BTH-L003",
                message: format!("{part} has {texels} texels; up to {MAX_TEXELS} are read"),
            },
        })
    }

    /// The coordinates of the texture of a row; `None` without one.
    pub(super) fn coordinates(&self, row: usize) -> Option<&TextureCoordinates> {
        self.coordinates[row].as_ref()
    }

    /// Whether the texture coordinates of a material decide about its alpha.
    pub(super) fn needs_uvs(&self, row: usize) -> bool {
        self.read[row].image.is_some()
    }
}
