//! Pictures of a file that does not fit in memory, under a limit of a control group.

use crate::support::{bthc, command, folder, run_with, sphere};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// A control group with a limit of memory. It is removed when this is dropped.
struct Group(PathBuf);

impl Group {
    /// `None` where groups may not be made.
    fn new(bytes: usize) -> Option<Group> {
        let name = format!("bth-test-{}", std::process::id());
        let roots = [("memory", "memory.limit_in_bytes"), ("", "memory.max")];
        roots.iter().find_map(|(root, file)| {
            let group = Group(Path::new("/sys/fs/cgroup").join(root).join(&name));
            fs::create_dir(&group.0).ok()?;
            let limit = group.0.join(file);
            (limit.exists() && fs::write(limit, bytes.to_string()).is_ok()).then_some(group)
        })
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        let _ = fs::remove_dir(&self.0);
    }
}

#[test]
fn pictures_of_a_file_that_does_not_fit_in_memory_are_the_same_and_read_little() {
    const OBJECTS: usize = 9;
    const LIMIT: usize = 72 << 20;
    let Some(group) = Group::new(LIMIT) else {
        println!("skipped: a limit of memory, which needs the right to make control groups");
        return;
    };
    let (mut objects, mut nodes) = (String::new(), String::new());
    for i in 0..OBJECTS {
        writeln!(objects, "[[objects]]\nname = \"o{i}\"\nmodel = \"o{i}.obj\"").expect("a string");
        let (x, y) = (3 * (i % 3), 3 * (i / 3));
        writeln!(nodes, "[[nodes]]\nname = \"n{i}\"\nobject = \"o{i}\"\ntranslation = [{x}, {y}, 0]")
            .expect("a string");
    }
    let manifest = format!("version = 1\n{objects}{nodes}");
    let folder = folder(&[("balls.manifest", &manifest)]);
    for i in 0..OBJECTS {
        fs::write(folder.path().join(format!("o{i}.obj")), sphere(240 + i)).expect("a disk");
    }
    bthc(folder.path(), &["compile", "balls.manifest", "-o", "balls.bth", "--quality", "fast"]).expect(0);
    let file = folder.path().join("balls.bth");
    let length = fs::metadata(&file).expect("written").len();
    assert!(length > LIMIT as u64, "{length}");
    // Written pages cannot be dropped before they are on the disk.
    fs::File::open(&file).expect("written").sync_all().expect("a disk");
    let play = |output: &str| {
        // A small picture and two threads: more would take a large part of this limit.
        let args = ["balls.bth", "-o", output, "--mode", "ao", "--spp", "1", "--smooth", "0"];
        command(
            "bth-play",
            folder.path(),
            &[&args[..], &["--size", "320x180", "--threads", "2", "--stats", "--json"]].concat(),
        )
    };
    let all = run_with(play("all.png")).expect(0).json();
    assert_eq!(all["stats"]["paged"], false);

    // A shell enters the group before it becomes the program.
    let player = play("paged.png");
    let mut limited = std::process::Command::new("sh");
    limited.current_dir(folder.path()).args(["-c", "echo $$ > \"$0\" && exec \"$@\""]);
    limited.arg(group.0.join("cgroup.procs")).arg(player.get_program()).args(player.get_args());
    let paged = run_with(limited).expect(0).json();
    assert_eq!(paged["stats"]["paged"], true, "{paged:#}");
    // Half of each ball is seen. What other processes have in memory need not be read.
    let read = paged["stats"]["read_bytes"].as_u64().expect("on Linux");
    assert!(read < 2 * length, "{read} of {length}");
    assert_eq!(
        fs::read(folder.path().join("paged.png")).expect("a picture"),
        fs::read(folder.path().join("all.png")).expect("a picture")
    );
}
