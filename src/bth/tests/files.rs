//! The conformance files, embedded: opened, checked, damaged and traced without a file system, as
//! it runs under Miri (`tools/check/miri`), in WebAssembly and on 32-bit machines
//! (`tools/check/targets`).

use bth::TraceRay;
use bth::rays::{Hit, PrimitiveRef, Ray, Start, StartRay};

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_bytes!(concat!("../../../format-spec/conformance/valid/", $name, ".bth")).as_slice())),*]
    };
}

const VALID: [(&str, &[u8]); 32] = files![
    "deformable",
    "deformers",
    "free-directions",
    "free-distances",
    "gloss",
    "grid-16",
    "grid-21",
    "groups",
    "materials",
    "no-objects",
    "nothing-to-hit",
    "opacity",
    "scene-empty",
    "scene-groups",
    "scene-moving",
    "scene-still",
    "scene-trees",
    "scene-trees-of-first-groups",
    "scene-trees-of-groups",
    "second-uvs",
    "sequence",
    "tets-link32",
    "triangle",
    "triangle-bare",
    "two-levels",
    "two-objects",
    "unknown-optional-section",
    "places",
    "places-deformable",
    "places-grid-16",
    "places-tets",
    "widened-boxes",
];

#[test]
#[cfg(all(not(miri), not(target_family = "wasm")))]
fn every_valid_file_is_among_them() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../format-spec/conformance/valid");
    // No query reads `exact-positions` yet.
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), VALID.len() + 1);
}

/// Rays along and across the boxes of the scene's instances.
fn rays(scene: &bth::Scene) -> Vec<Ray> {
    let boxes: Vec<_> = (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i)).collect();
    let count = if cfg!(miri) { 5 } else { 2000 };
    let ray = |i: usize| {
        let (lower, upper) = boxes.get(i % boxes.len().max(1)).copied().unwrap_or(([-1.0; 3], [1.0; 3]));
        let ends = [0.5f32, -1.0, 0.25, 1.0, 2.0, 0.0, 0.625];
        let point = |i: usize| {
            [1, 3, 17]
                .map(|step| ends[i / step % 7])
                .into_iter()
                .zip(0..3)
                .map(|(s, k)| lower[k] * (1.0 - s) + upper[k] * s)
        };
        let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
        for (k, (from, to)) in point(5 * i + 4).zip(point(i)).enumerate() {
            (origin[k], direction[k]) = (from, to - from);
        }
        Ray { origin, tmin: 0.0, direction, tmax: if i % 3 == 2 { 1.0 } else { f32::INFINITY } }
    };
    (0..count).map(ray).collect()
}

fn trace(scene: &bth::Scene) -> usize {
    let rays = rays(scene);
    let hits = trace_all(scene, &rays);
    // The rays that start where these hit, and some that start elsewhere.
    let onward: Vec<StartRay> = (rays.iter().zip(&hits).zip(0u32..))
        .map(|((ray, hit), i)| match i % 3 {
            0 => {
                let primitive = PrimitiveRef { instance: i % 2, triangle: i % 5 };
                Start { primitive, u: 0.25, v: (i % 4) as f32 * 0.25 }.ray(ray.direction)
            }
            _ => StartRay::from_hit(hit, ray.direction.map(|x| -x)).with_tmax(ray.tmax),
        })
        .collect();
    trace_all(scene, &onward);
    hits.iter().filter(|hit| hit.is_hit()).count()
}

/// The nearest hits of rays, which are the same in a batch and alone.
fn trace_all<R: TraceRay + std::fmt::Debug>(scene: &bth::Scene, rays: &[R]) -> Vec<Hit> {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    scene.batch(rays).nearest(&mut hits);
    scene.batch(rays).any(&mut found);
    for ((ray, hit), found) in rays.iter().zip(&hits).zip(found) {
        assert_eq!(hit.is_hit(), found);
        assert_eq!(scene.nearest(ray).unwrap_or(Hit::MISS), *hit, "{ray:?}");
    }
    hits
}

#[test]
#[cfg(target_endian = "little")]
fn every_valid_file_opens_verifies_and_is_traced() {
    let mut hits = 0;
    for (name, bytes) in VALID {
        let file = bth_format::File::from_bytes(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{name}: {}", e[0]));
        let mut scene = bth::from_bytes(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        hits += trace(&scene);
        if scene.description().is_some() {
            scene.set_seconds(0.75).unwrap_or_else(|e| panic!("{name}: {e}"));
            hits += trace(&scene);
        }
    }
    assert!(hits > 5, "{hits} hits");
}

/// The text of `BTH-O002`, which is all that a big-endian machine gets.
#[test]
#[cfg(target_endian = "big")]
fn big_endian_machines_get_the_documented_error() {
    for (name, bytes) in VALID {
        let error = bth_format::File::from_bytes(bytes).unwrap_err();
        assert_eq!(error.code().as_str(), "BTH-O002", "{name}");
        assert!(error.to_string().contains("big-endian"), "{error}");
        assert!(bth::from_bytes(bytes).is_err());
    }
}

/// Cuts and flipped bytes of the smallest files: an error, whatever they hit.
#[test]
#[cfg(target_endian = "little")]
fn damaged_files_are_refused() {
    let step = if cfg!(miri) { 311 } else { 1 };
    for (name, bytes) in VALID.into_iter().filter(|(_, bytes)| bytes.len() <= 1280) {
        for at in (0..bytes.len()).step_by(step) {
            assert!(bth::from_bytes(&bytes[..at]).is_err(), "{name} cut to {at} bytes");
            let mut damaged = bytes.to_vec();
            damaged[at] ^= 0x55;
            let refused = bth_format::File::from_bytes(&damaged)
                .map_or(true, |file| bth_format::verify::verify(&file).is_err());
            assert!(refused, "{name} with byte {at} flipped");
        }
    }
}

/// The file `materials`: what its three objects look like, and the bytes of its images.
#[test]
fn materials_and_textures_are_those_of_the_file() {
    let (_, bytes) = VALID.into_iter().find(|(name, _)| *name == "materials").unwrap();
    let scene = bth::from_bytes(bytes).unwrap();
    let lamp = scene.material(0, 0).unwrap();
    assert_eq!((lamp.emissive, lamp.emissive_texture), ([4.0, 3.0, 0.0], Some(2)));
    assert_eq!((lamp.alpha, lamp.double_sided, lamp.base_color_texture), (bth::Alpha::Opaque, true, None));
    let leaf = scene.material(0, 1).unwrap();
    assert_eq!((leaf.base_color, leaf.base_color_texture), ([0.5, 0.25, 1.0, 1.0], Some(0)));
    assert_eq!((leaf.alpha, leaf.double_sided, leaf.unlit), (bth::Alpha::Mask(0.5), false, false));
    let glass = scene.material(1, 0).unwrap();
    assert_eq!((glass.alpha, glass.unlit), (bth::Alpha::Blend, true));
    let nowhere = [(0, 2), (2, 0), (3, 0)].map(|(object, material)| scene.material(object, material));
    assert_eq!(nowhere, [None; 3]);

    assert_eq!([0, 1, 2, 3].map(|object| scene.texture_count(object)), [3, 1, 0, 0]);
    let texture = scene.texture(0, 0).unwrap();
    assert_eq!((texture.wrap, texture.nearest), ([bth::Wrap::Repeat, bth::Wrap::Mirror], true));
    assert_eq!(texture.coordinates([0.5, 0.25]), [0.75, 0.75]);
    assert!(texture.bytes.starts_with(b"\x89PNG") && texture.bytes.ends_with(b"IEND\xaeB`\x82"));
    assert_eq!(scene.texture(0, 1).map(|t| (t.image, t.bytes)), Some((texture.image, texture.bytes)));
    assert_ne!(scene.texture(0, 2).unwrap().bytes, texture.bytes);
    assert_eq!(scene.texture(0, 2).unwrap().image, scene.texture(1, 0).unwrap().image);
    assert_eq!((scene.texture(0, 3), scene.texture(9, 0)), (None, None));

    let hit = |instance: u32, u: f32, v: f32| Hit {
        t: 1.0,
        u,
        v,
        primitive: PrimitiveRef { instance, triangle: 0 },
    };
    assert_eq!(scene.vertex_color(&hit(0, 0.0, 0.0)), Some([1.0; 4]));
    let [r, g, b, a] = scene.vertex_color(&hit(0, 0.5, 0.25)).unwrap();
    assert_eq!((r, g, a), (1.0, 0.5, 1.0));
    assert!((b - 0.75).abs() < 1e-5, "{b}");
    assert_eq!((scene.vertex_color(&hit(1, 0.0, 0.0)), scene.vertex_color(&hit(9, 0.0, 0.0))), (None, None));
}

#[test]
fn new_positions_move_what_is_hit() {
    let mut scene =
        bth::from_bytes(include_bytes!("../../../format-spec/conformance/valid/deformable.bth")).unwrap();
    let rest = scene.object(0).positions.to_vec();
    let ray = Ray::new([0.25, 0.5, 9.0], [0.0, 0.0, -1.0]);
    let mut builder = bth::SceneBuilder::new();
    let object = builder.add(&scene);
    builder.instance(object, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
    for z in [0.0, 2.0, -3.0, 0.0] {
        let moved: Vec<_> = rest.iter().map(|p| [p[0], p[1], p[2] + z]).collect();
        assert_eq!(scene.set_positions(0, &moved).unwrap().deformed_cost_ratio, 1.0);
        builder.set_positions(object, &moved).unwrap();
        builder.commit().unwrap();
        for scene in [&scene, builder.scene()] {
            assert_eq!(scene.nearest(&ray).map(|hit| (hit.t, hit.primitive.triangle)), Some((9.0 - z, 0)));
            assert_eq!(scene.object_bounds(0).unwrap().1[2], z);
        }
    }
    // The last two squares are folded away: their triangles have no area.
    let folded: Vec<_> = rest.iter().map(|p| [p[0].min(1.0), p[1], p[2]]).collect();
    scene.set_positions(0, &folded).unwrap();
    assert_eq!(scene.nearest(&Ray::new([1.0, 0.5, 9.0], [0.0, 0.0, -1.0])).unwrap().primitive.triangle, 1);
    assert_eq!(scene.closest([2.0, 0.5, 0.0], 9.0).map(|found| found.primitive.triangle), Some(1));
    assert!(scene.nearest(&Ray::new([1.5, 0.5, 9.0], [0.0, 0.0, -1.0])).is_none());
}

#[test]
fn files_with_what_is_no_longer_read_are_refused_and_the_error_says_what_to_do() {
    for file in [
        &include_bytes!("../../../format-spec/conformance/invalid/F007-boxes-of-8-bits.bth")[..],
        include_bytes!("../../../format-spec/conformance/invalid/F007-tets-that-deform.bth"),
        include_bytes!("../../../format-spec/conformance/invalid/F007-trees-for-ranges-of-time.bth"),
    ] {
        let error = bth::from_bytes(file).unwrap_err().to_string();
        assert!(error.contains("BTH-F007") && error.contains(" again"), "{error}");
    }
}
