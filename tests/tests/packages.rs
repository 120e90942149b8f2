//! Programs in C and C++ that find the installed libraries by CMake and by pkg-config
//! (`tools/package/install`), and packages for Debian (`tools/package/debian`).
#![cfg(unix)]
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the repository")
}

/// Returns true if a program can be run; prints a line if not.
fn have(program: &str) -> bool {
    let found = Command::new(program).arg("--version").output().is_ok();
    if !found {
        println!("SKIPPED: no {program}");
    }
    found
}

/// Runs a command that must succeed, and returns its output.
fn output_of(command: &mut Command) -> String {
    let output = command.output().expect("the command runs");
    assert!(output.status.success(), "{command:?}: {output:?}");
    String::from_utf8(output.stdout).expect("text")
}

/// A folder with the libraries installed and then moved, as by a package manager.
fn installed(folder: &Path) -> PathBuf {
    let built = bth_tests::built(&["bth-capi", "bth-compile-capi", "bth-embree"]);
    let prefix = folder.join("moved");
    let mut install = Command::new(root().join("tools/package/install"));
    output_of(install.arg("/usr").env("DESTDIR", folder).env("BTH_INSTALL_FROM", built));
    std::fs::rename(folder.join("usr"), &prefix).expect("a folder that can be moved");
    prefix
}

/// Runs the programs of `tests/c`, which check themselves.
fn run_both(folder: &Path) {
    output_of(Command::new(folder.join("scene")).arg(folder.join("absent.bth")));
    output_of(
        Command::new(folder.join("compile")).args(["mesh.bth", "scene.bth"].map(|name| folder.join(name))),
    );
}

/// Writes the examples of `docs/c.md` as files. What has no function `main` is called a part.
fn write_examples(folder: &Path) {
    std::fs::create_dir(folder).expect("a folder");
    let page = std::fs::read_to_string(root().join("docs/c.md")).expect("the page");
    let blocks = page.split("\n```").skip(1).step_by(2).filter_map(|block| block.split_once('\n'));
    let mut written = 0;
    for (language, text) in blocks.filter(|(language, _)| ["c", "cpp"].contains(language)) {
        let kind = if text.contains("int main(") { "example" } else { "part" };
        std::fs::write(folder.join(format!("{kind}{written}.{language}")), text).expect("a file");
        written += 1;
    }
    assert!(written > 5, "{written} examples");
}

#[test]
fn a_cmake_project_finds_the_libraries() {
    if !["cmake", "c++", "cc"].into_iter().all(have) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let moved = installed(folder.path());
    // A link to the folder with the files for CMake, as /lib is one to /usr/lib; /include is
    // elsewhere.
    let prefix = folder.path().join("root");
    std::fs::create_dir(&prefix).expect("a folder");
    std::os::unix::fs::symlink(moved.join("lib"), prefix.join("lib")).expect("a link");
    let (build, examples) = (folder.path().join("build"), folder.path().join("examples"));
    write_examples(&examples);
    let configure = |extra: &str| {
        let mut cmake = Command::new("cmake");
        cmake.arg("-S").arg(root().join("tests/packages/cmake")).arg("-B").arg(&build);
        cmake.arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display()));
        cmake.arg(format!("-DPROGRAMS={}", root().join("tests/c").display()));
        cmake.arg(format!("-DEXAMPLES={}", examples.display())).arg(extra);
        cmake
    };
    output_of(&mut configure("-DCMAKE_BUILD_TYPE=Release"));
    output_of(Command::new("cmake").arg("--build").arg(&build));
    run_both(&build);
}

#[test]
fn programs_find_the_libraries_by_pkg_config() {
    if !["pkg-config", "c++", "cc"].into_iter().all(have) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let prefix = installed(folder.path());
    let ask = |arguments: &[&str]| {
        let mut ask = Command::new("pkg-config");
        output_of(ask.args(arguments).env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig"))).trim().to_owned()
    };
    assert_eq!(ask(&["--modversion", "bth"]), env!("CARGO_PKG_VERSION"));
    let flags = ask(&["--cflags", "--libs", "bth", "bth_compile"]);
    for (compiler, source) in [("c++", "scene.cpp"), ("cc", "compile.c")] {
        let mut compile = Command::new(compiler);
        compile.arg(root().join("tests/c").join(source)).args(flags.split(' '));
        compile.arg(format!("-Wl,-rpath,{}", prefix.join("lib").display()));
        output_of(compile.arg("-o").arg(folder.path().join(source).with_extension("")));
    }
    run_both(folder.path());
}

#[test]
fn folders_start_where_the_scripts_are_started() {
    let built =
        bth_tests::built(&["bthc", "bth-play", "bth-scenes", "bth-capi", "bth-compile-capi", "bth-embree"]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = |name: &str, arguments: &[&str]| {
        let mut script = Command::new(root().join("tools/package").join(name));
        script
            .args(arguments)
            .current_dir(folder.path())
            .env("BTH_INSTALL_FROM", &built)
            .env_remove("DESTDIR");
        script.output().expect("the script runs")
    };
    std::os::unix::fs::symlink(&built, folder.path().join("programs")).expect("a link");
    assert!(script("install", &["here/bth"]).status.success());
    assert!(folder.path().join("here/bth/include/bth.h").exists());
    assert!(script("manuals", &["programs", "here"]).status.success());
    assert!(folder.path().join("here/share/man/man1/bthc.1.gz").exists());
    let absent = script("manuals", &["absent", "there"]);
    assert_eq!(absent.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&absent.stderr).contains("there is no bthc in"), "{absent:?}");
    // Whatever was asked is made, or its absence is told.
    for name in ["install", "static", "debian", "wheel"] {
        let refused = script(name, &["one", "two"]);
        assert_eq!(refused.status.code(), Some(2), "{name}: {refused:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).starts_with("usage: "), "{name}: {refused:?}");
    }
    for name in ["absent", "there", "one", "two"] {
        assert!(!root().join(name).exists() && !folder.path().join(name).exists(), "{name}");
    }
}

/// Packs packages for Debian into a folder: their names without version, and their paths.
fn pack_debian_packages(folder: &Path) -> Vec<(String, PathBuf)> {
    let built =
        bth_tests::built(&["bthc", "bth-play", "bth-scenes", "bth-capi", "bth-compile-capi", "bth-embree"]);
    let mut pack = Command::new(root().join("tools/package/debian"));
    // Programs of debug builds are large, and the usual compression takes half a minute for them.
    pack.envs([("DPKG_DEB_COMPRESSOR_TYPE", "gzip"), ("DPKG_DEB_COMPRESSOR_LEVEL", "1")]);
    output_of(pack.arg(folder).env("BTH_INSTALL_FROM", built).env_remove("SOURCE_DATE_EPOCH"));
    let paths =
        std::fs::read_dir(folder).expect("the packages").map(|entry| entry.expect("a package").path());
    let named = |path: PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name.split('_').next().expect("a name").to_owned(), path)
    };
    let mut packages: Vec<_> = paths.map(named).collect();
    packages.sort();
    packages
}

/// The packages for Debian, which are packed once for all tests, into a folder next to the build's.
fn debian_packages() -> &'static [(String, PathBuf)] {
    static PACKED: OnceLock<Vec<(String, PathBuf)>> = OnceLock::new();
    PACKED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("debian");
        if folder.exists() {
            std::fs::remove_dir_all(&folder).expect("the packages of the run before can be removed");
        }
        std::fs::create_dir_all(&folder).expect("a folder for packages");
        pack_debian_packages(&folder)
    })
}

#[test]
fn debian_packages_list_the_sums_of_their_files() {
    if !["dpkg-deb", "md5sum"].into_iter().all(have) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, package) in debian_packages() {
        let unpacked = folder.path().join(name);
        output_of(Command::new("dpkg-deb").arg("-R").arg(package).arg(&unpacked));
        let checked = output_of(Command::new("md5sum").args(["-c", "DEBIAN/md5sums"]).current_dir(&unpacked));
        let found = output_of(Command::new("find").args(["usr", "-type", "f"]).current_dir(&unpacked));
        assert_eq!(checked.lines().count(), found.lines().count(), "{name}");
        let control = std::fs::read_to_string(unpacked.join("DEBIAN/control")).expect("a description");
        let description = control.lines().skip_while(|line| !line.starts_with("Description:")).skip(1);
        assert!(
            description.clone().count() > 0 && description.clone().all(|line| line.len() <= 80),
            "{control}"
        );
    }
}

#[test]
fn debian_packages_have_the_licences_of_what_they_hold() {
    if !have("dpkg-deb") {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, package) in debian_packages() {
        let unpacked = folder.path().join(name);
        output_of(Command::new("dpkg-deb").arg("-x").arg(package).arg(&unpacked));
        let text = std::fs::read_to_string(unpacked.join("usr/share/doc").join(name).join("copyright"));
        let text = text.expect("a file of licences");
        // All programs and libraries hold the first crate.
        for part in ["libc 0.", "Permission is hereby granted", "Apache License"] {
            assert!(text.contains(part), "{name} has no {part:?}");
        }
        if name == "bth-tetgen" {
            assert!(text.contains("GNU AFFERO GENERAL PUBLIC LICENSE\nVersion 3"), "{name}");
        }
    }
}

#[test]
fn debian_packages_have_manuals_and_completions_where_they_are_looked_for() {
    if !have("dpkg-deb") {
        return;
    }
    let (_, package) =
        debian_packages().iter().find(|(name, _)| name == "bth").expect("the package of programs");
    let files = output_of(Command::new("dpkg-deb").arg("-c").arg(package));
    for program in ["bthc", "bth-play", "bth-scenes"] {
        for file in [
            format!("bin/{program}"),
            format!("share/man/man1/{program}.1.gz"),
            format!("share/bash-completion/completions/{program}"),
            format!("share/zsh/vendor-completions/_{program}"),
            format!("share/fish/vendor_completions.d/{program}.fish"),
        ] {
            assert!(files.lines().any(|line| line.ends_with(&format!(" ./usr/{file}"))), "{file}: {files}");
        }
    }
    if let Some((_, worker)) = debian_packages().iter().find(|(name, _)| name == "bth-tetgen") {
        let files = output_of(Command::new("dpkg-deb").arg("-c").arg(worker));
        assert!(files.contains(" ./usr/share/man/man1/bth-tetgen.1.gz"), "{files}");
    }
}

#[test]
fn the_same_files_give_the_same_debian_packages() {
    if !have("dpkg-deb") {
        return;
    }
    let first = debian_packages();
    // Times of files are in seconds.
    std::thread::sleep(std::time::Duration::from_millis(1100));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let second = pack_debian_packages(folder.path());
    assert!(first.len() >= 2, "{first:?}");
    assert_eq!(first.len(), second.len());
    for ((name, a), (_, b)) in first.iter().zip(&second) {
        assert!(
            std::fs::read(a).expect("a package") == std::fs::read(b).expect("a package"),
            "{name} differs"
        );
    }
}
