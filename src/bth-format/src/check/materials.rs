//! Materials, textures, vertex colours, second sets of texture coordinates and images: BTH-F149,
//! BTH-F160 to BTH-F162, and BTH-F220 to BTH-F222.

use super::rows::{RowResult, check_all, check_fields, check_object_rows, is_finite};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::view::{ImagesView, MaterialsView};
use std::borrow::Cow;
use std::fmt::Debug;
use std::mem::offset_of;

/// Checks the materials of an object with `materials` rows of MATERIALS and `triangles` triangles.
pub(crate) fn materials(view: &MaterialsView<'_>, materials: usize, triangles: u32) -> Result<()> {
    for (code, section, rows) in [
        (Code::MaterialParameters, kind::MATERIAL_PARAMETERS, view.parameters.len()),
        (Code::GlossParameters, kind::GLOSS_PARAMETERS, view.gloss.len()),
    ] {
        if rows != 0 && rows != materials {
            return error(code, section, 0, format!("{materials} rows or none"), &rows);
        }
    }
    check_object_rows(kind::MATERIAL_PARAMETERS, view.parameters, |_, row| {
        parameters(row, view.textures.len())
    })?;
    check_object_rows(kind::GLOSS_PARAMETERS, view.gloss, |_, row| gloss(row, view.textures.len()))?;
    check_object_rows(kind::TEXTURES, view.textures, |_, row| texture(row))?;
    let triangles = triangles as usize;
    // BTH-F161.
    corners(Code::Colors, kind::COLOR_CORNERS, view.color_corners, triangles, view.colors.len())?;
    // BTH-F220 and BTH-F221.
    let rows = view.second_uvs.len();
    corners(Code::SecondCorners, kind::SECOND_CORNERS, view.second_corners, triangles, rows)?;
    let numbers = view.second_uvs.as_flattened();
    check_all(Code::SecondUvs, kind::SECOND_UVS, numbers, |x| x.is_finite(), "finite coordinates")
}

/// BTH-F149 of a row.
fn parameters(p: &MaterialParameters, textures: usize) -> RowResult<()> {
    let amount = |x: &f32| x.is_finite() && *x >= 0.0;
    let is_texture = |row: u32| row == NONE || (row as usize) < textures;
    let row_of_texture = || format!("a row below {textures} or NONE");
    check_fields!(MaterialParameters {
        MaterialParameters base_color: p.base_color.iter().all(amount) && p.base_color[3] <= 1.0,
            "a finite color from 0 and an alpha from 0 to 1", p.base_color;
        MaterialParameters emissive: p.emissive.iter().all(amount), "a finite color from 0", p.emissive;
        MaterialParameters alpha_cutoff: amount(&p.alpha_cutoff), "a finite cutoff from 0", p.alpha_cutoff;
        MaterialParameters alpha_mode: p.alpha_mode <= ALPHA_BLEND, "a mode from 0 to 2", p.alpha_mode;
        MaterialParameters flags: p.flags & !(MATERIAL_DOUBLE_SIDED | MATERIAL_UNLIT) == 0, "known flags", p.flags;
        MaterialParameters base_color_texture: is_texture(p.base_color_texture),
            row_of_texture(), p.base_color_texture;
        MaterialParameters emissive_texture: is_texture(p.emissive_texture),
            row_of_texture(), p.emissive_texture;
        MaterialParameters reserved: p.reserved == [0; 4], "zeros", p.reserved;
    });
    Ok(())
}

/// BTH-F222 of a row.
fn gloss(p: &GlossParameters, textures: usize) -> RowResult<()> {
    let is_share = |x: f32| (0.0..=1.0).contains(&x);
    let is_texture = |row: u32| row == NONE || (row as usize) < textures;
    let row_of_texture = || format!("a row below {textures} or NONE");
    check_fields!(GlossParameters {
        GlossParameters metallic: is_share(p.metallic), "a number from 0 to 1", p.metallic;
        GlossParameters roughness: is_share(p.roughness), "a number from 0 to 1", p.roughness;
        GlossParameters normal_scale: p.normal_scale.is_finite(), "a finite number", p.normal_scale;
        GlossParameters occlusion_strength: is_share(p.occlusion_strength),
            "a number from 0 to 1", p.occlusion_strength;
        GlossParameters metallic_roughness_texture: is_texture(p.metallic_roughness_texture),
            row_of_texture(), p.metallic_roughness_texture;
        GlossParameters normal_texture: is_texture(p.normal_texture), row_of_texture(), p.normal_texture;
        GlossParameters occlusion_texture: is_texture(p.occlusion_texture),
            row_of_texture(), p.occlusion_texture;
        GlossParameters reserved: p.reserved == 0, "zero", p.reserved;
    });
    Ok(())
}

/// BTH-F160 of a row.
fn texture(t: &Texture) -> RowResult<()> {
    check_fields!(Texture {
        Texture wrap: t.wrap.iter().all(|wrap| *wrap <= WRAP_CLAMP), "wrap modes from 0 to 2", t.wrap;
        Texture filter: t.filter <= FILTER_NEAREST, "0 or 1", t.filter;
        Texture transform: is_finite(t.transform.as_flattened()), "a finite transform", t.transform;
        Texture uv_set: t.uv_set <= UV_SET_SECOND, "a set of texture coordinates, 0 or 1", t.uv_set;
        Texture reserved: t.reserved == [0; 2], "zeros", t.reserved;
    });
    Ok(())
}

/// Checks that corners have one row per triangle of the object, or none, and refer to `rows` rows
/// of another section.
fn corners(code: Code, section: u32, corners: &[[u32; 3]], triangles: usize, rows: usize) -> Result<()> {
    if !corners.is_empty() && corners.len() != triangles {
        let expected = format!("{triangles} rows or none");
        return error(code, section, 0, expected, &corners.len());
    }
    let expected = format!("a row below {rows}");
    check_all(code, section, corners.as_flattened(), |row| (*row as usize) < rows, expected)
}

/// BTH-F162 without textures: order and ranges.
pub(crate) fn images(view: &ImagesView<'_>) -> Result<()> {
    let mut end = 0u64;
    for (row, image) in view.images.iter().enumerate() {
        let ascends = row.checked_sub(1).is_none_or(|before| view.images[before].name < image.name);
        let behind = image.first.checked_add(image.length).filter(|_| image.first == end && image.length > 0);
        end = match behind.filter(|behind| ascends && *behind <= view.bytes.len() as u64) {
            Some(behind) => behind,
            None => {
                let expected = format!("a greater name, and bytes from {end} within {}", view.bytes.len());
                return within_file(row * size_of::<Image>(), expected, image);
            }
        };
    }
    if end != view.bytes.len() as u64 {
        return within_file(0, format!("images of all {} bytes", view.bytes.len()), &end);
    }
    Ok(())
}

/// BTH-F162 of the textures of an object.
pub(crate) fn image_names(view: &MaterialsView<'_>, images: &ImagesView<'_>) -> Result<()> {
    match view.textures.iter().position(|texture| images.row_of(texture.image).is_none()) {
        None => Ok(()),
        Some(row) => {
            let at = row * size_of::<Texture>() + offset_of!(Texture, image);
            error(Code::Images, kind::TEXTURES, at, "the name of an image", &view.textures[row].image)
        }
    }
}

fn within_file(at: usize, expected: impl Into<Cow<'static, str>>, found: &dyn Debug) -> Result<()> {
    Err(Error::within_file(Code::Images, kind::IMAGES, at as u64, expected, format!("{found:?}")))
}

fn error(
    code: Code,
    kind: u32,
    at: usize,
    expected: impl Into<Cow<'static, str>>,
    found: &dyn Debug,
) -> Result<()> {
    Err(Error::within(code, kind, at as u64, expected, format!("{found:?}")))
}
