//! Meshes and BVHs to test with.

pub(crate) use bth_bvh::testing::weld;
use bth_bvh::{BinaryBvh, Node};
use bth_import::Mesh;
use bth_random::Rng;

/// A rectangular grid of `n` by `m` cells mapped by `at`, two triangles a cell.
pub(crate) fn grid(n: u32, m: u32, at: impl Fn(u32, u32) -> [f32; 3]) -> Mesh {
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    weld(cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    }))
}

/// A closed torus.
pub(crate) fn torus(n: u32, m: u32) -> Mesh {
    grid(n, m, |i, j| {
        let turn = std::f32::consts::TAU;
        let (u, v) = ((i % n) as f32 / n as f32 * turn, (j % m) as f32 / m as f32 * turn);
        let r = 1.0 + 0.4 * v.cos();
        [r * u.cos(), r * u.sin(), 0.4 * v.sin()]
    })
}

/// A bumpy height field: open, and without self-intersection because it is a graph.
pub(crate) fn bumps(n: u32, seed: u64, offset: [f32; 3], scale: f32) -> Mesh {
    let mut random = Rng::new(seed);
    let heights: Vec<f32> = (0..(n + 1) * (n + 1)).map(|_| random.unit_f32() * 2.0).collect();
    grid(n, n, |i, j| {
        let p = [i as f32, j as f32, heights[(i * (n + 1) + j) as usize]];
        std::array::from_fn(|k| offset[k] + scale * p[k])
    })
}

/// The twelve triangles of a cube.
pub(crate) fn cube() -> Mesh {
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = |i: u32| std::array::from_fn(|k| (i >> k & 1) as f32);
    weld(quads.into_iter().flat_map(|q: [u32; 4]| {
        let [a, b, c, d] = q.map(corner);
        [[a, b, c], [a, c, d]]
    }))
}

/// A BVH by median splits of the triangles' centres.
pub(crate) fn bvh(mesh: &Mesh) -> BinaryBvh {
    fn grow(mesh: &Mesh, ids: &mut [u32], first: u32, bvh: &mut BinaryBvh) {
        let mut lower = [f32::INFINITY; 3];
        let mut upper = [f32::NEG_INFINITY; 3];
        for p in ids.iter().flat_map(|&id| mesh.corners(id)) {
            for k in 0..3 {
                lower[k] = lower[k].min(p[k]);
                upper[k] = upper[k].max(p[k]);
            }
        }
        let at = bvh.nodes.len();
        bvh.nodes.push(Node { lower, upper, first, count: ids.len() as u32, right: 0 });
        if let [id] = *ids {
            bvh.order.push(id);
            return;
        }
        let axis =
            (0..3).max_by(|&a, &b| (upper[a] - lower[a]).total_cmp(&(upper[b] - lower[b]))).unwrap_or(0);
        let centre = |id: u32| mesh.corners(id).iter().map(|p| p[axis]).sum::<f32>();
        ids.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
        let (left, right) = ids.split_at_mut(ids.len() / 2);
        let split = left.len() as u32;
        grow(mesh, left, first, bvh);
        bvh.nodes[at].right = bvh.nodes.len() as u32;
        grow(mesh, right, first + split, bvh);
    }
    let mut bvh = BinaryBvh::default();
    grow(mesh, &mut (0..mesh.triangles.len() as u32).collect::<Vec<_>>(), 0, &mut bvh);
    bvh
}

/// The topmost nodes of at most that many triangles, ascending.
pub(crate) fn nodes_of_at_most(bvh: &BinaryBvh, most: u32) -> Vec<u32> {
    let mut nodes = Vec::new();
    let mut at = 0;
    while at < bvh.nodes.len() as u32 {
        let node = bvh.nodes[at as usize];
        if node.count <= most {
            nodes.push(at);
            // A tree over n triangles has 2n - 1 nodes.
            at += 2 * node.count - 1;
        } else {
            at += 1;
        }
    }
    nodes
}
