//! Models that are hard for compilers: every one compiles, verifies, and gives the answers of the
//! plain BVH.

use bth::rays::Hit;
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_random::Rng;
use bth_scenes::Model;
use bth_tests::rays::assorted;
use bth_tests::structures::bits;

/// Compiles with the defaults and as a BVH, verifies both, and compares some rays.
fn check(name: &str, model: &Model) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).unwrap();
    let scene = |structure| {
        let mut options = CompileOptions { structure, ..CompileOptions::default() };
        options.tets.worker = bth_tests::worker().map(Into::into);
        options.costs.minimum_triangles = 16;
        options.tets.minimum = 1;
        let (compiled, report) = compile(&path, &options, &Silent).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(report.mesh.triangles, model.triangles.len() as u64, "{name}");
        let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
        bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{name}: {}", e[0]));
        bth::from_bytes(&compiled.bytes).unwrap()
    };
    let (bth, bvh) = (scene(Structure::Bth), scene(Structure::Bvh));
    if model.triangles.is_empty() {
        return;
    }
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let rays = assorted(&corners, 1000, 1);
    let (mut a, mut b) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
    bth.batch(&rays).nearest(&mut a);
    bvh.batch(&rays).nearest(&mut b);
    for ((a, b), ray) in a.iter().zip(&b).zip(&rays) {
        assert_eq!(bits(a), bits(b), "{name}: {ray:?}");
    }
}

fn model(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Model {
    Model { positions, triangles }
}

/// A bumpy square of `n` cells a side, moved up by `ulps` units in the last place of every height.
fn sheet(n: u32, ulps: u32) -> Model {
    let mut rng = Rng::new(4);
    let mut sheet = Model::default();
    for i in 0..=n {
        for j in 0..=n {
            let height = 1.0 + 0.25 * rng.unit_f32();
            sheet.positions.push([i as f32, j as f32, f32::from_bits(height.to_bits() + ulps)]);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| (i + di) * (n + 1) + j + dj);
            sheet.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    sheet
}

fn append(to: &mut Model, other: &Model) {
    let base = to.positions.len() as u32;
    to.positions.extend(&other.positions);
    to.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
}

#[test]
fn nothing_one_triangle_and_many_equal_ones_compile() {
    let corner = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.25]];
    check("no triangle", &Model::default());
    check("one triangle", &model(corner.clone(), vec![[0, 1, 2]]));
    check("2,000 equal triangles", &model(corner.clone(), vec![[0, 1, 2]; 2000]));
    check("only triangles without area", &model(corner, vec![[0, 1, 1]; 100]));
}

#[test]
fn sheets_a_unit_in_the_last_place_apart_compile() {
    let mut sheets = sheet(12, 0);
    for ulps in [1, 2, 7] {
        append(&mut sheets, &sheet(12, ulps));
    }
    check("sheets 1 ulp apart", &sheets);
}

#[test]
fn needle_fans_and_vertices_of_high_valence_compile() {
    for (name, height) in [("fan", 1.0), ("needles", 1e5), ("flat fan", 0.0)] {
        let mut fan = model(vec![[0.0, 0.0, height]], Vec::new());
        for i in 0..1500u32 {
            let angle = f64::from(i) / 1500.0 * std::f64::consts::TAU;
            fan.positions.push([angle.cos() as f32, angle.sin() as f32, 0.0]);
            fan.triangles.push([0, 1 + i, 1 + (i + 1) % 1500]);
        }
        check(name, &fan);
    }
}

#[test]
fn facets_that_cross_touch_and_overlap_compile() {
    let mut plc = sheet(6, 0);
    let n = plc.positions.len() as u32;
    // A crossing quad, a triangle that ends within another, a coplanar overlap, and an edge along
    // an edge.
    plc.positions.extend([[1.5, 1.5, 0.0], [4.5, 1.5, 0.0], [4.5, 1.5, 3.0], [1.5, 1.5, 3.0]]);
    plc.triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    let [a, b, c] = plc.triangles[20].map(|v| plc.positions[v as usize]);
    let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
    plc.positions.extend([middle, [middle[0], middle[1], 4.0], [middle[0] + 0.5, middle[1], 4.0]]);
    plc.triangles.push([n + 4, n + 5, n + 6]);
    plc.triangles.push(plc.triangles[30]);
    plc.positions.push([0, 1, 2].map(|k| (a[k] + b[k]) / 2.0));
    plc.triangles.push([plc.triangles[20][0], n + 7, n + 5]);
    check("a degenerate complex", &plc);
}

#[test]
fn surfaces_within_surfaces_compile() {
    let mut nested = Model::default();
    for shell in 0..12 {
        let mut blob = bth_scenes::blob::blob(160);
        let scale = 1.0 - 0.07 * shell as f32;
        blob.positions.iter_mut().for_each(|p| *p = p.map(|x| x * scale));
        append(&mut nested, &blob);
    }
    check("nested surfaces", &nested);
}

#[test]
fn a_hundred_thousand_components_compile() {
    let mut rng = Rng::new(9);
    let mut dust = Model::default();
    for _ in 0..100_000 {
        let at = [(); 3].map(|()| 100.0 * rng.unit_f32());
        let corner = [(); 3].map(|()| at.map(|x| x + 0.05 * rng.unit_f32()));
        append(&mut dust, &model(corner.to_vec(), vec![[0, 1, 2]]));
    }
    check("100,000 components", &dust);
}
