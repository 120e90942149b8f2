//! Objects of a scene: only used ones are stored, each geometry once, from models and from compiled
//! files.

use crate::support::{compiled, manifest, models, options};
use bth_compile::pipeline::{CompileOptions, compile};
use bth_compile::{Error, Silent, scene};
use std::path::Path;

fn refused(text: &str, folder: &Path) -> Error {
    scene::compile(&manifest(text), folder, Path::new("scene.manifest"), &options(), &Silent).unwrap_err()
}

#[test]
fn equal_geometry_is_stored_once_and_unseen_objects_not_at_all() {
    let folder = models();
    std::fs::copy(folder.path().join("knot.ply"), folder.path().join("same.ply")).unwrap();
    let text = r#"
        objects = [
            { name = "a", model = "knot.ply" }, { name = "b", model = "same.ply" }, { name = "c", model = "quad.obj" },
            { name = "unused", model = "absent.ply" }, { name = "hidden", model = "absent too.ply" },
        ]
        nodes = [
            { name = "1", object = "a" }, { name = "2", object = "b" }, { name = "3", object = "c" }, { name = "4", object = "b" },
            { name = "5", object = "hidden", visible = false },
        ]"#;
    let (scene, report) = compiled(&manifest(text), folder.path());
    assert_eq!(scene.object_count(), 2);
    let names: Vec<_> = report.objects.iter().map(|o| o.names.join(" ")).collect();
    assert_eq!(names, ["a b", "c"]);
    assert_eq!(report.unused, ["unused", "hidden"]);
    let objects: Vec<_> = (0..4).map(|i| scene.instance(i).object).collect();
    assert_eq!((objects.as_slice(), scene.instance_count()), (&[0, 0, 1, 0][..], 4));
    assert_eq!(scene.description().unwrap().node_name(scene.instance(3).node), "4");
}

#[test]
fn compiled_objects_are_taken_as_they_are() {
    let folder = models();
    let (single, _) = compile(&folder.path().join("knot.ply"), &options(), &Silent).unwrap();
    std::fs::write(folder.path().join("knot.bth"), &single.bytes).unwrap();
    let text = r#"objects = [{ name = "a", file = "knot.bth" }, { name = "b", model = "quad.obj" }, { name = "c", file = "knot.bth" }]
        nodes = [{ name = "1", object = "a" }, { name = "2", object = "b" }, { name = "3", object = "c" }]"#;
    let (scene, report) = compiled(&manifest(text), folder.path());
    assert_eq!(report.objects.iter().map(|o| o.copied).collect::<Vec<_>>(), [true, false]);
    let copied = scene.instance(0).object;
    let original = bth_format::File::from_bytes(&single.bytes).unwrap();
    for section in original.sections().filter(|s| s.entry.object == 0) {
        let found = scene.file().section(copied, section.entry.kind).unwrap();
        assert!(found.bytes == section.bytes, "section {}", section.entry.kind);
    }
    let missing = refused(
        r#"objects = [{ name = "a", file = "knot.bth", object = 1 }]
        nodes = [{ name = "1", object = "a" }]"#,
        folder.path(),
    );
    assert!(
        missing.to_string().contains("knot.bth: BTH-I051") && missing.to_string().contains("BTH-O003"),
        "{missing}"
    );
    let text = r#"objects = [{ name = "a", file = "quad.obj" }]
        nodes = [{ name = "1", object = "a" }]"#;
    assert!(refused(text, folder.path()).to_string().contains("BTH-F0"), "no compiled file");
}

/// Groups of the source keep their names, and everything that traces stays.
#[test]
fn looks_of_a_manifest_take_the_place_of_materials() {
    let folder = models();
    let grouped = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ng left\nusemtl steel\nf 1 2 3\ng right\nf 3 2 4\n";
    std::fs::write(folder.path().join("parts.obj"), grouped).unwrap();
    let named = CompileOptions { names: true, ..options() };
    let (parts, _) = compile(&folder.path().join("parts.obj"), &named, &Silent).unwrap();
    std::fs::write(folder.path().join("parts.bth"), &parts.bytes).unwrap();
    let text = r##"objects = [
            { name = "plain", model = "quad.obj" },
            { name = "red", model = "quad.obj", color = [1, 0, 0] },
            { name = "also red", model = "quad.obj", color = "#ff0000", material = {} },
            { name = "gold", model = "quad.obj", material = { metallic = 1, roughness = 0.5, emission = [0, 2, 0] } },
            { name = "blue parts", file = "parts.bth", color = [0, 0, 1] },
            { name = "parts", file = "parts.bth" },
        ]
        nodes = [
            { name = "1", object = "plain" }, { name = "2", object = "red" }, { name = "3", object = "also red" },
            { name = "4", object = "gold" }, { name = "5", object = "blue parts" }, { name = "6", object = "parts" },
        ]"##;
    let (scene, _) = compiled(&manifest(text), folder.path());
    let objects: Vec<_> = (0..6).map(|i| scene.instance(i).object).collect();
    assert_eq!(objects, [0, 1, 1, 2, 3, 4]);
    assert_eq!((scene.material_count(0), scene.material_count(4)), (0, 1));
    let material = |object| scene.material(object, 0).unwrap();
    assert_eq!(material(1).base_color, [1.0, 0.0, 0.0, 1.0]);
    assert!(material(1).double_sided && material(1).gloss.is_none());
    let gloss = material(2).gloss.unwrap();
    assert_eq!((gloss.metallic, gloss.roughness, material(2).emissive), (1.0, 0.5, [0.0, 2.0, 0.0]));
    assert_eq!(material(3).base_color, [0.0, 0.0, 1.0, 1.0]);
    let view = scene.file().object(3).unwrap();
    let names = [0, 1].map(|triangle| view.group_name(view.group_of(triangle)));
    assert_eq!((names, view.material_of(view.group_of(1))), (["left", "right"], Some(0)));
}

#[test]
fn bytes_depend_on_neither_order_of_files_nor_names_of_folders() {
    let (a, b) = (models(), models());
    let bytes = |folder: &Path| {
        let options = options();
        let manifest = crate::support::varied();
        scene::compile(&manifest, folder, Path::new("x"), &options, &Silent).unwrap().0.bytes
    };
    assert!(bytes(a.path()) == bytes(b.path()));
}

#[test]
fn first_frames_that_cannot_be_shown_are_refused() {
    let folder = models();
    let text = r#"objects = [{ name = "a", model = "quad.obj" }]
        nodes = [{ name = "folded", object = "a", matrix = [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0]] }]"#;
    let error = refused(text, folder.path()).to_string();
    assert!(
        error.contains("BTH-I050") && error.contains("BTH-S001") && error.contains("\"folded\""),
        "{error}"
    );
}

#[test]
fn missing_models_and_meshes_are_named() {
    let folder = models();
    let one = |source: &str| {
        format!("objects = [{{ name = \"a\", {source} }}]\nnodes = [{{ name = \"1\", object = \"a\" }}]")
    };
    let absent = refused(&one("model = \"absent.ply\""), folder.path()).to_string();
    assert!(absent.contains("absent.ply: BTH-O0"), "{absent}");
    let mesh = refused(&one("model = \"quad.obj\", mesh = 0"), folder.path()).to_string();
    assert!(mesh.contains("quad.obj: BTH-I001"), "{mesh}");
}

#[test]
fn nodes_may_stand_before_their_parents() {
    let folder = models();
    let text = r#"objects = [{ name = "a", model = "quad.obj" }]
        nodes = [
            { name = "leaf", object = "a", parent = "middle", translation = [1, 0, 0] },
            { name = "middle", parent = "top", scale = [2, 2, 2] }, { name = "top", translation = [0, 10, 0] },
        ]
        cameras = [{ name = "eye", node = "leaf", fov = 50 }]"#;
    let (scene, _) = compiled(&manifest(text), folder.path());
    let leaf = scene.instance(0);
    assert_eq!(leaf.to_world, [[2.0, 0.0, 0.0, 2.0], [0.0, 2.0, 0.0, 10.0], [0.0, 0.0, 2.0, 0.0]]);
    let view = scene.description().unwrap();
    assert_eq!((view.node_name(leaf.node), view.cameras[0].node), ("leaf", leaf.node));
}
