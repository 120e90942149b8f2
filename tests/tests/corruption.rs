//! However a file is corrupted, opening and checking it ends in a result, never in a panic.

use bth::rays::Ray;
use bth_tests::conformance::{Editor, Seal, valid, worst};
use std::time::{Duration, Instant};

/// Opens a file and checks all objects; true if it passes.
fn passes(bytes: &[u8]) -> bool {
    let Ok(file) = bth_format::File::from_bytes(bytes) else { return false };
    let good = (0..file.object_count()).all(|i| file.check(i).is_ok());
    // A scene that opens can be set to any time and traced, or returns an error.
    if let Ok(mut scene) = bth::from_bytes(bytes)
        && scene.description().is_some()
    {
        let ray =
            bth::rays::Ray { origin: [0.3, 0.2, 9.0], tmin: 0.0, direction: [0.0, 0.1, -1.0], tmax: 1e9 };
        for seconds in [-1.0, 0.3, 1.5, 1e300, f64::NAN] {
            let _ = scene.set_seconds(seconds);
            let primitive = bth::rays::PrimitiveRef { instance: 1, triangle: 0 };
            let onward = bth::rays::Start { primitive, u: 0.25, v: 0.5 }.ray(ray.direction);
            scene.nearest(&ray);
            scene.any(&ray);
            scene.nearest(&onward);
            scene.any(&onward);
        }
    }
    if good {
        // Verification must end, too; it may report errors.
        let _ = bth_format::verify::verify(&file);
    }
    good
}

#[test]
fn every_truncation_is_refused() {
    for case in valid() {
        for length in 0..case.bytes.len() {
            assert!(!passes(&case.bytes[..length]), "{} cut to {length} bytes", case.name);
        }
    }
}

#[test]
fn every_flipped_byte_is_found() {
    for case in valid() {
        let mut bytes = case.bytes.clone();
        for i in 0..bytes.len() {
            bytes[i] ^= 0xff;
            let found = bth_format::File::from_bytes(&bytes)
                .map_or(true, |file| bth_format::verify::verify(&file).is_err());
            assert!(found, "{} with byte {i} flipped", case.name);
            bytes[i] ^= 0xff;
        }
    }
}

/// With all hashes recomputed, the flipped bits reach the checks of the section table and the
/// indices.
#[test]
fn flips_behind_right_hashes_end_in_a_result() {
    let (mut passed, mut refused) = (0, 0);
    for case in valid() {
        for i in 0..case.bytes.len() {
            for mask in [1, 0x80, 0xff] {
                let mut editor = Editor::new(&case.bytes);
                editor.bytes[i] ^= mask;
                let good = passes(&editor.seal(Seal::Sections));
                passed += u32::from(good);
                refused += u32::from(!good);
            }
        }
    }
    assert!(passed > 0 && refused > passed / 4, "{passed} passed, {refused} were refused");
}

/// Extreme 32-bit values in every place, with correct hashes.
#[test]
fn extreme_words_behind_right_hashes_end_in_a_result() {
    for case in valid() {
        for i in (0..case.bytes.len()).step_by(4) {
            for word in [0, 1, 1 << 29, 5 << 29, 1 << 31, u32::MAX - 1, u32::MAX, f32::NAN.to_bits()] {
                let mut editor = Editor::new(&case.bytes);
                editor.put(i, &word.to_le_bytes());
                passes(&editor.seal(Seal::Sections));
            }
        }
    }
}

/// The time of the quickest of some rays, all ways of tracing together.
fn time_of_ray(scene: &bth::Scene, ray: Ray) -> Duration {
    let once = |_| {
        let start = Instant::now();
        let _ = std::hint::black_box((scene.nearest(&ray), scene.any(&ray)));
        scene.batch(&[ray; 2]).any(&mut [false; 2]);
        start.elapsed()
    };
    (0..8).map(once).min().unwrap_or_default()
}

/// A file that passes the checks can make rays slow only in proportion to its size: a ray visits
/// each node and triangle once, and each tetrahedron twice, on a walk and in a flood.
#[test]
#[allow(clippy::print_stdout)]
fn the_worst_files_are_visited_once() {
    let ray =
        |origin: [f32; 3], direction: [f32; 3]| Ray { origin, tmin: 0.0, direction, tmax: f32::INFINITY };
    let down = ray([0.0, 0.0, 9.0], [0.0, 0.0, -1.0]);
    let along = ray([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    let size = 4_000;
    for (name, ray, bytes) in [
        ("a bundle of triangles", down, worst::bundle(size)),
        ("a strip of tetrahedra", along, worst::strip(size)),
    ] {
        let scene = bth::from_bytes(&bytes).expect("it passes the checks");
        let (_, steps) = scene.nearest_counted(&ray);
        let (time, bytes) = (time_of_ray(&scene, ray).as_secs_f64() / 4.0, scene.resident_bytes());
        println!("{name}: {steps:?}, {:.2} ms for each megabyte", time * 1e9 / bytes as f64);
        let all = size;
        let of_tets = name.contains("strip");
        assert!(if of_tets { steps.cells >= all } else { steps.triangles >= all }, "{name}: {steps:?}");
        assert!(
            steps.cells <= 2 * all && steps.triangles <= all && steps.nodes <= all / 8,
            "{name}: {steps:?}"
        );
    }
}
