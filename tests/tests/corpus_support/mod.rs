//! Runs the built programs on the models that lie next to the checkout.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Folder of the test models: `BTH_DATA`, else `../shared/data` next to the checkout.
pub(crate) fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("BTH_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A program of the workspace, from the build that this test belongs to.
pub(crate) fn program(name: &str) -> Option<PathBuf> {
    let test = std::env::current_exe().ok()?;
    let file = test.parent()?.parent()?.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    file.is_file().then_some(file)
}

/// The test models and the compiler; `None`, and a printed line, where one is missing.
pub(crate) fn data_and_compiler() -> Option<(PathBuf, PathBuf)> {
    match (data(), program("bthc")) {
        (Some(data), Some(bthc)) => Some((data, bthc)),
        (None, _) => {
            println!("SKIPPED: no test models (set BTH_DATA to their folder)");
            None
        }
        (_, None) => {
            println!("SKIPPED: bthc is not built (cargo build --workspace)");
            None
        }
    }
}

/// How a program ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Exit code; none when a signal ended it.
    pub(crate) code: Option<i32>,
    /// Standard output.
    pub(crate) stdout: String,
    /// Standard error.
    pub(crate) stderr: String,
    /// Seconds on the wall clock.
    pub(crate) seconds: f64,
}

/// Runs a program; one that takes longer than `limit` is ended and reported as an error.
pub(crate) fn run(command: &mut Command, limit: Duration) -> Result<Ended, String> {
    // Files instead of pipes: the program would block on a full pipe that is not read until it
    // ends.
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let (out, err) = (folder.path().join("out"), folder.path().join("err"));
    let create = |path: &Path| std::fs::File::create(path).map_err(|e| e.to_string());
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(create(&out)?)
        .stderr(create(&err)?)
        .spawn()
        .map_err(|e| e.to_string())?;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            break status;
        }
        if start.elapsed() > limit {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("not done after {} s", limit.as_secs()));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let read = |path: &Path| {
        std::fs::read(path)
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
            .map_err(|e| e.to_string())
    };
    Ok(Ended {
        code: status.code(),
        stdout: read(&out)?,
        stderr: read(&err)?,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// All files below a folder with an extension that the compiler reads, sorted.
pub(crate) fn models(folder: &Path) -> Vec<PathBuf> {
    let (mut folders, mut found) = (vec![folder.to_path_buf()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            if path.is_dir() {
                folders.push(path);
            } else if extension.is_some_and(|e| ["obj", "ply", "stl", "off", "gltf", "glb"].contains(&&*e)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Triangles of a model according to the table of the corpus; none where it lists no number.
pub(crate) fn listed_triangles(data: &Path, section: &str, model: &Path) -> Option<u64> {
    let index = std::fs::read_to_string(data.join("INDEX.md")).ok()?;
    let name = model.strip_prefix(data.join(section)).ok()?.to_str()?;
    let part = index.split("\n## ").find(|part| part.starts_with(section))?;
    let row = part.lines().find(|line| line.strip_prefix(&format!("| {name} |")).is_some())?;
    row.split('|').nth(2)?.trim().parse().ok()
}
