//! The part of the C interface that tells how surfaces look: materials, textures and vertex
//! colours.

use crate::surface::{check_triangle, store};
use crate::{ERROR_ARGUMENT, ERROR_MISSING, Out, fail};
use runtime::rays::Hit;
use runtime::{Alpha, Scene, Wrap};

const DOUBLE_SIDED: u32 = 1;
const UNLIT: u32 = 2;

/// `bth_material_look` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct MaterialC {
    base_color: [f32; 4],
    emissive: [f32; 3],
    alpha_cutoff: f32,
    alpha_mode: u32,
    flags: u32,
    base_color_texture: u32,
    emissive_texture: u32,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    metallic_roughness_texture: u32,
    normal_texture: u32,
    occlusion_texture: u32,
}

/// `bth_texture_image` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct TextureC {
    bytes: *const u8,
    length: usize,
    transform: [[f32; 3]; 2],
    image: u32,
    wrap: [u32; 2],
    nearest: u32,
    uv_set: u32,
    reserved: u32,
}

const _: () = assert!(size_of::<MaterialC>() == 76);
const _: () = assert!(size_of::<TextureC>() == 48 + 2 * size_of::<usize>());

impl MaterialC {
    fn new(material: &runtime::Material) -> Self {
        let flag = |holds: bool, flag: u32| if holds { flag } else { 0 };
        let (alpha_mode, alpha_cutoff) = match material.alpha {
            Alpha::Opaque => (0, 0.0),
            Alpha::Mask(cutoff) => (1, cutoff),
            Alpha::Blend => (2, 0.0),
        };
        let texture = |texture: Option<u32>| texture.unwrap_or(u32::MAX);
        let gloss = material.gloss.unwrap_or_default();
        Self {
            base_color: material.base_color,
            emissive: material.emissive,
            alpha_cutoff,
            alpha_mode,
            flags: flag(material.double_sided, DOUBLE_SIDED) | flag(material.unlit, UNLIT),
            base_color_texture: texture(material.base_color_texture),
            emissive_texture: texture(material.emissive_texture),
            metallic: gloss.metallic,
            roughness: gloss.roughness,
            normal_scale: gloss.normal_scale,
            occlusion_strength: gloss.occlusion_strength,
            metallic_roughness_texture: texture(gloss.metallic_roughness_texture),
            normal_texture: texture(gloss.normal_texture),
            occlusion_texture: texture(gloss.occlusion_texture),
        }
    }
}

/// Why a row of an object's list is not there.
fn no_row(what: &str, object: u32, row: u32, (objects, rows): (u32, u32)) -> (i32, String) {
    let text = match object < objects {
        true => format!("there is no {what} {row} of object {object}, which has {rows}"),
        false => format!("there is no object {object}"),
    };
    (ERROR_ARGUMENT, text)
}

/// How a material looks; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_material(
    scene: Option<&Scene>,
    object: u32,
    material: u32,
    look: Out<'_, MaterialC>,
) -> i32 {
    let find = |scene: &Scene| {
        let objects = scene.object_count();
        let count = if object < objects { scene.material_count(object) } else { 0 };
        if material >= count {
            return Err(no_row("material", object, material, (objects, count)));
        }
        let found = scene.material(object, material).ok_or_else(|| {
            let text = "the file keeps only the names of materials; compile it with --materials".to_owned();
            (ERROR_MISSING, text)
        });
        found.map(|found| MaterialC::new(&found))
    };
    store("bth_material", scene, look, find)
}

/// Number of textures of an object; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_texture_count(scene: Option<&Scene>, object: u32) -> u32 {
    scene.map_or(0, |scene| scene.texture_count(object))
}

/// A texture of an object; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_texture(
    scene: Option<&Scene>,
    object: u32,
    texture: u32,
    image: Out<'_, TextureC>,
) -> i32 {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    };
    let find = |scene: &Scene| {
        let counts = (scene.object_count(), scene.texture_count(object));
        let found =
            scene.texture(object, texture).ok_or_else(|| no_row("texture", object, texture, counts))?;
        Ok(TextureC {
            bytes: found.bytes.as_ptr(),
            length: found.bytes.len(),
            transform: found.transform,
            image: found.image,
            wrap: found.wrap.map(wrap),
            nearest: u32::from(found.nearest),
            uv_set: found.uv_set,
            reserved: 0,
        })
    };
    store("bth_texture", scene, image, find)
}

/// The texture coordinates of a set at a hit; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_texture_coordinates(
    scene: Option<&Scene>,
    hit: Option<&Hit>,
    uv_set: u32,
    uv: Out<'_, [f32; 2]>,
) -> i32 {
    let Some(hit) = hit else {
        return fail(ERROR_ARGUMENT, "bth_texture_coordinates: hit must not be null".into());
    };
    let find = |scene: &Scene| {
        check_triangle(scene, hit.primitive)?;
        if uv_set > 1 {
            return Err((
                ERROR_ARGUMENT,
                format!("there is no set {uv_set} of texture coordinates: sets are 0 and 1"),
            ));
        }
        let nothing = || (ERROR_MISSING, format!("the file keeps no set {uv_set} for the triangle"));
        scene.texture_coordinates(hit, uv_set).ok_or_else(nothing)
    };
    store("bth_texture_coordinates", scene, uv, find)
}

/// The vertex colour at a hit; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_vertex_color(
    scene: Option<&Scene>,
    hit: Option<&Hit>,
    color: Out<'_, [f32; 4]>,
) -> i32 {
    let Some(hit) = hit else {
        return fail(ERROR_ARGUMENT, "bth_vertex_color: hit must not be null".into());
    };
    let find = |scene: &Scene| {
        check_triangle(scene, hit.primitive)?;
        let nothing = || (ERROR_MISSING, "the file keeps no vertex colors of the triangle".to_owned());
        scene.vertex_color(hit).ok_or_else(nothing)
    };
    store("bth_vertex_color", scene, color, find)
}
