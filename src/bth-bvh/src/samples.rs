//! Meshes for tests.

pub(super) use crate::testing::weld;
use bth_import::Mesh;
use bth_import::monitor::Silent;
use bth_random::Rng;
use std::path::PathBuf;

/// Small separate triangles anywhere in the unit cube.
pub(super) fn soup(count: usize, seed: u64) -> Mesh {
    let mut random = Rng::new(seed);
    let size = 0.5 / (count as f32).cbrt();
    let corners: Vec<_> = (0..count)
        .map(|_| {
            let center = [random.unit_f32(), random.unit_f32(), random.unit_f32()];
            std::array::from_fn(|_| center.map(|c| c + size * (random.unit_f32() - 0.5)))
        })
        .collect();
    weld(&corners)
}

/// A height field of `2 * side * side` triangles.
pub(super) fn grid(side: usize, height: f32, seed: u64) -> Mesh {
    let mut random = Rng::new(seed);
    let row = side as u32 + 1;
    let mut mesh = Mesh::default();
    for y in 0..row {
        for x in 0..row {
            mesh.positions.push([x as f32, y as f32, height * random.unit_f32()]);
        }
    }
    for y in 0..side as u32 {
        for x in 0..side as u32 {
            let v = y * row + x;
            mesh.triangles.push([v, v + 1, v + row]);
            mesh.triangles.push([v + 1, v + row + 1, v + row]);
        }
    }
    mesh
}

/// Triangles with few distinct coordinates: many repeat, touch, coincide or have no area.
pub(super) fn clutter(count: usize, values: &[f32], seed: u64) -> Mesh {
    let mut random = Rng::new(seed);
    let corners: Vec<[[f32; 3]; 3]> = (0..count)
        .map(|_| {
            std::array::from_fn(|_| {
                std::array::from_fn(|_| values[random.below(values.len() as u64) as usize])
            })
        })
        .collect();
    weld(&corners)
}

/// Triangles whose size and distance grow exponentially, which SAH splits one by one.
pub(super) fn exponential(count: usize) -> Mesh {
    let corners: Vec<_> = (0..count)
        .map(|i| {
            let s = 2f32.powf(i as f32 * 200.0 / count as f32 - 100.0);
            [[s, 0.0, 0.0], [s, s, 0.0], [s, 0.0, s]]
        })
        .collect();
    weld(&corners)
}

/// A model of the shared test data, if it is there.
pub(super) fn model(name: &str) -> Option<Mesh> {
    let data = std::env::var_os("BTH_DATA")
        .map(PathBuf::from)
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    let path = data.join("static").join(name);
    path.exists().then(|| bth_import::import(&path, bth_import::Wanted::default(), &Silent).unwrap().0)
}
