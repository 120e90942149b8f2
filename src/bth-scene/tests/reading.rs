//! The meaning of manifests, and the errors of malformed ones with their places.

use bth_scene::{
    Error, Interpolation, Lens, LightKind, Manifest, Material, Property, SequenceFrames, SequenceTiming,
    Source, Transform, parse,
};
use std::path::Path;

fn read(text: &str) -> Result<Manifest, Error> {
    parse(text, Path::new("scene.manifest"))
}

/// The scene that the refused ones are made from.
const SCENE: &str = r#"version = 1
camera = "main"
frames = { first = -2, last = 10, rate = 25 }
objects = [{ name = "ball", model = "models/ball.ply" }, { name = "done", file = "done.bth", object = 2 }]

[[nodes]]
name = "arm"
parent = "body"
object = "ball"
rotation = { axis = [0, 2, 0], degrees = 90 }
scale = [1, 2, -3]

[[nodes]]
name = "body"
visible = false
translation = [1, 2.5, -3e2]

[[nodes]]
name = "fixed"
matrix = [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6]]

[[nodes]]
name = "eye"
look = { from = [0, 0, 5], to = [0, 0, 0] }

[[cameras]]
name = "main"
node = "eye"
fov = 40

[[lights]]
name = "sun"
node = "fixed"
kind = "spot"
outer = 30
intensity = 3

[[tracks]]
node = "arm"
property = "rotation"
times = [0, 0.5]
values = [[0, 0, 0, 1], { axis = [1, 0, 0], degrees = 180 }]

[[tracks]]
node = "body"
property = "visible"
times = [0, 1]
values = [true, false]

[[tracks]]
node = "body"
property = "translation"
interpolation = "cubic"
times = [2]
values = [[[0, 0, 0], [1, 2, 3], [4, 5, 6]]]
"#;

#[test]
fn every_part_of_a_scene_is_read() {
    let scene = read(SCENE).unwrap();
    assert_eq!((scene.frames.first, scene.frames.last, scene.frames.rate), (-2, 10, 25.0));
    assert_eq!(scene.camera, Some(0));
    assert_eq!(scene.objects[0].source, Source::Model { path: "models/ball.ply".into(), mesh: None });
    assert_eq!(scene.objects[1].source, Source::Compiled { path: "done.bth".into(), object: Some(2) });
    let arm = scene.nodes.get(0);
    assert_eq!((arm.parent, arm.object, arm.visible), (Some(1), Some(0), true));
    let Transform::Parts { translation, rotation, scale } = arm.transform else { panic!("{arm:?}") };
    let half = 0.5f64.sqrt();
    assert!((rotation[1] - half).abs() < 1e-15 && (rotation[3] - half).abs() < 1e-15, "{rotation:?}");
    assert_eq!((translation, scale), ([0.0; 3], [1.0, 2.0, -3.0]));
    assert!(!scene.nodes.get(1).visible);
    let Transform::Matrix(rows) = scene.nodes.get(2).transform else { panic!() };
    assert_eq!(rows[2], [0.0, 0.0, 1.0, 6.0]);
    let Transform::Parts { translation, rotation, .. } = scene.nodes.get(3).transform else { panic!() };
    assert_eq!((translation, rotation), ([0.0, 0.0, 5.0], [0.0, 0.0, 0.0, 1.0]));
    assert_eq!((scene.cameras[0].node, scene.cameras[0].lens), (3, Lens::Perspective(40.0)));
    assert_eq!(scene.lights[0].kind, LightKind::Spot { inner: 0.0, outer: 30.0 });
    let [turn, seen, move_] = scene.tracks.as_slice() else { panic!("three tracks") };
    assert_eq!((turn.property, turn.interpolation), (Property::Rotation, Interpolation::Linear));
    assert_eq!(turn.values[..4], [0.0, 0.0, 0.0, 1.0]);
    assert!((turn.values[4] - 1.0).abs() < 1e-15 && turn.values[7].abs() < 1e-15);
    assert_eq!((seen.interpolation, seen.values.as_slice()), (Interpolation::Step, &[1.0, 0.0][..]));
    assert_eq!(move_.values, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn objects_whose_vertices_move_are_read() {
    let timed = |rate, start| SequenceTiming { rate, start };
    let source = |keys: &str| {
        read(&format!("version = 1\n[[objects]]\nname = \"a\"\n{keys}"))
            .map(|scene| scene.objects[0].source.clone())
    };
    assert_eq!(
        source("sequence = \"in/walk_####.ply\"\nrate = 30\nstart = -1").unwrap(),
        Source::Sequence {
            frames: SequenceFrames::Numbered("in/walk_####.ply".into()),
            timing: timed(Some(30.0), -1.0)
        }
    );
    assert_eq!(
        source("sequence = [\"b.obj\", \"a.obj\"]").unwrap(),
        Source::Sequence {
            frames: SequenceFrames::Listed(vec!["b.obj".into(), "a.obj".into()]),
            timing: timed(None, 0.0)
        }
    );
    assert_eq!(
        source("model = \"a.obj\"\nvertex_cache = \"a.mdd\"").unwrap(),
        Source::Cached { path: "a.obj".into(), mesh: None, cache: "a.mdd".into(), timing: timed(None, 0.0) }
    );
    for (keys, code, words) in [
        ("sequence = \"walk.ply\"", "BTH-M011", "one run of `#`"),
        ("sequence = \"a#b#.ply\"", "BTH-M011", "one run of `#`"),
        ("sequence = \"w#/a#.ply\"", "BTH-M011", "one run of `#`"),
        ("sequence = []", "BTH-M005", "at least one file"),
        ("sequence = \"a#.ply\"\nmodel = \"a.ply\"", "BTH-M013", "exclude"),
        ("sequence = \"a#.ply\"\nrate = 0", "BTH-M005", "above 0"),
        ("model = \"a.ply\"\nrate = 3", "BTH-M013", "belongs to objects with"),
        ("vertex_cache = \"a.pc2\"", "BTH-M006", "`model` is missing"),
        ("model = \"a.glb\"\nvertex_cache = \"a.pc2\"\nnode = 1", "BTH-M013", "exclude"),
    ] {
        let error = source(keys).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(error.code, code, "{error}");
    }
}

#[test]
fn colors_are_linear_numbers_or_bytes_in_srgb() {
    let text = r##"version = 1
        objects = [
            { name = "plain", model = "a.ply" },
            { name = "red", model = "a.ply", color = "#ff00BC" },
            { name = "grey", file = "a.bth", color = [0.25, 0.5, 1] },
            { name = "gold", sequence = "a_#.ply", color = [1, 0.7, 0.3], material = { metallic = 1, roughness = 0.25 } },
            { name = "lamp", model = "a.ply", material = { emission = [9, 9.5, 0] } },
        ]
        nodes = [{ name = "n" }]
        lights = [{ name = "l", node = "n", kind = "point", color = "#ffffff" }]"##;
    let scene = read(text).unwrap();
    let found: Vec<_> = scene.objects.iter().map(|object| object.material).collect();
    let plain = Material::default();
    // 0xbc is 188 of 255 in sRGB.
    let mid = ((188.0 / 255.0 + 0.055) / 1.055f64).powf(2.4);
    let gold = Material { color: [1.0, 0.7, 0.3], metallic: 1.0, roughness: 0.25, ..plain };
    let expected = [
        None,
        Some(Material { color: [1.0, 0.0, mid], ..plain }),
        Some(Material { color: [0.25, 0.5, 1.0], ..plain }),
        Some(gold),
        Some(Material { emission: [9.0, 9.5, 0.0], ..plain }),
    ];
    assert_eq!(found, expected);
    assert_eq!(scene.lights[0].color, [1.0; 3]);
}

#[test]
fn groups_are_read() {
    let nodes = |nodes: &str| read(&format!("version = 1\nnodes = [{nodes}]"));
    let scene = nodes(
        r#"{ name = "a", group = "b" }, { name = "b" }, { name = "c", parent = "b", group = "d" }, { name = "d" }"#,
    )
    .unwrap();
    assert_eq!(scene.nodes.iter().map(|node| node.group).collect::<Vec<_>>(), [Some(1), None, Some(3), None]);
    let chain = |levels: usize| {
        let show = |i: usize| format!("{{ name = \"{i}\", group = \"{}\" }}, ", i + 1);
        nodes(&format!("{}{{ name = \"{levels}\" }}", (0..levels).map(show).collect::<String>()))
    };
    assert!(chain(15).is_ok());
    let in_group = r#"{ name = "a", group = "b" }, { name = "b" }"#;
    for (text, code, words) in [
        (r#"{ name = "a", group = "a" }"#.to_owned(), "BTH-M010", "shows itself"),
        (
            r#"{ name = "a", group = "b" }, { name = "b", group = "a" }"#.to_owned(),
            "BTH-M010",
            "shows itself",
        ),
        (
            r#"{ name = "a", group = "c" }, { name = "b" }, { name = "c", parent = "b" }"#.to_owned(),
            "BTH-M013",
            "has a parent",
        ),
        (r#"{ name = "a", group = "b" }"#.to_owned(), "BTH-M009", "no node"),
    ] {
        let error = nodes(&text).unwrap_err();
        assert!(error.code == code && error.to_string().contains(words), "{error}");
    }
    assert_eq!(chain(16).unwrap_err().code, "BTH-M010");
    for (table, what) in [
        (r#"lights = [{ name = "l", node = "b", kind = "point" }]"#, "a light"),
        (r#"cameras = [{ name = "c", node = "b", fov = 40 }]"#, "a camera"),
    ] {
        let error = read(&format!("version = 1\nnodes = [{in_group}]\n{table}")).unwrap_err();
        assert!(error.code == "BTH-M013" && error.to_string().contains(what), "{error}");
    }
    let both = read(
        "version = 1\nobjects = [{ name = \"o\", model = \"o.ply\" }]\n\
        nodes = [{ name = \"a\", group = \"b\", object = \"o\" }, { name = \"b\" }]",
    );
    assert_eq!(both.unwrap_err().code, "BTH-M013");
}

#[test]
fn the_least_manifest_has_a_version_only() {
    assert_eq!(read("version = 1").unwrap(), Manifest::default());
}

/// Changes the first occurrence of a text in [`SCENE`] and expects a code at the place of `place`
/// in the changed text (`place` after the change), with words in the message.
#[track_caller]
fn refused(from: &str, to: &str, code: &str, place: &str, words: &str) {
    assert!(SCENE.contains(from), "{from}");
    let text = SCENE.replacen(from, to, 1);
    let error = read(&text).expect_err(to);
    let at = text.find(place).unwrap_or_else(|| panic!("{place} in {text}"));
    let line = text[..at].matches('\n').count() + 1;
    let column = at - text[..at].rfind('\n').map_or(0, |i| i + 1) + 1;
    assert_eq!((error.code, error.line, error.column), (code, line, column), "{error}");
    assert!(error.to_string().contains(words) && !error.hint.is_empty(), "{error}");
}

#[test]
fn text_that_is_no_toml_is_refused() {
    refused("fov = 40", "fov = = 40", "BTH-M002", "= 40", "");
    refused("fov = 40", "fov = 40\nfov = 41", "BTH-M002", "fov = 41", "duplicate");
}

#[test]
fn unknown_keys_are_refused_everywhere() {
    refused(
        "camera = \"main\"",
        "camara = \"main\"",
        "BTH-M003",
        "camara",
        "the keys here are version, camera",
    );
    refused("rate = 25", "fps = 25", "BTH-M003", "fps", "first, last, rate");
    refused("object = 2", "mesh_id = 2", "BTH-M003", "mesh_id", "name, model");
    refused("object = 2", "material = { color = [1, 1, 1] }", "BTH-M003", "color", "emission, metallic");
    refused("scale =", "scales =", "BTH-M003", "scales", "unknown key");
    refused("degrees = 90", "angle = 90", "BTH-M003", "angle", "axis, degrees");
    refused("to = [0, 0, 0]", "at = [0, 0, 0]", "BTH-M003", "at = [0", "from, to, up");
    refused("fov = 40", "yfov = 40", "BTH-M003", "yfov", "fov");
    refused("intensity", "power", "BTH-M003", "power", "intensity");
    refused("times =", "time =", "BTH-M003", "time =", "times");
}

#[test]
fn values_of_another_type_are_refused() {
    refused("version = 1", "version = \"1\"", "BTH-M004", "\"1\"", "a whole number");
    refused("first = -2", "first = -2.0", "BTH-M004", "-2.0", "type float");
    refused("rate = 25", "rate = true", "BTH-M004", "true }", "a number");
    refused("object = 2", "material = \"gold\"", "BTH-M004", "\"gold\"", "a table");
    refused("visible = false", "visible = 0", "BTH-M004", "0\ntranslation", "true or false");
    refused("parent = \"body\"", "parent = [1]", "BTH-M004", "[1]", "a string");
    refused("[1, 2, -3]", "2", "BTH-M004", "2\n\n[[nodes]]\nname = \"body\"", "an array");
    refused("[true, false]", "[true, 0]", "BTH-M004", "0]\n\n[[tracks]]", "true or false");
    refused("[[cameras]]", "[cameras]", "BTH-M004", "[cameras]", "an array");
}

#[test]
fn values_out_of_range_are_refused() {
    refused("rate = 25", "rate = 0", "BTH-M005", "0 }\nobjects", "above 0");
    refused("last = 10", "last = -3", "BTH-M005", "-3,", "not before the first");
    refused("last = 10", "last = 99999999999999999999", "BTH-M005", "99999", "whole number");
    refused("-3e2]", "nan]", "BTH-M005", "nan", "finite");
    refused("-3e2]", "1e999]", "BTH-M005", "1e999", "finite");
    refused("[1, 2.5, -3e2]", "[1, 2.5]", "BTH-M005", "[1, 2.5]", "3 numbers");
    refused("axis = [0, 2, 0]", "axis = [0, 0, 0]", "BTH-M005", "[0, 0, 0]", "not zero");
    refused("[0, 0, 0, 1]", "[0, 0, 0, 0]", "BTH-M005", "[0, 0, 0, 0]", "quaternion that is not zero");
    refused("to = [0, 0, 0]", "to = [0, 9, 5]", "BTH-M005", "{ from", "direction of view");
    refused("[0, 0, 1, 6]]", "[0, 0, 1]]", "BTH-M005", "[0, 0, 1]]", "4 numbers");
    refused("fov = 40", "fov = 180", "BTH-M005", "180\n", "between 0 and 180");
    refused("fov = 40", "fov = 40\nnear = 2\nfar = 2", "BTH-M005", "2\n\n[[lights]]", "above `near`");
    refused("outer = 30", "outer = 30\ninner = 30", "BTH-M005", "30\nintensity", "below `outer`");
    refused("kind = \"spot\"", "kind = \"sun\"", "BTH-M005", "\"sun\"\nouter", "directional, point, spot");
    refused("intensity = 3", "color = [1, -1, 1]", "BTH-M005", "[1, -1, 1]", "from 0");
    refused("intensity = 3", "color = \"red\"", "BTH-M005", "\"red\"", "found \"red\"");
    refused("object = 2", "color = [1, 1.5, 0]", "BTH-M005", "[1, 1.5, 0]", "three numbers from 0 to 1");
    refused("object = 2", "color = \"#12345g\"", "BTH-M005", "\"#12345g\"", "three numbers or a color");
    refused("object = 2", "material = { roughness = -0.1 }", "BTH-M005", "-0.1", "from 0 to 1");
    refused("object = 2", "material = { emission = [1e9, 0, 0] }", "BTH-M005", "[1e9", "0 to 1000000");
    refused("\"cubic\"", "\"smooth\"", "BTH-M005", "\"smooth\"", "step, linear, cubic");
    refused("\"visible\"", "\"visible\"\ninterpolation = \"linear\"", "BTH-M005", "\"linear\"", "step");
}

#[test]
fn missing_keys_and_other_versions_are_refused() {
    refused("version = 1\n", "", "BTH-M006", "camera", "`version` is missing");
    refused("version = 1", "version = 2", "BTH-M007", "2\n", "version 1");
    refused("name = \"arm\"\n", "", "BTH-M006", "[[nodes]]", "`name`");
    refused("node = \"eye\"\n", "", "BTH-M006", "[[cameras]]", "`node`");
    refused("fov = 40\n", "", "BTH-M006", "[[cameras]]", "`fov`");
    refused(", model = \"models/ball.ply\"", "", "BTH-M006", "{ name = \"ball\"", "`model`");
    refused("times = [0, 0.5]\n", "", "BTH-M006", "[[tracks]]", "`times`");
}

#[test]
fn names_must_be_unique_and_there() {
    refused("name = \"body\"", "name = \"arm\"", "BTH-M008", "\"arm\"\nvisible", "there already");
    refused("name = \"body\"", "name = \"\"", "BTH-M008", "\"\"", "control characters");
    refused("\"done\"", "\"ball\"", "BTH-M008", "\"ball\", file", "the object \"ball\"");
    refused("parent = \"body\"", "parent = \"torso\"", "BTH-M009", "\"torso\"", "no node \"torso\"");
    refused("object = \"ball\"", "object = \"bell\"", "BTH-M009", "\"bell\"", "no object \"bell\"");
    refused("camera = \"main\"", "camera = \"mein\"", "BTH-M009", "\"mein\"", "no camera \"mein\"");
    refused("node = \"eye\"", "node = \"ear\"", "BTH-M009", "\"ear\"", "no node");
}

#[test]
fn cycles_are_refused() {
    refused("visible = false", "parent = \"arm\"", "BTH-M010", "\"body\"\nobject", "its own ancestor");
    refused("parent = \"body\"", "parent = \"arm\"", "BTH-M010", "\"arm\"\nobject", "\"arm\" is its own");
    // A long way into a circle, from either end.
    let mut text = "version = 1\n".to_owned();
    for i in 0..1000 {
        text.push_str(&format!("[[nodes]]\nname = \"{i}\"\nparent = \"{}\"\n", (i + 1).min(999)));
    }
    assert_eq!(read(&text).unwrap_err().code, "BTH-M010");
    assert!(read(&text.replace("name = \"999\"\nparent = \"999\"", "name = \"999\"")).is_ok());
}

#[test]
fn names_and_paths_beyond_the_limits_are_refused() {
    let long = format!("\"{}\"", "n".repeat(bth_scene::limits::MAX_NAME + 1));
    refused("\"arm\"", &long, "BTH-M008", &long, "at most 4096 bytes, found 4097");
    let path = format!("\"{}b.ply\"", "folder/".repeat(bth_scene::limits::MAX_PATH / 7));
    refused("\"models/ball.ply\"", &path, "BTH-M011", &path, "at most 4096 bytes");
}

#[test]
fn paths_that_leave_the_folder_are_refused() {
    for path in [
        "/etc/passwd",
        "../ball.ply",
        "a/../../b.ply",
        "a/..",
        "C:/x.ply",
        "a\\\\b.ply",
        "./a.ply",
        "",
        "a//b",
    ] {
        let to = format!("\"{path}\"");
        refused("\"models/ball.ply\"", &to, "BTH-M011", &to, "within the manifest's folder");
        refused("\"done.bth\"", &to, "BTH-M011", &to, "within the manifest's folder");
    }
}

#[test]
fn tracks_must_fit_together() {
    refused("times = [0, 0.5]", "times = []", "BTH-M012", "[]", "at least one");
    refused("times = [0, 0.5]", "times = [0.5, 0.5]", "BTH-M012", "0.5]", "after 0.5");
    refused("times = [0, 0.5]", "times = [0]", "BTH-M012", "[[0, 0, 0, 1], {", "each of 1 times");
    refused("[[[0, 0, 0], [1, 2, 3], [4, 5, 6]]]", "[[[1, 2, 3]]]", "BTH-M012", "[[1, 2, 3]]", "in-tangent");
    refused(
        "\"body\"\nproperty = \"translation\"",
        "\"body\"\nproperty = \"visible\"",
        "BTH-M005",
        "\"cubic\"",
        "step",
    );
    let twice = "[[tracks]]\nnode = \"body\"\nproperty = \"visible\"\ntimes = [0]\nvalues = [true]\n\n";
    refused(
        "[[tracks]]\nnode = \"arm\"",
        &format!("{twice}[[tracks]]\nnode = \"arm\""),
        "BTH-M012",
        "[[tracks]]\nnode = \"body\"\nproperty = \"visible\"\ntimes = [0, 1]",
        "has a track already",
    );
}

#[test]
fn keys_that_exclude_each_other_are_refused() {
    refused("matrix", "scale = [1, 1, 1]\nmatrix", "BTH-M013", "[1, 1, 1]\nmatrix", "`matrix` and `scale`");
    refused(
        "look",
        "rotation = [0, 0, 0, 1]\nlook",
        "BTH-M013",
        "[0, 0, 0, 1]\nlook",
        "`look` and `rotation`",
    );
    refused("fov = 40", "fov = 40\nheight = 2", "BTH-M013", "2\n\n[[lights]]", "`fov` and `height`");
    refused("file = \"done.bth\"", "model = \"a.ply\"", "BTH-M013", "2 }]", "`model` and `object`");
    refused("kind = \"spot\"", "kind = \"point\"", "BTH-M013", "30\nintensity", "`outer` belongs");
    refused(
        "node = \"arm\"\nproperty",
        "node = \"fixed\"\nproperty",
        "BTH-M013",
        "\"fixed\"\nproperty",
        "has a matrix",
    );
}

#[test]
fn what_is_written_is_read_back_equal() {
    let scene = read(SCENE).unwrap();
    let text = scene.to_toml();
    assert_eq!(read(&text).unwrap(), scene, "{text}");
    assert_eq!(read(&text).unwrap().to_toml(), text);
    assert_eq!(read(&Manifest::default().to_toml()).unwrap(), Manifest::default());
}

#[test]
fn files_that_are_not_utf8_or_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.manifest");
    std::fs::write(&path, b"version = 1\n# caf\xe9\n").unwrap();
    let error = bth_scene::read(&path).unwrap_err();
    assert_eq!((error.code, error.line, error.column), ("BTH-M002", 2, 6), "{error}");
    assert!(
        error.to_string().contains("scene.manifest:2:6: BTH-M002: expected UTF-8, found the byte 0xe9"),
        "{error}"
    );

    let error = bth_scene::read(&folder.path().join("none.manifest")).unwrap_err();
    assert_eq!((error.code, error.line), ("BTH-M001", 0));
    assert!(error.to_string().contains("none.manifest: BTH-M001: cannot read"), "{error}");
}
