//! The unchanged parts of a scene are taken from the file of the last compilation if that is
//! complete, and the result is the same as without.

use crate::cache::{compile, found, scene};
use crate::support::sphere;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

/// Compiles the scene over the existing output, compares with a compilation without a cache, and
/// returns the file.
#[track_caller]
fn same_as_new(path: &Path, options: &[&str]) -> Vec<u8> {
    compile(path, &[&["s.manifest"], options].concat());
    let bytes = std::fs::read(path.join("s.bth")).unwrap();
    compile(path, &[&["s.manifest", "-o", "new.bth", "--no-cache"], options].concat());
    assert!(std::fs::read(path.join("new.bth")).unwrap() == bytes);
    bytes
}

/// Removes meshes and objects from the cache, so that they can only come from the existing output.
fn forget_objects(path: &Path) {
    let list = crate::cache::cached(path, &["cache", "list", "--json"]).expect(0).json();
    for entry in list["entries"].as_array().unwrap() {
        let stage = entry["stage"].as_str().unwrap();
        // Records without their content are of no use.
        if (stage == "object" || stage == "mesh") && !entry["idle_seconds"].is_null() {
            let file =
                crate::cache::cached(path, &["cache", "path", entry["id"].as_str().unwrap()]).expect(0);
            std::fs::remove_file(file.stdout.trim_end()).unwrap();
        }
    }
}

#[test]
fn unchanged_objects_come_from_the_file_that_was_there() {
    let folder = scene(5);
    let path = folder.path();
    compile(path, &["s.manifest"]);
    forget_objects(path);
    // A larger object moves the sections that follow it.
    std::fs::write(path.join("2.obj"), sphere(17)).unwrap();
    let dry = [
        "compile",
        "--dry-run",
        "--json",
        "--set",
        "min-tet-triangles=64",
        "--set",
        "c-tet=0.5",
        "s.manifest",
    ];
    let dry = &crate::cache::cached(path, &dry).expect(0).json()["jobs"][0];
    assert_eq!((&dry["objects_kept"], &dry["objects"][0]["part"]), (&4.into(), &"2.obj flat".into()));
    let (hits, misses) = found(&compile(path, &["s.manifest"]));
    assert_eq!(hits, ["object 4"]);
    assert!(misses[1..].iter().all(|miss| miss.ends_with("2.obj flat") || miss == "tets"), "{misses:?}");
    same_as_new(path, &[]);
    forget_objects(path);
    // One object is removed, one replaced, one used twice; and a path changes without its content.
    std::fs::rename(path.join("0.obj"), path.join("other.obj")).unwrap();
    std::fs::copy(path.join("3.obj"), path.join("1.obj")).unwrap();
    let text = std::fs::read_to_string(path.join("s.manifest")).unwrap();
    std::fs::write(path.join("s.manifest"), text.replace("0.obj", "other.obj")).unwrap();
    let (hits, misses) = found(&compile(path, &["s.manifest"]));
    assert_eq!((&hits[..], &misses[..]), (&["object 4".into()][..], &["scene".into()][..]));
    same_as_new(path, &[]);
    // Objects compiled with other options are not reused.
    same_as_new(path, &["--attributes", "all"]);
    same_as_new(path, &["--structure", "bvh"]);
}

#[test]
fn damage_of_the_file_that_was_there_does_not_spread() {
    let folder = scene(3);
    let path = folder.path();
    compile(path, &["s.manifest"]);
    let whole = std::fs::read(path.join("s.bth")).unwrap();
    let mut sizes = (9..14).cycle();
    let mut changed = |bytes: &[u8]| {
        // The scene changes together with the file.
        std::fs::write(path.join("1.obj"), sphere(sizes.next().unwrap())).unwrap();
        std::fs::write(path.join("s.bth"), bytes).unwrap();
        same_as_new(path, &[])
    };
    let mut before = whole;
    let places = 24;
    for place in 0..places {
        // Header, table, objects, scene and provenance; also bytes between sections.
        let mut bytes = before.clone();
        let at = place * (bytes.len() - 1) / (places - 1);
        bytes[at] ^= 0x10;
        before = changed(&bytes);
    }
    for bytes in [&before[..before.len() / 2], &before[..100], b""] {
        changed(bytes);
    }
}

#[cfg(unix)]
#[test]
fn a_large_file_that_was_there_is_taken_unread_only_if_nobody_touched_it() {
    let folder = scene(2);
    let path = folder.path();
    // Above the size from which files are recognized by their fingerprints.
    std::fs::write(path.join("0.obj"), sphere(200)).unwrap();
    let options = ["--structure", "bvh"];
    let compile = |args: &[&str]| compile(path, &[args, &options[..]].concat());
    compile(&["s.manifest"]);
    let output = path.join("s.bth");
    assert!(std::fs::metadata(&output).unwrap().len() > 4 << 20);
    for round in 0..3 {
        std::fs::write(path.join("1.obj"), sphere(30 + round)).unwrap();
        if round > 0 {
            // A change in the middle of the large object that keeps the times of the file; then a
            // change of the times only.
            let modified = std::fs::metadata(&output).unwrap().modified().unwrap();
            let mut file = std::fs::File::options().read(true).write(true).open(&output).unwrap();
            if round == 1 {
                file.seek(SeekFrom::Start(2 << 20)).unwrap();
                file.write_all(b"damage").unwrap();
            }
            file.set_modified(modified).unwrap();
        }
        same_as_new(path, &options);
    }
}
