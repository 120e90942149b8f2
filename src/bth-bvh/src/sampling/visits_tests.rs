use super::*;
use crate::{BvhOptions, build};
use bth_import::monitor::Silent;
use bth_random::Rng;

/// Two clusters of the same small triangles, one in the open, and one in the middle of a closed box
/// next to it.
fn open_and_enclosed() -> Mesh {
    let mut mesh = Mesh::default();
    let mut add = |corners: [[f32; 3]; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    let mut random = Rng::new(5);
    for _ in 0..400 {
        let center = [(); 3].map(|()| random.unit_f32());
        let corners = [(); 3].map(|()| center.map(|x| x + 0.1 * random.unit_f32()));
        add(corners);
        add(corners.map(|[x, y, z]| [x + 5.0, y, z]));
    }
    // The walls are a fifth of a unit from the cluster, and show their fronts to the outside.
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.3 } else { -0.2 });
    for axis in 0..3 {
        for side in 0..2 {
            let (mut u, mut v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            if side == 0 {
                (u, v) = (v, u);
            }
            let base = side << axis;
            add([base, base + u, base + u + v].map(corner));
            add([base, base + u + v, base + v].map(corner));
        }
    }
    // Far away, so that few rays from within the bounds start inside of the walls.
    add([[20.0; 3], [20.0, 20.0, 21.0], [20.0, 21.0, 20.0]]);
    add([[-20.0; 3], [-20.0, -20.0, -21.0], [-20.0, -21.0, -20.0]]);
    mesh
}

#[test]
fn nodes_behind_walls_are_entered_less_than_by_their_area() {
    let mesh = open_and_enclosed();
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let probabilities = visits(&mesh, &bvh, None);
    // What small triangles of either cluster are entered, relative to their area.
    let relative = |enclosed: bool| {
        let leaves = (0..bvh.nodes.len()).filter(|&at| {
            let node = &bvh.nodes[at];
            let small = node.is_leaf() && bvh.order[node.first as usize] < 800;
            small && (node.upper[0] < 2.0) == enclosed
        });
        let (entered, area) = leaves.fold((0.0, 0.0), |(entered, area), at| {
            (entered + probabilities[at], area + bvh.nodes[at].half_area())
        });
        entered / area
    };
    // Rays from outside and most of those from surfaces elsewhere do not reach what is enclosed.
    assert!(relative(true) < 0.8 * relative(false), "{} {}", relative(true), relative(false));
}

#[test]
fn probabilities_fall_from_the_root_down_and_follow_areas_where_no_ray_comes() {
    let mesh = open_and_enclosed();
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let probabilities = visits(&mesh, &bvh, None);
    assert_eq!(probabilities[0], 1.0);
    for (at, node) in bvh.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
        for child in [at + 1, node.right as usize] {
            let (above, below) = (probabilities[at], probabilities[child]);
            assert!(0.0 < below && below <= above * (1.0 + 1e-12), "{below} below {above}");
        }
    }
    assert_eq!(visits(&Mesh::default(), &BinaryBvh::default(), None), Vec::<f64>::new());
}

#[test]
fn known_rays_raise_the_probabilities_of_what_they_enter() {
    let mesh = open_and_enclosed();
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    // Rays between the walls, through the enclosed cluster.
    let known = KnownRays {
        outside: within([0.0; 3], [1.0; 3], [1 << 14, 1], 7),
        surface: within([0.0; 3], [1.0; 3], [100, 1], 8),
    };
    let drawn = visits(&mesh, &bvh, None);
    let weighted = visits(&mesh, &bvh, Some(&known));
    assert_eq!(weighted[0], 1.0);
    let sum = |probabilities: &[f64], enclosed: bool| -> f64 {
        let leaves = bvh.nodes.iter().zip(probabilities).filter(|(node, _)| node.is_leaf());
        let of_cluster =
            |node: &Node| bvh.order[node.first as usize] < 800 && (node.upper[0] < 2.0) == enclosed;
        leaves.filter(|(node, _)| of_cluster(node)).map(|(_, probability)| probability).sum()
    };
    assert!(sum(&weighted, true) > 2.0 * sum(&drawn, true), "{} {}", sum(&weighted, true), sum(&drawn, true));
    // The other cluster is still entered by the rays that are drawn.
    assert!(sum(&weighted, false) > 0.0 && sum(&weighted, false) < 0.5 * sum(&drawn, false));
    assert_eq!(visits(&mesh, &bvh, Some(&KnownRays::default())), drawn);
}

#[test]
fn rays_are_counted_at_each_box_that_they_enter_before_their_hits() {
    let mesh = open_and_enclosed();
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let rays: Vec<SampleRay> = sample(&mesh, &bvh, 0).into_iter().step_by(16).collect();
    let mut expected = vec![0; bvh.nodes.len()];
    for ray in &rays {
        // The nearest hit of all triangles.
        let t = |triangle: usize| {
            let corners = crate::vectors::corners(&mesh, triangle as u32);
            crate::sampling::crosses(ray, corners, ray.tmax)
        };
        let limit = (0..mesh.triangles.len()).filter_map(t).fold(ray.tmax, f64::min);
        for (count, node) in expected.iter_mut().zip(&bvh.nodes) {
            *count += u32::from(enters(ray, node.lower, node.upper, limit).is_some());
        }
    }
    assert_eq!(entered(&mesh, &bvh, &rays), expected);
}

#[test]
fn where_triangles_coincide_fewer_rays_are_taken() {
    let mut mesh = Mesh { positions: vec![[0.0; 3], [1.0, 0.0, 0.3], [0.0, 1.0, 0.1]], ..Mesh::default() };
    mesh.triangles = vec![[0, 1, 2]; 20_000];
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let rays = sample(&mesh, &bvh, 0);
    let taken = affordable(&mesh, &bvh, rays.clone());
    let enters = |rays: &[SampleRay]| {
        rays.iter().map(|ray| u64::from(walk(&mesh, &bvh, ray, |_| ()).visits)).sum::<u64>()
    };
    assert!(enters(&taken) < 1 << 25 && 4 * taken.len() < rays.len() && taken.len() > 100, "{}", taken.len());
    // Of ordinary meshes all are.
    let mesh = open_and_enclosed();
    let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let rays = sample(&mesh, &bvh, 0);
    assert_eq!(affordable(&mesh, &bvh, rays.clone()), rays);
}
