//! Downloaded models, where they exist.

use std::path::{Path, PathBuf};

use bth_import::Mesh;
use bth_import::Silent;
use bth_tets::build;

use crate::meshes::{bvh, weld};
use crate::oracle::assert_holds;
use crate::with_worker;

fn data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("BTH_DATA").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"));
    let path = folder.join(name);
    if !path.is_file() {
        println!("{name}: skipped, it is not at {}", path.display());
        return None;
    }
    Some(path)
}

/// Reads binary little-endian PLY with float positions first and faces as `uchar int` lists.
fn read_ply(path: &Path) -> Mesh {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    assert!(header.contains("binary_little_endian"), "{header}");
    let count = |element: &str| -> usize {
        let rest = header.split_once(&format!("element {element} ")).unwrap().1;
        rest.lines().next().unwrap().trim().parse().unwrap()
    };
    let vertex_part = header.split_once("element vertex").unwrap().1.split_once("element face").unwrap().0;
    let stride = 4 * vertex_part.matches("property").count();
    let at = |i: usize| u32::from_le_bytes(bytes[i..i + 4].try_into().unwrap());
    let position = |v: u32| [0, 1, 2].map(|k| f32::from_bits(at(end + v as usize * stride + 4 * k)));
    let faces = end + count("vertex") * stride;
    weld((0..count("face")).map(|f| {
        assert_eq!(bytes[faces + 13 * f], 3);
        [0, 1, 2].map(|k| position(at(faces + 13 * f + 1 + 4 * k)))
    }))
}

fn whole_model_holds(name: &str, tets_per_triangle: f64) {
    let (Some(options), Some(path)) = (with_worker(name), data(name)) else { return };
    let mesh = read_ply(&path);
    let bvh = bvh(&mesh);
    let (built, report) = build(&mesh, &bvh, &[0], &options, &Silent).unwrap();
    let triangles = mesh.triangles.len() as f64;
    println!(
        "{name}: {} of {} triangles, {:.2} tets a triangle, {} Steiner points ({} in free space), {} nudged",
        report.built_triangles,
        report.chosen_triangles,
        report.tets as f64 / triangles,
        report.steiner_points,
        report.free_points,
        report.nudged
    );
    assert_eq!((report.built, report.given_up), (1, 0), "{:?}", report.failures);
    assert!((report.tets as f64) < tets_per_triangle * triangles);
    assert_holds(&mesh, &bvh, 0, &built[0].1);
}

#[test]
fn the_bunny_holds() {
    whole_model_holds("static/stanford-bunny.ply", 4.5);
}

#[test]
fn the_fandisk_holds() {
    whole_model_holds("static/fandisk.ply", 6.0);
}
