//! In generated models and planted cases exactly the triangles in bad contact are marked.

use std::collections::HashMap;

use bth_compile::{Silent, bvh, marks};
use bth_import::Mesh;
use bth_scenes::{Model, catalogue, planted};

/// The compiler's mesh of a model: bit-equal positions welded.
fn weld(model: &Model) -> Mesh {
    let mut mesh = Mesh::default();
    let mut rows = HashMap::new();
    for t in &model.triangles {
        mesh.triangles.push(t.map(|v| {
            let p = model.positions[v as usize].map(|x| x + 0.0);
            *rows.entry(p.map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(p);
                mesh.positions.len() as u32 - 1
            })
        }));
    }
    mesh
}

/// Returns true if the whole model is free of bad contacts according to the compiler.
fn is_suitable(model: &Model) -> bool {
    let mesh = weld(model);
    let (tree, _) = bvh::build(&mesh, &bvh::BvhOptions::default(), &Silent).unwrap();
    let (marks, _) = marks::mark(&mesh, &tree, &Silent).unwrap();
    marks.suitable[0]
}

#[test]
fn planted_contacts_are_found_and_harmless_neighbours_left_alone() {
    for case in planted::cases() {
        assert_eq!(is_suitable(&case.model), !case.bad, "{}", case.name);
    }
}

#[test]
fn planted_cases_are_judged_alike_in_any_order_and_orientation() {
    for case in planted::cases() {
        let mut model = case.model.clone();
        model.triangles.reverse();
        for t in &mut model.triangles {
            t.rotate_left(1);
        }
        model.triangles[0].swap(1, 2);
        for p in &mut model.positions {
            *p = [p[1], p[2], p[0]];
        }
        assert_eq!(is_suitable(&model), !case.bad, "{}", case.name);
    }
}

#[test]
fn clean_models_are_suitable_whole_and_messy_ones_are_not() {
    for (name, suitable) in [
        ("torus-knot", true),
        ("torus-knots-in-a-box", true),
        ("gyroid", true),
        ("blob", true),
        ("hall", false),
        ("hairball", false),
        ("soup", false),
    ] {
        let entry = catalogue::find(name).unwrap();
        assert_eq!(is_suitable(&(entry.make)(entry.faces.min(30_000))), suitable, "{name}");
    }
}
