//! Colours, and the materials of objects.

use crate::error::Result;
use crate::model::Material;
use crate::table::{Table, Value};

pub(crate) const MATERIAL_KEYS: &[&str] = &["emission", "metallic", "roughness"];

/// The material of an object; `None` where it has neither colour nor material.
pub(crate) fn material(object: &Table<'_>) -> Result<Option<Material>> {
    let mut material = Material::default();
    if let Some(value) = object.get("color") {
        material.color = color(&value, 1.0)?;
    }
    let Some(value) = object.get("material") else {
        return Ok(object.get("color").map(|_| material));
    };
    let table = value.table(MATERIAL_KEYS)?;
    if let Some(value) = table.get("emission") {
        material.emission = color(&value, Material::MAX_EMISSION)?;
    }
    for (key, number) in [("metallic", &mut material.metallic), ("roughness", &mut material.roughness)] {
        if let Some(value) = table.get(key) {
            *number = value.number_that("a number from 0 to 1", |n| (0.0..=1.0).contains(&n))?;
        }
    }
    Ok(Some(material))
}

/// A linear colour: three numbers from 0 to `most`, or "#rrggbb" in sRGB.
pub(crate) fn color(value: &Value<'_>, most: f64) -> Result<[f64; 3]> {
    if value.is_string() {
        let text = value.string()?;
        return hexadecimal(text)
            .ok_or_else(|| value.not_allowed("three numbers or a color \"#rrggbb\"", format!("\"{text}\"")));
    }
    let color: [f64; 3] = value.numbers()?;
    if color.iter().all(|c| (0.0..=most).contains(c)) {
        return Ok(color);
    }
    let expected = match most.is_finite() {
        true => format!("three numbers from 0 to {most}"),
        false => "three numbers from 0".to_owned(),
    };
    Err(value.not_allowed(&expected, format!("{color:?}")))
}

/// The linear colour of a text "#rrggbb" in sRGB (IEC 61966-2-1).
fn hexadecimal(text: &str) -> Option<[f64; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
    let bits =
        digits.bytes().all(|b| b.is_ascii_hexdigit()).then(|| u32::from_str_radix(digits, 16).ok())??;
    let linear = |byte: u8| {
        let srgb = f64::from(byte) / 255.0;
        if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
    };
    let [_, red, green, blue] = bits.to_be_bytes();
    Some([red, green, blue].map(linear))
}
