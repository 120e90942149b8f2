//! Reads how the materials of a document look, as compiled files keep it, and their images.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use bth_format::layout::*;
use serde_json::Value;

use crate::cutout::Wrap;
use crate::error::Result;
use crate::gltf::extensions::Use;
use crate::gltf::file::GltfFile;
use crate::gltf::material::{Material, SPECULAR_GLOSSINESS, Textures, UNLIT, UsedTexture};
use crate::gltf::schema::GltfDocument;
use crate::gltf::texture_reader::TextureReader;
use crate::gltf::uv_set::UvSet;
use crate::image_file;
use crate::materials::{ImageFile, MaterialRecorder, NO_GLOSS, Unreadable, warn_left_out};
use crate::mesh::Polygons;
use crate::source::Source;
use crate::text::shown;

/// How to do without what is read here, in errors.
const WITHOUT: &str = "without --materials";

/// What the meshes of a document share while their materials are read.
#[derive(Default)]
pub(crate) struct SharedMaterials {
    /// Names of the document's images that were read; `None` for those that are skipped.
    images: RefCell<HashMap<usize, Option<[u8; 16]>>>,
    /// What some material has and no file keeps.
    left_out: RefCell<BTreeSet<String>>,
}

impl SharedMaterials {
    /// Warns of what is not kept.
    pub(crate) fn report(self, source: &Source<'_>) {
        warn_left_out(&self.left_out.into_inner(), source.monitor);
    }
}

/// Reads the materials with these numbers, in order, into a recorder.
///
/// # Errors
/// `BTH-I002` for a malformed material, `BTH-I014` and `BTH-I016` for an image that cannot be read,
/// `BTH-L003` for one that is too large.
pub(super) fn read(
    file: &GltfFile<'_>,
    shared: &SharedMaterials,
    numbers: &[usize],
    unreadable: Unreadable,
    recorder: &mut MaterialRecorder,
) -> Result<()> {
    let textures = TextureReader { file, without: WITHOUT };
    let mut reader = MaterialReader { textures, unreadable, shared, recorder };
    for number in numbers {
        let (parameters, gloss) = reader.material(*number)?;
        reader.recorder.parameters.push(parameters);
        reader.recorder.gloss.push(gloss);
    }
    Ok(())
}

struct MaterialReader<'m, 'a> {
    textures: TextureReader<'m, 'a>,
    unreadable: Unreadable,
    shared: &'m SharedMaterials,
    recorder: &'m mut MaterialRecorder,
}

/// The sets of texture coordinates that are kept for a material.
struct KeptSets {
    first: UvSet,
    second: Option<u32>,
}

impl KeptSets {
    /// Returns which of the two sets a texture has, and the transform from what is kept; `None`
    /// where it has neither.
    fn of(&self, texture: &UsedTexture) -> serde_json::Result<Option<(u32, [[f32; 3]; 2])>> {
        let set = UvSet::of(texture)?;
        if let Some(transform) = self.first.relative(&set) {
            return Ok(Some((UV_SET_FIRST, transform)));
        }
        let second = set.rows().filter(|_| self.second == Some(set.number));
        Ok(second.map(|transform| (UV_SET_SECOND, transform)))
    }
}

impl MaterialReader<'_, '_> {
    fn material(&mut self, number: usize) -> Result<(MaterialParameters, GlossParameters)> {
        let part = format!("material {number}");
        let reader = &self.textures;
        let (material, base) = reader.material(number)?;
        let left_out = &mut *self.shared.left_out.borrow_mut();
        left_out.extend(material.left_out());
        let unknown = material.unknown_alpha_mode();
        left_out.extend(unknown.map(|mode| format!("alphaMode \"{}\"", shown(mode.as_bytes()))));
        let malformed = |what: &str, e: serde_json::Error| {
            reader.malformed(&part, format!("expected {what}, found: {e}"))
        };
        let first = UvSet::of_material(&material.textures).map_err(|e| malformed("a glTF material", e))?;
        let strength = material.emissive_strength().map_err(|e| malformed("an emissiveStrength", e))?;
        let unlit = if material.extensions.contains_key(UNLIT) { MATERIAL_UNLIT } else { 0 };
        let sides = if material.double_sided { MATERIAL_DOUBLE_SIDED } else { 0 };
        let emissive = material.emissive_factor.unwrap_or_default().map(|x| (x * strength) as f32);
        let parameters = MaterialParameters {
            base_color: base.factor.unwrap_or([1.0; 4]).map(|x| x as f32),
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
        let sets = KeptSets { first, second: material.second_set() };
        let base_color_texture = self.texture(base.texture.as_ref(), &sets, &part, "base color")?;
        let used = material.textures.emissive_texture.as_ref();
        let emissive_texture = match emissive == [0.0; 3] {
            true => NONE,
            false => self.texture(used, &sets, &part, "emissive")?,
        };
        // Without its texture all of the surface would glow.
        let emissive = if used.is_some() && emissive_texture == NONE { [0.0; 3] } else { emissive };
        let parameters = MaterialParameters { base_color_texture, emissive, emissive_texture, ..parameters };
        // The older model has other parameters, and no light falls on what is unlit.
        let is_older = material.extensions.contains_key(SPECULAR_GLOSSINESS)
            && material.textures.pbr_metallic_roughness.is_none();
        let gloss = match is_older || unlit != 0 {
            true => NO_GLOSS,
            false => self.gloss(&material, &part)?,
        };
        let [metallic_roughness, normal, occlusion] = material.gloss_textures();
        let mut texture = |used: Option<UsedTexture>, what| self.texture(used.as_ref(), &sets, &part, what);
        let metallic_roughness_texture = texture(metallic_roughness.clone(), "metallic-roughness")?;
        // Without its texture all of the surface would be metal.
        let is_lost = metallic_roughness.is_some() && metallic_roughness_texture == NONE;
        let gloss = GlossParameters {
            metallic: if is_lost { 0.0 } else { gloss.metallic },
            metallic_roughness_texture,
            normal_texture: texture(normal, "normal")?,
            occlusion_texture: texture(occlusion, "occlusion")?,
            ..gloss
        };
        Ok((parameters, gloss))
    }

    /// Returns how glossy a material is, without its textures.
    fn gloss(&self, material: &Material, part: &str) -> Result<GlossParameters> {
        let Textures { pbr_metallic_roughness: pbr, normal_texture, occlusion_texture, .. } =
            &material.textures;
        let number = |value: Option<&Value>, what: &str, is_good: fn(f64) -> bool| match value {
            None | Some(Value::Null) => Ok(1.0),
            Some(value) => value.as_f64().filter(|x| is_good(*x)).map(|x| x as f32).ok_or_else(|| {
                self.textures.malformed(part, format!("expected a glTF {what}, found {value}"))
            }),
        };
        let is_share = |x: f64| (0.0..=1.0).contains(&x);
        let pbr = pbr.as_ref();
        Ok(GlossParameters {
            metallic: number(pbr.map(|p| &p.metallic_factor), "metallicFactor", is_share)?,
            roughness: number(pbr.map(|p| &p.roughness_factor), "roughnessFactor", is_share)?,
            normal_scale: number(normal_texture.as_ref().map(|t| &t.scale), "scale of normals", |x| {
                (x as f32).is_finite()
            })?,
            occlusion_strength: number(
                occlusion_texture.as_ref().map(|t| &t.strength),
                "strength of occlusion",
                is_share,
            )?,
            ..NO_GLOSS
        })
    }

    /// Refuses numbers beyond what the format holds.
    fn check(&self, parameters: &MaterialParameters, part: &str) -> Result<()> {
        let MaterialParameters { base_color, emissive, alpha_cutoff, .. } = *parameters;
        let mut amounts = base_color.iter().chain(&emissive).chain([&alpha_cutoff]);
        if amounts.all(|x| x.is_finite() && *x >= 0.0) && base_color[3] <= 1.0 {
            return Ok(());
        }
        let message = format!(
            "expected colors and a cutoff from 0 and an alpha up to 1, found base color {base_color:?}, emission \
             {emissive:?} and cutoff {alpha_cutoff}"
        );
        Err(self.textures.malformed(part, message))
    }

    /// Returns the row of a texture; `NONE` without one, and for one that is skipped with a
    /// warning.
    fn texture(
        &mut self,
        used: Option<&UsedTexture>,
        sets: &KeptSets,
        part: &str,
        what: &str,
    ) -> Result<u32> {
        let Some(used) = used else { return Ok(NONE) };
        let monitor = self.textures.file.source.monitor;
        let left_out = |why: &str| {
            monitor.warn(&format!("{part}: its {what} texture is left out: {why}"));
            Ok(NONE)
        };
        let sampled = self.textures.texture(used.index)?;
        let Some(image) = sampled.image else {
            return left_out("it has no image in PNG, JPEG or WebP");
        };
        let coordinates = sets.of(used);
        let coordinates = coordinates
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
        let known = self.shared.images.borrow().get(&image).copied();
        let name = match known {
            Some(name) => name,
            None => {
                self.unreadable.check(read_image(&self.textures, image), monitor)?.map(|image| image.name)
            }
        };
        self.shared.images.borrow_mut().insert(image, name);
        let Some(image) = name else { return Ok(NONE) };
        Ok(self.recorder.texture(Texture { image, wrap, filter, transform, uv_set, reserved: [0; 2] }))
    }
}

/// Reads an image of the document and checks its format and size.
fn read_image(textures: &TextureReader<'_, '_>, index: usize) -> Result<ImageFile> {
    textures.image(index, |bytes| {
        image_file::check(&bytes)?;
        Ok(ImageFile::new(bytes.into_owned()))
    })
}

impl GltfDocument {
    /// Returns the numbers of the textures that materials use and files keep, in order.
    pub(super) fn kept_textures(&self) -> BTreeSet<usize> {
        self.well_formed_materials().flat_map(|m| m.kept_textures().map(|used| used.index)).collect()
    }
}

/// Returns the images of all materials of a document that can be read.
pub(crate) fn images(source: &Source<'_>) -> Result<Vec<ImageFile>> {
    let file = &GltfFile::open(source, Use::Parts, Polygons::default())?;
    let textures = TextureReader { file, without: WITHOUT };
    let used = file.document.kept_textures().into_iter();
    let numbers: BTreeSet<usize> = used.filter_map(|texture| textures.texture(texture).ok()?.image).collect();
    // Materials that no mesh has may refer to images that cannot be read.
    Ok(numbers.into_iter().filter_map(|image| read_image(&textures, image).ok()).collect())
}
