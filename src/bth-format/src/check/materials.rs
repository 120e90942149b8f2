//! Materials, textures, vertex colours, second sets of texture coordinates and images: BTH-F149, BTH-F160 to BTH-F162, BTH-F220
//! and BTH-F221.

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::materials_view::{ImagesView, MaterialsView};
use std::borrow::Cow;
use std::fmt::Debug;
use std::mem::offset_of;

/// Checks the materials of an object that has so many rows of MATERIALS and triangles.
pub(crate) fn materials(view: &MaterialsView<'_>, materials: usize, triangles: u32) -> Result<()> {
    let rows = view.parameters.len();
    if rows != 0 && rows != materials {
        let expected = format!("{materials} rows or none");
        return error(Code::MaterialParameters, kind::MATERIAL_PARAMETERS, 0, expected, &rows);
    }
    for (row, parameters) in view.parameters.iter().enumerate() {
        self::parameters(parameters, view.textures.len(), row * size_of::<MaterialParameters>())?;
    }
    for (row, texture) in view.textures.iter().enumerate() {
        self::texture(texture, row * size_of::<Texture>())?;
    }
    colors(view, triangles as usize)?;
    second_uvs(view, triangles as usize)
}

/// BTH-F149 of a row.
fn parameters(p: &MaterialParameters, textures: usize, at: usize) -> Result<()> {
    let wrong = |field: usize, expected: &'static str, found: &dyn Debug| {
        error(Code::MaterialParameters, kind::MATERIAL_PARAMETERS, at + field, expected, found)
    };
    let amount = |x: &f32| x.is_finite() && *x >= 0.0;
    if !p.base_color.iter().all(amount) || p.base_color[3] > 1.0 {
        let expected = "a finite color from 0 and an alpha from 0 to 1";
        return wrong(offset_of!(MaterialParameters, base_color), expected, &p.base_color);
    }
    if !p.emissive.iter().all(amount) {
        return wrong(offset_of!(MaterialParameters, emissive), "a finite color from 0", &p.emissive);
    }
    if !amount(&p.alpha_cutoff) {
        let at = offset_of!(MaterialParameters, alpha_cutoff);
        return wrong(at, "a finite cutoff from 0", &p.alpha_cutoff);
    }
    if p.alpha_mode > ALPHA_BLEND {
        return wrong(offset_of!(MaterialParameters, alpha_mode), "a mode from 0 to 2", &p.alpha_mode);
    }
    if p.flags & !(MATERIAL_DOUBLE_SIDED | MATERIAL_UNLIT) != 0 {
        return wrong(offset_of!(MaterialParameters, flags), "known flags", &p.flags);
    }
    for (field, row) in [
        (offset_of!(MaterialParameters, base_color_texture), p.base_color_texture),
        (offset_of!(MaterialParameters, emissive_texture), p.emissive_texture),
    ] {
        if row != NONE && row as usize >= textures {
            let expected = format!("a row below {textures} or NONE");
            return error(Code::MaterialParameters, kind::MATERIAL_PARAMETERS, at + field, expected, &row);
        }
    }
    if p.reserved != [0; 4] {
        return wrong(offset_of!(MaterialParameters, reserved), "zeros", &p.reserved);
    }
    Ok(())
}

/// BTH-F160 of a row.
fn texture(t: &Texture, at: usize) -> Result<()> {
    let wrong = |field: usize, expected: &'static str, found: &dyn Debug| {
        error(Code::Texture, kind::TEXTURES, at + field, expected, found)
    };
    if t.wrap.iter().any(|wrap| *wrap > WRAP_CLAMP) {
        return wrong(offset_of!(Texture, wrap), "wrap modes from 0 to 2", &t.wrap);
    }
    if t.filter > FILTER_NEAREST {
        return wrong(offset_of!(Texture, filter), "0 or 1", &t.filter);
    }
    if !t.transform.as_flattened().iter().all(|x| x.is_finite()) {
        return wrong(offset_of!(Texture, transform), "a finite transform", &t.transform);
    }
    if t.uv_set > UV_SET_SECOND {
        return wrong(offset_of!(Texture, uv_set), "a set of texture coordinates, 0 or 1", &t.uv_set);
    }
    if t.reserved != [0; 2] {
        return wrong(offset_of!(Texture, reserved), "zeros", &t.reserved);
    }
    Ok(())
}

/// BTH-F161.
fn colors(view: &MaterialsView<'_>, triangles: usize) -> Result<()> {
    corners((Code::Colors, kind::COLOR_CORNERS), view.color_corners, (view.colors.len(), triangles))
}

/// BTH-F220 and F221.
fn second_uvs(view: &MaterialsView<'_>, triangles: usize) -> Result<()> {
    let (code, section) = (Code::SecondCorners, kind::SECOND_CORNERS);
    corners((code, section), view.second_corners, (view.second_uvs.len(), triangles))?;
    let numbers = view.second_uvs.as_flattened();
    match numbers.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(i) => error(Code::SecondUvs, kind::SECOND_UVS, 4 * i, "finite coordinates", &numbers[i]),
    }
}

/// Whether corners have as many rows as the object has triangles, or none, which lie within so many rows of another section.
fn corners(
    (code, section): (Code, u32),
    corners: &[[u32; 3]],
    (rows, triangles): (usize, usize),
) -> Result<()> {
    if !corners.is_empty() && corners.len() != triangles {
        let expected = format!("{triangles} rows or none");
        return error(code, section, 0, expected, &corners.len());
    }
    match corners.as_flattened().iter().position(|row| *row as usize >= rows) {
        None => Ok(()),
        Some(i) => {
            let expected = format!("a row below {rows}");
            error(code, section, 4 * i, expected, &corners.as_flattened()[i])
        }
    }
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
