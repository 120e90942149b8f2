//! `bthc trace`: ray files, and the exact answers of `--exact`.

use crate::support::{bthc, command, folder, sphere};
use bth::rays::{Hit, Ray};

/// Rays of a grid in front of the unit sphere, some past it.
fn rays() -> Vec<Ray> {
    let at = |i: i32| i as f32 / 20.0 - 1.25;
    let ray = |x, y| Ray { origin: [x, y, 3.0], tmin: 0.0, direction: [0.01, -0.02, -1.0], tmax: 10.0 };
    (0..50 * 50).map(|i| ray(at(i % 50), at(i / 50))).collect()
}

fn file(tag: &[u8; 4], rows: impl Iterator<Item = Vec<u8>>) -> Vec<u8> {
    let rows: Vec<Vec<u8>> = rows.collect();
    let header = [&tag[..], &1u32.to_le_bytes(), &(rows.len() as u64).to_le_bytes()].concat();
    [header, rows.concat()].concat()
}

fn ray_bytes(ray: &Ray) -> Vec<u8> {
    let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
    [ox, oy, oz, ray.tmin, dx, dy, dz, ray.tmax].iter().flat_map(|f| f.to_le_bytes()).collect()
}

#[test]
fn hits_are_those_of_the_library_bit_for_bit() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let scene = bth::open(folder.path().join("ball.bth")).unwrap();
    let rays = rays();
    std::fs::write(folder.path().join("x.rays"), file(b"RAYS", rays.iter().map(ray_bytes))).unwrap();

    let expected = file(
        b"HITS",
        rays.iter().map(|ray| {
            let hit = scene.nearest(ray).unwrap_or(Hit::MISS);
            let values: Vec<u8> = [hit.t, hit.u, hit.v].iter().flat_map(|f| f.to_le_bytes()).collect();
            [values, hit.primitive.triangle.to_le_bytes().to_vec()].concat()
        }),
    );
    for extra in [&[][..], &["--threads", "1"], &["--threads", "2"]] {
        let mut args = vec!["trace", "ball.bth", "x.rays", "-o", "x.hits"];
        args.extend(extra);
        bthc(folder.path(), &args).expect(0);
        assert!(std::fs::read(folder.path().join("x.hits")).unwrap() == expected, "{extra:?}");
    }

    let args = ["trace", "ball.bth", "x.rays", "-o", "x.hits", "--any", "--json"];
    let json = bthc(folder.path(), &args).expect(0).json();
    let hits = std::fs::read(folder.path().join("x.hits")).unwrap();
    let found: Vec<bool> = hits[16..].chunks(16).map(|hit| hit[12..] != [0xff; 4]).collect();
    let any: Vec<bool> = rays.iter().map(|ray| scene.any(ray)).collect();
    assert_eq!(found, any);
    assert_eq!(json["hits"], any.iter().filter(|b| **b).count());
}

/// The rows of a .hits file: t, u, v and the triangle.
fn rows(path: &std::path::Path) -> Vec<([f32; 3], u32)> {
    let bytes = std::fs::read(path).unwrap();
    let word = |row: &[u8], i: usize| u32::from_le_bytes(row[4 * i..4 * i + 4].try_into().unwrap());
    bytes[16..]
        .chunks(16)
        .map(|row| ([0, 1, 2].map(|i| f32::from_bits(word(row, i))), word(row, 3)))
        .collect()
}

#[test]
fn exact_hits_are_those_of_every_structure() {
    let folder = folder(&[("ball.obj", &sphere(8))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    std::fs::write(folder.path().join("x.rays"), file(b"RAYS", rays().iter().map(ray_bytes))).unwrap();
    bthc(folder.path(), &["trace", "ball.bth", "x.rays", "-o", "walked.hits"]).expect(0);
    let args = ["trace", "ball.bth", "x.rays", "--exact", "-o", "exact.hits", "--json"];
    let json = bthc(folder.path(), &args).expect(0).json();
    assert_eq!(json["exact"], true);
    let (walked, exact) = (rows(&folder.path().join("walked.hits")), rows(&folder.path().join("exact.hits")));
    assert_eq!(json["hits"], exact.iter().filter(|(_, triangle)| *triangle != u32::MAX).count());
    for ((a, a_triangle), (b, b_triangle)) in walked.iter().zip(&exact) {
        assert_eq!((a_triangle, a[0].to_bits()), (b_triangle, b[0].to_bits()));
        assert!((a[1] - b[1]).abs() < 1e-6 && (a[2] - b[2]).abs() < 1e-6, "{a:?} {b:?}");
    }
    // Any hit: whether there is one.
    bthc(folder.path(), &["trace", "ball.bth", "x.rays", "--exact", "--any", "-o", "any.hits"]).expect(0);
    let any = rows(&folder.path().join("any.hits"));
    assert!(any.iter().zip(&exact).all(|(a, b)| (a.1 == 0) == (b.1 != u32::MAX)));
}

#[test]
fn every_instruction_set_gives_the_same_file_and_others_are_refused() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    std::fs::write(folder.path().join("x.rays"), file(b"RAYS", rays().iter().map(ray_bytes))).unwrap();
    let args = ["trace", "ball.bth", "x.rays", "-o", "x.hits"];
    let hits = || std::fs::read(folder.path().join("x.hits")).unwrap();
    bthc(folder.path(), &[&args[..], &["--isa", "scalar"]].concat()).expect(0);
    let expected = hits();
    let cpu = bthc(folder.path(), &["info", "--cpu", "--json"]).expect(0).json();
    let available: Vec<&str> =
        cpu["cpu"]["available"].as_array().unwrap().iter().flat_map(|v| v.as_str()).collect();
    assert_eq!(available[0], "scalar");
    for isa in &available {
        let chosen = bthc(folder.path(), &["info", "--cpu", "--json", "--isa", isa]).expect(0).json();
        assert_eq!(chosen["cpu"]["isa"], *isa);
        bthc(folder.path(), &[&args[..], &["--isa", isa]].concat()).expect(0);
        assert!(hits() == expected, "--isa {isa}");
        let status = command("bthc", folder.path(), &args).env("BTH_ISA", isa).status().unwrap();
        assert!(status.success() && hits() == expected, "BTH_ISA={isa}");
    }
    let run = bthc(folder.path(), &[&args[..], &["--isa", "mmx"]].concat()).expect(2);
    assert!(run.stderr.contains("scalar, sse4, neon, simd128, avx2 or avx512"), "{run:?}");
    let status = command("bthc", folder.path(), &args).env("BTH_ISA", "mmx").status().unwrap();
    assert_eq!(status.code(), Some(2), "BTH_ISA=mmx");
}

#[test]
fn rejects_ray_files_that_are_cut_or_of_another_kind() {
    let folder = folder(&[("ball.obj", &sphere(8)), ("text.rays", "not rays, but long enough for a header")]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let whole = file(b"RAYS", rays().iter().map(ray_bytes));
    std::fs::write(folder.path().join("cut.rays"), &whole[..whole.len() - 1]).unwrap();
    for rays in ["text.rays", "cut.rays"] {
        let run = bthc(folder.path(), &["trace", "ball.bth", rays, "-o", "x.hits"]).expect(3);
        assert!(run.stderr.contains(rays) && run.stderr.contains("BTH-I090"), "{run:?}");
    }
    assert!(!folder.path().join("x.hits").exists());
}
