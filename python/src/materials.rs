//! How surfaces look: the materials and textures of objects.

use crate::errors::check_index;
use crate::scene::NativeScene;
use bth::{Alpha, Gloss, Scene, Wrap};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Name, base colour, its texture, emission, its texture, what alpha means, cutoff, whether
/// double-sided, whether unlit, gloss.
type MaterialRow =
    (String, [f32; 4], Option<u32>, [f32; 3], Option<u32>, &'static str, f32, bool, bool, Option<GlossRow>);

/// Metallic and roughness and the texture of both; the texture and scale of normals; the texture
/// and strength of occlusion.
type GlossRow = (f32, f32, Option<u32>, Option<u32>, f32, Option<u32>, f32);

/// Image, bytes of its file, wrap modes, whether the nearest texel is taken, set of coordinates,
/// rows of the transform.
type TextureRow<'py> = (u32, Bound<'py, PyBytes>, (&'static str, &'static str), bool, u32, [[f32; 3]; 2]);

fn row(scene: &Scene, object: u32, material: u32) -> Option<MaterialRow> {
    let look = scene.material(object, material)?;
    let (alpha, cutoff) = match look.alpha {
        Alpha::Opaque => ("opaque", 0.0),
        Alpha::Mask(cutoff) => ("mask", cutoff),
        Alpha::Blend => ("blend", 0.0),
    };
    let name = scene.material_name(object, material).to_owned();
    Some((
        name,
        look.base_color,
        look.base_color_texture,
        look.emissive,
        look.emissive_texture,
        alpha,
        cutoff,
        look.double_sided,
        look.unlit,
        look.gloss.map(gloss_row),
    ))
}

fn gloss_row(gloss: Gloss) -> GlossRow {
    let Gloss { metallic, roughness, metallic_roughness_texture, .. } = gloss;
    let Gloss { normal_texture, normal_scale, occlusion_texture, occlusion_strength, .. } = gloss;
    (
        metallic,
        roughness,
        metallic_roughness_texture,
        normal_texture,
        normal_scale,
        occlusion_texture,
        occlusion_strength,
    )
}

/// The materials of an object; `None` where the file keeps only the name.
#[pyfunction]
pub(crate) fn materials(
    py: Python<'_>,
    scene: &NativeScene,
    object: u32,
) -> PyResult<Vec<Option<MaterialRow>>> {
    scene.with(py, |scene| {
        check_index("object", object, scene.object_count())?;
        Ok((0..scene.material_count(object)).map(|material| row(scene, object, material)).collect())
    })?
}

/// The textures of an object.
#[pyfunction]
pub(crate) fn textures<'py>(
    py: Python<'py>,
    scene: &NativeScene,
    object: u32,
) -> PyResult<Vec<TextureRow<'py>>> {
    let scene = scene.get()?;
    let scene = scene.read_attached(py)?;
    check_index("object", object, scene.object_count())?;
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    };
    let row = |texture: bth::Texture<'_>| {
        let [u, v] = texture.wrap.map(wrap);
        let bytes = PyBytes::new(py, texture.bytes);
        (texture.image, bytes, (u, v), texture.nearest, texture.uv_set, texture.transform)
    };
    Ok((0..scene.texture_count(object)).filter_map(|k| scene.texture(object, k)).map(row).collect())
}
