//! How surfaces look, and the image files of textures.

use bth::{Alpha, Scene, Wrap};

/// Words of [`bth_material`].
const MATERIAL_WORDS: usize = 19;

/// Words of [`bth_texture`].
const TEXTURE_WORDS: usize = 13;

/// Writes how a material of an object looks, [`MATERIAL_WORDS`] words: red, green, blue and alpha
/// of the base colour, red, green and blue of the emission and the cutoff, as f32; what alpha means
/// (0 nothing, 1 a mask, 2 a share); the bits 1 for both sides, 2 for no light and 4 for gloss;
/// textures of the base colour and of the emission, 2^32 - 1 for none; of the gloss metallic,
/// roughness, scale of normals and strength of occlusion, as f32, and the textures of the first
/// two, of normals and of occlusion. Returns 0 if the file does not keep it.
///
/// # Safety
/// `scene` is open, and `words` points to as many words as stated, which overlap nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_material(
    scene: *const Scene,
    object: u32,
    material: u32,
    words: *mut [u32; MATERIAL_WORDS],
) -> u32 {
    // SAFETY: by contract the scene is open, and `words` points to an array of this length.
    let (scene, words) = unsafe { (&*scene, &mut *words) };
    let Some(found) = scene.material(object, material) else { return 0 };
    let [r, g, b, a] = found.base_color.map(f32::to_bits);
    let [er, eg, eb] = found.emissive.map(f32::to_bits);
    let (alpha, cutoff) = match found.alpha {
        Alpha::Opaque => (0, 0.0),
        Alpha::Mask(cutoff) => (1, cutoff),
        Alpha::Blend => (2, 0.0),
    };
    let is_glossy = u32::from(found.gloss.is_some());
    let flags = u32::from(found.double_sided) | u32::from(found.unlit) << 1 | is_glossy << 2;
    let texture = |texture: Option<u32>| texture.unwrap_or(u32::MAX);
    let gloss = found.gloss.unwrap_or_default();
    *words = [
        r,
        g,
        b,
        a,
        er,
        eg,
        eb,
        cutoff.to_bits(),
        alpha,
        flags,
        texture(found.base_color_texture),
        texture(found.emissive_texture),
        gloss.metallic.to_bits(),
        gloss.roughness.to_bits(),
        gloss.normal_scale.to_bits(),
        gloss.occlusion_strength.to_bits(),
        texture(gloss.metallic_roughness_texture),
        texture(gloss.normal_texture),
        texture(gloss.occlusion_texture),
    ];
    1
}

/// Writes a texture of an object, [`TEXTURE_WORDS`] words: the address and the bytes of its image
/// file, the index of the image, wrap modes for u and v (0 repeat, 1 mirror, 2 clamp), whether the
/// nearest texel is taken, the set of its texture coordinates, and the rows of their transform as
/// f32. Returns 0 if there is no such texture.
///
/// # Safety
/// The contract of [`bth_material`], with as many words as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_texture(
    scene: *const Scene,
    object: u32,
    texture: u32,
    words: *mut [u32; TEXTURE_WORDS],
) -> u32 {
    // SAFETY: as in `bth_material`.
    let (scene, words) = unsafe { (&*scene, &mut *words) };
    let Some(found) = scene.texture(object, texture) else { return 0 };
    let [s, t] = found.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    // Addresses have 32 bits here.
    let (address, length) = (found.bytes.as_ptr() as usize as u32, found.bytes.len() as u32);
    words[..7].copy_from_slice(&[address, length, found.image, s, t, found.nearest.into(), found.uv_set]);
    for (to, from) in words[7..].iter_mut().zip(found.transform.as_flattened()) {
        *to = from.to_bits();
    }
    1
}
