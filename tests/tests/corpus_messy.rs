//! Every messy model ends in a compiled file that verifies, or in an error that a person can act
//! on.
#![allow(clippy::print_stdout, reason = "tests print what they skip and what they found")]

mod corpus_support;

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use corpus_support::{data_and_compiler, listed_triangles, models, program, run};

/// Wall-clock limit, generous for busy machines; the documented limits are below.
const LIMIT: Duration = Duration::from_secs(300);
/// Limits for a messy model: seconds of CPU time of the compiler, and memory. No messy model has
/// 70,000 triangles.
const CPU_SECONDS: u32 = 60;
const MEMORY_KIB: u32 = 4 << 20;
/// Seconds of a tetrahedralization. By default it may take minutes, which TetGen spends on two of
/// the models without success.
const DEADLINE: &str = "tet-deadline=1";

/// Models that are not usable, and where the error must point.
const UNUSABLE: [(&str, &str); 3] = [
    ("tinyobj/test-nan.obj", "test-nan.obj:12: "),
    ("tinyobj/issue-140-zero-face-idx.obj", "issue-140-zero-face-idx.obj:16: "),
    ("tobj/invalid_index.obj", "invalid_index.obj:12: "),
];

#[test]
fn every_messy_model_compiles_or_is_refused_with_a_reason() {
    let Some((data, bthc)) = data_and_compiler() else { return };
    let folder = data.join("messy");
    let out = tempfile::tempdir().unwrap();
    let models = models(&folder);
    // As many models at once as there are processors.
    let (next, results) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(model) = models.get(number) else { break };
                    let result = check(&bthc, &data, model, &out.path().join(format!("{number}.bth")));
                    results.lock().unwrap().push((model, result));
                }
            });
        }
    });
    let (mut compiled, mut refused, mut slowest, mut wrong) = (0, 0, 0.0f64, Vec::new());
    for (model, result) in results.into_inner().unwrap() {
        match result {
            Ok((done, seconds)) => {
                compiled += usize::from(done);
                refused += usize::from(!done);
                slowest = slowest.max(seconds);
            }
            Err(message) => {
                wrong.push(format!("{}: {message}", model.strip_prefix(&folder).unwrap().display()))
            }
        }
    }
    println!(
        "{} messy models: {compiled} compiled and verified, {refused} refused; the slowest took {slowest:.1} s",
        models.len()
    );
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), models.len(), wrong.join("\n"));
    for (name, place) in UNUSABLE {
        let model = folder.join(name);
        if model.exists() {
            let ended = run(
                Command::new(&bthc).arg("compile").arg(&model).arg("-o").arg(out.path().join("x.bth")),
                LIMIT,
            );
            let ended = ended.unwrap();
            assert_eq!(ended.code, Some(3), "{name}: {}", ended.stderr);
            assert!(ended.stderr.contains(place), "{name}: {}", ended.stderr);
        }
    }
}

/// With materials, too: libraries and images that are missing or broken are errors with a code, a
/// place and a hint. The player shows every model that compiles without them.
#[test]
fn materials_of_messy_models_are_read_or_refused_with_a_reason() {
    let Some((data, bthc)) = data_and_compiler() else { return };
    let Some(player) = program("bth-play") else { return println!("SKIPPED: bth-play is not built") };
    let out = tempfile::tempdir().unwrap();
    let (mut kept, mut refused) = (0, 0);
    let is_obj = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "obj");
    for model in models(&data.join("messy")).into_iter().filter(is_obj) {
        let file = out.path().join("x.bth");
        let mut compile = limited(&bthc);
        compile.arg("compile").arg(&model).arg("-o").arg(&file).args(["--materials", "--structure", "bvh"]);
        let ended = run(&mut compile, LIMIT).unwrap();
        let shown = model.display();
        match ended.code {
            Some(0) => {
                let picture = out.path().join("x.png");
                let mut play = Command::new(&player);
                play.arg(&file).arg("-o").arg(&picture).args(["--size", "32x32", "--spp", "1"]);
                let played = run(&mut play, LIMIT).unwrap();
                assert_eq!(played.code, Some(0), "{shown}: {}", played.stderr);
                kept += 1;
            }
            Some(3 | 5) => {
                let said = &ended.stderr;
                assert!(said.contains("BTH-") && said.contains("hint"), "{shown}: {said}");
                refused += 1;
            }
            code => panic!("{shown}: {code:?} {}", ended.stderr),
        }
    }
    println!("{kept} messy models with materials, {refused} refused");
}

#[test]
fn every_compressed_model_compiles() {
    let Some((data, bthc)) = data_and_compiler() else { return };
    let folder = data.join("compressed");
    if !folder.is_dir() {
        println!("SKIPPED: no folder compressed among the test models");
        return;
    }
    let out = tempfile::tempdir().unwrap();
    for model in models(&folder) {
        let (compiled, _) = check(&bthc, &data, &model, &out.path().join("x.bth")).unwrap();
        assert!(compiled, "{}", model.display());
    }
}

/// The compiler, ended by the system when it takes more than it may.
fn limited(bthc: &Path) -> Command {
    if !cfg!(unix) {
        return Command::new(bthc);
    }
    let mut command = Command::new("sh");
    let limits = format!("ulimit -S -t {CPU_SECONDS} && ulimit -S -v {MEMORY_KIB} && exec \"$0\" \"$@\"");
    command.arg("-c").arg(limits).arg(bthc).env("BTH_NO_CACHE", "1");
    command
}

/// Returns true if the model was compiled, and in how many seconds; an error when something is not
/// as it must be.
fn check(bthc: &Path, data: &Path, model: &Path, file: &Path) -> Result<(bool, f64), String> {
    let mut compile = limited(bthc);
    compile.arg("compile").arg(model).arg("-o").arg(file).args(["--json", "--set", DEADLINE]);
    let ended = run(&mut compile, LIMIT)?;
    if ended.stderr.contains("panicked") {
        return Err(format!("panicked: {}", ended.stderr));
    }
    let json: serde_json::Value = serde_json::from_str(&ended.stdout)
        .map_err(|e| format!("no JSON ({e}): {} {}", ended.stdout, ended.stderr))?;
    match ended.code {
        Some(0) => {
            if let Some(listed) = listed_triangles(data, "messy", model) {
                let found = json["jobs"][0]["report"]["mesh"]["triangles"].as_u64();
                if found != Some(listed) && !differently_counted(model) {
                    return Err(format!("{found:?} triangles instead of {listed}"));
                }
            }
            let verified = run(limited(bthc).arg("verify").arg(file), LIMIT)?;
            if verified.code != Some(0) {
                return Err(format!("does not verify: {}{}", verified.stdout, verified.stderr));
            }
            Ok((true, ended.seconds))
        }
        Some(3 | 5) => {
            let name = model.file_name().unwrap().to_string_lossy().into_owned();
            if !ended.stderr.contains("error: ") || !ended.stderr.contains("BTH-") {
                return Err(format!("an error without a code: {}", ended.stderr));
            }
            if !ended.stderr.contains(&name) {
                return Err(format!("an error that does not name the file: {}", ended.stderr));
            }
            if file.exists() {
                return Err("refused, but a file was written".to_owned());
            }
            Ok((false, ended.seconds))
        }
        other => Err(format!("exit code {other:?}: {}", ended.stderr)),
    }
}

/// Models whose triangles the table counts by other rules.
fn differently_counted(_model: &Path) -> bool {
    false
}
