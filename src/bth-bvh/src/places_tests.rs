use super::super::samples::{grid, soup};
use super::super::{BvhOptions, CollapseOptions, Weighed, build, collapse};
use super::*;
use bth_import::Mesh;
use bth_import::monitor::Silent;

/// The wide BVH of a mesh, in which these nodes of the binary one are tet leaves.
fn wide(mesh: &Mesh, cut: &[u32]) -> Wide {
    let (tree, _) = build(mesh, &BvhOptions::default(), &Silent).unwrap();
    let weighed = Weighed { bvh: &tree, probabilities: None };
    collapse(mesh, weighed, cut, &CollapseOptions::default(), &Silent).unwrap().0
}

/// The id at a place.
fn id_at(wide: &Wide, place: u32) -> u32 {
    let TrianglePlace { leaf: child, slot } = TrianglePlace::from_code(place).unwrap();
    let leaf = leaf(wide, child, None);
    assert!(slot < leaf.triangles);
    wide.triangle_ids[(leaf.first + slot) as usize]
}

#[test]
fn every_triangle_in_a_leaf_has_its_place() {
    for mesh in [grid(9, 1.0, 1), soup(100, 2)] {
        let triangles = mesh.triangles.len();
        let whole = wide(&mesh, &[]);
        let places = triangle_places(&whole, None, triangles + 1);
        assert_eq!(places.len(), triangles + 1);
        assert!((0..triangles).all(|t| id_at(&whole, places[t]) == t as u32));
        assert_eq!(places[triangles], NONE, "no leaf holds it");
    }
}

#[test]
fn triangles_of_tet_leaves_have_no_places() {
    let mesh = grid(9, 1.0, 1);
    let triangles = mesh.triangles.len();
    let places = |cut: u32| triangle_places(&wide(&mesh, &[cut]), None, triangles);
    assert!(places(0).iter().all(|place| *place == NONE));
    let without = places(1).iter().filter(|place| **place == NONE).count();
    assert!(0 < without && without < triangles, "{without}");
    assert!(triangle_places(&Wide { root: NONE, ..Wide::default() }, None, 3).is_empty());
}

#[test]
fn a_triangle_in_several_leaves_has_the_place_in_the_first() {
    let mesh = soup(200, 3);
    let mut wide = wide(&mesh, &[]);
    let all = leaves(&wide, None);
    assert!(all.len() > 2 && all.is_sorted_by_key(|leaf| leaf.half));
    // The last leaf, another one and two slots of it now hold the same triangle.
    let [second, last] = [&all[1], &all[all.len() - 1]];
    assert!(second.triangles > 2);
    for row in [second.first + 1, second.first + 2, last.first] {
        wide.triangle_ids[row as usize] = 7777;
    }
    let place = triangle_places(&wide, None, 7778)[7777];
    assert_eq!(TrianglePlace::from_code(place), Some(TrianglePlace { leaf: second.child, slot: 1 }));
}
