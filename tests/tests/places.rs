//! The places of triangles in compiled files lead to the triangles, in every kind of leaf.

use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_format::File;
use bth_format::file::DeformableObject;
use bth_format::layout::{Child, GridBits, NONE, TrianglePlace};
use bth_format::object::ObjectView;
use bth_scenes::{Model, blob, knot, soup};
use bth_tests::structures::options;

fn compiled(model: &Model, options: &CompileOptions) -> File {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).unwrap();
    let (compiled, _) = compile(&path, options, &Silent).unwrap();
    File::from_bytes(&compiled.bytes).unwrap()
}

/// Options for one kind of leaves each, with a name.
fn kinds() -> Vec<(&'static str, CompileOptions)> {
    let plain = options(Structure::Bvh);
    let with = |change: fn(&mut CompileOptions)| {
        let mut options = plain.clone();
        change(&mut options);
        options
    };
    let mut kinds = vec![
        ("f32", plain.clone()),
        ("16 bits", with(|o| o.coordinates.bits = Some(GridBits::B16))),
        ("21 bits", with(|o| o.coordinates.bits = Some(GridBits::B21))),
        ("deformable", with(|o| o.deformable = true)),
        ("free directions", with(|o| o.free.keep = bth_compile::free::KeepFree::All)),
    ];
    if bth_tests::worker().is_some() {
        kinds.push(("tet leaves", options(Structure::Bth)));
    }
    kinds
}

/// Checks that a place leads to each triangle in a leaf, and that no other triangle has a place.
/// Returns the number of triangles in indexed leaves, in raw leaves, and without a place.
fn check(view: &ObjectView<'_>, name: &str) -> [usize; 3] {
    let mut counts = [0; 3];
    let mut in_leaves = vec![false; view.header.triangles as usize];
    view.triangle_ids.iter().for_each(|id| in_leaves[*id as usize] = true);
    assert_eq!(view.places.len(), in_leaves.len(), "{name}");
    for (triangle, in_leaf) in (0..).zip(in_leaves) {
        let Some(place) = view.place(triangle) else {
            assert!(!in_leaf && view.places[triangle as usize] == NONE, "{name}: {triangle}");
            counts[2] += 1;
            continue;
        };
        assert_eq!(place.code(), view.places[triangle as usize]);
        let TrianglePlace { leaf, slot } = place;
        let (first, triangles) = match leaf {
            Child::Indexed(index) => {
                counts[0] += 1;
                let mut unpacked = None;
                let leaf = view.indexed(index, &mut unpacked);
                (leaf.first, leaf.triangles)
            }
            Child::Raw(index) => {
                counts[1] += 1;
                let mut unpacked = None;
                let leaf = view.raw(index, &mut unpacked);
                (leaf.first, leaf.triangles)
            }
            _ => panic!("{name}: {leaf:?}"),
        };
        assert!(slot < triangles, "{name}: {triangle}");
        assert_eq!(view.triangle_ids[(first + slot) as usize], triangle, "{name}");
    }
    counts
}

#[test]
fn places_lead_to_the_triangles() {
    let mut twice = blob::blob(600);
    twice.triangles.extend_from_within(..200);
    let mut flat = blob::blob(600);
    flat.triangles.extend([[0, 0, 1], [5, 5, 5]]);
    let one =
        Model { positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
    let models = [
        ("knot", knot::torus_knot(1500)),
        ("soup", soup::soup(400)),
        ("twice", twice),
        ("flat", flat),
        ("one", one),
    ];
    let mut counts = [0; 3];
    for (model_name, model) in &models {
        for (kind, options) in kinds() {
            let name = format!("{model_name}, {kind}");
            let file = compiled(model, &options);
            bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{name}: {e:?}"));
            let found = check(&file.check(0).unwrap(), &name);
            assert_eq!(found.iter().sum::<usize>(), model.triangles.len(), "{name}");
            counts = [0, 1, 2].map(|k| counts[k] + found[k]);
            if options.deformable {
                let deformed = DeformableObject::new(&file, 0).unwrap();
                assert_eq!(check(deformed.view(), &name), found);
                assert_eq!(found[2], 0, "{name}: a deformable object drops no triangle");
            }
        }
    }
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
}

#[test]
fn an_object_without_anything_to_hit_has_no_places() {
    let model = Model { positions: vec![[0.0; 3], [1.0; 3]], triangles: vec![[0, 0, 1]] };
    let file = compiled(&model, &kinds()[0].1);
    let view = file.check(0).unwrap();
    assert_eq!((view.header.root, view.places.len()), (NONE, 0));
    assert_eq!(view.place(0), None);
}
