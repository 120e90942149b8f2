//! The downloaded static models compile, verify, and give the same answers to rays with and without
//! tetrahedra.
#![allow(clippy::print_stdout, reason = "tests print what they skip and what they found")]

mod corpus_support;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use bth::Isa;
use bth::rays::{Hit, Ray, StartRay};
use bth_random::Rng;
use bth_tests::rays::{alone, check_batch};

use corpus_support::{Ended, data_and_compiler, listed_triangles, models, program, run};

const LIMIT: Duration = Duration::from_secs(600);

/// Max triangles of the models that are tried, by `BTH_CORPUS`: small ones without it.
fn most_triangles() -> u64 {
    match std::env::var("BTH_CORPUS").as_deref() {
        Ok("all") => u64::MAX,
        Ok("large") => 300_000,
        _ => 15_000,
    }
}

/// The models to try, with their numbers of triangles; prints which are skipped.
fn chosen(data: &Path) -> Vec<(PathBuf, u64)> {
    let mut chosen = Vec::new();
    for model in models(&data.join("static")) {
        let name = model.file_name().unwrap().to_string_lossy().into_owned();
        match listed_triangles(data, "static", &model) {
            Some(triangles) if triangles <= most_triangles() => chosen.push((model, triangles)),
            Some(triangles) => {
                println!(
                    "SKIPPED: {name} has {triangles} triangles (BTH_CORPUS=large takes up to 300,000, BTH_CORPUS=all any)"
                )
            }
            None => println!("SKIPPED: {name} is not listed"),
        }
    }
    chosen
}

fn bthc(program: &Path, arguments: &[&std::ffi::OsStr]) -> Ended {
    let ended = run(Command::new(program).args(arguments).env("BTH_NO_CACHE", "1"), LIMIT)
        .unwrap_or_else(|e| panic!("{arguments:?}: {e}"));
    assert_eq!(ended.code, Some(0), "{arguments:?}: {}{}", ended.stdout, ended.stderr);
    ended
}

#[test]
fn static_models_verify_and_answer_alike_with_and_without_tetrahedra() {
    let Some((data, compiler)) = data_and_compiler() else { return };
    if program("bth-tetgen").is_none() {
        println!("NOTE: bth-tetgen is not built, so there are no tetrahedra to compare");
    }
    let out = tempfile::tempdir().unwrap();
    for (model, triangles) in chosen(&data) {
        let mut scenes = Vec::new();
        let mut said = String::new();
        for structure in ["bth", "bvh"] {
            let file = out.path().join(structure);
            let ended = bthc(
                &compiler,
                &[
                    "compile".as_ref(),
                    model.as_os_str(),
                    "-o".as_ref(),
                    file.as_os_str(),
                    "--structure".as_ref(),
                    structure.as_ref(),
                    // Of glTF files the table counts all triangles of the scene.
                    "--flatten".as_ref(),
                    "--json".as_ref(),
                ],
            );
            let json: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
            let report = &json["jobs"][0]["report"];
            assert_eq!(report["mesh"]["triangles"].as_u64(), Some(triangles), "{}", model.display());
            bthc(&compiler, &["verify".as_ref(), file.as_os_str()]);
            said += &format!(", {structure} in {:.1} s", ended.seconds);
            if structure == "bth" {
                said += &format!(" with {} tet leaves", report["file"]["tet_leaves"]);
            }
            scenes.push(bth::open(&file).unwrap());
        }
        let hits = compare(&scenes[0], &scenes[1], &model);
        agree_in_batches(&scenes[0], &scenes[1], &model);
        println!("{}: {triangles} triangles{said}, {hits} hits", model.file_name().unwrap().display());
    }
}

/// Traces random rays through both; returns the number of hits.
fn compare(tets: &bth::Scene, bvh: &bth::Scene, model: &Path) -> usize {
    let object = *bvh.object(0).header;
    let (lower, upper) = (object.lower, object.upper);
    let size = (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f32::max);
    let mut rng = Rng::new(1);
    let mut hits = 0;
    for _ in 0..20_000 {
        let mut point =
            || [0, 1, 2].map(|k| lower[k] - 0.1 * size + (upper[k] - lower[k] + 0.2 * size) * rng.unit_f32());
        let (origin, target) = (point(), point());
        let ray = Ray {
            origin,
            tmin: 0.0,
            direction: [0, 1, 2].map(|k| target[k] - origin[k]),
            tmax: f32::INFINITY,
        };
        let (a, b) = (tets.nearest(&ray).unwrap_or(Hit::MISS), bvh.nearest(&ray).unwrap_or(Hit::MISS));
        assert_eq!(a.t.to_bits(), b.t.to_bits(), "{}: {ray:?} gives {a:?} and {b:?}", model.display());
        // Where triangles touch, either may be reported; only the distance must agree.
        hits += usize::from(a.t.is_finite());
    }
    hits
}

/// A pinhole camera's rays from one side, in tiles, and random rays from the surfaces they hit.
fn coherent_and_bounced(bvh: &bth::Scene) -> (Vec<Ray>, Vec<StartRay>) {
    const SIDE: u16 = 64;
    let object = *bvh.object(0).header;
    let (lower, upper) = (object.lower, object.upper);
    let size = (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f32::max);
    let middle = [0, 1, 2].map(|k| 0.5 * (lower[k] + upper[k]));
    let origin = [middle[0] + 0.9 * size, middle[1] + 0.3 * size, middle[2] + 1.1 * size];
    let ray = |i: u16| {
        // Tiles of eight by eight.
        let (tile, within) = (i / 64, i % 64);
        let x = (tile % (SIDE / 8)) * 8 + within % 8;
        let y = (tile / (SIDE / 8)) * 8 + within / 8;
        let [x, y] = [x, y].map(|x| (f32::from(x) / f32::from(SIDE) - 0.5) * size);
        let target = [middle[0] + x, middle[1] + y, middle[2] - x];
        Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
    };
    let rays: Vec<Ray> = (0..SIDE * SIDE).map(ray).collect();
    let mut rng = Rng::new(5);
    let onward = rays.iter().enumerate().filter_map(|(i, ray)| {
        let hit = bvh.nearest(ray)?;
        let direction = [(); 3].map(|()| (rng.unit_f32() - 0.5) * size);
        let tmax = if i % 3 == 0 { 0.1 } else { f32::INFINITY };
        Some(StartRay::from_hit(&hit, direction).with_tmax(tmax))
    });
    let onward = onward.collect();
    (rays, onward)
}

/// Batches of both structures give on every instruction set the bits of single rays.
fn agree_in_batches(tets: &bth::Scene, bvh: &bth::Scene, model: &Path) {
    let (rays, onward) = coherent_and_bounced(bvh);
    let (expected, after) = (alone(bvh, &rays), alone(bvh, &onward));
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("an instruction set that is available");
        for scene in [tets, bvh] {
            let context = format_args!("{}, {isa}", model.display());
            check_batch(scene, &rays, &expected, context);
            check_batch(scene, &onward, &after, context);
        }
    }
    Isa::best().choose().expect("the best is available");
}
