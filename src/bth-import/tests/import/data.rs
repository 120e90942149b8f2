//! The collected test models: every one ends in a mesh or a clear error, with the known counts.

use super::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The folder of the collected models, or `None` with a line that says so.
pub(super) fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("BTH_DATA").map_or(beside, PathBuf::from);
    let found = folder.join("INDEX.md").is_file();
    #[allow(clippy::print_stderr, reason = "a skipped test says so")]
    if !found {
        eprintln!("skipped: no test models (set BTH_DATA to their folder)");
    }
    found.then_some(folder)
}

/// Counts of the index's tables, for those that are told.
#[derive(Debug)]
struct Known {
    triangles: Option<u64>,
    welded: Option<u64>,
    topology: String,
}

/// The tables of INDEX.md by path.
fn index(folder: &Path) -> BTreeMap<PathBuf, Known> {
    let mut section = PathBuf::new();
    let mut known = BTreeMap::new();
    for line in std::fs::read_to_string(folder.join("INDEX.md")).unwrap().lines() {
        if let Some(name) = line.strip_prefix("## ") {
            section = folder.join(name.trim());
        }
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let [_, file, triangles, vertices, topology, ..] = cells[..] else { continue };
        let welded = vertices.split_once('(').and_then(|(_, rest)| rest.trim_end_matches(')').parse().ok());
        let known_file = Known { triangles: triangles.parse().ok(), welded, topology: topology.to_owned() };
        known.insert(section.join(file), known_file);
    }
    known
}

/// All models below a folder.
fn models(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
            match extension.as_deref() {
                _ if path.is_dir() => folders.push(path),
                Some("obj" | "ply" | "stl" | "off" | "glb" | "gltf") => found.push(path),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

/// The value after a word such as `nm` in "open b43140 nm2880 dup1920"; 0 when it is not told.
fn told(topology: &str, word: &str) -> u64 {
    let mut values = topology.split_whitespace().filter_map(|part| part.strip_prefix(word)?.parse().ok());
    values.next().unwrap_or(0)
}

/// Models that the index's own loader read otherwise than the format says or than we do, with what
/// is right: positions, boundary, non-manifold, zero-area, duplicate.
const OTHERWISE: [(&str, [u64; 5]); 8] = [
    // Positions that no face uses are counted there.
    ("static/stanford-bunny.ply", [34834, 223, 0, 0, 0]),
    // 32-bit coordinates there, which move points onto one another.
    ("manifold/Offset1.obj", [2285, 0, 4, 0, 2]),
    ("manifold/openscad-nonmanifold-crash.obj", [658, 0, 18, 1, 3]),
    // Negative indices there count from the end of the file, which folds most faces onto the last.
    ("tinyobj/cornell_box.obj", [28, 8, 0, 0, 0]),
    ("tinyobj/cornell_box_multimaterial.obj", [28, 8, 0, 0, 0]),
    ("tinyobj/missing_material_file.obj", [28, 8, 0, 0, 0]),
    ("tinyobj/no_material.obj", [28, 8, 0, 0, 0]),
    ("tobj/cornell_box.obj", [28, 8, 0, 0, 0]),
];

/// Compares all models of a section; `refused` names those that must be errors and where.
fn check(section: &str, refused: &[(&str, &str)]) {
    let Some(folder) = folder() else { return };
    let index = index(&folder);
    let mut wrong = Vec::new();
    let models = models(&folder.join(section));
    assert!(!models.is_empty());
    for path in &models {
        let name = path.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        let expected_error = refused.iter().find(|(file, _)| name.ends_with(file)).map(|(_, place)| *place);
        let (mesh, report) = match import(path, Keep::None, &Silent) {
            Ok(found) => found,
            Err(error) => {
                let text = error.to_string();
                if !expected_error.is_some_and(|place| text.contains(place)) {
                    wrong.push(format!("{name}: {text}"));
                }
                continue;
            }
        };
        // Attributes do not change the geometry; only they can name rows that do not exist.
        match import(path, Keep::All, &Silent) {
            Ok((with, _)) => {
                assert!((&with.positions, &with.triangles) == (&mesh.positions, &mesh.triangles))
            }
            Err(Error::Input { code: "BTH-I005", hint, .. }) => assert!(hint.contains("--attributes none")),
            Err(error) => wrong.push(format!("{name} with attributes: {error}")),
        }
        if expected_error.is_some() {
            wrong.push(format!("{name}: should be refused"));
        }
        let rows = mesh.positions.len() as u32;
        assert!(mesh.triangles.as_flattened().iter().all(|&row| row < rows));
        assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
        let Some(known) = index.get(path) else { continue };
        if known.triangles.is_some_and(|count| count != report.triangles) {
            wrong.push(format!("{name}: {} triangles, known {known:?}", report.triangles));
        }
        let found = [
            report.positions,
            report.boundary_edges,
            report.non_manifold_edges,
            report.degenerate,
            report.duplicate,
        ];
        let [boundary, non_manifold, zero_area, duplicate] =
            ["b", "nm", "za", "dup"].map(|word| told(&known.topology, word));
        let told = known.welded.map(|welded| [welded, boundary, non_manifold, zero_area, duplicate]);
        let otherwise = OTHERWISE.iter().find(|(file, _)| name.ends_with(file)).map(|(_, counts)| *counts);
        if otherwise.or(told).is_some_and(|known| known != found) {
            wrong.push(format!("{name}: {found:?}, known {:?}", otherwise.or(told)));
        }
    }
    assert!(wrong.is_empty(), "{} of {} models:\n{}", wrong.len(), models.len(), wrong.join("\n"));
}

#[test]
fn static_models_have_their_known_counts() {
    check("static", &[]);
}

#[test]
fn animated_models_have_their_known_counts() {
    check("animated", &[]);
}

#[test]
fn messy_models_are_read_or_refused_with_their_place() {
    check(
        "messy",
        &[
            ("tinyobj/test-nan.obj", "test-nan.obj:12: BTH-I004"),
            ("tinyobj/issue-140-zero-face-idx.obj", "issue-140-zero-face-idx.obj:16: BTH-I005"),
            ("tobj/invalid_index.obj", "invalid_index.obj:12: BTH-I005"),
        ],
    );
}

/// Triangles, and the smallest and the largest corner in world space, as gltf-transform 4.5.1
/// (Node.js, with the meshoptimizer of its authors) reads them.
#[cfg(feature = "meshopt")]
const COMPRESSED: [(&str, u64, [[f64; 3]; 2]); 2] = [
    (
        "pirate.glb",
        5010,
        [[-0.76058197, -0.00108800002, -0.229468003], [0.760505213499, 1.903962938537, 0.225776727785]],
    ),
    (
        "ingenuity.glb",
        9060,
        [
            [-0.4949973523616791, -0.0060527026653289795, -0.5528796911239624],
            [0.49137577414512634, 0.5560029149055481, 0.5535024404525757],
        ],
    ),
];

#[cfg(feature = "meshopt")]
#[test]
fn compressed_models_have_the_bounds_that_another_reader_finds() {
    let Some(folder) = folder() else { return };
    for (name, triangles, bounds) in COMPRESSED {
        let path = folder.join("compressed").join(name);
        #[allow(clippy::print_stderr, reason = "a skipped test says so")]
        if !path.is_file() {
            eprintln!("skipped: no {}", path.display());
            continue;
        }
        let (mesh, report) = import(&path, Keep::All, &Silent).unwrap();
        assert_eq!(report.triangles, triangles, "{name}");
        let extreme = |k: usize, pick: fn(f32, f32) -> f32| {
            mesh.positions.iter().map(|p| p[k]).reduce(pick).map_or(f64::NAN, f64::from)
        };
        for k in 0..3 {
            let found = [extreme(k, f32::min), extreme(k, f32::max)];
            for (found, expected) in found.into_iter().zip(bounds.map(|b| b[k])) {
                let half_ulp = f64::from(f32::EPSILON) / 2.0 * expected.abs();
                assert!((found - expected).abs() <= half_ulp, "{name}: {found} instead of {expected}");
            }
        }
        // Whatever bits of the streams change, no decoder panics or reads outside.
        let bytes = std::fs::read(&path).unwrap();
        let mut random = bth_random::Rng::new(2);
        for _ in 0..20 {
            let mut damaged = bytes.clone();
            for _ in 0..=random.below(8) {
                let at = random.below(bytes.len() as u64) as usize;
                damaged[at] ^= 1 << random.below(8);
            }
            let _ = bth_import::import_bytes(&path, &damaged, Keep::All, &Silent);
        }
    }
}

#[test]
fn cuts_and_flipped_bits_of_models_never_panic() {
    let Some(folder) = folder() else { return };
    let mut generator = bth_random::Rng::new(1);
    let mut random = move |below: usize| generator.below(below as u64) as usize;
    for path in models(&folder) {
        let bytes = std::fs::read(&path).unwrap();
        if bytes.is_empty() || bytes.len() > 40_000 {
            continue;
        }
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        for _ in 0..40 {
            let mut damaged = bytes.clone();
            if random(2) == 0 {
                damaged.truncate(random(bytes.len()));
            }
            for _ in 0..random(4) {
                if !damaged.is_empty() {
                    let at = random(damaged.len());
                    damaged[at] ^= 1 << random(8);
                }
            }
            // Any outcome but a panic is right.
            let _ = import_bytes(&name, &damaged, Keep::All);
        }
    }
}

/// A vertex far out of a scan, as a number instead of one that is missing would be.
#[test]
fn a_vertex_far_out_of_a_scan_is_warned_of_and_the_scan_is_not() {
    let Some(folder) = folder() else { return };
    let listener = Listener::default();
    let path = folder.join("static/stanford-bunny.ply");
    let (mesh, _) = import(&path, Keep::None, &listener).unwrap();
    assert!(!listener.heard("lie"), "{:?}", listener.0);
    let mut positions = mesh.positions;
    positions[mesh.triangles[1000][1] as usize][2] = -1e13;
    let rows = bth_import::PositionRows::F32(&positions);
    let far = bth_import::import_triangles(&path, rows, &mesh.triangles, Keep::None, &listener);
    assert_eq!(far.unwrap().1.triangles, mesh.triangles.len() as u64);
    assert!(listener.heard("1 vertex lies more than 2^30 times as far out"), "{:?}", listener.0);
}
