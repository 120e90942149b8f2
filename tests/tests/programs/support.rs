//! Running the programs, and small models for them.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// How a program ended.
#[derive(Debug)]
pub(crate) struct Run {
    /// Exit code; `None` when a signal ended it.
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
    /// The first argument, if the program is `bthc`.
    command: String,
}

impl Run {
    /// What was printed with `--json`.
    #[track_caller]
    pub(crate) fn json(&self) -> serde_json::Value {
        let found = serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in {self:?}"));
        crate::schema::check(&self.command, &found);
        found
    }
    /// The report on the first of the models that were compiled.
    #[track_caller]
    pub(crate) fn job(&self) -> serde_json::Value {
        self.json()["jobs"][0].clone()
    }
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{self:?}");
        self
    }
}

/// Folder of the built programs.
fn programs() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| bth_tests::built(&["bthc", "bth-play", "bth-scenes"]))
}

/// The command for a program, in a folder.
pub(crate) fn command(program: &str, folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(programs().join(program));
    // Without the cache: no test may profit from what another one compiled.
    command.args(args).current_dir(folder).stdin(Stdio::null()).env("BTH_NO_CACHE", "1");
    command
}

pub(crate) fn run(program: &str, folder: &Path, args: &[&str]) -> Run {
    run_with(command(program, folder, args))
}

pub(crate) fn run_with(mut command: Command) -> Run {
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let is_bthc = Path::new(command.get_program()).file_stem().is_some_and(|name| name == "bthc");
    let name = command.get_args().next().filter(|_| is_bthc).unwrap_or_default();
    let command = name.to_string_lossy().into_owned();
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr), command }
}

pub(crate) fn bthc(folder: &Path, args: &[&str]) -> Run {
    run("bthc", folder, args)
}

/// Waits for a program; kills it and returns `None` when it takes longer.
pub(crate) fn wait(child: &mut Child, limit: Duration) -> Option<std::process::ExitStatus> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status);
        }
        if start.elapsed() > limit {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Text of an OBJ file.
pub(crate) fn obj(positions: &[[f32; 3]], faces: &[[usize; 3]]) -> String {
    let mut text = String::new();
    for [x, y, z] in positions {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for face in faces {
        writeln!(text, "f {} {} {}", face[0] + 1, face[1] + 1, face[2] + 1).unwrap();
    }
    text
}

/// Text of an OBJ file with a [`sphere_mesh`].
pub(crate) fn sphere(n: usize) -> String {
    let (positions, faces) = sphere_mesh(n);
    obj(&positions, &faces)
}

/// A closed bumpy sphere of `4 * n * (n - 1)` triangles.
pub(crate) fn sphere_mesh(n: usize) -> (Vec<[f32; 3]>, Vec<[usize; 3]>) {
    let columns = 2 * n;
    let point = |row: usize, column: usize| {
        let (theta, phi) = (row as f32 / n as f32, column as f32 / columns as f32);
        let (theta, phi) = (theta * std::f32::consts::PI, phi * std::f32::consts::TAU);
        let radius = 1.0 + 0.1 * (5.0 * theta).sin() * (4.0 * phi).cos();
        [radius * theta.sin() * phi.cos(), radius * theta.cos(), radius * theta.sin() * phi.sin()]
    };
    let mut positions = vec![[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    for row in 1..n {
        positions.extend((0..columns).map(|column| point(row, column)));
    }
    let at = |row: usize, column: usize| match row {
        0 => 0,
        r if r == n => 1,
        r => 2 + (r - 1) * columns + column % columns,
    };
    let mut faces = Vec::new();
    for row in 0..n {
        for column in 0..columns {
            let (a, b) = (at(row, column), at(row, column + 1));
            let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
            if a != b {
                faces.push([a, b, c]);
            }
            if c != d {
                faces.push([b, d, c]);
            }
        }
    }
    (positions, faces)
}

/// Two triangles that cross, and one apart from them.
pub(crate) fn crossing() -> String {
    let positions = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [0.0, 4.0, 0.0],
        [1.0, 1.0, -1.0],
        [1.0, 1.0, 1.0],
        [2.0, 1.0, 1.0],
        [9.0, 9.0, 9.0],
        [8.0, 9.0, 9.0],
        [9.0, 8.0, 9.0],
    ];
    obj(&positions, &[[0, 1, 2], [3, 4, 5], [6, 7, 8]])
}

/// A folder with these files.
pub(crate) fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// Folder of the downloaded models; `None`, and a printed line, where it does not exist.
pub(crate) fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("BTH_DATA").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no models at {}", folder.display());
    None
}
