//! The cache: unchanged sources are not compiled again, and damaged entries are never used.

use crate::support::{Run, command, folder, run_with, sphere};
use serde_json::Value;
use std::path::Path;

/// Runs bthc with a cache in the folder.
pub(crate) fn cached(folder: &Path, args: &[&str]) -> Run {
    let mut command = command("bthc", folder, args);
    command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", folder.join("cache"));
    run_with(command)
}

/// What a compilation found in the cache, by stage, and what it missed, as `stage part`.
pub(crate) fn found(json: &Value) -> (Vec<String>, Vec<String>) {
    let hits = json["cache"]["hits"].as_object().unwrap();
    let text = |v: &Value| v.as_str().unwrap().to_owned();
    let misses = json["cache"]["misses"].as_array().unwrap().iter();
    let misses = misses.map(|m| format!("{} {}", text(&m["stage"]), text(&m["part"])).trim_end().to_owned());
    (hits.iter().map(|(stage, n)| format!("{stage} {n}")).collect(), misses.collect())
}

pub(crate) fn compile(folder: &Path, args: &[&str]) -> Value {
    let all = [&["compile", "--json", "--set", "min-tet-triangles=64", "--set", "c-tet=0.5"], args].concat();
    cached(folder, &all).expect(0).job()
}

fn stats(folder: &Path) -> Value {
    cached(folder, &["cache", "stats", "--json"]).expect(0).json()
}

/// A scene of `n` spheres.
pub(crate) fn scene(n: usize) -> tempfile::TempDir {
    let folder = folder(&[]);
    let mut text = String::from("version = 1\n");
    for i in 0..n {
        std::fs::write(folder.path().join(format!("{i}.obj")), sphere(6 + i)).unwrap();
        text += &format!("[[objects]]\nname = \"o{i}\"\nmodel = \"{i}.obj\"\n");
        text += &format!("[[nodes]]\nname = \"n{i}\"\nobject = \"o{i}\"\ntranslation = [{}, 0, 0]\n", 3 * i);
    }
    std::fs::write(folder.path().join("s.manifest"), text).unwrap();
    folder
}

#[test]
fn an_unchanged_model_is_neither_compiled_nor_written_again() {
    let folder = folder(&[("a.obj", &sphere(16))]);
    let first = compile(folder.path(), &["a.obj"]);
    assert_eq!((&first["cache"]["hit"], &first["written"]), (&false.into(), &true.into()));
    assert!(Path::new(first["cache"]["entry"].as_str().unwrap()).is_file());
    let output = folder.path().join("a.bth");
    let modified = |path: &Path| std::fs::metadata(path).unwrap().modified().unwrap();
    let written = modified(&output);
    let second = compile(folder.path(), &["a.obj"]);
    assert_eq!((&second["cache"]["hit"], &second["written"]), (&true.into(), &false.into()));
    assert_eq!(second["report"]["file"], first["report"]["file"]);
    assert_eq!(modified(&output), written);

    // A model that is newer but has the same bytes: the output gets a newer time, as build systems
    // expect.
    let model = folder.path().join("a.obj");
    std::fs::write(&model, sphere(16)).unwrap();
    assert_eq!(compile(folder.path(), &["a.obj"])["written"], false);
    assert!(modified(&output) >= modified(&model));

    // An output that was removed or changed is restored from the cache.
    let good = std::fs::read(&output).unwrap();
    std::fs::write(&output, b"something else").unwrap();
    let third = compile(folder.path(), &["a.obj"]);
    assert_eq!((&third["cache"]["hit"], &third["written"]), (&true.into(), &true.into()));
    assert_eq!(std::fs::read(&output).unwrap(), good);
    let tally = &stats(folder.path())["tally"];
    assert_eq!((&tally["hits"]["file"], &tally["misses"]["file"]["new"]), (&3.into(), &1.into()));
}

#[test]
fn neither_name_nor_folder_nor_time_is_part_of_a_key() {
    let (one, two) = (folder(&[("a.obj", &sphere(12))]), folder(&[("b.obj", &sphere(12))]));
    let key =
        |folder: &Path, model: &str| compile(folder, &[model, "--threads", "1"])["cache"]["key"].clone();
    assert_eq!(key(one.path(), "a.obj"), key(two.path(), "b.obj"));
}

#[test]
fn one_option_redoes_what_depends_on_it_and_says_so() {
    let folder = folder(&[("a.obj", &sphere(24))]);
    let free = ["--free-directions", "auto"];
    let (hits, misses) = found(&compile(folder.path(), &[&["a.obj"][..], &free].concat()));
    assert!(hits.is_empty(), "{hits:?}");
    let tets = misses.contains(&"tets".to_owned());
    let all = ["file", "mesh", "bvh", "marks"].into_iter().chain(tets.then_some("tets"));
    let all: Vec<&str> = all.chain(["free-directions"]).collect();
    assert_eq!(misses, all);

    let json = compile(folder.path(), &[&["a.obj", "--no-geometry"][..], &free].concat());
    let (hits, misses) = found(&json);
    assert_eq!(misses, ["file"], "without its geometry: nothing but the file");
    assert_eq!(hits.iter().any(|h| h == "tets 1"), tets, "{hits:?}");
    assert_eq!(json["cache"]["misses"][0]["because"][0], "source geometry: true -> false");

    let (hits, misses) = found(&compile(folder.path(), &["a.obj", "--attributes", "all"]));
    assert_eq!((&misses[..], hits.contains(&"bvh 1".into())), (&["file".into(), "mesh".into()][..], true));

    let (hits, misses) = found(&compile(folder.path(), &["a.obj", "--quality", "best"]));
    // The node has the same triangles in both trees.
    assert_eq!(hits.iter().any(|h| h == "tets 1"), tets, "{hits:?}");
    assert!(hits.contains(&"mesh 1".into()) && hits.len() == 1 + usize::from(tets), "{hits:?}");
    assert!(misses.starts_with(&["file".into(), "bvh".into(), "marks".into()]), "{misses:?}");
}

/// As on a disc or an image of a disk, which keep no empty folders.
#[cfg(target_os = "linux")]
#[test]
fn a_cache_on_a_read_only_disk_is_used_and_verified() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    compile(folder.path(), &["a.obj"]);
    std::fs::remove_dir(folder.path().join("cache/v1/locks")).unwrap();
    let read_only = |args: &[&str]| {
        let script = "mount --bind cache cache && mount -o remount,ro,bind cache && ! touch cache/x && exec \"$0\" \"$@\"";
        let bthc = command("bthc", folder.path(), &[]).get_program().to_owned();
        let mut command = std::process::Command::new("unshare");
        command.args(["-rm", "sh", "-c", script]).arg(bthc).args(args).current_dir(folder.path());
        command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", folder.path().join("cache"));
        command.output()
    };
    if !read_only(&["--version"]).is_ok_and(|done| done.status.success()) {
        println!("skipped: a read-only disk, which needs namespaces of users");
        return;
    }
    let said = |args: &[&str]| {
        let done = read_only(args).unwrap();
        assert!(done.status.success(), "{done:?}");
        String::from_utf8(done.stdout).unwrap()
    };
    assert!(said(&["cache", "verify", "--cache-dir", "cache"]).contains("0 damaged"));
    let compile = ["compile", "a.obj", "-o", "b.bth", "--set", "min-tet-triangles=64", "--set", "c-tet=0.5"];
    assert!(said(&compile).contains("from the cache"));
}

#[test]
fn the_cache_never_shows_in_the_bytes() {
    let folder = folder(&[("a.obj", &sphere(20))]);
    let (path, out) = (folder.path(), folder.path().join("out.bth"));
    let variants: [&[&str]; 4] = [&[], &["--quality", "best"], &["--no-geometry"], &["--structure", "bvh"]];
    let args = |variant: &[&'static str]| [&["a.obj", "-o", "out.bth"], variant].concat();
    let plain: Vec<_> = variants
        .iter()
        .map(|variant| {
            compile(path, &[&args(variant)[..], &["--no-cache"]].concat());
            std::fs::read(&out).unwrap()
        })
        .collect();
    for _ in 0..2 {
        for (variant, plain) in variants.iter().zip(&plain) {
            compile(path, &args(variant));
            assert!(std::fs::read(&out).unwrap() == *plain, "{variant:?}");
            std::fs::remove_file(&out).unwrap();
        }
    }
}

#[test]
fn moving_an_instance_compiles_nothing_and_changing_an_object_only_that() {
    let folder = scene(4);
    let path = folder.path();
    compile(path, &["s.manifest"]);
    let whole = std::fs::read(path.join("s.bth")).unwrap();
    let unchanged = compile(path, &["s.manifest"]);
    assert_eq!((&unchanged["cache"]["hit"], &unchanged["written"]), (&true.into(), &false.into()));
    assert!(unchanged["cache"]["entry"].is_null(), "the scene itself is not kept");

    let manifest = path.join("s.manifest");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replace("translation = [3, 0, 0]", "translation = [3, 5, 0]")).unwrap();
    let (hits, misses) = found(&compile(path, &["s.manifest"]));
    assert_eq!((&misses[..], &hits[..]), (&["scene".into()][..], &["object 4".into()][..]));
    assert!(std::fs::read(path.join("s.bth")).unwrap() != whole);

    std::fs::write(path.join("2.obj"), sphere(40)).unwrap();
    let dry = cached(
        path,
        &[
            "compile",
            "--dry-run",
            "--json",
            "--set",
            "min-tet-triangles=64",
            "--set",
            "c-tet=0.5",
            "s.manifest",
        ],
    );
    let dry = &dry.expect(0).json()["jobs"][0];
    assert_eq!((&dry["action"], &dry["objects_kept"]), (&"compile".into(), &3.into()));
    assert_eq!(dry["objects"][0]["part"], "2.obj flat");
    let json = compile(path, &["s.manifest"]);
    let (hits, misses) = found(&json);
    assert_eq!(hits, ["object 3"]);
    assert!(misses[1..].iter().all(|miss| miss.ends_with("2.obj flat") || miss == "tets"), "{misses:?}");
    let cached_bytes = std::fs::read(path.join("s.bth")).unwrap();
    compile(path, &["s.manifest", "--no-cache"]);
    assert!(std::fs::read(path.join("s.bth")).unwrap() == cached_bytes);
}

#[test]
fn damaged_entries_are_reported_removed_and_built_again() {
    let folder = folder(&[("a.obj", &sphere(16))]);
    let path = folder.path();
    compile(path, &["a.obj"]);
    let good = std::fs::read(path.join("a.bth")).unwrap();
    let entries = cached(path, &["cache", "list", "--json"]).expect(0).json()["entries"].clone();
    assert!(entries.as_array().unwrap().len() >= 4);
    for entry in entries.as_array().unwrap() {
        let key = entry["id"].as_str().unwrap();
        let file = cached(path, &["cache", "path", key]).expect(0).stdout;
        let file = Path::new(file.trim_end());
        let mut bytes = std::fs::read(file).unwrap();
        let last = bytes.len() - 1;
        bytes[last / 2] ^= 1;
        std::fs::remove_file(file).unwrap();
        std::fs::write(file, bytes).unwrap();
    }
    std::fs::remove_file(path.join("a.bth")).unwrap();
    let args = ["compile", "a.obj", "--set", "min-tet-triangles=64", "--set", "c-tet=0.5"];
    let run = cached(path, &args).expect(0);
    assert!(run.stderr.contains("is damaged"), "{run:?}");
    assert_eq!(std::fs::read(path.join("a.bth")).unwrap(), good);
    assert_eq!(cached(path, &args).expect(0).stderr, "");
    assert!(stats(path)["tally"]["damaged"].as_u64().unwrap() >= 4);
    cached(path, &["cache", "verify"]).expect(0);
}

#[test]
fn the_cache_is_looked_after() {
    let folder = scene(3);
    let path = folder.path();
    compile(path, &["s.manifest"]);
    let json = |args: &[&str]| cached(path, args).expect(0).json();
    let survey = stats(path);
    assert_eq!(survey["records"]["object"], 3);
    assert_eq!(survey["cap"], 20u64 << 30);
    assert!(cached(path, &["cache", "stats"]).expect(0).stdout.contains("entries of object"));
    let verdict = json(&["cache", "verify", "--json"]);
    assert_eq!(verdict["damaged"], serde_json::json!([]));
    assert_eq!(json(&["cache", "path", "--json"])["folder"], path.join("cache").to_str().unwrap());
    let gone = json(&["cache", "gc", "--cache-size", "10k", "--json"]);
    assert!(gone["entries"].as_u64().unwrap() > 0 && gone["left_bytes"].as_u64().unwrap() <= 10240, "{gone}");
    json(&["cache", "clear", "--json"]);
    assert_eq!(stats(path)["bytes"], 0);
    let wrong = cached(path, &["cache", "path", "0123"]).expect(2);
    assert!(wrong.stderr.contains("bthc cache list"), "{wrong:?}");
    cached(path, &["compile", "s.manifest", "--cache-size", "1X"]).expect(2);
    std::fs::write(path.join("file"), "").unwrap();
    let wrong = cached(path, &["compile", "s.manifest", "--cache-dir", "file"]).expect(4);
    assert!(wrong.stderr.contains("BTH-O063"), "{wrong:?}");
}

#[test]
fn a_folder_that_is_named_by_mistake_stays_as_it_is() {
    let folder = folder(&[("a.obj", &sphere(4))]);
    let path = folder.path();
    for command in ["stats", "list", "gc", "verify", "path", "clear"] {
        for mistake in ["missing", "."] {
            let wrong = cached(path, &["cache", command, "--cache-dir", mistake]).expect(4);
            assert!(wrong.stderr.contains("BTH-O063"), "{wrong:?}");
        }
    }
    assert_eq!(std::fs::read_dir(path).unwrap().count(), 1);
    std::fs::create_dir(path.join("empty")).unwrap();
    cached(path, &["cache", "stats", "--cache-dir", "empty"]).expect(0);
    compile(path, &["a.obj", "--cache-dir", "made"]);
    cached(path, &["cache", "stats", "--cache-dir", "made"]).expect(0);
}

#[test]
fn machines_share_what_they_made() {
    let (here, there, shared) = (scene(3), scene(3), tempfile::tempdir().unwrap());
    let place = shared.path().to_str().unwrap();
    compile(here.path(), &["s.manifest", "--shared-cache", place]);
    let json = compile(there.path(), &["s.manifest", "--shared-cache", place]);
    let (hits, misses) = found(&json);
    // The scene is assembled again; the cache holds only its objects.
    assert_eq!((&hits[..], &misses[..]), (&["object 3".into()][..], &["scene".into()][..]));
    let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join("s.bth")).unwrap();
    assert!(read(&here) == read(&there));
}

#[test]
fn shards_of_a_scene_meet_in_the_cache() {
    let folder = scene(5);
    let path = folder.path();
    let shard = |which: &str| {
        let json = compile(path, &["s.manifest", "--shard", which, "--in-cache"]);
        json["objects"].as_u64().unwrap()
    };
    assert_eq!([shard("1/3"), shard("2/3"), shard("3/3")], [2, 2, 1]);
    let (hits, misses) = found(&compile(path, &["s.manifest"]));
    assert_eq!((&hits[..], &misses[..]), (&["object 5".into()][..], &["scene".into()][..]));
    // Without a cache all work would be lost.
    for args in [&["--no-cache"][..], &["--cache-dir", "s.manifest"]] {
        let run = cached(path, &[&["compile", "s.manifest", "--shard", "1/3"], args].concat());
        assert!(matches!(run.code, Some(2 | 4)), "{run:?}");
    }
    for variable in ["HOME", "XDG_CACHE_HOME"] {
        let mut command = command("bthc", path, &["compile", "s.manifest", "--shard", "1/3"]);
        command.env_remove("BTH_NO_CACHE").env_remove("HOME").env_remove("XDG_CACHE_HOME");
        command.env(variable, path.join("s.manifest"));
        let run = run_with(command).expect(2);
        assert!(run.stderr.contains("BTH-U001"), "{run:?}");
    }
}

/// Parts of large objects are work, too: of a single model, and of a scene's objects.
#[test]
fn shards_of_large_objects_meet_in_the_cache() {
    let folder = scene(2);
    let path = folder.path();
    std::fs::write(path.join("1.obj"), sphere(20)).unwrap();
    for (model, expected, kept) in [
        ("1.obj", [(0, 6), (0, 5), (0, 5)], &["mesh 1", "part 16"][..]),
        ("s.manifest", [(1, 5), (0, 6), (0, 5)], &["object 1", "part 16"]),
    ] {
        let args = [model, "--set", "part-triangles=256"];
        compile(path, &[&args[..], &["-o", "whole.bth", "--no-cache"]].concat());
        let shards = ["1/3", "2/3", "3/3"].map(|which| {
            let json = compile(path, &[&args[..], &["--in-cache", "--shard", which]].concat());
            (json["objects"].as_u64().unwrap(), json["parts"].as_u64().unwrap())
        });
        assert_eq!(shards, expected, "{model}");
        let (hits, misses) = found(&compile(path, &[&args[..], &["-o", "out.bth"]].concat()));
        assert_eq!(hits, kept, "{misses:?}");
        let read = |name| std::fs::read(path.join(name)).unwrap();
        assert!(read("out.bth") == read("whole.bth"));
    }
    let parts = cached(path, &["cache", "list", "--stage", "part", "--json"]).expect(0).json();
    assert_eq!(parts["entries"].as_array().unwrap().len(), 16, "one set for both");
    // A model that is not built in parts is work for one shard, and so is a scene among models.
    let several = ["s.manifest", "0.obj", "--in-cache", "--shard", "1/2"];
    assert_eq!(compile(path, &several)["output"], "the cache");
    let small = |which| compile(path, &["0.obj", "--in-cache", "--shard", which]);
    assert_eq!(small("2/2")["objects"], 0);
    assert_eq!(small("1/2")["output"], "the cache");
}

#[test]
fn what_a_cache_is_too_small_for_is_not_said_to_be_in_it() {
    let folder = folder(&[("a.obj", &sphere(16))]);
    let small = ["--cache-size", "1000"];
    let run = cached(folder.path(), &[&["compile", "a.obj", "--in-cache"], &small[..]].concat()).expect(4);
    assert!(run.stderr.contains("BTH-O061"), "{run:?}");
    cached(folder.path(), &[&["compile", "a.obj"], &small[..]].concat()).expect(0);
}

#[test]
fn a_damaged_entry_that_stays_in_the_cache_is_made_again() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let args = ["a.obj", "--in-cache"];
    let entry = compile(folder.path(), &args)["cache"]["entry"].as_str().unwrap().to_owned();
    let good = std::fs::read(&entry).unwrap();
    assert_eq!(compile(folder.path(), &args)["cache"]["hit"], true);
    std::fs::remove_file(&entry).unwrap();
    std::fs::write(&entry, vec![0; good.len()]).unwrap();
    assert_eq!(compile(folder.path(), &args)["cache"]["hit"], false);
    assert!(std::fs::read(&entry).unwrap() == good);
}

#[test]
fn what_cannot_be_removed_is_told() {
    let folder = folder(&[("a.obj", &sphere(8))]);
    let entry = compile(folder.path(), &["a.obj"])["cache"]["entry"].as_str().unwrap().to_owned();
    // Not even the superuser removes a folder as if it were a file.
    std::fs::remove_file(&entry).unwrap();
    std::fs::create_dir(&entry).unwrap();
    for args in [&["cache", "gc", "--cache-size", "0", "--json"][..], &["cache", "clear", "--json"]] {
        let run = cached(folder.path(), args).expect(4);
        assert!(run.stderr.contains("1 contents cannot be removed"), "{run:?}");
        assert_eq!(run.json()["not_removed"], 1);
    }
}

#[test]
fn a_shared_cache_that_is_not_used_is_told() {
    let folder = folder(&[("a.obj", &sphere(4))]);
    std::fs::create_dir(folder.path().join("shared")).unwrap();
    let args = ["compile", "a.obj", "--shared-cache", "shared"];
    let off = run_with(command("bthc", folder.path(), &args)).expect(0);
    let mut homeless = command("bthc", folder.path(), &args);
    for name in ["BTH_NO_CACHE", "BTH_CACHE_DIR", "HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"] {
        homeless.env_remove(name);
    }
    for run in [off, run_with(homeless).expect(0)] {
        assert!(run.stderr.contains("warning: ") && run.stderr.contains("BTH_"), "{run:?}");
    }
}

#[test]
fn objects_that_are_compiled_at_once_come_to_the_same_file() {
    let folder = scene(6);
    let path = folder.path();
    let compiled = |args: &[&str]| {
        compile(path, &[&["s.manifest", "-o", "s.bth", "--no-cache"], args].concat());
        std::fs::read(path.join("s.bth")).unwrap()
    };
    let one_by_one = compiled(&["--threads", "1"]);
    assert!(compiled(&["--threads", "5"]) == one_by_one);
    assert!(compiled(&["--threads", "3", "--memory", "1"]) == one_by_one, "without memory for two");
    // Of several faulty objects the error names the first in the manifest, whichever fails first.
    for faulty in ["1.obj", "4.obj"] {
        std::fs::write(path.join(faulty), "f 1 2 3\n").unwrap();
    }
    for threads in ["1", "5"] {
        let run = cached(path, &["compile", "s.manifest", "--no-cache", "--threads", threads]).expect(3);
        assert!(run.stderr.contains("1.obj:1"), "{run:?}");
    }
}

/// What was said about a model is said again when its results come from the cache.
#[test]
fn warnings_are_those_of_the_first_compilation() {
    let folder = folder(&[
        ("a.obj", "v 9 9 nan\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"),
        (
            "s.manifest",
            "version = 1\nobjects = [{ name = \"a\", model = \"a.obj\" }]\nnodes = [{ name = \"a\", object = \"a\" }]\n",
        ),
    ]);
    let path = folder.path();
    for model in ["a.obj", "s.manifest"] {
        // The second run takes the file, the third the mesh, the last nothing from the cache.
        for args in [&[][..], &[], &["--quality", "fast"], &["--no-cache"]] {
            let args = [&["compile", model, "-o", "a.bth"], args].concat();
            let run = cached(path, &args).expect(0);
            assert_eq!(
                run.stderr.matches("warning: 1 positions are not finite").count(),
                1,
                "{args:?}: {run:?}"
            );
            let json = cached(path, &[&args[..], &["--json"]].concat()).expect(0).job();
            let warnings = json["warnings"].as_array().unwrap();
            assert_eq!(warnings.len(), 1, "{args:?}: {json:#}");
            let quiet = cached(path, &[&args[..], &["--quiet"]].concat()).expect(0);
            assert_eq!((quiet.stdout.as_str(), quiet.stderr), ("", run.stderr));
        }
    }
}

/// Warnings about the files of a scene name them, and none is lost or about another file, whatever
/// comes from the cache.
#[test]
fn warnings_of_scenes_name_the_files() {
    let model = "v 9 9 nan\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\np 2\n";
    let other = model.replace("v 1 0 0", "v 2 0 0");
    let two = |first: &str, x: u32| {
        format!(
            "version = 1\nobjects = [{{ name = \"a\", model = \"{first}.obj\" }}, {{ name = \"b\", model = \"b.obj\" }}]\n\
            nodes = [{{ name = \"a\", object = \"a\" }}, {{ name = \"b\", object = \"b\", translation = [{x}, 0, 0] }}]\n"
        )
    };
    let (of_a, of_c) = (two("a", 1), two("c", 2));
    let folder = folder(&[
        ("a.obj", model),
        ("b.obj", &other),
        ("c.obj", model),
        ("a.manifest", &of_a),
        ("c.manifest", &of_c),
    ]);
    let path = folder.path();
    let warned = |model: &str| {
        let json = cached(path, &["compile", model, "--json"]).expect(0).job();
        let texts = json["warnings"].as_array().unwrap().iter().map(|text| text.as_str().unwrap().to_owned());
        let mut texts: Vec<String> = texts.collect();
        texts.sort();
        texts
    };
    let about = |file: &str| {
        let left_out = "1 elements are left out: points, lines and faces of fewer than three corners";
        let not_finite = "1 positions are not finite; no face uses them, they are left out";
        [left_out, not_finite].map(|text| format!("{file}: {text}"))
    };
    // Results of a model that is compiled by itself have no name.
    assert_eq!(warned("c.obj"), [about("c.obj")[1].trim_start_matches("c.obj: ")]);
    let of_both = [about("a.obj"), about("b.obj")].concat();
    assert_eq!(warned("a.manifest"), of_both);
    assert_eq!(warned("a.manifest"), of_both, "of a scene that has not changed");
    std::fs::write(path.join("b.obj"), other.replace("v 2 0 0", "v 3 0 0")).unwrap();
    assert_eq!(warned("a.manifest"), of_both, "with an object of the file that was there");
    assert_eq!(
        warned("c.manifest"),
        [about("b.obj"), about("c.obj")].concat(),
        "of a file of the same content"
    );
    assert_eq!(warned("a.obj"), [about("a.obj")[1].trim_start_matches("a.obj: ")]);
}

#[test]
fn options_without_effect_are_told() {
    let folder = folder(&[("a.obj", &sphere(4)), ("s.manifest", "version = 1\n")]);
    let warned = |model: &str, option: &[&str]| {
        let run = cached(folder.path(), &[&["compile", model], option].concat()).expect(0);
        run.stderr.contains("has no effect")
    };
    for model in ["a.obj", "s.manifest"] {
        assert!(!warned(model, &[]));
        for option in [&["--rate", "30"][..], &["--scene", "0"], &["--at-rest"], &["--strict"]] {
            assert!(warned(model, option), "{model} {option:?}");
        }
    }
    let poses = ["--set", "poses=3"];
    assert!(warned("a.obj", &poses) && !warned("s.manifest", &poses));
    assert!(warned("a.obj", &["--format", "ply"]));
    assert!(warned("s.manifest", &["--shard", "1/2", "-o", "x.bth"]));
    // What is no scene is flat as it is.
    assert!(warned("s.manifest", &["--flatten"]) && !warned("a.obj", &["--flatten"]));
}
