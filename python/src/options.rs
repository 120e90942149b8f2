//! The options of a compilation, as keywords of Python.

use crate::rays::{RayArrays, Rays};
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_compile::sampling::KnownRays;
use bth_compile::settings::Setting;
use bth_compile::{bvh, coordinates, free};
use bth_format::layout::GridBits;
use bth_import::{AlphaMode, Keep, Polygons, Positions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyAny, PyDict};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The keywords of a call; those that are missing or `None` have their defaults.
pub(crate) struct Keywords<'a, 'py>(pub(crate) &'a Bound<'py, PyDict>);

impl<'py> Keywords<'_, 'py> {
    /// The value of a keyword.
    pub(crate) fn get(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.0.get_item(name)?.filter(|value| !value.is_none()))
    }

    /// The value of a keyword, as a type of Rust.
    pub(crate) fn value<T>(&self, name: &str) -> PyResult<Option<T>>
    where
        T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
    {
        let Some(value) = self.get(name)? else { return Ok(None) };
        let value = value.extract().map_err(|error: PyErr| {
            let py = value.py();
            PyErr::from_type(error.get_type(py), format!("{name}: {}", error.value(py)))
        })?;
        Ok(Some(value))
    }

    /// A whole number in a range.
    pub(crate) fn within(&self, name: &str, range: RangeInclusive<u64>) -> PyResult<Option<u64>> {
        let number = self.value::<i128>(name)?;
        let wanted = |n: i128| u64::try_from(n).ok().filter(|n| range.contains(n));
        let outside = |n| {
            let (least, most) = (range.start(), range.end());
            PyValueError::new_err(format!("{name}: expected a number from {least} to {most}, got {n}"))
        };
        number.map(|n| wanted(n).ok_or_else(|| outside(n))).transpose()
    }

    /// The choice that a keyword names.
    fn choice<T: Clone>(&self, name: &str, choices: &[(&str, T)]) -> PyResult<Option<T>> {
        let Some(value) = self.get(name)? else { return Ok(None) };
        let text = value.str()?.to_string();
        match choices.iter().find(|(choice, _)| *choice == text) {
            Some((_, choice)) => Ok(Some(choice.clone())),
            None => {
                let all: Vec<String> = choices.iter().map(|(choice, _)| format!("'{choice}'")).collect();
                let message = format!("{name}: expected {}, got '{text}'", all.join(", "));
                Err(PyValueError::new_err(message))
            }
        }
    }
}

/// The options of the compiler.
pub(crate) fn options(keywords: &Keywords<'_, '_>) -> PyResult<CompileOptions> {
    let structure = keywords
        .choice("structure", &[("bth", Structure::Bth), ("bvh", Structure::Bvh), ("tets", Structure::Tets)])?
        .unwrap_or(Structure::Bvh);
    let materials = keywords.value::<bool>("materials")?.unwrap_or(false);
    let deformable = keywords.value::<bool>("deformable")?.unwrap_or(false);
    let attributes = keywords
        .choice("attributes", &[("none", Keep::None), ("normals", Keep::Normals), ("all", Keep::All)])?
        .unwrap_or_default();
    let mut options = CompileOptions {
        structure,
        attributes: if materials { Keep::All } else { attributes },
        coordinates: coordinates(keywords)?,
        alpha: keywords
            .choice(
                "alpha",
                &[("none", AlphaMode::None), ("mask", AlphaMode::Mask), ("blend", AlphaMode::Blend)],
            )?
            .unwrap_or_default(),
        polygons: keywords
            .choice("polygons", &[("fans", Polygons::Fans), ("ears", Polygons::Ears)])?
            .unwrap_or_default(),
        positions: keywords
            .choice(
                "positions",
                &[("auto", Positions::Auto), ("f32", Positions::F32), ("f64", Positions::F64)],
            )?
            .unwrap_or_default(),
        geometry: keywords.value("geometry")?.unwrap_or(true),
        names: materials || keywords.value("names")?.unwrap_or(false),
        materials,
        lenient_materials: keywords.value("lenient_materials")?.unwrap_or(false),
        deformable,
        ..CompileOptions::default()
    };
    free_directions(keywords, &mut options)?;
    selection(keywords, &mut options)?;
    if let Some(mib) = keywords.within("memory", 1..=u64::MAX >> 20)? {
        options.objects_memory = mib << 20;
    }
    Ok(options)
}

/// Sets where free directions are kept.
fn free_directions(keywords: &Keywords<'_, '_>, options: &mut CompileOptions) -> PyResult<()> {
    let keep = [
        ("none", free::KeepFree::None),
        ("auto", free::KeepFree::Auto),
        ("distances", free::KeepFree::Distances),
        ("all", free::KeepFree::All),
    ];
    if let Some(keep) = keywords.choice("free_directions", &keep)? {
        options.free.keep = keep;
    }
    Ok(())
}

fn coordinates(keywords: &Keywords<'_, '_>) -> PyResult<coordinates::CoordinateOptions> {
    let bits = keywords
        .choice("coordinates", &[("f32", None), ("21", Some(GridBits::B21)), ("16", Some(GridBits::B16))])?;
    let max_error = match keywords.value::<MaxError>("max_error")? {
        None => None,
        Some(MaxError::Text(text)) => Some(text),
        Some(MaxError::Number(x)) => Some(x.to_string()),
    };
    let max_error = max_error
        .map(|text| text.parse().map_err(|e| PyValueError::new_err(format!("max_error: {e}"))))
        .transpose()?;
    let (bits, max_error) = match bits {
        // As in the program: f32 that is asked for keeps all vertices in place.
        Some(None) => (None, None),
        Some(bits) => (bits, max_error),
        None => (None, max_error),
    };
    Ok(coordinates::CoordinateOptions { bits, max_error })
}

/// A distance as a number, or in words of the program.
#[derive(FromPyObject)]
enum MaxError {
    Number(f64),
    Text(String),
}

/// The rays that will be traced, in f32. Some may be such that they cannot, but not all.
fn known_rays(arrays: &RayArrays<'_>) -> PyResult<KnownRays> {
    let rays = arrays.origin_rays::<f32>()?;
    let mut read = Vec::new();
    rays.read(0..rays.len(), &mut read);
    let (known, _) = KnownRays::of(&read);
    if known.count() == 0 {
        let message = format!("rays: expected rays that can be traced, got none of {}", read.len());
        return Err(PyValueError::new_err(message));
    }
    Ok(known)
}

fn selection(keywords: &Keywords<'_, '_>, options: &mut CompileOptions) -> PyResult<()> {
    let quality =
        [("fast", bvh::Quality::Fast), ("balanced", bvh::Quality::Balanced), ("best", bvh::Quality::Best)];
    if let Some(quality) = keywords.choice("quality", &quality)? {
        options.bvh.quality = quality;
    }
    if let Some(arrays) = keywords.value::<RayArrays<'_>>("rays")? {
        options.costs.rays = Some(Arc::new(known_rays(&arrays)?));
    }
    for (key, value) in keywords.value::<BTreeMap<String, Bound<'_, PyAny>>>("settings")?.unwrap_or_default()
    {
        let setting = Setting::parse(&format!("{}={}", key.replace('_', "-"), value.str()?));
        setting.map_err(|e| PyValueError::new_err(format!("settings: {e}")))?.apply(options);
    }
    Ok(())
}
