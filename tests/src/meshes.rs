//! Random meshes in which triangles touch, coincide and are thin, at all scales.

use bth_random::Rng;
use bth_scenes::Model;

/// The kinds of [`mesh`].
pub const KINDS: usize = 9;

fn on_grid(rng: &mut Rng, reach: u64) -> [f32; 3] {
    [(); 3].map(|()| rng.below(2 * reach + 1) as f32 - reach as f32)
}

fn rows(rng: &mut Rng, vertices: usize, triangles: u64) -> Vec<[u32; 3]> {
    (0..1 + rng.below(triangles)).map(|_| [(); 3].map(|()| rng.below(vertices as u64) as u32)).collect()
}

/// A closed box of cells, its corners pushed about if `bumpy` is given.
pub fn cube(cells: usize, bumpy: Option<&mut Rng>) -> Model {
    let mut model = Model::default();
    let mut rows = std::collections::BTreeMap::new();
    let mut vertex = |p: [usize; 3]| {
        *rows.entry(p).or_insert_with(|| {
            model.positions.push(p.map(|x| 2.0 * x as f32 - cells as f32));
            model.positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for (side, cell) in [0, cells].into_iter().flat_map(|s| (0..cells * cells).map(move |c| (s, c))) {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
                let mut p = [side; 3];
                p[(axis + 1) % 3] = cell / cells + i;
                p[(axis + 2) % 3] = cell % cells + j;
                vertex(p)
            });
            let of_side = if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
            model.triangles.extend(of_side);
        }
    }
    if let Some(rng) = bumpy {
        model.positions.iter_mut().for_each(|p| *p = p.map(|x| x + rng.unit_f32() * 0.7));
    }
    model
}

/// A mesh of a kind.
pub fn mesh(kind: usize, rng: &mut Rng) -> Model {
    match kind {
        // On few points: coplanar, coincident and touching triangles.
        0 => {
            let positions: Vec<_> = (0..4 + rng.below(20)).map(|_| on_grid(rng, 2)).collect();
            Model { triangles: rows(rng, positions.len(), 60), positions }
        }
        // In one plane, and a few others across it.
        1 => {
            let mut positions: Vec<[f32; 3]> =
                (0..3 + rng.below(20)).map(|_| on_grid(rng, 3)).map(|[x, y, _]| [x, y, 1.0]).collect();
            positions.extend((0..3).map(|_| on_grid(rng, 3)));
            Model { triangles: rows(rng, positions.len(), 50), positions }
        }
        2 => cube(1 + rng.below(3) as usize, None),
        // Slivers: corners next to a line.
        3 => {
            let positions: Vec<_> = (0..4 + rng.below(20))
                .map(|_| {
                    let along = rng.unit_f32() * 4.0 - 2.0;
                    [along, along * 0.5 + rng.unit_f32() * 1e-6, 1e-6 * rng.unit_f32()]
                })
                .chain([[1.0, -1.0, 0.0], [0.0, 1.0, 1.0], [0.5, 0.0, -1.0]])
                .collect();
            Model { triangles: rows(rng, positions.len(), 60), positions }
        }
        // Needles around an axis.
        4 => {
            let n = 5 + rng.below(40) as u32;
            let mut positions = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
            positions.extend((0..n).map(|i| {
                let (sin, cos) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
                [cos, sin, 0.0].map(|x| x * 3.0)
            }));
            let ring = |i: u32| 2 + i % n;
            let fans = (0..n).flat_map(|i| [[ring(i), ring(i + 1), 0], [ring(i + 1), ring(i), 1]]);
            Model { triangles: fans.collect(), positions }
        }
        // Duplicates, in all orders of corners.
        5 => {
            let positions: Vec<_> = (0..4 + rng.below(8)).map(|_| on_grid(rng, 2)).collect();
            let all = rows(rng, positions.len(), 15);
            let orders = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, b, a], [a, b, c]];
            Model { triangles: all.into_iter().flat_map(orders).collect(), positions }
        }
        6 => {
            let positions: Vec<_> =
                (0..4 + rng.below(30)).map(|_| [(); 3].map(|()| rng.unit_f32() * 2.0 - 1.0)).collect();
            Model { triangles: rows(rng, positions.len(), 60), positions }
        }
        7 => cube(2 + rng.below(2) as usize, Some(rng)),
        // Corners on edges and faces of others, and sheets a unit in the last place apart.
        _ => {
            let mut model = cube(1, None);
            let first = model.positions.len() as u32;
            let ulp = 1.0f32.next_up();
            model.positions.extend([[1.0, 0.0, 0.0], [1.0, 0.5, 0.25], [1.0, -0.5, 1.0], [2.0, 0.0, 0.0]]);
            model.positions.extend([[ulp, -1.0, -1.0], [ulp, 1.0, -1.0], [ulp, 1.0, 1.0]]);
            let touching = [[0, 1, 3], [1, 2, 3], [0, 2, 3], [4, 5, 6], [0, 1, 2]];
            model.triangles.extend(touching.map(|t| t.map(|row| row + first)));
            model
        }
    }
}

/// The model in other units and elsewhere.
pub fn placed(mut model: Model, scale: f32, by: f32) -> Model {
    for p in &mut model.positions {
        let [x, y, z] = p.map(|x| x * scale);
        *p = [x + by, y - by, z + 0.5 * by];
    }
    model
}
