//! What the fuzz targets share.

use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Isa, Scene};
use bth_compile::Silent;
use bth_import::{AlphaMode, Keep, Wanted, import_bytes, import_cutouts_bytes};
use bth_random::Rng;
use std::path::Path;

/// A generator seeded by the input (FNV-1a), so that an input always does the same.
fn seeded_by(bytes: &[u8]) -> Rng {
    let fold = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    Rng::new(bytes.iter().fold(0xcbf2_9ce4_8422_2325, fold))
}

/// Opens a file; what passes the checks is traced with 64 rays, at some times, with the instruction set that the
/// input's bytes choose. Whatever the answers: no panic, no end beyond the time limit, nothing read out of bounds.
pub fn open_and_trace(bytes: &[u8]) {
    let Ok(mut scene) = bth::from_bytes(bytes) else { return };
    let mut rng = seeded_by(bytes);
    let available: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    available[rng.below(available.len() as u64) as usize].choose().expect("it is available");
    trace(&scene, &mut rng);
    if scene.description().is_some() {
        for seconds in [0.3, -1.0, 1.5, 1e300, f64::NAN] {
            if scene.set_seconds(seconds).is_ok() {
                trace(&scene, &mut rng);
            }
        }
    }
}

/// 64 rays: one by one, as a batch, with and without hints, nearest and any hit.
fn trace(scene: &Scene, rng: &mut Rng) {
    let rays: Vec<Ray> = (0..64).map(|_| ray(scene, rng)).collect();
    let from: Vec<PrimitiveRef> = rays
        .iter()
        .map(|_| PrimitiveRef { instance: rng.below(3) as u32, triangle: rng.below(40) as u32 })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut found = vec![false; rays.len()];
    scene.batch(&rays).nearest(&mut hits);
    scene.batch(&rays).from(&from[..]).nearest(&mut hits);
    scene.batch(&rays).from(&from[..]).any(&mut found);
    scene.batch(&rays).any(&mut found);
    for hit in &hits {
        if let Some(surface) = scene.surface(hit) {
            assert!(surface.group < scene.group_count(surface.object));
            scene.group_name(surface.object, surface.group);
            if let Some(material) = surface.material {
                scene.material_name(surface.object, material);
                let look = scene.material(surface.object, material);
                for texture in look.into_iter().flat_map(|look| [look.base_color_texture, look.emissive_texture]) {
                    let texture = texture.map(|row| scene.texture(surface.object, row).expect("a checked row"));
                    assert!(texture.is_none_or(|texture| !texture.bytes.is_empty()));
                }
            }
            scene.vertex_color(hit);
            scene.object_name(surface.object);
        }
        scene.triangle_in_world(hit.primitive);
    }
    scene.bounds();
    for (ray, from) in rays.iter().zip(&from).take(8) {
        scene.nearest_from(ray, *from);
        scene.any(ray);
        scene.nearest_counted(ray, *from);
    }
}

/// A ray about an instance: often between points of its box, along axes, from corners; also without sense.
fn ray(scene: &Scene, rng: &mut Rng) -> Ray {
    let instance = rng.below(u64::from(scene.instance_count().max(1))) as u32;
    let bounds = (instance < scene.instance_count()).then(|| scene.instance_bounds(instance)).flatten();
    let (lower, upper) = bounds.unwrap_or(([-1.0; 3], [1.0; 3]));
    let mut point = |spread: f32| {
        let s = [(); 3].map(|()| match rng.below(4) {
            0 => rng.below(2) as f32,
            1 => 0.5,
            _ => 0.5 + ((rng.next() >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * spread,
        });
        [0, 1, 2].map(|k| lower[k] * (1.0 - s[k]) + upper[k] * s[k])
    };
    let (origin, target) = (point(4.0), point(1.0));
    let mut direction = [0, 1, 2].map(|k| target[k] - origin[k]);
    if rng.below(4) == 0 {
        let axis = rng.below(3) as usize;
        direction = [0.0, -0.0, 0.0];
        direction[axis] = if rng.below(2) == 0 { -1.0 } else { 1e-30 };
    }
    let tmin = [0.0, 0.0, 0.5, -1.0, f32::NEG_INFINITY, f32::NAN][rng.below(6) as usize];
    let tmax = [f32::INFINITY, 1.0, f32::INFINITY, f32::MAX, 1e-30, f32::NAN][rng.below(6) as usize];
    Ray { origin, tmin, direction, tmax }
}

/// Imports a model of this format; a mesh that comes out keeps the promises of its type.
pub fn import(format: &str, bytes: &[u8]) {
    let name = Path::new("/nonexistent/fuzz/model").with_extension(format);
    let wanted = Wanted { attributes: Keep::All, groups: true, materials: true, vertices: false };
    let Ok((mesh, report)) = import_bytes(&name, bytes, wanted, &Silent) else { return };
    assert_eq!(report.triangles, mesh.triangles.len() as u64);
    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
    assert!(mesh.triangles.as_flattened().iter().all(|row| (*row as usize) < mesh.positions.len()));
    if let Ok(cutouts) = import_cutouts_bytes(&name, bytes, AlphaMode::Blend, &Silent) {
        let fits = |t: &bth_import::CutoutTriangle| {
            (t.triangle as usize) < mesh.triangles.len() && (t.material as usize) < cutouts.materials.len()
        };
        assert!(cutouts.triangles.iter().all(fits));
    }
    let groups = mesh.groups.as_ref().expect("groups, which are wanted");
    assert!(groups.runs.first().is_none_or(|run| run[0] == 0));
    assert!(groups.runs.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] != pair[1][1]));
    assert!(groups.runs.iter().all(|run| (run[0] as usize) < mesh.triangles.len()));
    assert!(groups.runs.iter().all(|run| (run[1] as usize) < groups.groups.len()));
    let material =
        |group: &bth_import::Group| group.material.is_none_or(|m| (m as usize) < groups.materials.len());
    assert!(groups.groups.iter().all(material));
    let materials = mesh.materials.as_ref().expect("materials, which are wanted");
    assert!([0, groups.materials.len()].contains(&materials.parameters.len()));
    assert!(materials.color_corners.as_flattened().iter().all(|row| (*row as usize) < materials.colors.len()));
    assert!([0, mesh.triangles.len()].contains(&materials.color_corners.len()));
    if let Some(attributes) = &mesh.attributes {
        let rows = attributes.normals.len().max(attributes.uvs.len());
        assert!(attributes.corners.as_flattened().iter().all(|row| (*row as usize) < rows));
        assert_eq!(attributes.corners.len(), mesh.triangles.len());
    }
}
