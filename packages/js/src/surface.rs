//! The surface at hits.

use crate::queries::{HIT_COLUMNS, hit, store_f64};
use bth::Scene;
use bth::rays::Hit;

/// Words of a hit's surface: position (3 numbers of f64, two words each), normal and geometric
/// normal (3 each, world space), texture coordinates (2), linear red, green, blue and alpha,
/// texture coordinates of the second set (2), as f32; object, group and material, as words.
const SURFACE_WORDS: usize = 23;

/// Words of positions.
const POSITION_WORDS: usize = 6;

/// The surface at hits: columns, of positions with two words a hit, of others with one. A miss, and
/// all hits if the file does not keep the vertices of triangles, have numbers of NaN and indices of
/// 2^32 - 1. So have texture coordinates and materials that the file does not keep. The colour is
/// the material's factor times the colour at the vertices, without textures. It is white where
/// there is neither.
///
/// # Safety
/// `scene` is open, `hits` points to the columns that `bth_nearest` wrote for `count` rays, and
/// `surfaces` to as many words as stated, which overlap nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_surface(
    scene: *const Scene,
    hits: *const u32,
    count: usize,
    surfaces: *mut u32,
) {
    // SAFETY: by contract the scene is open, and the addresses belong to arrays of these lengths,
    // which do not overlap.
    let (scene, hits, columns) = unsafe {
        let columns = std::slice::from_raw_parts_mut(surfaces, SURFACE_WORDS * count);
        (&*scene, std::slice::from_raw_parts(hits, HIT_COLUMNS * count), columns)
    };
    for i in 0..count {
        let (position, words) = surface(scene, &hit(hits, count, i));
        store_f64(columns, count, i, position);
        for (k, word) in words.into_iter().enumerate() {
            columns[(POSITION_WORDS + k) * count + i] = word;
        }
    }
}

/// The position and the other words of one hit.
fn surface(scene: &Scene, hit: &Hit) -> ([f64; 3], [u32; SURFACE_WORDS - POSITION_WORDS]) {
    let mut words = [f32::NAN.to_bits(); SURFACE_WORDS - POSITION_WORDS];
    words[14..].fill(u32::MAX);
    let Some(surface) = hit.is_hit().then(|| scene.surface(hit)).flatten() else {
        return ([f64::NAN; 3], words);
    };
    let vectors = [surface.normal, surface.geometric_normal];
    for (to, from) in words.iter_mut().zip(vectors.as_flattened()) {
        *to = (*from as f32).to_bits();
    }
    for (to, from) in words[6..8].iter_mut().zip(surface.uv.iter().flatten()) {
        *to = from.to_bits();
    }
    let factor = surface.material.and_then(|m| scene.material(surface.object, m)).map(|m| m.base_color);
    let (factor, at_vertices) = (factor.unwrap_or([1.0; 4]), scene.vertex_color(hit).unwrap_or([1.0; 4]));
    for k in 0..4 {
        words[8 + k] = (factor[k] * at_vertices[k]).to_bits();
    }
    for (to, from) in words[12..14].iter_mut().zip(scene.texture_coordinates(hit, 1).iter().flatten()) {
        *to = from.to_bits();
    }
    words[14..].copy_from_slice(&[surface.object, surface.group, surface.material.unwrap_or(u32::MAX)]);
    (surface.position, words)
}
