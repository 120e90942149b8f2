//! The surface at hits.

use crate::queries::{HIT_COLUMNS, hit};
use bth::Scene;
use bth::rays::Hit;

/// Numbers of a hit's surface: position, normal and geometric normal (3 each, world space), texture
/// coordinates (2), linear red, green, blue and alpha, texture coordinates of the second set (2),
/// as f32; object, group and material, as words.
const SURFACE_COLUMNS: usize = 20;

/// The surface at hits: columns of [`SURFACE_COLUMNS`] words a hit. A miss, and all hits if the
/// file does not keep the vertices of triangles, have numbers of NaN and indices of 2^32 - 1. So
/// have texture coordinates and materials that the file does not keep. The colour is the material's
/// factor times the colour at the vertices, without textures. It is white where there is neither.
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
        let columns = std::slice::from_raw_parts_mut(surfaces, SURFACE_COLUMNS * count);
        (&*scene, std::slice::from_raw_parts(hits, HIT_COLUMNS * count), columns)
    };
    for i in 0..count {
        for (k, word) in surface(scene, &hit(hits, count, i)).into_iter().enumerate() {
            columns[k * count + i] = word;
        }
    }
}

/// The words of one hit.
fn surface(scene: &Scene, hit: &Hit) -> [u32; SURFACE_COLUMNS] {
    let mut words = [f32::NAN.to_bits(); SURFACE_COLUMNS];
    words[17..].fill(u32::MAX);
    let Some(surface) = hit.is_hit().then(|| scene.surface(hit)).flatten() else { return words };
    let vectors = [surface.position, surface.normal, surface.geometric_normal];
    for (to, from) in words.iter_mut().zip(vectors.as_flattened()) {
        *to = (*from as f32).to_bits();
    }
    for (to, from) in words[9..11].iter_mut().zip(surface.uv.iter().flatten()) {
        *to = from.to_bits();
    }
    let factor = surface.material.and_then(|m| scene.material(surface.object, m)).map(|m| m.base_color);
    let (factor, at_vertices) = (factor.unwrap_or([1.0; 4]), scene.vertex_color(hit).unwrap_or([1.0; 4]));
    for k in 0..4 {
        words[11 + k] = (factor[k] * at_vertices[k]).to_bits();
    }
    for (to, from) in words[15..17].iter_mut().zip(scene.texture_coordinates(hit, 1).iter().flatten()) {
        *to = from.to_bits();
    }
    words[17..].copy_from_slice(&[surface.object, surface.group, surface.material.unwrap_or(u32::MAX)]);
    words
}
