//! How the materials of a document look: base colour, emission, alpha and sidedness, with their textures (glTF 2.0 specification,
//! §3.9), and what of them is left out.

use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeSet, HashMap};

use bth_format::layout::*;
use serde::Deserialize;
use serde_json::{Value, from_slice};

use crate::cutout::Wrap;
use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::base_color::{BaseColor, SPECULAR_GLOSSINESS, UsedTexture, base_color};
use crate::gltf::buffer::Buffers;
use crate::gltf::document;
use crate::gltf::extensions::{SCENE_EXTENSIONS, SUPPORTED};
use crate::gltf::schema::{Extensions, TextureReference};
use crate::gltf::texture::{self, KeptSet};
use crate::gltf::texture_parts::{TextureParts, TextureReader};
use crate::image_file::{self, MAX_TEXELS, Refused};
use crate::materials::{ImageFile, MaterialRecorder, Unreadable};
use crate::number::shown;
use crate::source::Source;

/// How to do without what is read here, in errors.
const WITHOUT: &str = "without --materials";
/// Materials without light; the factor of emission.
const UNLIT: &str = "KHR_materials_unlit";
const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";

/// The alpha modes of materials; others count as the first.
pub(super) const ALPHA_MODES: [&str; 3] = ["OPAQUE", "MASK", "BLEND"];

/// What is read of a material.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct SurfaceMaterial {
    alpha_mode: Option<String>,
    alpha_cutoff: Option<f64>,
    double_sided: bool,
    pbr_metallic_roughness: Option<BaseColor>,
    emissive_factor: Option<[f64; 3]>,
    emissive_texture: Option<UsedTexture>,
    normal_texture: Option<Value>,
    occlusion_texture: Option<Value>,
    extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct EmissiveStrength {
    emissive_strength: Option<f64>,
}

impl SurfaceMaterial {
    /// Base colour and its texture: those of the older model where the material has nothing else.
    fn base(&self, reader: &TextureReader<'_, '_>, part: &str) -> Result<BaseColor> {
        base_color(self.pbr_metallic_roughness.as_ref(), &self.extensions).map_err(|e| {
            reader.malformed(part, format!("expected what {SPECULAR_GLOSSINESS} defines, found: {e}"))
        })
    }

    /// Names of what it has and no file keeps.
    fn left_out(&self, base: &BaseColor) -> impl Iterator<Item = String> {
        let textures = [
            (base.metallic_roughness_texture.is_some(), "metallic-roughness textures"),
            (self.normal_texture.is_some(), "normal textures"),
            (self.occlusion_texture.is_some(), "occlusion textures"),
        ];
        let textures = textures.into_iter().filter(|(there, _)| *there).map(|(_, name)| name.to_owned());
        let known = [UNLIT, EMISSIVE_STRENGTH, SPECULAR_GLOSSINESS];
        let others = self.extensions.keys().filter(move |name| !known.contains(&name.as_str()));
        textures.chain(others.cloned().collect::<Vec<_>>())
    }
}

/// What the meshes of a document share while their materials are read.
#[derive(Default)]
pub(crate) struct SharedMaterials {
    /// Names of the document's images that were read; `None` for those that are left out.
    images: RefCell<HashMap<usize, Option<[u8; 16]>>>,
    /// What some material has and no file keeps.
    left_out: RefCell<BTreeSet<String>>,
    /// The parts of the document that textures are made of, read when the first mesh needs them.
    parts: OnceCell<TextureParts>,
}

impl SharedMaterials {
    fn parts(&self, source: &Source<'_>) -> Result<&TextureParts> {
        if let Some(parts) = self.parts.get() {
            return Ok(parts);
        }
        let parts = TextureParts::of(source)?;
        Ok(self.parts.get_or_init(|| parts))
    }

    /// Reports what was left out.
    pub(crate) fn report(&self, source: &Source<'_>) {
        let left_out = self.left_out.take();
        if !left_out.is_empty() {
            let names: Vec<String> = left_out.into_iter().collect();
            source.monitor.warn(&format!("materials: not kept are {}", names.join(", ")));
        }
    }
}

/// Which coordinates a texture has and their transform, given the set that is kept and the number of the second one; `None` where they can
/// be had from neither.
fn coordinates(
    texture: &TextureReference,
    kept: &KeptSet,
    second: Option<u32>,
) -> serde_json::Result<Option<(u32, [[f32; 3]; 2])>> {
    if let Some(transform) = kept.relative(texture)? {
        return Ok(Some((UV_SET_FIRST, transform)));
    }
    let (set, transform) = texture::own_set(texture)?;
    let transform = transform.filter(|_| second == Some(set));
    Ok(transform.map(|transform| (UV_SET_SECOND, transform)))
}

/// The number of the second set of texture coordinates of a material: that of the first of the textures that are kept whose
/// coordinates cannot be had from the set that is kept. `None` for a malformed material, whose error is found where it is read.
pub(super) fn second_set(material: &Value) -> Option<u32> {
    let kept = texture::kept_set(material).ok()?;
    let material = SurfaceMaterial::deserialize(material).ok()?;
    let is_lit = material.emissive_factor.is_some_and(|factor| factor != [0.0; 3]);
    let emissive = material.emissive_texture.clone().filter(|_| is_lit);
    let used = [base_texture(&material), emissive];
    used.into_iter().flatten().find_map(|used| {
        let reference = &used.reference;
        let absent = kept.relative(reference).ok()?.is_none();
        let (set, transform) = texture::own_set(reference).ok()?;
        (absent && transform.is_some()).then_some(set)
    })
}

/// The texture of a material's base colour, if the material is well-formed.
fn base_texture(material: &SurfaceMaterial) -> Option<UsedTexture> {
    base_color(material.pbr_metallic_roughness.as_ref(), &material.extensions).ok()?.base_color_texture
}

/// Reads the materials with these numbers, in order, into a recorder.
///
/// # Errors
/// `BTH-I002` for a malformed material, `BTH-I014` and `BTH-I016` for an image that cannot be read, `BTH-L003` for one that is too
/// large.
pub(super) fn read(
    accessors: &Accessors<'_>,
    shared: &SharedMaterials,
    numbers: &[usize],
    (unreadable, recorder): (Unreadable, &mut MaterialRecorder),
) -> Result<()> {
    let parts = shared.parts(accessors.source)?;
    let textures = TextureReader { accessors, parts, without: WITHOUT };
    let mut reader = MaterialReader { textures, unreadable, shared, recorder };
    for number in numbers {
        let parameters = reader.material(*number)?;
        reader.recorder.parameters.push(parameters);
    }
    Ok(())
}

struct MaterialReader<'m, 'a> {
    textures: TextureReader<'m, 'a>,
    unreadable: Unreadable,
    shared: &'m SharedMaterials,
    recorder: &'m mut MaterialRecorder,
}

impl MaterialReader<'_, '_> {
    fn material(&mut self, number: usize) -> Result<MaterialParameters> {
        let part = format!("material {number}");
        let reader = &self.textures;
        let material: SurfaceMaterial = reader.part(&reader.parts.materials, number, &part)?;
        let base = material.base(reader, &part)?;
        self.shared.left_out.borrow_mut().extend(material.left_out(&base));
        if let Some(mode) = material.alpha_mode.as_deref().filter(|mode| !ALPHA_MODES.contains(mode)) {
            self.shared.left_out.borrow_mut().insert(format!("alphaMode \"{}\"", shown(mode.as_bytes())));
        }
        let kept = texture::kept_set(&reader.parts.materials[number])
            .map_err(|e| reader.malformed(&part, format!("expected a glTF material, found: {e}")))?;
        let strength = match material.extensions.get(EMISSIVE_STRENGTH) {
            Some(value) => EmissiveStrength::deserialize(value)
                .map_err(|e| reader.malformed(&part, format!("expected an emissiveStrength, found: {e}")))?
                .emissive_strength
                .unwrap_or(1.0),
            None => 1.0,
        };
        let unlit = if material.extensions.contains_key(UNLIT) { MATERIAL_UNLIT } else { 0 };
        let sides = if material.double_sided { MATERIAL_DOUBLE_SIDED } else { 0 };
        let base_color = base.base_color_factor.unwrap_or([1.0; 4]).map(|x| x as f32);
        let emissive = material.emissive_factor.unwrap_or_default().map(|x| (x * strength) as f32);
        let parameters = MaterialParameters {
            base_color,
            emissive,
            alpha_cutoff: material.alpha_cutoff.unwrap_or(0.5) as f32,
            alpha_mode: match material.alpha_mode.as_deref() {
                Some("MASK") => ALPHA_MASK,
                Some("BLEND") => ALPHA_BLEND,
                _ => ALPHA_OPAQUE,
            },
            flags: unlit | sides,
            base_color_texture: NONE,
            emissive_texture: NONE,
            reserved: [0; 4],
        };
        self.check(&parameters, &part)?;
        let sets = (&kept, second_set(&reader.parts.materials[number]));
        let base_color_texture = self.texture(base.base_color_texture.as_ref(), sets, &part, "base color")?;
        let emissive_texture = match emissive == [0.0; 3] {
            true => NONE,
            false => self.texture(material.emissive_texture.as_ref(), sets, &part, "emissive")?,
        };
        // Without its texture all of the surface would glow.
        let emissive = match material.emissive_texture.is_some() && emissive_texture == NONE {
            true => [0.0; 3],
            false => emissive,
        };
        Ok(MaterialParameters { base_color_texture, emissive, emissive_texture, ..parameters })
    }

    /// Refuses numbers beyond what the format holds.
    fn check(&self, parameters: &MaterialParameters, part: &str) -> Result<()> {
        let MaterialParameters { base_color, emissive, alpha_cutoff, .. } = *parameters;
        let amounts = base_color.iter().chain(&emissive).chain([&alpha_cutoff]);
        if amounts.into_iter().all(|x| x.is_finite() && *x >= 0.0) && base_color[3] <= 1.0 {
            return Ok(());
        }
        let message = format!(
            "expected colors and a cutoff from 0 and an alpha up to 1, found base color {base_color:?}, emission \
             {emissive:?} and cutoff {alpha_cutoff}"
        );
        Err(self.textures.malformed(part, message))
    }

    /// The row of a texture; `NONE` without one, and for one that is left out with a warning.
    /// `sets` are that which is kept, and the number of the second one.
    fn texture(
        &mut self,
        used: Option<&UsedTexture>,
        (kept, second): (&KeptSet, Option<u32>),
        part: &str,
        what: &str,
    ) -> Result<u32> {
        let Some(used) = used else { return Ok(NONE) };
        let left_out = |why: &str| {
            let warning = format!("{part}: its {what} texture is left out: {why}");
            self.textures.accessors.source.monitor.warn(&warning);
            Ok(NONE)
        };
        let sampled = self.textures.texture(used.index)?;
        let Some(image) = sampled.image else {
            return left_out("it has no image in PNG, JPEG or WebP");
        };
        let coordinates = coordinates(&used.reference, kept, second)
            .map_err(|e| self.textures.malformed(part, format!("expected a texture, found: {e}")))?;
        let Some((uv_set, transform)) = coordinates else {
            return left_out("its texture coordinates are none of the two sets that are kept");
        };
        let wrap = sampled.wrap.map(|wrap| match wrap {
            Wrap::Repeat => WRAP_REPEAT,
            Wrap::Mirror => WRAP_MIRROR,
            Wrap::Clamp => WRAP_CLAMP,
        });
        let filter = if sampled.nearest { FILTER_NEAREST } else { FILTER_LINEAR };
        let Some(image) = self.image(image)? else { return Ok(NONE) };
        Ok(self.recorder.texture(Texture { image, wrap, filter, transform, uv_set, reserved: [0; 2] }))
    }

    /// The name of an image; `None` if it is left out.
    fn image(&self, index: usize) -> Result<Option<[u8; 16]>> {
        if let Some(name) = self.shared.images.borrow().get(&index) {
            return Ok(*name);
        }
        let monitor = self.textures.accessors.source.monitor;
        let image = self.unreadable.check(image_file(&self.textures, index), monitor)?;
        let name = image.map(|image| image.name);
        self.shared.images.borrow_mut().insert(index, name);
        Ok(name)
    }
}

/// An image of the document, whose format and size are checked.
fn image_file(textures: &TextureReader<'_, '_>, index: usize) -> Result<ImageFile> {
    let part = format!("image {index}");
    let bytes = textures.image(index)?;
    image_file::check(&bytes).map_err(|refused| match refused {
        Refused::Malformed(message) => textures.unreadable(&part, message),
        Refused::TooLarge(texels) => Error::Limit {
            code: "BTH-L003",
            message: format!("{part} has {texels} texels; up to {MAX_TEXELS} are kept"),
        },
    })?;
    Ok(ImageFile::new(bytes.into_owned()))
}

/// The numbers of the textures that materials of a document use and files keep, without repetition.
fn used_textures(materials: &[Value]) -> Vec<usize> {
    let mut used = BTreeSet::new();
    for material in materials.iter().filter_map(|value| SurfaceMaterial::deserialize(value).ok()) {
        let base = base_texture(&material);
        used.extend([base, material.emissive_texture].into_iter().flatten().map(|texture| texture.index));
    }
    used.into_iter().collect()
}

/// The files beside a document that hold images of its materials. What is malformed is left out; reading it reports an error.
pub(super) fn files(json: &[u8]) -> Vec<String> {
    let Ok(parts) = from_slice::<TextureParts>(json) else { return Vec::new() };
    let mut uris: Vec<String> = Vec::new();
    for texture in used_textures(&parts.materials) {
        uris.extend(parts.file(texture).filter(|uri| !uris.contains(uri)));
    }
    uris
}

/// The images of all materials of a document that can be read.
pub(crate) fn images(source: &Source<'_>) -> Result<Vec<ImageFile>> {
    let supported = [SUPPORTED.as_slice(), &SCENE_EXTENSIONS].concat();
    let (document, binary) = document::read(source, &supported)?;
    let accessors =
        &Accessors { source, document: &document, buffers: Buffers::new(source, &document, binary) };
    let parts = &TextureParts::of(source)?;
    let textures = TextureReader { accessors, parts, without: WITHOUT };
    let used = used_textures(&textures.parts.materials);
    let numbers: BTreeSet<usize> =
        used.into_iter().filter_map(|texture| textures.texture(texture).ok()?.image).collect();
    // Materials that no mesh has may refer to images that cannot be read.
    Ok(numbers.into_iter().filter_map(|image| image_file(&textures, image).ok()).collect())
}
