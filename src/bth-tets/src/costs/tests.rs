//! Tests of the selection and its parts against plain recursion and against meshes with known
//! numbers of steps.

use super::testing::{marks_beyond, tree};
use super::*;
use crate::marks::Marks;
use crate::{Behind, TetMesh};
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::{KnownRays, SampleRay, from_surface, outside, walk};
use bth_import::Mesh;
use bth_import::monitor::Silent;

#[test]
fn an_empty_bvh_chooses_nothing_and_foreign_marks_are_an_error() {
    let choose =
        |bvh: &BinaryBvh| choose(&Mesh::default(), bvh, &Marks::default(), &CostOptions::default(), &Silent);
    let (chosen, report) = choose(&BinaryBvh::default()).unwrap();
    assert!(chosen.is_empty() && report.examined == 0);
    assert!(choose(&tree(1, 9)).unwrap_err().to_string().contains("BTH-X030"));
}

/// A closed model, its BVH, and marks in which every node is suitable.
fn blob() -> (Mesh, BinaryBvh, Marks) {
    let model = bth_scenes::blob::blob(6000);
    let mesh = Mesh { positions: model.positions, triangles: model.triangles, ..Mesh::default() };
    let (bvh, _) = bth_bvh::build(&mesh, &bth_bvh::BvhOptions::default(), &Silent).unwrap();
    let marks = Marks { suitable: vec![true; bvh.nodes.len()] };
    (mesh, bvh, marks)
}

#[test]
fn a_ray_meets_what_trying_all_triangles_meets_and_enters_the_nodes_above() {
    let (mesh, bvh, _) = blob();
    let root = bvh.nodes[0];
    let mut hits = 0;
    for ray in outside(root.lower, root.upper, 300, 7) {
        let mut entered = vec![false; bvh.nodes.len()];
        let met = walk(&mesh, &bvh, &ray, |node| entered[node as usize] = true);
        let all = bvh.order.iter().enumerate().filter_map(|(row, &triangle)| {
            Some((
                bth_bvh::sampling::crosses(&ray, bth_bvh::vectors::corners(&mesh, triangle), f64::INFINITY)?,
                row as u32,
            ))
        });
        let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(met.hit.map(|(_, t)| t), nearest.map(|(t, _)| t));
        assert_eq!(met.visits as usize, entered.iter().filter(|e| **e).count());
        if let Some((row, _)) = met.hit {
            hits += 1;
            for (i, node) in bvh.nodes.iter().enumerate() {
                assert!(entered[i] || !(node.first..node.first + node.count).contains(&row));
            }
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn cheap_tetrahedra_are_taken_whole_and_dear_ones_not_at_all() {
    let (mesh, bvh, marks) = blob();
    let choice = |c_tet: f64, options: CostOptions| {
        let options = CostOptions { c_tet: Some(c_tet), minimum_triangles: 64, ..options };
        choose(&mesh, &bvh, &marks, &options, &Silent).unwrap()
    };
    let (cheap, report) = choice(1e-3, CostOptions::default());
    assert_eq!((cheap, report.examined), (vec![0], 1));
    let (none, refused) = choice(1e-3, CostOptions { minimum_gain: 1.1, ..CostOptions::default() });
    assert!(none.is_empty() && refused.triangles == 0);
    assert_eq!(refused.cost_with_tets, refused.cost_bvh);
    assert!(report.cost_with_tets < 0.5 * report.cost_bvh, "{report:?}");
    let (none, report) = choice(1e3, CostOptions::default());
    assert!(none.is_empty() && report.refused_for_cost > 0);

    // Rays from outside walk through the tetrahedra, too.
    let camera = CostOptions { optimize_for: OptimizeFor::Camera, ..CostOptions::default() };
    assert_eq!(choice(1e-3, camera).0, [0]);
}

#[test]
fn rays_of_a_scene_decide_which_nodes_count() {
    let (mesh, bvh, marks) = blob();
    let nodes = |rays: KnownRays| {
        let rays = Some(std::sync::Arc::new(rays));
        let options =
            CostOptions { c_tet: Some(1e-3), minimum_triangles: 64, rays, ..CostOptions::default() };
        choose(&mesh, &bvh, &marks, &options, &Silent).unwrap().0
    };
    assert!(nodes(KnownRays::default()).is_empty());
    // Rays that all start below one child of the root and end there.
    let right = bvh.nodes[0].right;
    let rows = bvh.nodes[right as usize].first as usize..bvh.order.len();
    let surface = from_surface(&mesh, &bvh, rows.clone(), 400, 5);
    let surface: Vec<SampleRay> = surface.into_iter().filter(|r| r.tmax.is_finite()).collect();
    let found = nodes(KnownRays { outside: Vec::new(), surface });
    assert!(!found.is_empty());
    assert!(found.iter().all(|&n| bvh.nodes[n as usize].first as usize >= rows.start || n == 0), "{found:?}");
}

#[test]
fn what_all_nodes_cannot_gain_no_marks_can() {
    let (mesh, bvh, _) = blob();
    let (mut none, mut some) = (0, 0);
    for (c_tet, minimum_gain) in
        (0..12).flat_map(|k| [0.0, 0.02, 0.2].map(|gain| (0.5 * 1.3f64.powi(k), gain)))
    {
        let options =
            CostOptions { c_tet: Some(c_tet), minimum_triangles: 64, minimum_gain, ..CostOptions::default() };
        assert!(options.more_suitable_gain_more());
        let (of_all, report) = choose_of_all(&mesh, &bvh, &options, &Silent).unwrap();
        let gain = report.cost_bvh - report.cost_with_tets;
        for row in [0, 1, 100, bvh.order.len() as u32 / 2, bvh.order.len() as u32 - 300] {
            let marks = marks_beyond(&bvh, row);
            let (choice, report) = choose(&mesh, &bvh, &marks, &options, &Silent).unwrap();
            assert!(
                report.cost_bvh - report.cost_with_tets <= gain + 1e-9 * report.cost_bvh,
                "{c_tet}, {row}"
            );
            assert!(!of_all.is_empty() || choice.is_empty(), "{c_tet}, {row}");
        }
        *if of_all.is_empty() { &mut none } else { &mut some } += 1;
    }
    assert!(none > 5 && some > 5, "{none}, {some}");
    let nodes = CostOptions { select: Select::Nodes(Vec::new()), ..CostOptions::default() };
    assert!(!nodes.more_suitable_gain_more());
}

/// Two tetrahedra over the triangle (0, 1, 2), which is a constrained face; the hull is not a box,
/// which walks do not require.
fn two_tets() -> TetMesh {
    let face = crate::Face { triangle: 9, vertex: [0, 1, 2], tet: [0, 1] };
    TetMesh {
        lower: [0.0, 0.0, -1.0],
        upper: [1.0, 1.0, 1.0],
        vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, 1.0], [0.2, 0.2, -1.0]],
        tets: vec![[0, 1, 2, 3], [0, 1, 2, 4]],
        behind: vec![
            [Behind::Hull, Behind::Hull, Behind::Hull, Behind::Face(0)],
            [Behind::Hull, Behind::Hull, Behind::Hull, Behind::Face(0)],
        ],
        faces: vec![face],
        steiner_points: 0,
    }
}

#[test]
fn walks_end_at_triangles_the_hull_or_the_rays_end() {
    let mesh = two_tets();
    let walker = TetWalker::new(&mesh);
    let ray = |z: f64, down: f64, tmax: f64, from: Option<u32>| SampleRay {
        origin: [0.25, 0.25, z],
        direction: [0.0, 0.0, down],
        tmax,
        from,
    };
    let walked = |hit, left| Some(Walked { steps: 1, hit, left });
    assert_eq!(walker.walk(&ray(5.0, -1.0, f64::INFINITY, None)), walked(true, false));
    assert_eq!(walker.walk(&ray(0.0, 1.0, f64::INFINITY, Some(9))), walked(false, true));
    assert_eq!(walker.walk(&ray(0.0, -1.0, f64::INFINITY, Some(9))), walked(false, true));
    assert_eq!(walker.walk(&ray(0.0, 1.0, 0.01, Some(9))), walked(false, false));
    assert_eq!(walker.walk(&ray(5.0, 1.0, f64::INFINITY, None)), None);
}
