//! How the materials of a mesh look, as the sections of a compiled file have it: parameters,
//! textures, vertex colours, and a second set of texture coordinates.

use crate::cutout::AlphaMode;
use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::polygon::Polygons;
use crate::source::IMAGE;
use bth_format::file::hash128;
use bth_format::layout::{GlossParameters, MaterialParameters, NONE, Texture, UV_SET_SECOND};
use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;

/// The materials of a mesh's groups, and the colours of its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Materials {
    /// For each material of the groups its parameters; empty where the source tells of none.
    pub parameters: Vec<MaterialParameters>,
    /// For each material of the groups how glossy it is; empty where none is.
    pub gloss: Vec<GlossParameters>,
    /// The textures that parameters refer to. Their images are [`ImageFile`]s of the source.
    pub textures: Vec<Texture>,
    /// Per triangle rows of `colors`; empty without vertex colours.
    pub color_corners: Vec<[u32; 3]>,
    /// Distinct vertex colours, linear red, green, blue and alpha; 65,535 means 1.
    pub colors: Vec<[u16; 4]>,
    /// Per triangle rows of `second_uvs`; empty where no texture has coordinates of a second set.
    pub second_corners: Vec<[u32; 3]>,
    /// Distinct texture coordinates of the second set.
    pub second_uvs: Vec<[f32; 2]>,
}

/// What becomes of images and material libraries that are missing, broken or too large
/// (`--lenient-materials`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unreadable {
    /// They are errors.
    #[default]
    Refused,
    /// Skips them, each with a warning. A base colour counts as white then, and what would emit
    /// does not.
    LeftOut,
}

impl Unreadable {
    /// Returns what was read; `None`, with a warning, for an image or a material library that
    /// cannot be read and is skipped.
    ///
    /// # Errors
    /// Other errors, and all errors if nothing is to be skipped.
    pub(crate) fn check<T>(self, read: Result<T>, monitor: &dyn Monitor) -> Result<Option<T>> {
        let what = match (self, &read) {
            (Unreadable::LeftOut, Err(Error::Input { code: IMAGE, place, message, .. })) => {
                format!("{place}: {message}")
            }
            (Unreadable::LeftOut, Err(Error::Limit { code: "BTH-L003", message })) => message.clone(),
            _ => return read.map(Some),
        };
        monitor.warn(&format!("{what}; it is left out"));
        Ok(None)
    }
}

/// Warns of what some material has and no file keeps.
pub(crate) fn warn_left_out(names: &BTreeSet<String>, monitor: &dyn Monitor) {
    if !names.is_empty() {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        monitor.warn(&format!("materials: not kept are {}", names.join(", ")));
    }
}

/// What of a model's looks is read, for which files besides the model itself are needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Looks {
    /// Materials whose alpha makes holes.
    pub alpha: AlphaMode,
    /// How materials look.
    pub materials: bool,
    /// What becomes of images and material libraries that cannot be read.
    pub unreadable: Unreadable,
    /// How polygons become triangles, by whose numbers holes are told.
    pub polygons: Polygons,
}

impl From<AlphaMode> for Looks {
    fn from(alpha: AlphaMode) -> Self {
        Self { alpha, ..Self::default() }
    }
}

/// An image file of a source: PNG, JPEG or WebP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageFile {
    /// The first 128 bits of the BLAKE3 hash of its bytes, by which textures name it.
    pub name: [u8; 16],
    /// Its bytes, as they are in the source.
    pub bytes: Vec<u8>,
}

impl ImageFile {
    /// The image in these bytes.
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        Self { name: hash128(&bytes), bytes }
    }
}

/// The colour of what has no vertex colour.
const WHITE: [f32; 4] = [1.0; 4];

/// The parameters of a material about which the source says nothing: white, opaque, seen from both
/// sides.
pub const PLAIN: MaterialParameters = MaterialParameters {
    base_color: [1.0; 4],
    emissive: [0.0; 3],
    alpha_cutoff: 0.5,
    alpha_mode: bth_format::layout::ALPHA_OPAQUE,
    flags: bth_format::layout::MATERIAL_DOUBLE_SIDED,
    base_color_texture: NONE,
    emissive_texture: NONE,
    reserved: [0; 4],
};

/// A matte material.
pub const NO_GLOSS: GlossParameters = GlossParameters {
    metallic: 0.0,
    roughness: 1.0,
    normal_scale: 1.0,
    occlusion_strength: 1.0,
    metallic_roughness_texture: NONE,
    normal_texture: NONE,
    occlusion_texture: NONE,
    reserved: 0,
};

/// Collects materials while a source is read.
#[derive(Debug, Default)]
pub(crate) struct MaterialRecorder {
    /// By the numbers that groups refer to.
    pub(crate) parameters: Vec<MaterialParameters>,
    /// As `parameters`; what is missing has no gloss.
    pub(crate) gloss: Vec<GlossParameters>,
    textures: Vec<Texture>,
    rows: HashMap<TextureKey, u32>,
    pub(crate) colors: ColorRecorder,
    pub(crate) second_uvs: CornerRecorder<[u32; 2]>,
}

/// What makes two textures equal.
type TextureKey = ([u8; 16], [u32; 2], [u32; 2], [u32; 6]);

impl MaterialRecorder {
    /// Returns the row of a texture, which is added if it is new.
    pub(crate) fn texture(&mut self, texture: Texture) -> u32 {
        let mut bits = [0; 6];
        bits.iter_mut().zip(texture.transform.as_flattened()).for_each(|(to, x)| *to = x.to_bits());
        let next = self.textures.len() as u32;
        let key = (texture.image, texture.wrap, [texture.filter, texture.uv_set], bits);
        let row = *self.rows.entry(key).or_insert(next);
        if row == next {
            self.textures.push(texture);
        }
        row
    }

    /// Returns the materials of a mesh of `triangles` triangles. `kept` are the numbers of the
    /// materials that its groups have, in order.
    pub(crate) fn finish(self, kept: &[u32], triangles: usize) -> Materials {
        let Self { parameters, gloss, textures, colors, second_uvs, .. } = self;
        let parameters = kept_rows(&parameters, kept, PLAIN);
        let mut gloss = kept_rows(&gloss, kept, NO_GLOSS);
        if gloss.iter().all(|row| *row == NO_GLOSS) {
            gloss.clear();
        }
        let (color_corners, colors) = colors.0.finish(triangles, color(WHITE));
        let (second_corners, second_uvs) = second_uvs.finish(triangles, [0; 2]);
        let second_uvs = second_uvs.into_iter().map(|bits| bits.map(f32::from_bits)).collect();
        used(Materials { parameters, gloss, textures, color_corners, colors, second_corners, second_uvs })
    }
}

/// The rows of the materials that are kept, in order; empty without any.
fn kept_rows<T: Copy>(rows: &[T], kept: &[u32], missing: T) -> Vec<T> {
    match rows.is_empty() {
        true => Vec::new(),
        false => kept.iter().map(|row| rows.get(*row as usize).copied().unwrap_or(missing)).collect(),
    }
}

/// The materials without the textures that none of them refers to, and without a second set of
/// coordinates that no texture has.
fn used(mut materials: Materials) -> Materials {
    let mut rows = HashMap::new();
    let mut used = Vec::new();
    let of_parameters =
        materials.parameters.iter_mut().flat_map(|p| [&mut p.base_color_texture, &mut p.emissive_texture]);
    let of_gloss = materials
        .gloss
        .iter_mut()
        .flat_map(|p| [&mut p.metallic_roughness_texture, &mut p.normal_texture, &mut p.occlusion_texture]);
    for texture in of_parameters.chain(of_gloss).filter(|texture| **texture != NONE) {
        *texture = *rows.entry(*texture).or_insert_with(|| {
            used.push(materials.textures[*texture as usize]);
            used.len() as u32 - 1
        });
    }
    materials.textures = used;
    if materials.textures.iter().all(|texture| texture.uv_set != UV_SET_SECOND) {
        (materials.second_corners, materials.second_uvs) = (Vec::new(), Vec::new());
    }
    materials
}

/// Collects the values at the corners of triangles; each different value is kept once.
#[derive(Debug)]
pub(crate) struct CornerRecorder<T> {
    corners: Vec<[u32; 3]>,
    values: Vec<T>,
    rows: HashMap<T, u32>,
}

impl<T> Default for CornerRecorder<T> {
    fn default() -> Self {
        Self { corners: Vec::new(), values: Vec::new(), rows: HashMap::new() }
    }
}

impl<T: Copy + Eq + Hash> CornerRecorder<T> {
    /// The row of a value.
    pub(crate) fn row(&mut self, value: T) -> u32 {
        let next = self.values.len() as u32;
        let row = *self.rows.entry(value).or_insert(next);
        if row == next {
            self.values.push(value);
        }
        row
    }

    /// Adds the rows of the corners of triangles from the triangle `first` on; those before without
    /// rows have `absent`.
    pub(crate) fn add(&mut self, first: usize, corners: impl Iterator<Item = [u32; 3]>, absent: T) {
        self.fill(first, absent);
        self.corners.extend(corners);
    }

    fn fill(&mut self, triangles: usize, absent: T) {
        if self.corners.len() < triangles {
            let row = self.row(absent);
            self.corners.resize(triangles, [row; 3]);
        }
    }

    fn finish(mut self, triangles: usize, absent: T) -> (Vec<[u32; 3]>, Vec<T>) {
        if self.corners.is_empty() {
            return (Vec::new(), Vec::new());
        }
        self.fill(triangles, absent);
        (self.corners, self.values)
    }
}

/// Collects vertex colours.
#[derive(Debug, Default)]
pub(crate) struct ColorRecorder(CornerRecorder<[u16; 4]>);

/// A colour as files have it. What is no number counts as 1; other numbers are clamped to 0 and 1.
fn color(color: [f32; 4]) -> [u16; 4] {
    let unit = |x: f32| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) };
    color.map(|x| (f64::from(unit(x)) * f64::from(u16::MAX)).round() as u16)
}

impl ColorRecorder {
    /// The row of a linear colour.
    pub(crate) fn row(&mut self, rgba: [f32; 4]) -> u32 {
        self.0.row(color(rgba))
    }

    /// The row of a colour in sRGB.
    pub(crate) fn srgb_row(&mut self, color: [f32; 3]) -> u32 {
        let [r, g, b] = color.map(|x| if x.is_nan() { x } else { linear(x.clamp(0.0, 1.0)) });
        self.row([r, g, b, 1.0])
    }

    /// Adds the rows of the corners of triangles from the triangle `first` on; those before without
    /// colours are white.
    pub(crate) fn add(&mut self, first: usize, corners: impl Iterator<Item = [u32; 3]>) {
        self.0.add(first, corners, color(WHITE));
    }
}

/// A component from 0 to 1 of a colour in sRGB (IEC 61966-2-1), linear.
pub(crate) fn linear(srgb: f32) -> f32 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_merged_and_triangles_without_any_are_white() {
        let mut recorder = ColorRecorder::default();
        let red = recorder.row([2.0, -1.0, 0.0, f32::NAN]);
        assert_eq!(recorder.row([1.0, 0.0, 0.0, 1.0]), red);
        recorder.add(2, [[red; 3]].into_iter());
        let (corners, colors) = recorder.0.finish(4, color(WHITE));
        assert_eq!(colors, [[65535, 0, 0, 65535], [65535; 4]]);
        assert_eq!(corners, [[1; 3], [1; 3], [0; 3], [1; 3]]);
        assert_eq!(CornerRecorder::<[u16; 4]>::default().finish(7, [0; 4]), (Vec::new(), Vec::new()));
    }

    #[test]
    fn only_textures_of_kept_materials_stay() {
        let mut recorder = MaterialRecorder::default();
        let texture = |byte| Texture {
            image: [byte; 16],
            wrap: [0; 2],
            filter: 0,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            uv_set: u32::from(byte == 1),
            reserved: [0; 2],
        };
        let rows = [recorder.texture(texture(1)), recorder.texture(texture(2)), recorder.texture(texture(1))];
        assert_eq!(rows, [0, 1, 0]);
        recorder.second_uvs.add(0, [[0; 3]].into_iter(), [0; 2]);
        recorder.parameters = vec![
            MaterialParameters { base_color_texture: 0, ..PLAIN },
            PLAIN,
            MaterialParameters { emissive_texture: 1, ..PLAIN },
        ];
        let materials = recorder.finish(&[2, 1], 3);
        assert_eq!(materials.parameters, [MaterialParameters { emissive_texture: 0, ..PLAIN }, PLAIN]);
        assert_eq!(materials.textures, [texture(2)]);
        assert!(
            materials.second_corners.is_empty(),
            "the texture with coordinates of a second set is not used"
        );
    }

    #[test]
    fn srgb_becomes_linear_by_its_definition() {
        for (srgb, expected) in [(0.0, 0.0), (0.04045, 0.003_130_8), (0.5, 0.214_041_14), (1.0, 1.0)] {
            assert!((linear(srgb) - expected).abs() < 1e-6, "{srgb}");
        }
    }
}
