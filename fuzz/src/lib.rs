//! What the fuzz targets share.

pub mod write;

use bth::rays::{Hit, PrimitiveRef, Ray, Start, StartRay};
use bth::{Accept, Code, Isa, Scene};
use bth_format::verify::verify;
// Sources of `bth-compile` in `write` name it as their crate's.
use bth_import::error;
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{self, ImportOptions};
use bth_import::{
    AlphaMode, GltfPart, Keep, Mesh, Polygons, Silent, Timing, Wanted, import_bytes, import_cutouts_bytes,
    import_gltf_parts_bytes, import_sequence_bytes, import_vertex_cache_bytes, read_vertex_cache,
};
use bth_random::Rng;
use bth_scene::Source;
use std::path::{Path, PathBuf};

/// A generator seeded by the input (FNV-1a), so that an input always does the same.
fn seeded_by(bytes: &[u8]) -> Rng {
    let fold = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    Rng::new(bytes.iter().fold(0xcbf2_9ce4_8422_2325, fold))
}

/// Opens a file; what passes the checks is traced with 64 rays, at some times, with the instruction
/// set that the input's bytes choose. Whatever the answers: no panic, no end beyond the time limit,
/// nothing read out of bounds.
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
    for object in 0..scene.object_count() {
        let Some(count) = scene.vertex_count(object) else { continue };
        // Scaled along axes, tetrahedra stay as they are, and any others turn some over.
        let scaled = scene.positions(object).iter().map(|[x, y, z]| [1.5 * x, y + 3.0, 0.5 * z]).collect();
        let mut number = || (rng.below(1 << 20) as f32 / (1u32 << 19) as f32 - 1.0) * 1e3;
        let positions = (0..count).map(|_| [number(), number(), number()]).collect();
        for positions in [scaled, positions] {
            let positions: Vec<[f32; 3]> = positions;
            if scene.set_positions(object, &positions).is_ok() {
                assert_eq!(scene.positions(object), positions);
                trace(&scene, &mut rng);
            }
        }
    }
}

/// 64 rays and 64 from starts: one by one, as a batch, nearest and any hit.
fn trace(scene: &Scene, rng: &mut Rng) {
    // A small file with groups may have billions of instances, all in one place.
    if scene.instance_count() > 1 << 12 {
        return;
    }
    let rays: Vec<Ray> = (0..64).map(|_| ray(scene, rng)).collect();
    let starts: Vec<StartRay> = rays
        .iter()
        .map(|ray| {
            let primitive = PrimitiveRef { instance: rng.below(3) as u32, triangle: rng.below(40) as u32 };
            let mut weight = || [0.0, 0.25, 0.5, 1.0, -1.0, f32::NAN][rng.below(6) as usize];
            let (u, v) = (weight(), weight());
            Start { primitive, u, v }.ray(ray.direction).with_tmax(ray.tmax)
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut found = vec![false; rays.len()];
    scene.batch(&rays).nearest(&mut hits);
    scene.batch(&rays).any(&mut found);
    let onward: Vec<StartRay> =
        rays.iter().zip(&hits).map(|(ray, hit)| StartRay::from_hit(hit, ray.direction)).collect();
    for starts in [&starts, &onward] {
        let (mut after, mut blocked) = (hits.clone(), found.clone());
        scene.batch(starts).nearest(&mut after);
        scene.batch(starts).any(&mut blocked);
        for ((ray, hit), blocked) in starts.iter().zip(&after).zip(blocked) {
            assert!(hit.is_hit() == blocked || has_wrong_geometry(scene));
            assert!(!hit.is_hit() || scene.check_start(&ray.start).is_ok());
        }
    }
    for hit in &hits {
        if let Some(surface) = scene.surface(hit) {
            assert!(surface.group < scene.group_count(surface.object));
            scene.group_name(surface.object, surface.group);
            if let Some(material) = surface.material {
                scene.material_name(surface.object, material);
                let look = scene.material(surface.object, material);
                for texture in
                    look.into_iter().flat_map(|look| [look.base_color_texture, look.emissive_texture])
                {
                    let texture =
                        texture.map(|row| scene.texture(surface.object, row).expect("a checked row"));
                    assert!(texture.is_none_or(|texture| !texture.bytes.is_empty()));
                }
            }
            scene.vertex_color(hit);
            scene.object_name(surface.object);
        }
        scene.triangle_in_world(hit.primitive);
    }
    scene.bounds();
    let mut all = Vec::new();
    for (ray, start) in rays.iter().zip(&starts).take(8) {
        scene.nearest(ray);
        scene.any(ray);
        scene.nearest_counted(ray);
        scene.nearest(start);
        scene.any(start);
        scene.nearest_counted(start);
        scene.all_hits(start, &Accept::default(), &mut all);
        scene.crossings(start);
    }
}

/// Returns true if the boxes or triangles of a file contradict each other. Then a triangle may be
/// hidden from one walk and not from another.
fn has_wrong_geometry(scene: &Scene) -> bool {
    let is_about_bytes = |error: &bth::Error| matches!(error.code(), Code::SectionHash | Code::Gap);
    verify(scene.file()).is_err_and(|errors| !errors.iter().all(is_about_bytes))
}

/// A ray about an instance: often between points of its box, along axes, from corners; also without
/// sense.
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
    let polygons = Polygons::Ears;
    let wanted = Wanted { attributes: Keep::All, groups: true, materials: true, polygons, ..Wanted::default() };
    let Ok((mesh, report)) = import_bytes(&name, bytes, wanted, &Silent) else { return };
    assert_eq!(report.triangles, mesh.triangles.len() as u64);
    check(&mesh);
    if let Ok(cutouts) = import_cutouts_bytes(&name, bytes, AlphaMode::Blend, &Silent) {
        let fits = |t: &bth_import::CutoutTriangle| {
            (t.triangle as usize) < mesh.triangles.len() && (t.material as usize) < cutouts.materials.len()
        };
        assert!(cutouts.triangles.iter().all(fits));
    }
}

/// Imports a glTF file as a scene with all its animations; its manifest reads back equal, and its
/// meshes keep the promises of their type, also those that deform.
pub fn import_scene(bytes: &[u8]) {
    let path = Path::new("/nonexistent/fuzz/model.gltf");
    let rigid_parts = bytes.len() % 2 == 1;
    let options = ImportOptions { animation: Chosen::All, rigid_parts, ..ImportOptions::default() };
    let Ok((manifest, _)) = scene::import_bytes(path, bytes, "model.gltf", &options, &Silent) else { return };
    let text = manifest.to_toml();
    let again = bth_scene::parse(&text, Path::new("fuzz.manifest"));
    assert!(again.expect("what is written can be read") == manifest, "{text}");
    let part = |object: &bth_scene::Object| match object.source {
        Source::Model { mesh, .. } => mesh.map(GltfPart::Mesh),
        Source::Deforming { mesh, without, .. } => Some(GltfPart::Deforming { mesh, without }),
        Source::RigidPart { mesh, joint, .. } => Some(GltfPart::Rigid { mesh, joint }),
        Source::AtRest { node, .. } => Some(GltfPart::AtRest(node)),
        _ => None,
    };
    let parts: Vec<GltfPart> = manifest.objects.iter().filter_map(part).take(16).collect();
    let wanted = Wanted { attributes: Keep::All, groups: true, materials: true, ..Wanted::default() };
    let Ok(meshes) = import_gltf_parts_bytes(path, bytes, &parts, wanted, &Silent) else { return };
    for ((mesh, _), part) in meshes.iter().zip(&parts) {
        check(mesh);
        assert_eq!(mesh.deformation.is_some(), matches!(part, GltfPart::Deforming { .. }));
    }
}

/// What the types of a mesh that was read with groups and materials promise.
fn check(mesh: &Mesh) {
    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
    assert!(mesh.triangles.as_flattened().iter().all(|row| (*row as usize) < mesh.positions.len()));
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
    assert!(
        materials.color_corners.as_flattened().iter().all(|row| (*row as usize) < materials.colors.len())
    );
    assert!([0, mesh.triangles.len()].contains(&materials.color_corners.len()));
    assert!([0, mesh.triangles.len()].contains(&materials.second_corners.len()));
    let rows = materials.second_uvs.len();
    assert!(materials.second_corners.as_flattened().iter().all(|row| (*row as usize) < rows));
    assert!(materials.second_uvs.as_flattened().iter().all(|x| x.is_finite()));
    if let Some(attributes) = &mesh.attributes {
        let rows = attributes.normals.len().max(attributes.uvs.len());
        assert!(attributes.corners.as_flattened().iter().all(|row| (*row as usize) < rows));
        assert_eq!(attributes.corners.len(), mesh.triangles.len());
    }
    let Some(moved) = &mesh.deformation else { return };
    let normals = mesh.attributes.as_ref().map_or(0, |attributes| attributes.normals.len());
    let (sets, targets) = (moved.counts.influence_sets as usize, moved.counts.targets as usize);
    assert_eq!([moved.joints.len(), moved.weights.len()], [sets * mesh.positions.len(); 2]);
    assert!(moved.joints.as_flattened().iter().all(|joint| u32::from(*joint) < moved.counts.joints));
    assert!(moved.weights.as_flattened().iter().all(|weight| weight.is_finite() && *weight >= 0.0));
    assert!(moved.deltas.as_flattened().iter().all(|x| x.is_finite()));
    assert!([targets, 2 * targets].contains(&moved.morphs.len()));
    for (i, morph) in moved.morphs.iter().enumerate() {
        let all = if i < targets { mesh.positions.len() } else { normals };
        let first = morph.first_row as usize;
        match morph.first_row {
            u32::MAX => assert_eq!(morph.deltas as usize, all),
            _ => {
                let rows = &moved.morph_rows[first..][..morph.deltas as usize];
                assert!(rows.windows(2).all(|pair| pair[0] < pair[1]));
                assert!(rows.iter().all(|row| (*row as usize) < all));
            }
        }
        assert!(morph.first_delta as usize + morph.deltas as usize <= moved.deltas.len());
    }
}

/// Between two frames of a sequence in an input.
const FRAME_END: &[u8] = b"\0FRAME\0";

/// Imports the frames of a sequence, which the input has one after the other behind a byte that
/// chooses their format.
pub fn import_frames(bytes: &[u8]) {
    let Some((choice, mut rest)) = bytes.split_first() else { return };
    let name = PathBuf::from("frame").with_extension(["obj", "ply", "stl", "off"][usize::from(*choice % 4)]);
    let mut files = Vec::new();
    while let Some(end) = rest.windows(FRAME_END.len()).position(|part| part == FRAME_END) {
        files.push((name.clone(), rest[..end].to_vec()));
        rest = &rest[end + FRAME_END.len()..];
    }
    files.push((name, rest.to_vec()));
    let timing = Timing { rate: Some(f64::from(*choice)), usual_rate: 24.0, start: 0.0 };
    let polygons = Polygons::Ears;
    let wanted =
        |vertices| Wanted { attributes: Keep::All, groups: true, materials: true, polygons, vertices, ..Wanted::default() };
    for vertices in [false, true] {
        if let Ok((mesh, _)) = import_sequence_bytes(&files, &timing, wanted(vertices), &Silent) {
            assert_eq!(mesh.sequence.as_ref().expect("frames").times.len(), files.len());
            check_moving(&mesh);
        }
    }
}

/// Reads a vertex cache, and imports it with a model of four vertices.
pub fn import_cache(bytes: &[u8]) {
    let (name, model) = (Path::new("cache"), Path::new("model.obj"));
    let square = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    for rate in [None, Some(25.0)] {
        let timing = Timing { rate, usual_rate: 24.0, start: 0.5 };
        if let Ok(cache) = read_vertex_cache(name, bytes, &timing, &Silent) {
            assert_eq!(cache.positions.len(), cache.points * cache.times.len());
        }
        let wanted = Wanted { attributes: Keep::All, groups: true, materials: true, ..Wanted::default() };
        let read = import_vertex_cache_bytes((model, square, None), (name, bytes), &timing, wanted, &Silent);
        if let Ok((mesh, _)) = read {
            check_moving(&mesh);
        }
    }
}

/// A mesh with frames keeps the promises of its type.
fn check_moving(mesh: &Mesh) {
    let sequence = mesh.sequence.as_ref().expect("frames");
    assert!(sequence.times.iter().all(|time| time.is_finite()));
    assert!(sequence.times.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!(sequence.positions.len(), sequence.times.len() * mesh.positions.len());
    assert!(sequence.positions.as_flattened().iter().all(|x| x.is_finite()));
    assert!(sequence.positions.starts_with(&mesh.positions));
    assert!(mesh.triangles.as_flattened().iter().all(|row| (*row as usize) < mesh.positions.len()));
}
