//! Several models at once, build systems, standard input and output, and watching.

use crate::support::{Run, bthc, command, folder, run_with, sphere, wait};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap()
}

#[test]
fn many_models_compile_at_once_as_they_do_alone() {
    let models: Vec<(String, String)> = (0..6).map(|i| (format!("{i}.obj"), sphere(8 + i))).collect();
    let folder = folder(&[]);
    let path = folder.path();
    models.iter().for_each(|(name, text)| std::fs::write(path.join(name), text).unwrap());
    std::fs::create_dir(path.join("out")).unwrap();
    let names: Vec<&str> = models.iter().map(|(name, _)| name.as_str()).collect();
    let args = [&["compile"], &names[..], &["-o", "out", "--jobs", "3", "--memory", "100"]].concat();
    let run = bthc(path, &args).expect(0);
    assert_eq!(run.stdout.lines().count(), 6, "{run:?}");
    let json = bthc(path, &[&args[..], &["--json"]].concat()).expect(0).json();
    assert_eq!(json["jobs"].as_array().unwrap().len(), 6);
    for (i, name) in names.iter().enumerate() {
        bthc(path, &["compile", name, "-q"]).expect(0);
        let one = name.replace("obj", "bth");
        assert!(read(path, &one) == read(&path.join("out"), &one));
        assert_eq!(json["jobs"][i]["model"], **name);
    }
    let shard = |which: &str| {
        let json = bthc(path, &[&args[..], &["--json", "--shard", which]].concat()).expect(0).json();
        let jobs = json["jobs"].as_array().cloned().unwrap_or_else(|| vec![json]);
        jobs.iter().map(|job| job["model"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!([shard("1/4"), shard("4/4")].concat(), ["0.obj", "4.obj", "3.obj"]);
}

#[test]
fn a_failed_model_stops_no_other_and_gives_the_exit_code() {
    let folder = folder(&[("a.obj", &sphere(8)), ("b.obj", "f 1 2 3\n"), ("c.obj", &sphere(9))]);
    let args = ["compile", "a.obj", "b.obj", "c.obj", "missing.obj"];
    let run = bthc(folder.path(), &args).expect(3);
    assert!(run.stderr.contains("b.obj:1") && run.stderr.contains("missing.obj"), "{run:?}");
    assert!(folder.path().join("a.bth").exists() && folder.path().join("c.bth").exists());
    let json = bthc(folder.path(), &[&args[..], &["--json"]].concat()).expect(3).json();
    let codes: Vec<_> = json["jobs"].as_array().unwrap().iter().map(|j| &j["error"]["code"]).collect();
    assert_eq!((codes[0].is_null(), codes[1].is_string(), codes[2].is_null()), (true, true, true));
    assert_eq!(codes[3], "BTH-O001");
    let hint = json["jobs"][3]["error"]["hint"].as_str().unwrap();
    assert!(!hint.is_empty() && run.stderr.contains(&format!(" (hint: {hint})")), "{run:?}");
}

#[test]
fn outputs_that_would_collide_are_refused_before_anything_is_done() {
    let folder = folder(&[("a.obj", &sphere(8)), ("a.off", "OFF\n0 0 0\n")]);
    let path = folder.path();
    let run = bthc(path, &["compile", "a.obj", "a.off"]).expect(2);
    assert!(run.stderr.contains("both be written to a.bth"), "{run:?}");
    bthc(path, &["compile", "a.obj", "a.off", "-o", "none"]).expect(2);
    bthc(path, &["compile", "a.obj", "a.off", "-o", "-"]).expect(2);
    // Whatever their folders are spelled like.
    bthc(path, &["compile", "a.obj", "./a.off"]).expect(2);
    bthc(path, &["compile", "a.obj", "--depfile", "./a.bth"]).expect(2);
    assert!(!path.join("a.bth").exists());
}

#[test]
fn a_model_passes_through_pipes() {
    let folder = folder(&[("a.obj", &sphere(12))]);
    let path = folder.path();
    bthc(path, &["compile", "a.obj", "-q"]).expect(0);
    for format in [&["--format", "obj"][..], &[]] {
        let args = [&["compile", "-", "-o", "-"], format].concat();
        let mut child = command("bthc", path, &args);
        let mut child = child.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(&read(path, "a.obj")).unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stdout == read(path, "a.bth"), "{format:?}");
    }
    let unnamed = bthc(path, &["compile", "-"]).expect(2);
    assert!(unnamed.stderr.contains("-o"), "{unnamed:?}");
    bthc(path, &["compile", "-", "-o", "empty.bth"]).expect(3);
    // Only what is a file can be watched, and only a file has a name for a dependency file.
    bthc(path, &["compile", "-", "-o", "a.bth", "--watch"]).expect(2);
    bthc(path, &["compile", "a.obj", "-o", "-", "--watch"]).expect(2);
    bthc(path, &["compile", "a.obj", "-o", "-", "--depfile", "a.d"]).expect(2);
    bthc(path, &["compile", "a.obj", "--watch", "--depfile", "a.d"]).expect(2);
}

#[test]
fn places_of_errors_name_standard_input_and_not_its_copy() {
    let folder =
        folder(&[("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n"), ("a.obj", &sphere(4)), ("bad.glb", "glTF")]);
    let path = folder.path();
    let run = |args: &[&str], model: &str| {
        let mut command = command("bthc", path, args);
        command.stdin(std::fs::File::open(path.join(model)).unwrap());
        run_with(command)
    };
    let bad = run(&["compile", "-", "--format", "obj", "-o", "x.bth", "--json"], "bad.obj").expect(3);
    assert_eq!(bad.json()["error"]["place"], "standard input:3");
    assert!(bad.stderr.starts_with("error: standard input:3: BTH-"), "{bad:?}");
    let dry = run(&["compile", "-", "--format", "glb", "-o", "x.bth", "--dry-run"], "bad.glb").expect(3);
    assert!(dry.stderr.starts_with("error: standard input"), "{dry:?}");
    let many = run(&["compile", "-", "a.obj", "--format", "glb", "-o", ".", "--json"], "bad.glb").expect(3);
    assert!(
        many.json()["jobs"][0]["error"]["place"].as_str().unwrap().starts_with("standard input"),
        "{many:?}"
    );
    let kept = run(&["compile", "-", "--in-cache", "--cache-dir", "c", "--json"], "a.obj").expect(0);
    assert_eq!(kept.job()["inputs"], serde_json::json!([]));
}

/// A model is hashed and then read, and a pipe is empty after that.
#[cfg(target_os = "linux")]
#[test]
fn a_pipe_that_is_named_as_a_model_is_refused() {
    let folder = folder(&[]);
    let mut child = command("bthc", folder.path(), &["compile", "/dev/stdin", "-o", "a.bth"]);
    let mut child = child.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // It may have ended without reading.
    let _ = child.stdin.take().unwrap().write_all(sphere(8).as_bytes());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(4) && stderr.contains("not a regular file"), "{stderr}");
}

#[test]
fn a_model_from_standard_input_is_called_so_wherever_it_is_named() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let path = folder.path();
    let compile = |output: &str| {
        let mut command =
            command("bthc", path, &["compile", "-", "-o", output, "--depfile", "a.d", "--json"]);
        command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", path.join("cache"));
        command.stdin(std::fs::File::open(path.join("a.obj")).unwrap());
        run_with(command).expect(0).job()
    };
    let names = || std::fs::read_dir(path.join("cache/v1/last")).unwrap().count();
    assert_eq!(compile("a.bth")["model"], "-");
    // The temporary file is gone when Make would look for it.
    assert_eq!(read(path, "a.d"), b"a.bth:\n");
    let before = names();
    compile("b.bth");
    assert_eq!(names(), before, "the cache keeps no name for every temporary file");
}

#[cfg(unix)]
#[test]
fn a_read_only_output_that_is_up_to_date_gets_a_newer_time() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder(&[("a.obj", &sphere(8))]);
    let (model, output) = (folder.path().join("a.obj"), folder.path().join("a.bth"));
    let compile = || {
        let mut command = command("bthc", folder.path(), &["compile", "a.obj"]);
        command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", folder.path().join("cache"));
        run_with(command).expect(0)
    };
    let modified = |path: &Path| std::fs::metadata(path).unwrap().modified().unwrap();
    compile();
    std::fs::set_permissions(&output, std::fs::Permissions::from_mode(0o444)).unwrap();
    std::fs::File::open(&model).unwrap().set_modified(std::time::SystemTime::now()).unwrap();
    assert!(modified(&model) > modified(&output));
    compile();
    assert!(modified(&output) >= modified(&model));
}

#[test]
fn dependencies_name_every_file_of_a_scene() {
    let manifest = "version = 1\n[[objects]]\nname = \"o\"\nmodel = \"models/a b.obj\"\n[[nodes]]\nname = \"n\"\nobject = \"o\"\n";
    let folder = folder(&[("s.manifest", manifest)]);
    let path = folder.path();
    std::fs::create_dir(path.join("models")).unwrap();
    std::fs::write(path.join("models/a b.obj"), sphere(8)).unwrap();
    bthc(path, &["compile", "s.manifest", "-q", "--depfile", "s.d"]).expect(0);
    let text = String::from_utf8(read(path, "s.d")).unwrap();
    assert_eq!(text, "s.bth: \\\n  s.manifest \\\n  models/a\\ b.obj\n");
}

#[test]
fn a_dependency_file_that_cannot_be_written_leaves_one_json_object() {
    let folder = folder(&[("a.obj", &sphere(4)), ("b.obj", &sphere(4))]);
    for models in [&["a.obj"][..], &["a.obj", "b.obj"]] {
        let args = [&["compile", "--depfile", "none/a.d", "--json"], models].concat();
        assert_eq!(bthc(folder.path(), &args).expect(4).json()["error"]["code"], "BTH-O020");
    }
}

#[test]
fn a_dry_run_says_what_would_be_done_and_does_nothing() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let path = folder.path();
    let run = |args: &[&str]| -> Run {
        let mut command = command("bthc", path, args);
        command.env("BTH_CACHE_DIR", path.join("cache")).env_remove("BTH_NO_CACHE");
        run_with(command)
    };
    let dry = |args: &[&str]| run(&[&["compile", "a.obj", "--dry-run"], args].concat()).expect(0).stdout;
    assert_eq!(dry(&[]), "a.bth: compile (new)\n");
    assert!(!path.join("a.bth").exists());
    run(&["compile", "a.obj"]).expect(0);
    assert_eq!(dry(&[]), "a.bth: nothing to do\n");
    assert_eq!(dry(&["--structure", "bvh", "-o", "b.bth"]).split('(').next(), Some("b.bth: compile "));
    assert_eq!(dry(&["--quality", "best"]), "a.bth: compile (quality: balanced -> best)\n");
    std::fs::remove_file(path.join("a.bth")).unwrap();
    assert_eq!(dry(&[]), "a.bth: take from the cache\n");
    std::fs::write(path.join("a.obj"), sphere(9)).unwrap();
    assert_eq!(dry(&[]), "a.bth: compile (source)\n");
    assert_eq!(dry(&["--no-cache"]), "a.bth: compile (no cache)\n");
    let scene = "version = 1\nobjects = [{ name = \"a\", model = \"a.obj\" }]\nnodes = [{ name = \"a\", object = \"a\" }]\n";
    std::fs::write(path.join("s.manifest"), scene).unwrap();
    let of_scene = run(&["compile", "s.manifest", "--dry-run", "--no-cache"]).expect(0).stdout;
    assert_eq!(of_scene, "s.bth: compile (no cache)\n  a.obj flat: compile\n");
}

#[test]
fn compiled_files_are_compared_by_content() {
    let folder = folder(&[("a.obj", &sphere(12)), ("b.obj", &sphere(13))]);
    let path = folder.path();
    let compile = |model: &str, output: &str, more: &[&str]| {
        bthc(path, &[&["compile", model, "-o", output, "-q"], more].concat()).expect(0);
    };
    compile("a.obj", "a.bth", &[]);
    compile("a.obj", "same.bth", &[]);
    compile("a.obj", "options.bth", &["--set", "c-tet=77"]);
    compile("b.obj", "b.bth", &[]);
    assert!(bthc(path, &["diff", "a.bth", "same.bth"]).expect(0).stdout.contains("identical"));
    let options = bthc(path, &["diff", "a.bth", "options.bth"]).expect(1).stdout;
    assert!(options.contains("content is the same") && options.contains("c_tet"), "{options}");
    let json = bthc(path, &["diff", "a.bth", "b.bth", "--json"]).expect(1).json();
    assert_eq!((&json["identical"], &json["same_content"]), (&false.into(), &false.into()));
    let leaves = |section: &serde_json::Value| section["object"] == 0 && section["kind"] == "LINES";
    assert!(json["sections"].as_array().unwrap().iter().any(leaves), "{json:#}");
    bthc(path, &["diff", "a.bth", "a.obj"]).expect(3);
    bthc(path, &["diff", "a.bth", "missing.bth"]).expect(4);
}

#[cfg(target_os = "linux")]
#[test]
fn a_link_to_standard_output_stays_a_link() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let path = folder.path();
    std::os::unix::fs::symlink("/proc/self/fd/1", path.join("stdout")).unwrap();
    let mut command = command("bthc", path, &["compile", "a.obj", "-o", "stdout"]);
    command.stdout(std::fs::File::create(path.join("out")).unwrap());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(std::fs::symlink_metadata(path.join("stdout")).unwrap().is_symlink());
}

#[cfg(unix)]
#[test]
fn watching_compiles_again_after_a_change_and_waits_out_errors() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let path = folder.path();
    let mut child = command("bthc", path, &["compile", "a.obj", "--watch"]);
    let mut child = child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut errors = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("a.bth  compiled"));
    let first = read(path, "a.bth");
    std::fs::write(path.join("a.obj"), "f 1 2 3\n").unwrap();
    assert!(errors.next().unwrap().unwrap().contains("a.obj:1"));
    assert_eq!(read(path, "a.bth"), first, "a faulty model leaves the output as it was");
    std::fs::write(path.join("a.obj"), sphere(10)).unwrap();
    assert!(lines.next().unwrap().unwrap().starts_with("a.bth  compiled"));
    assert_ne!(read(path, "a.bth"), first);
    let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
    let status = wait(&mut child, Duration::from_secs(20)).expect("Ctrl-C ends it");
    assert_eq!(status.code(), Some(130));
}
