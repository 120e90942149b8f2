//! Groups of triangles: what each format yields.

use super::gltf::Model;
use super::*;
use bth_import::Groups;
use serde_json::json;

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn groups(name: &str, bytes: &[u8]) -> (Mesh, Groups) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let read = |groups| import(&path, Wanted { groups, ..Wanted::default() }, &Silent).unwrap().0;
    let (mut mesh, plain) = (read(true), read(false));
    let groups = mesh.groups.take().expect("wanted groups");
    assert_eq!(mesh, plain, "groups change nothing else");
    (mesh, groups)
}

/// The groups as text: name, material and runs.
fn shown(groups: &Groups) -> Vec<String> {
    let runs = |row: usize| {
        let of_row = groups.runs.iter().filter(|run| run[1] as usize == row);
        of_row.map(|run| run[0].to_string()).collect::<Vec<_>>().join(",")
    };
    let material = |row: Option<u32>| row.map_or("-", |row| groups.materials[row as usize].as_str());
    let one = |(row, group): (usize, &bth_import::Group)| {
        format!("{}|{}|{}", group.name, material(group.material), runs(row))
    };
    groups.groups.iter().enumerate().map(one).collect()
}

#[test]
fn obj_groups_are_names_with_materials() {
    let text = format!(
        "{CORNERS}f 1 2 3\nusemtl red paint # metallic\nf 1 2 3 4\no car\ng\nf 1 2 3\ng body  left\nf 1 2 3\n\
         usemtl\nf 1 2 3\nusemtl unused\nusemtl blue\nl 1 2\nf 1 2\nusemtl red paint\nf 4 3 2 1\ng unused\n"
    );
    let (mesh, groups) = groups("a.obj", text.as_bytes());
    assert_eq!(mesh.triangles.len(), 8);
    let expected = ["|-|0", "|red paint|1", "body left|red paint|4,6", "body left|-|5"];
    assert_eq!(shown(&groups), expected);
    assert_eq!(groups.materials, ["red paint"]);
}

#[test]
fn obj_groups_that_come_again_are_the_same_and_many_are_quick() {
    let mut text = CORNERS.to_owned();
    for i in 0..20_000 {
        text += &format!("g part {}\nusemtl m{}\nf 1 2 3\n", i % 5000, i % 5000);
    }
    let (_, groups) = groups("a.obj", text.as_bytes());
    assert_eq!((groups.groups.len(), groups.materials.len(), groups.runs.len()), (5000, 5000, 20_000));
    assert_eq!(groups.groups[4999].name, "part 4999");
    assert_eq!(groups.runs[12_345], [12_345, 2345]);
}

#[test]
fn names_that_are_not_utf8_are_told_apart() {
    // Red and blue in GBK: without characters that are not UTF-8 the two would have the same name.
    let text =
        b"usemtl \xBA\xEC\xC9\xAB\nf 1 2 3\nusemtl \xC0\xB6\xC9\xAB\nf 1 3 4\ng H\xFCtte \x80\nf 1 2 4\n";
    let (_, groups) = groups("a.obj", &[CORNERS.as_bytes(), text].concat());
    let [red, blue] = ["\u{BA}\u{EC}\u{C9}\u{AB}", "\u{C0}\u{B6}\u{C9}\u{AB}"];
    assert_eq!(groups.materials, [red, blue]);
    assert_eq!(
        shown(&groups),
        [format!("|{red}|0"), format!("|{blue}|1"), format!("H\u{FC}tte \u{20AC}|{blue}|2")]
    );
}

#[test]
fn solids_of_stl_are_groups() {
    let facet = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let text = format!(
        "solid left  wheel\n{facet}{facet}endsolid\nsolid\nendsolid\nsolid right\n{facet}endsolid right\n"
    );
    assert_eq!(shown(&groups("a.stl", text.as_bytes()).1), ["left wheel|-|0", "right|-|2"]);
    let latin_1 = [&b"solid T\xFCr\n"[..], facet.as_bytes(), b"endsolid T\xFCr\n"].concat();
    assert_eq!(shown(&groups("a.stl", &latin_1).1), ["T\u{FC}r|-|0"]);
}

#[test]
fn a_format_without_groups_has_none() {
    let off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(groups("a.off", off).1, Groups::default());
    assert_eq!(groups("a.obj", format!("{CORNERS}f 1 2 3\n").as_bytes()).1, Groups::default());
    assert_eq!(groups("a.obj", b"g a\nusemtl b\n").1, Groups::default());
}

#[test]
fn primitives_of_gltf_are_groups() {
    let primitive = |material: Option<u32>| match material {
        Some(m) => json!({"attributes": {"POSITION": 0}, "mode": 5, "material": m}),
        None => json!({"attributes": {"POSITION": 0}, "mode": 5}),
    };
    let lines = json!({"attributes": {"POSITION": 0}, "mode": 1});
    let document = json!({
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"mesh": 1}, {"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 1, "scale": [-1, 1, 1]}],
        "materials": [{"name": "unused"}, {}, {"name": "glass"}],
        "meshes": [
            {"primitives": [primitive(Some(1))]},
            {"name": "door", "primitives": [primitive(Some(2)), lines, primitive(None)]}
        ],
    });
    let bytes = Model::new(document).rows(&SQUARE).glb();
    let (_, groups) = groups("a.glb", &bytes);
    assert_eq!(shown(&groups), ["door/0|glass|0,6", "door/2|-|2,8", "mesh 0|material 1|4"]);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, &bytes).unwrap();
    let wanted = Wanted { groups: true, ..Wanted::default() };
    let meshes =
        bth_import::import_gltf_parts(&path, &[0, 1].map(bth_import::GltfPart::Mesh), wanted, &Silent)
            .unwrap();
    let of = |row: usize| shown(meshes[row].0.groups.as_ref().unwrap());
    assert_eq!(
        (of(0), of(1)),
        (vec!["mesh 0|material 1|0".into()], vec!["door/0|glass|0".into(), "door/2|-|2".into()])
    );
}

#[test]
fn names_of_obj_may_have_words_that_begin_with_a_hash() {
    let text = format!(
        "{CORNERS}g #1\nusemtl Material #25\nf 1 2 3\no part #2 # a comment\nusemtl #glass\nf 1 3 4\n\
         g # no name\nusemtl # no material\nf 1 2 4 #f 1 2 3\n"
    );
    let (mesh, groups) = groups("a.obj", text.as_bytes());
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(shown(&groups), ["#1|Material #25|0", "part #2|#glass|1", "|-|2"]);
}
