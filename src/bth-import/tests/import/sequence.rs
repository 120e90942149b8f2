//! Meshes whose vertices move: numbered files, PC2 and MDD.

use super::gltf::Model;
use super::*;
use bth_import::{Polygons, Timing, import_sequence, import_vertex_cache, read_vertex_cache, sequence_files};
use serde_json::json;
use std::path::{Path, PathBuf};

const TIMING: Timing = Timing { rate: Some(10.0), usual_rate: 24.0, start: 0.5 };

/// Two triangles with a common edge whose vertices each has separately. They part in the second
/// frame if `lift` is not 0.
fn frame(lift: f32) -> String {
    format!(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 {lift}\nv 0 1 {lift}\nv 1 1 {lift}\nvt 0 0\nvn 0 0 1\n\
         f 1/1/1 2/1/1 3/1/1\nf 4/1/1 6/1/1 5/1/1\n"
    )
}

fn write(folder: &Path, files: &[(&str, &[u8])]) -> Vec<PathBuf> {
    files
        .iter()
        .map(|(name, bytes)| {
            let path = folder.join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        })
        .collect()
}

#[test]
fn concave_polygons_are_split_as_in_the_first_frame() {
    let folder = tempfile::tempdir().unwrap();
    // In the second frame the arrow head has become a square, whose fan would have the other
    // diagonal.
    let frame = |notch: &str| format!("v 2 -1 0\nv {notch} 0\nv 2 1 0\nv 0 0 0\nf 1 2 3 4\n");
    let frames = [frame("1 0"), frame("4 0")];
    let files = write(folder.path(), &[("1.obj", frames[0].as_bytes()), ("2.obj", frames[1].as_bytes())]);
    let wanted = Wanted { polygons: Polygons::Ears, ..Wanted::default() };
    let (mesh, report) = import_sequence(&files, &TIMING, wanted, &Silent).unwrap();
    assert_eq!((mesh.triangles, report.concave), (vec![[0, 1, 2], [2, 3, 0]], 1));
    // As fans they are told.
    let listener = Listener::default();
    import_sequence(&files, &TIMING, Wanted::default(), &listener).unwrap();
    assert!(listener.0.into_inner().unwrap()[0].starts_with("1 polygon is concave: "));
}

/// As of single models.
#[test]
fn what_no_face_uses_and_is_not_finite_is_told_and_so_are_coordinates_far_out() {
    let folder = tempfile::tempdir().unwrap();
    let frame = |x: &str, unused: &str| format!("v 0 0 0\nv {x} 0 0\nv 0 1 0\nv {unused} 0 0\nf 1 2 3\n");
    let frames = [frame("1e15", "1"), frame("1e15", "nan"), frame("1e15", "inf")];
    let files: Vec<_> =
        ["1.obj", "2.obj", "3.obj"].into_iter().zip(frames.iter().map(String::as_bytes)).collect();
    let files = write(folder.path(), &files);
    for (vertices, fate) in [(false, "are left out"), (true, "are kept as zeros")] {
        let listener = Listener::default();
        let (mesh, report) =
            import_sequence(&files, &TIMING, Wanted { vertices, ..Wanted::default() }, &listener).unwrap();
        assert_eq!((mesh.positions.len(), report.non_finite_unused), (if vertices { 4 } else { 3 }, 1));
        assert!(listener.heard(&format!("1 positions are not finite; no face uses them, they {fate}")));
        assert!(listener.heard("1.1e12 (2^40)"), "{:?}", listener.0);
    }
}

#[test]
fn frames_become_one_mesh_whose_vertices_are_welded_where_all_frames_agree() {
    let folder = tempfile::tempdir().unwrap();
    let frames = [frame(0.0), frame(-0.0), frame(0.5)];
    write(
        folder.path(),
        &[
            ("w_07.obj", frames[0].as_bytes()),
            ("w_08.obj", frames[1].as_bytes()),
            ("w_09.obj", frames[2].as_bytes()),
        ],
    );
    let files = sequence_files(&folder.path().join("w_##.obj")).unwrap();
    let wanted = Wanted { attributes: Keep::All, groups: true, ..Wanted::default() };
    let (mesh, report) = import_sequence(&files, &TIMING, wanted, &Silent).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    let sequence = mesh.sequence.unwrap();
    assert_eq!(sequence.times, [0.5, 0.5 + 1.0 / 10.0, 0.5 + 2.0 / 10.0]);
    assert_eq!(sequence.positions[..6], mesh.positions);
    assert_eq!(sequence.positions[6..12], mesh.positions);
    assert_eq!(sequence.positions[15], [1.0, 0.0, 0.5]);
    assert!(sequence.positions.as_flattened().iter().all(|x| x.to_bits() != (-0.0f32).to_bits()));
    let attributes = mesh.attributes.unwrap();
    assert!(attributes.normals.is_empty() && attributes.uvs == [[0.0; 2]]);
    assert_eq!((report.format.as_str(), report.frames, report.positions_read), ("sequence of obj", 3, 6));
    // All vertices of the source stay where they are wanted.
    let wanted = Wanted { vertices: true, ..Wanted::default() };
    let (all, _) = import_sequence(&files[..2], &TIMING, wanted, &Silent).unwrap();
    assert_eq!((all.triangles, all.positions.len()), (vec![[0, 1, 2], [3, 5, 4]], 6));
    // Without the third frame the shared edge is welded.
    let (mesh, report) = import_sequence(&files[..2], &TIMING, Wanted::default(), &Silent).unwrap();
    assert_eq!((mesh.triangles, report.positions), (vec![[0, 1, 2], [1, 3, 2]], 4));
}

#[test]
fn frames_of_other_topology_are_refused_with_file_expected_and_found() {
    let folder = tempfile::tempdir().unwrap();
    let good = frame(0.0);
    let more = format!("{good}v 9 9 9\n");
    let fewer = good.replace("f 1/1/1 2/1/1 3/1/1\n", "");
    let other = good.replace("f 1/1/1 2/1/1", "f 2/1/1 1/1/1");
    let infinite = good.replace("v 1 1 0", "v 1 inf 0");
    let texts = [good, more, fewer, other, infinite];
    let files: Vec<_> = (0..).zip(&texts).map(|(i, text)| (format!("{i}.obj"), text.as_bytes())).collect();
    let files: Vec<_> = files.iter().map(|(name, bytes)| (name.as_str(), *bytes)).collect();
    let paths = write(folder.path(), &files);
    let error = |other: usize| {
        let pair = [paths[0].clone(), paths[other].clone()];
        import_sequence(&pair, &TIMING, Wanted::default(), &Silent).unwrap_err().to_string()
    };
    assert!(
        error(1).contains("1.obj: BTH-I017: expected the faces of")
            && error(1).contains("6 vertices; found 7")
    );
    assert!(error(2).contains("2.obj: BTH-I017") && error(2).contains("2 triangles; found 1"));
    assert!(error(3).contains("triangle 0 has the vertices [0, 1, 2]; found [1, 0, 2]"), "{}", error(3));
    assert!(error(4).contains("4.obj: vertex 5 of frame 1: BTH-I004"), "{}", error(4));
    let glb = write(folder.path(), &[("a.glb", b"glTF")]);
    assert!(
        import_sequence(&glb, &TIMING, Wanted::default(), &Silent)
            .unwrap_err()
            .to_string()
            .contains("BTH-I006")
    );
    let zero = Timing { rate: Some(f64::INFINITY), ..TIMING };
    let same = [paths[0].clone(), paths[0].clone()];
    let stands = import_sequence(&same, &zero, Wanted::default(), &Silent).unwrap_err().to_string();
    assert!(stands.contains("frame 1: expected a finite time after 0.5 s, found 0.5 s"), "{stands}");
}

/// A PC2 file of some samples, each of one point.
fn pc2(points: i32, samples: &[[f32; 3]], start: f32, step: f32) -> Vec<u8> {
    let mut bytes = b"POINTCACHE2\0".to_vec();
    bytes.extend(1i32.to_le_bytes());
    bytes.extend(points.to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend(step.to_le_bytes());
    bytes.extend((samples.len() as i32 / points.max(1)).to_le_bytes());
    samples.as_flattened().iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes
}

fn mdd(points: i32, times: &[f32], positions: &[[f32; 3]]) -> Vec<u8> {
    let mut bytes = (times.len() as i32).to_be_bytes().to_vec();
    bytes.extend(points.to_be_bytes());
    times.iter().chain(positions.as_flattened()).for_each(|x| bytes.extend(x.to_be_bytes()));
    bytes
}

#[test]
fn vertex_caches_give_times_and_positions() {
    let positions = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [-7.0, 8.5, 1e-20], [1e20, 0.0, -1.0]];
    let cache = read_vertex_cache(Path::new("a"), &pc2(2, &positions, 5.0, 0.5), &TIMING, &Silent).unwrap();
    assert_eq!((cache.points, &cache.positions[..]), (2, &positions[..]));
    assert_eq!(cache.times, [0.5 + 5.0 / 10.0, 0.5 + 5.5 / 10.0]);
    let untimed = Timing { rate: None, ..TIMING };
    let cache =
        read_vertex_cache(Path::new("a"), &mdd(2, &[0.25, 0.5], &positions), &untimed, &Silent).unwrap();
    assert_eq!((cache.points, &cache.positions[..]), (2, &positions[..]));
    assert_eq!(cache.times, [0.75, 1.0]);
}

#[test]
fn bad_vertex_caches_are_refused() {
    let untimed = Timing { rate: None, ..TIMING };
    let error = |bytes: &[u8]| match read_vertex_cache(Path::new("a"), bytes, &untimed, &Silent) {
        Err(error) => error.to_string(),
        Ok(cache) => panic!("{cache:?}"),
    };
    let good = pc2(1, &[[0.0; 3]; 3], 0.0, 1.0);
    for cut in 0..good.len() {
        error(&good[..cut]);
    }
    let changed = |at: usize, value: i32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    assert!(error(&changed(12, 2)).contains("BTH-I006: expected version 1 of PC2, found 2"));
    assert!(error(&changed(16, -1)).contains("BTH-I002"));
    assert!(error(&changed(16, i32::MAX)).contains("BTH-I003"));
    assert!(error(&changed(28, i32::MAX)).contains("BTH-I002"));
    assert!(error(&changed(28, 0)).contains("BTH-I003"));
    assert!(error(&pc2(1, &[], 0.0, 1.0)).contains("at least one frame"));
    assert!(error(&pc2(1, &[[0.0; 3]; 2], 0.0, 0.0)).contains("BTH-I017: frame 1"));
    assert!(error(&pc2(1, &[[0.0; 3]; 2], f32::NAN, 1.0)).contains("BTH-I017: frame 0"));
    let good = mdd(1, &[0.0, 1.0], &[[0.0; 3]; 2]);
    for good in [&pc2(1, &[[0.0; 3]; 3], 0.0, 1.0), &good] {
        let longer = error(&[&good[..], &[0]].concat());
        assert!(longer.contains("BTH-I003") && longer.contains("its header does not belong"), "{longer}");
        let cut = error(&good[..good.len() - 1]);
        assert!(cut.contains("BTH-I003") && cut.contains("the file is cut off"), "{cut}");
    }
    for cut in 0..good.len() {
        error(&good[..cut]);
    }
    assert!(error(&mdd(1, &[1.0, 1.0], &[[0.0; 3]; 2])).contains("frame 1: expected a finite time after"));
    assert!(error(&mdd(-1, &[], &[])).contains("BTH-I002"));
    let rated = read_vertex_cache(Path::new("a"), &good, &TIMING, &Silent).unwrap_err().to_string();
    assert!(rated.contains("leave out the rate"), "{rated}");
}

#[test]
fn a_vertex_cache_moves_the_vertices_of_its_model() {
    let folder = tempfile::tempdir().unwrap();
    let still = [[5.0; 3]; 6];
    let mut moved: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    moved.splice(0..0, still);
    let untimed = Timing { rate: None, ..TIMING };
    let paths = write(
        folder.path(),
        &[
            ("a.obj", frame(0.0).as_bytes()),
            ("a.mdd", &mdd(6, &[0.0, 1.0], &moved)),
            ("b.pc2", &pc2(5, &[[0.0; 3]; 5], 0.0, 1.0)),
        ],
    );
    let (mesh, report) =
        import_vertex_cache((&paths[0], None), &paths[1], &untimed, Wanted::default(), &Silent).unwrap();
    assert_eq!(report.format, "obj and mdd");
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.positions, still);
    assert_eq!(
        mesh.sequence.unwrap().positions[6..],
        [moved[6], moved[7], moved[8], moved[9], moved[11], moved[10]]
    );
    let error = import_vertex_cache((&paths[0], None), &paths[2], &untimed, Wanted::default(), &Silent)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("b.pc2: BTH-I017: expected the 6 vertices of") && error.contains("found 5"),
        "{error}"
    );
}

/// The mesh has two triangles, whose primitives have lines between them.
#[test]
fn a_vertex_cache_moves_the_primitives_of_a_gltf_mesh_one_after_the_other() {
    let meshes = json!([
        {"primitives": []},
        {"primitives": [
            {"attributes": {"POSITION": 0}},
            {"attributes": {"POSITION": 0}, "mode": 1},
            {"attributes": {"POSITION": 0}, "indices": 1}
        ]},
        {"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}]},
        {"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2}}]}
    ]);
    let model = Model::new(json!({ "meshes": meshes })).rows(&[[9.0f32; 3]; 3]);
    let model = model.rows(&[[2u16], [0], [1]]).rows(&[[0u8; 4]; 3]);
    let moved: Vec<[f32; 3]> = (0..12).map(|i| [i as f32, (i * i) as f32, 0.0]).collect();
    let folder = tempfile::tempdir().unwrap();
    let paths = write(
        folder.path(),
        &[
            ("a.glb", &model.glb()[..]),
            ("a.obj", frame(0.0).as_bytes()),
            ("a.pc2", &pc2(6, &moved, 0.0, 1.0)),
            ("b.pc2", &pc2(9, &[[0.0; 3]; 9], 0.0, 1.0)),
        ],
    );
    let wanted = Wanted { groups: true, ..Wanted::default() };
    let read = |model: usize, mesh, cache: usize| {
        import_vertex_cache((&paths[model], mesh), &paths[cache], &TIMING, wanted, &Silent)
    };
    let (mesh, report) = read(0, Some(1), 2).unwrap();
    assert_eq!((&*report.format, report.frames, report.skipped), ("gltf and pc2", 2, 1));
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    let row = |frame: usize| [0, 1, 2, 5, 3, 4].map(|row| moved[6 * frame + row]);
    assert_eq!(mesh.sequence.unwrap().positions, [row(0), row(1)].concat());
    assert_eq!(mesh.groups.unwrap().groups.len(), 2);
    for (model, mesh, cache, words) in [
        (0, Some(1), 3, "expected the 6 vertices of"),
        (0, None, 2, "of a glTF file name one mesh by its number"),
        (0, Some(2), 2, "without joints and morph targets, found mesh 2"),
        (0, Some(3), 2, "without joints and morph targets, found mesh 3"),
        (0, Some(4), 2, "expected a mesh below 4, found 4"),
        (1, Some(0), 2, "leave out the number of the mesh"),
    ] {
        let error = read(model, mesh, cache).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
