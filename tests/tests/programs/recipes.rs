//! The recipes of `docs/pipelines.md`: each build tool runs the compiler when, and only when,
//! something changed. A recipe is skipped where its tool is missing; `tools/test` prints which
//! tools these are.

use crate::support::{folder, sphere, sphere_mesh};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

/// The code below a heading of the page, in a language.
fn recipe(heading: &str, language: &str) -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pipelines.md");
    let page = std::fs::read_to_string(page).unwrap();
    let section = page.split("\n## ").find(|s| s.starts_with(heading)).expect("the page has that heading");
    let code = section.split(&format!("```{language}\n")).nth(1).expect("and that code below it");
    code.split("```").next().unwrap().to_owned()
}

fn has(tool: &str) -> bool {
    let there = Command::new(tool).arg("--version").output().is_ok_and(|o| o.status.success());
    if !there {
        println!("skipped: there is no {tool}");
    }
    there
}

fn ply(size: usize) -> String {
    let (positions, faces) = sphere_mesh(size);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        faces.len()
    );
    positions.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    faces.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    text
}

/// A project with the files that the recipes name, and a compiler that notes how often it is
/// called.
struct Project {
    folder: tempfile::TempDir,
    path: std::ffi::OsString,
}

const HALL: &str = "version = 1\n[[objects]]\nname = \"o\"\nmodel = \"pillar.obj\"\n\
                    [[nodes]]\nname = \"n\"\nobject = \"o\"\n";

impl Project {
    fn new() -> Self {
        let folder = folder(&[("calls", "")]);
        let at = |name: &str| folder.path().join(name);
        ["models", "scenes", "bin"].iter().for_each(|name| std::fs::create_dir(at(name)).unwrap());
        std::fs::write(at("models/dragon.ply"), ply(8)).unwrap();
        std::fs::write(at("scenes/pillar.obj"), sphere(7)).unwrap();
        std::fs::write(at("scenes/hall.manifest"), HALL).unwrap();
        let compiler = bth_tests::built(&["bthc"]).join("bthc");
        let script =
            format!("#!/bin/sh\necho called >> {:?}\nexec {compiler:?} \"$@\"\n", at("calls").as_os_str());
        let program = at("bin/bthc");
        std::fs::write(&program, script).unwrap();
        executable(&program);
        let before = std::env::var_os("PATH").unwrap_or_default();
        let all = std::iter::once(at("bin")).chain(std::env::split_paths(&before));
        let path = std::env::join_paths(all).unwrap();
        Self { folder, path }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn output(&self, folder: &str, program: &str, args: &[&str]) -> Output {
        let mut command = Command::new(program);
        command.args(args).current_dir(self.at(folder)).env("PATH", &self.path);
        command.env("BTH_CACHE_DIR", self.at("cache")).env_remove("BTH_NO_CACHE");
        // Clones hold Git LFS pointers until `git lfs pull`, whatever the user's git configuration.
        command.env("GIT_LFS_SKIP_SMUDGE", "1");
        command.output().unwrap()
    }

    fn run(&self, folder: &str, program: &str, args: &[&str]) {
        let done = self.output(folder, program, args);
        assert!(done.status.success(), "{program} {args:?}: {done:?}");
    }

    /// Calls of the compiler since the last call of this function.
    fn calls(&self) -> usize {
        let calls = std::fs::read_to_string(self.at("calls")).unwrap().lines().count();
        std::fs::write(self.at("calls"), "").unwrap();
        calls
    }

    /// Runs a build after every kind of change. `outputs` are the files of the model and, if the
    /// recipe has one, of the scene.
    fn follows_changes(&self, outputs: &[&str], build: &dyn Fn()) {
        let step = || std::thread::sleep(Duration::from_millis(30));
        build();
        assert_eq!(self.calls(), outputs.len(), "everything is new");
        outputs.iter().for_each(|output| assert!(self.at(output).is_file(), "{output}"));
        build();
        assert_eq!(self.calls(), 0, "nothing changed");
        step();
        std::fs::write(self.at("models/dragon.ply"), ply(8)).unwrap();
        build();
        assert_eq!(self.calls(), 1, "same content, newer time");
        build();
        assert_eq!(self.calls(), 0, "and the output is newer again");
        step();
        let before = std::fs::read(self.at(outputs[0])).unwrap();
        std::fs::write(self.at("models/dragon.ply"), ply(9)).unwrap();
        build();
        assert_eq!(self.calls(), 1);
        assert!(std::fs::read(self.at(outputs[0])).unwrap() != before);
        if let Some(scene) = outputs.get(1) {
            step();
            let before = std::fs::read(self.at(scene)).unwrap();
            std::fs::write(self.at("scenes/pillar.obj"), sphere(9)).unwrap();
            build();
            assert_eq!(self.calls(), 1, "a model that only the dependency file names");
            assert!(std::fs::read(self.at(scene)).unwrap() != before);
        }
        build();
        assert_eq!(self.calls(), 0);
    }
}

#[cfg(unix)]
fn executable(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn make_compiles_what_changed() {
    if has("make") {
        let project = Project::new();
        std::fs::write(project.at("Makefile"), recipe("Make", "make")).unwrap();
        let outputs = ["models/dragon.bth", "scenes/hall.bth"];
        project.follows_changes(&outputs, &|| project.run("", "make", &["--silent", "all"]));
    }
}

#[test]
fn ninja_compiles_what_changed() {
    if has("ninja") {
        let project = Project::new();
        std::fs::write(project.at("build.ninja"), recipe("Ninja", "ninja")).unwrap();
        let outputs = ["compiled/dragon.bth", "compiled/hall.bth"];
        project.follows_changes(&outputs, &|| project.run("", "ninja", &[]));
    }
}

#[test]
fn cmake_compiles_what_changed() {
    if has("cmake") {
        let project = Project::new();
        let generator = if has("ninja") { "Ninja" } else { "Unix Makefiles" };
        let head = "cmake_minimum_required(VERSION 3.20)\nproject(models NONE)\n";
        let text = head.to_owned() + &recipe("CMake", "cmake");
        std::fs::write(project.at("CMakeLists.txt"), text).unwrap();
        // The recipe has the model next to its CMakeLists.txt.
        std::fs::rename(project.at("models/dragon.ply"), project.at("dragon.ply")).unwrap();
        std::os::unix::fs::symlink("../dragon.ply", project.at("models/dragon.ply")).unwrap();
        project.run("", "cmake", &["-S", ".", "-B", "build", "-G", generator]);
        let build = || project.run("", "cmake", &["--build", "build"]);
        project.follows_changes(&["build/dragon.bth"], &build);
    }
}

#[test]
fn a_git_lfs_project_gets_its_compiled_files_from_the_shared_cache() {
    if !(has("git") && has("git-lfs")) {
        return;
    }
    let project = Project::new();
    ["first", "team"].iter().for_each(|name| std::fs::create_dir(project.at(name)).unwrap());
    let git = |folder: &str, args: &[&str]| {
        let identity = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"];
        project.run(folder, "git", &[&identity, args].concat());
    };
    let shared = project.at("team").display().to_string();
    let sh = recipe("Git LFS", "sh").replace("/mnt/team/bth", &shared);
    let (set_up, compile) = sh.split_at(sh.find("export ").unwrap());
    let shell = |folder: &str, script: &str| {
        // Each machine has its cache.
        let own = project.at(&format!("cache of {folder}"));
        project.output(folder, "sh", &["-ec", &format!("export BTH_CACHE_DIR='{}'\n{script}", own.display())])
    };

    git("", &["init", "--quiet", "--bare", "-b", "main", "origin.git"]);
    let origin = format!("file://{}", project.at("origin.git").display());
    git("first", &["init", "--quiet", "-b", "main"]);
    git("first", &["lfs", "install", "--local"]);
    git("first", &["remote", "add", "origin", &origin]);
    std::fs::rename(project.at("models"), project.at("first/models")).unwrap();
    assert!(shell("first", set_up).status.success());
    git("first", &["add", "."]);
    git("first", &["commit", "--quiet", "-m", "models"]);
    git("first", &["push", "--quiet", "-u", "origin", "main"]);
    assert!(shell("first", compile).status.success());

    git("", &["clone", "--quiet", &origin, "second"]);
    git("second", &["lfs", "install", "--local"]);
    let refused = shell("second", "bthc compile models/dragon.ply");
    assert_eq!(refused.status.code(), Some(3));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("git lfs pull"), "{said}");
    let kept = shell("second", "bthc cache stats --json").stdout;
    let kept: serde_json::Value = serde_json::from_slice(&kept).unwrap();
    assert_eq!(kept["bytes"], 0, "nothing is kept for a pointer");

    let report = compile.replace("--quiet", "--json -o models");
    let done = shell("second", &report);
    assert!(done.status.success(), "{done:?}");
    let json: serde_json::Value =
        serde_json::from_slice(&done.stdout[done.stdout.iter().position(|b| *b == b'{').unwrap()..]).unwrap();
    assert_eq!(json["jobs"][0]["cache"]["hit"], true, "{json}");
    let bytes = |folder: &str| std::fs::read(project.at(folder).join("models/dragon.bth")).unwrap();
    assert!(bytes("first") == bytes("second"));
}
