//! FBX: what becomes of meshes, nodes, materials, shapes, skins and animations, what is refused,
//! and files that are damaged at random.

use super::*;
use bth_import::gltf::scene::{self, ImportOptions};
use bth_import::{GltfPart, Polygons, import_gltf_parts_bytes};
use bth_random::Rng;
use bth_scene::{Manifest, Property, Source, Transform};

/// In centimetres with z up: two instances of a plate, whose faces are a square and an arrow head.
/// The second is behind a geometric transform, moves along x, and has another material. A strip of
/// two triangles has a bone for its last vertices and a shape.
const SCENE: &str = include_str!("../../../../fuzz/seeds/fbx/scene.fbx");

fn manifest(text: &str) -> (Manifest, scene::ImportReport) {
    scene::import_bytes(Path::new("a.fbx"), text.as_bytes(), "a.fbx", &ImportOptions::default(), &Silent)
        .unwrap()
}

fn flat(text: &str, wanted: Wanted) -> (Mesh, Report) {
    bth_import::import_bytes(Path::new("a.fbx"), text.as_bytes(), wanted, &Silent).unwrap()
}

#[test]
fn a_scene_has_the_nodes_instances_and_keys_of_the_file() {
    let (manifest, report) = manifest(SCENE);
    assert_eq!(report.space.as_deref(), Some("units of 0.01 m, z up; read as metres with y up"));
    let node = |name: &str| manifest.nodes.iter().position(|node| node.name == name).unwrap();
    let parent = |name: &str| manifest.nodes.get(node(name)).parent;
    assert_eq!(
        [parent("First"), parent("Second"), parent("Hidden")],
        [Some(0), Some(0), Some(node("First"))]
    );
    assert!(!manifest.nodes.get(node("Hidden")).visible);
    // The plate is there once for each material, and behind its geometric transform.
    let object = |name: &str| manifest.nodes.get(node(name)).object.unwrap();
    assert_eq!(manifest.objects[object("First")].name, "Plate");
    assert_ne!(object("First"), object("Second/geometry"));
    assert_eq!(parent("Second/geometry"), Some(node("Second")));
    let Transform::Parts { translation, .. } = manifest.nodes.get(node("Second/geometry")).transform else {
        panic!()
    };
    assert_eq!(translation, [0.0, 0.0, 100.0]);
    let Transform::Parts { scale, rotation, .. } = manifest.nodes.get(0).transform else { panic!() };
    assert!(scale.iter().all(|s| (s - 0.01).abs() < 1e-12) && rotation[0] < -0.7, "{scale:?} {rotation:?}");
    // The keys begin at 0. The bone moves nothing, and the shape swells.
    let track = |name: &str, property| {
        manifest.tracks.iter().find(|t| t.node == node(name) && t.property == property).unwrap()
    };
    let moves = track("Second", Property::Translation);
    assert_eq!(
        (&moves.times[..], &moves.values[..]),
        (&[0.0, 1.0][..], &[0., 1000., 0., 300., 1000., 0.][..])
    );
    let swells = track("Ribbon", Property::Weights);
    assert_eq!((&swells.times[..], &swells.values[..]), (&[0.0, 1.0][..], &[0.0, 1.0][..]));
    assert_eq!((report.animations, report.deformers), (vec!["Take".to_owned()], 1));
}

#[test]
fn a_flat_model_is_in_metres_with_y_up() {
    let (mesh, report) =
        flat(SCENE, Wanted { groups: true, materials: true, attributes: Keep::All, ..Wanted::default() });
    assert_eq!((report.format.as_str(), report.polygons, mesh.triangles.len()), ("fbx", 4, 10));
    let near =
        |p: [f64; 3]| mesh.positions.iter().any(|q| (0..3).all(|k| (f64::from(q[k]) - p[k]).abs() < 1e-6));
    assert!(near([4.0, 0.0, -1.0]) && near([4.0, 1.0, -11.0]), "{:?}", mesh.positions);
    let groups = mesh.groups.unwrap();
    assert_eq!(
        groups.groups.iter().map(|g| g.name.as_str()).collect::<Vec<_>>(),
        ["Plate", "Plate", "Strip"]
    );
    assert_eq!(groups.materials, ["Red", "Glow"]);
    let parameters = &mesh.materials.unwrap().parameters;
    assert_eq!(parameters[0].base_color, [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(parameters[1].emissive, [0.0, 4.0, 0.0]);
    // Texture coordinates have v downwards.
    assert_eq!(mesh.attributes.unwrap().uvs.iter().filter(|uv| **uv == [0.0, 1.0]).count(), 4);
}

#[test]
fn polygons_are_split_as_wanted() {
    let area = |polygons| {
        let (mesh, report) = flat(SCENE, Wanted { polygons, ..Wanted::default() });
        let corner = |row: u32| mesh.positions[row as usize].map(f64::from);
        let triangle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            ((b[0] - a[0]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[0] - a[0])).abs() / 2.0
        };
        (mesh.triangles.iter().map(triangle).sum::<f64>(), report.concave)
    };
    // Two plates of a square and an arrow head, 1 m² each, and the strip. The fan of an arrow head
    // from its second tip covers 2 m² more.
    assert!((area(Polygons::Ears).0 - 5.0).abs() < 1e-5, "{:?}", area(Polygons::Ears));
    assert!((area(Polygons::Fans).0 - 5.0).abs() < 1e-5 || area(Polygons::Fans).0 > 5.5);
    assert_eq!(area(Polygons::Ears).1, area(Polygons::Fans).1);
}

#[test]
fn a_mesh_far_from_its_origin_is_relative_to_its_middle() {
    let far = SCENE.replace("0,0,0,100,0,0,100,100,0,0,100,0,200,0,0,400,100,0,200,200,0,300,100,0",
        "6000000000.25,0,0,6000000100.25,0,0,6000000100.25,100,0,6000000000.25,100,0,6000000200,0,0,6000000400,100,0,6000000200,200,0,6000000300,100,0");
    let (manifest, _) = manifest(&far);
    let inner = manifest.nodes.iter().find(|node| node.name == "First/mesh").unwrap();
    let Transform::Parts { translation, .. } = &inner.transform else { panic!() };
    let Source::Model { mesh: Some(number), .. } = manifest.objects[inner.object.unwrap()].source else {
        panic!()
    };
    let parts = [GltfPart::Mesh(number)];
    let meshes =
        import_gltf_parts_bytes(Path::new("a.fbx"), far.as_bytes(), &parts, Keep::None, &Silent).unwrap();
    let x = meshes[0].0.positions.iter().map(|p| f64::from(p[0]) + translation[0]);
    assert_eq!(x.fold(f64::INFINITY, f64::min), 6000000000.25);
}

#[test]
fn what_is_no_whole_file_is_refused_with_its_place() {
    let cut = &SCENE[..SCENE.len() - 40];
    for (text, code) in [
        (cut, "BTH-I003"),
        (&SCENE.replace("0,1,2,-4,", "0,1,9,-4,"), "BTH-I002"),
        (&SCENE.replace("0,0,0,100,0,0,100,100,0,0", "0,0,0,1e999,0,0,100,100,0,0"), "BTH-I004"),
        ("Kaydara FBX Binary  \0\x1A\0\x01\x02\x03", "BTH-I003"),
    ] {
        let found = import_bytes("a.fbx", text.as_bytes(), Keep::None).map(|_| code).unwrap_err();
        let Error::Input { code: found, place, message, hint } = found else { panic!("{found}") };
        assert_eq!(found, code, "{place} {message}");
        assert!(place.to_string().contains("a.fbx") && !hint.is_empty());
    }
}

/// Damaged files are refused or give meshes; nothing panics.
#[test]
fn damaged_files_do_not_panic() {
    const NUMBERS: [&str; 10] =
        ["0", "1", "-1", "2", "1e39", "nan", "4294967295", "-2147483648", "0.5", "1e308"];
    let mut read = 0;
    for seed in 0..300 {
        let mut rng = Rng::new(seed);
        let mut bytes = SCENE.as_bytes().to_vec();
        for _ in 0..1 + rng.below(3) {
            let at = rng.below(bytes.len() as u64) as usize;
            match rng.below(4) {
                0 => bytes[at] ^= 1 << rng.below(8),
                1 if rng.below(4) == 0 => bytes.truncate(at),
                2 => {
                    let end = (at + 1 + rng.below(60) as usize).min(bytes.len());
                    bytes.drain(at..end);
                }
                _ => {
                    let Some(from) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else {
                        continue;
                    };
                    let count = bytes[from..].iter().take_while(|c| c.is_ascii_digit()).count();
                    bytes.splice(from..from + count, NUMBERS[rng.below(10) as usize].bytes());
                }
            }
        }
        let path = Path::new("a.fbx");
        let options = ImportOptions { rigid_parts: seed % 2 == 0, ..ImportOptions::default() };
        if let Ok((manifest, _)) = scene::import_bytes(path, &bytes, "a.fbx", &options, &Silent) {
            read += 1;
            bth_scene::parse(&manifest.to_toml(), Path::new("a.manifest")).unwrap();
        }
        let parts = [0, 1, 2].map(GltfPart::Mesh);
        let wanted = Wanted { groups: true, materials: true, attributes: Keep::All, ..Wanted::default() };
        let _ = import_gltf_parts_bytes(path, &bytes, &parts, wanted, &Silent);
        let _ = bth_import::import_bytes(path, &bytes, wanted, &Silent);
    }
    assert!(read > 60, "{read} of 300 were read");
}
