//! Materials of an FBX file and their textures.

use serde_json::{Value, json};
use ufbx::{MaterialMap, Scene, Texture, Vec4, WrapMode};

use crate::gltf::made::Made;

/// Wrap modes of glTF samplers (glTF 2.0 specification, §5.26).
const CLAMP: u64 = 33071;
const REPEAT: u64 = 10497;
/// Roughness of a material that has none.
const ROUGH: f64 = 1.0;

/// Adds the materials and textures, with the numbers that the library gives them.
pub(super) fn materials(scene: &Scene, made: &mut Made) {
    let (mut textures, mut images, mut samplers) = (Vec::new(), Vec::new(), Vec::new());
    for texture in &scene.textures {
        let file = file(texture);
        let wrap = |mode: WrapMode| if mode == WrapMode::Clamp { CLAMP } else { REPEAT };
        images.push(image(file, made));
        samplers.push(json!({"wrapS": wrap(texture.wrap_u), "wrapT": wrap(texture.wrap_v)}));
        let number = textures.len();
        textures.push(json!({"source": number, "sampler": number}));
    }
    (made.document.textures, made.document.images) = (Value::Array(textures), Value::Array(images));
    made.document.samplers = Value::Array(samplers);
    made.document.materials = scene.materials.iter().map(|m| material(m)).collect();
}

/// The image of a texture: of a layered one the first below it.
fn file(texture: &Texture) -> &Texture {
    texture.file_textures.iter().next().map_or(texture, |file| file)
}

/// An image in the file, or one next to it by the last part of its name: paths in FBX files
/// belong to the machine that wrote them.
fn image(texture: &Texture, made: &mut Made) -> Value {
    if !texture.content.is_empty() {
        return json!({"bufferView": made.view(&texture.content)});
    }
    let names = [&texture.relative_filename, &texture.filename, &texture.absolute_filename];
    let name = names.into_iter().find(|name| !name.is_empty()).map_or("", |name| name);
    let name = name.replace('\\', "/").replace('%', "%25");
    let is_relative =
        !name.contains(':') && !name.starts_with('/') && !name.split('/').any(|part| part == "..");
    let last = name.rsplit('/').next().unwrap_or_default();
    json!({"uri": if is_relative { &name } else { last }})
}

fn material(material: &ufbx::Material) -> Value {
    let (pbr, fbx) = (&material.pbr, &material.fbx);
    let factor = |map: &MaterialMap, default| if map.has_value { finite(map.value_vec4.x) } else { default };
    let [r, g, b] = color(&pbr.base_color, &pbr.base_factor, 1.0);
    let opacity = factor(&pbr.opacity, 1.0).clamp(0.0, 1.0);
    let mut metallic = json!({
        "baseColorFactor": [r, g, b, opacity],
        "metallicFactor": factor(&pbr.metalness, 0.0).clamp(0.0, 1.0),
        "roughnessFactor": factor(&pbr.roughness, ROUGH).clamp(0.0, 1.0),
    });
    let mut value = json!({
        "name": &*material.element.name,
        "emissiveFactor": color(&pbr.emission_color, &pbr.emission_factor, 0.0).map(|x| x.min(1.0)),
        "doubleSided": true,
    });
    let strength = color(&pbr.emission_color, &pbr.emission_factor, 0.0).into_iter().fold(1.0, f64::max);
    if strength > 1.0 {
        let factor = color(&pbr.emission_color, &pbr.emission_factor, 0.0).map(|x| x / strength);
        value["emissiveFactor"] = json!(factor);
        value["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
    }
    let normal = if used(&pbr.normal_map).is_some() { &pbr.normal_map } else { &fbx.normal_map };
    for (name, map) in [("emissiveTexture", &pbr.emission_color), ("normalTexture", normal)] {
        if let Some(texture) = used(map) {
            value[name] = texture;
        }
    }
    if let Some(texture) = used(&pbr.base_color) {
        metallic["baseColorTexture"] = texture;
    }
    // An opacity map that is the base colour's image: its alpha makes holes.
    let image = |map: &MaterialMap| map.texture.as_deref().map(|texture| file(texture).file_index);
    let has_holes = used(&pbr.opacity).is_some() && image(&pbr.opacity) == image(&pbr.base_color);
    value["alphaMode"] = json!(if has_holes {
        "MASK"
    } else if opacity < 1.0 {
        "BLEND"
    } else {
        "OPAQUE"
    });
    value["pbrMetallicRoughness"] = metallic;
    value
}

/// What is no number counts as 0.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// A colour times its factor; a texture takes the place of the colour.
fn color(color: &MaterialMap, factor: &MaterialMap, default: f64) -> [f64; 3] {
    let Vec4 { x, y, z, .. } = &color.value_vec4;
    let factor = if factor.has_value { factor.value_vec4.x } else { 1.0 };
    let plain = match (used(color), color.has_value) {
        (Some(_), _) => [1.0; 3],
        (None, true) => [*x, *y, *z],
        (None, false) => [default; 3],
    };
    plain.map(|part| finite(part * factor).max(0.0))
}

/// The use of a texture by a material.
fn used(map: &MaterialMap) -> Option<Value> {
    let texture = map.texture.as_deref().filter(|_| map.texture_enabled)?;
    let mut used = json!({"index": texture.element.typed_id});
    let m = &texture.uv_to_texture;
    // glTF has v downwards: 1 - (s (1 - v) + o).
    if texture.has_uv_transform && m.m01 == 0.0 && m.m10 == 0.0 {
        let (scale, offset) = ([m.m00, m.m11].map(finite), [m.m03, 1.0 - m.m11 - m.m13].map(finite));
        used["extensions"] = json!({"KHR_texture_transform": {"scale": scale, "offset": offset}});
    }
    Some(used)
}
