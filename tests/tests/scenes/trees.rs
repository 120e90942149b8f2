//! Trees in files: mapped scenes with them answer as scenes that are placed when they are opened,
//! and opening reads few pages.

use crate::support::{manifest, models, options};
use bth::rays::{Hit, Ray};
use bth_compile::pipeline::CompileOptions;
use bth_compile::{Silent, scene};
use bth_format::layout::{Node, kind};
use bth_random::Rng;
use std::fmt::Write;
use std::path::Path;

/// Text of nodes at random places: `count` instances, and above them what `more` says.
fn nodes(count: u32, more: &str) -> String {
    let (mut rng, mut text) = (Rng::new(5), String::new());
    let mut number = |width: f32| (rng.unit_f32() - 0.5) * width;
    for i in 0..count {
        let [x, y, z, a, b, c] = [90.0, 90.0, 90.0, 2.0, 2.0, 2.0].map(&mut number);
        let (object, visible) = (["knot", "quad"][i as usize % 2], i % 7 != 3);
        let _ = write!(
            text,
            "[[nodes]]\nname = \"{i}\"\n{more}\nobject = \"{object}\"\nvisible = {visible}\n\
             translation = [{x}, {y}, {z}]\nrotation = [{a}, {b}, {c}, 1]\nscale = [1, {}, 1]\n",
            if i % 11 == 0 { 0.0 } else { 1.5 }
        );
    }
    text
}

const OBJECTS: &str =
    "objects = [{ name = \"knot\", model = \"knot.ply\" }, { name = \"quad\", model = \"quad.obj\" }]\n";

/// Instances in a patch, patches in a field, and fields in the world.
fn grouped(count: u32) -> String {
    let mut text = format!("{OBJECTS}[[nodes]]\nname = \"patch\"\n[[nodes]]\nname = \"field\"\n");
    text += &nodes(count, "parent = \"patch\"");
    for (row, (name, more, shown)) in
        [("p", "parent = \"field\"\n", "patch"), ("f", "", "field")].iter().enumerate()
    {
        for i in 0..4 {
            let (x, y) = (i * 120 * (1 + 3 * row), 50 * i);
            let _ = write!(
                text,
                "[[nodes]]\nname = \"{name}{i}\"\n{more}group = \"{shown}\"\ntranslation = [{x}, {y}, 0]\n\
                 rotation = [0, {i}, 1, 3]\n"
            );
        }
    }
    text
}

/// A scene of a compiled file as it is mapped, and as it is read.
fn opened(text: &str, options: &CompileOptions) -> (bth::Scene, bth::Scene, tempfile::TempDir) {
    let folder = models();
    let (bytes, _) = scene::compile(&manifest(text), folder.path(), Path::new("x"), options, &Silent)
        .expect("it compiles");
    let path = folder.path().join("scene.bth");
    std::fs::write(&path, &bytes.bytes).unwrap();
    let read = bth::from_bytes(&bytes.bytes).unwrap();
    bth_format::verify::verify(read.file()).unwrap();
    // SAFETY: nobody else knows the folder, in which the file is not changed.
    #[allow(unsafe_code)]
    let mapped = unsafe { bth::map(&path) }.unwrap();
    (mapped, read, folder)
}

/// Asserts that two scenes answer all queries alike.
fn assert_same(a: &bth::Scene, b: &bth::Scene, rng: &mut Rng) {
    let count = a.instance_count();
    assert_eq!((count, a.row_count()), (b.instance_count(), b.row_count()));
    for i in (0..count).step_by(count as usize / 500 + 1) {
        assert_eq!(a.instance(i), b.instance(i), "{i}");
        assert_eq!((a.instance_path(i), a.object_of(i)), (b.instance_path(i), b.object_of(i)));
        assert_eq!(a.instance_bounds(i), b.instance_bounds(i));
    }
    assert_eq!(a.seconds(), b.seconds());
    let places: Vec<_> = (0..count).filter_map(|i| a.instance_bounds(i)).collect();
    let mut point = || {
        let (lower, upper) = places[rng.below(places.len() as u64) as usize];
        [0, 1, 2].map(|k| lower[k] + (upper[k] - lower[k]) * rng.unit_f32())
    };
    let rays: Vec<Ray> = (0..600)
        .map(|_| {
            let (from, to) = (point(), point());
            Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k]))
        })
        .collect();
    let nearest = |scene: &bth::Scene| {
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.batch(&rays).nearest(&mut hits);
        hits
    };
    assert_eq!(nearest(a), nearest(b));
    assert!(nearest(a).iter().filter(|hit| hit.is_hit()).count() > 300);
    for ray in &rays[..60] {
        assert_eq!(a.nearest(ray), b.nearest(ray));
        assert_eq!(a.any(ray), b.any(ray));
        let at = ray.at(0.3);
        assert_eq!(a.closest(at, 5.0), b.closest(at, 5.0));
        assert_eq!(a.contains(at), b.contains(at));
        let in_box = |scene: &bth::Scene| {
            let mut triangles = Vec::new();
            scene.triangles_in_box(at, at.map(|x| x + 3.0), &mut triangles);
            triangles
        };
        assert_eq!(in_box(a), in_box(b));
    }
}

fn has_trees(scene: &bth::Scene) -> usize {
    scene.description().map_or(0, |view| view.trees.len())
}

#[test]
fn mapped_scenes_with_trees_answer_as_others_at_any_time() {
    let mut rng = Rng::new(9);
    let tracks = "[[tracks]]\nnode = \"f1\"\nproperty = \"translation\"\ntimes = [0, 1]\n\
        values = [[0, 0, 0], [80, 9, -70]]\n[[tracks]]\nnode = \"f2\"\nproperty = \"visible\"\ntimes = [0, 1]\n\
        values = [true, false]\n";
    let flat = format!("{OBJECTS}{}", nodes(4000, ""));
    let moving =
        |more: &str| format!("frames = {{ first = 0, last = 9, rate = 9 }}\n{}{more}", grouped(4000));
    let in_field = tracks.replace("f1", "p1");
    // A group with a part that moves, and one that shows it: they come behind the others.
    let birds = "[[nodes]]\nname = \"bird\"\n[[nodes]]\nname = \"wing\"\nobject = \"knot\"\nparent = \"bird\"\n\
        [[nodes]]\nname = \"flock\"\n[[nodes]]\nname = \"b1\"\ngroup = \"bird\"\nparent = \"flock\"\n\
        [[nodes]]\nname = \"b2\"\ngroup = \"patch\"\nparent = \"flock\"\ntranslation = [3, 90, 1]\n\
        [[nodes]]\nname = \"in the world\"\ngroup = \"flock\"\n[[tracks]]\nnode = \"wing\"\n\
        property = \"translation\"\ntimes = [0, 1]\nvalues = [[0, 0, 0], [80, 9, -70]]\n";
    let before = birds.replacen("[[nodes]]", "[[nodes]]\nname = \"first\"\ngroup = \"bird\"\n[[nodes]]", 1);
    let scenes = [
        (flat, 1),
        (grouped(4000), 3),
        (moving(tracks), 2),
        (moving(&in_field), 1),
        (moving(birds), 2),
        (moving(&format!("{before}{tracks}")), 2),
    ];
    for (text, trees) in scenes {
        let (mut mapped, mut read, _folder) = opened(&text, &options());
        assert_eq!(has_trees(&mapped), trees);
        let before = mapped.heap_bytes().0;
        assert!(before < 200_000, "{before} bytes before the first ray");
        for seconds in [0.0, 0.5, 2.0, 0.0] {
            let (a, b) = (mapped.set_seconds(seconds).unwrap(), read.set_seconds(seconds).unwrap());
            assert_eq!(a.visible, b.visible);
            assert_same(&mapped, &read, &mut rng);
        }
    }
}

#[test]
fn objects_of_scenes_with_trees_take_new_positions() {
    let options = CompileOptions { deformable: true, ..options() };
    let flat = format!("{OBJECTS}{}", nodes(4000, ""));
    for text in [flat, grouped(4000)] {
        let (mut mapped, mut read, _folder) = opened(&text, &options);
        assert!(has_trees(&mapped) > 0);
        for scene in [&mut mapped, &mut read] {
            let moved: Vec<_> = scene.positions(0).iter().map(|p| p.map(|x| 3.0 * x + 1.0)).collect();
            scene.set_positions(0, &moved).unwrap();
        }
        assert_same(&mapped, &read, &mut Rng::new(3));
    }
}

/// A mapped file's transforms have not been checked.
#[test]
fn the_row_that_cannot_be_placed_is_named() {
    let options = CompileOptions { deformable: true, ..options() };
    let (_, read, folder) = opened(&format!("{OBJECTS}{}", nodes(4000, "")), &options);
    let row = (1000..).find(|row| read.instance(*row).visible).unwrap();
    let mut bytes = read.file().bytes().to_vec();
    let nodes = read.file().sections().find(|section| section.entry.kind == kind::NODES).unwrap();
    let node = nodes.entry.offset as usize + read.instance(row).node as usize * size_of::<Node>();
    bytes[node..][..size_of::<f64>()].copy_from_slice(&f64::MAX.to_le_bytes());
    let path = folder.path().join("far.bth");
    std::fs::write(&path, bytes).unwrap();
    // SAFETY: nobody else knows the folder, in which the file is not changed.
    #[allow(unsafe_code)]
    let mut mapped = unsafe { bth::map(&path) }.unwrap();
    let positions = mapped.positions(0).to_vec();
    let error = mapped.set_positions(0, &positions).unwrap_err();
    assert!(error.to_string().contains(&format!("instance {row}")), "{error}");
}

#[test]
fn small_scenes_have_no_trees() {
    let (mapped, read, _folder) = opened(&format!("{OBJECTS}{}", nodes(200, "")), &options());
    assert!(has_trees(&mapped) == 0 && read.file().section(u32::MAX, kind::TREE_LINES).is_none());
}

/// What opening does not read may be anything. All else of the scene has few pages.
#[test]
fn opening_a_mapped_scene_reads_few_pages() {
    let (mapped, read, folder) = opened(&grouped(12_000), &options());
    let heap = mapped.heap_bytes();
    assert!(heap.0 + heap.1 < 64 << 10, "{heap:?}");
    let mut bytes = read.file().bytes().to_vec();
    let (mut others, mut rows) = (0, 0);
    for section in read.file().sections().filter(|section| section.entry.object == u32::MAX) {
        let entry = section.entry;
        if [kind::NODES, kind::INSTANCES, kind::NAMES, kind::TREE_LINES].contains(&entry.kind) {
            bytes[entry.offset as usize..][..entry.length as usize].fill(0xff);
            rows += entry.length;
        } else {
            others += entry.length;
        }
    }
    assert!(rows > 2_000_000 && others < 4 << 10, "{rows} and {others} bytes");
    let path = folder.path().join("no_rows.bth");
    std::fs::write(&path, bytes).unwrap();
    // SAFETY: nobody else knows the folder. Rows are not read, so they need not be valid.
    #[allow(unsafe_code)]
    let mut mapped = unsafe { bth::map(&path) }.unwrap();
    assert_eq!(mapped.set_seconds(3.0).unwrap().placed, 0);
    assert_eq!((mapped.heap_bytes(), mapped.instance_count()), (heap, read.instance_count()));
}
