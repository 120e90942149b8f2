//! Scene manifests: compiled by the `bthc` beside this program, and kept in a cache.

use crate::failure::Failure;
use bth_scene::Manifest;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Bytes of compiled scenes that are kept; beyond it those that were used longest ago go.
const MOST_BYTES: u64 = 4 << 30;

/// Whether a file is a manifest, by its extension.
pub(crate) fn is_manifest(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    matches!(extension.as_deref(), Some("manifest" | "toml"))
}

/// The compiled file of a manifest, compiled now if the cache does not have it.
pub(crate) fn compiled(path: &Path) -> Result<PathBuf, Failure> {
    let manifest = bth_scene::read(path)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let key = key(&manifest, folder);
    let Some(cache) = cache_folder() else {
        return Err(Failure::Manifest {
            path: path.into(),
            message: "there is no folder for compiled scenes".to_owned(),
            hint: format!("set BTH_CACHE to one, or run: bthc compile {} -o scene.bth", path.display()),
        });
    };
    let file = cache.join(format!("{key}.bth"));
    if file.is_file() {
        // Marks it as used; a cache that cannot be written is still one that can be read.
        let _ = std::fs::File::open(&file).and_then(|f| f.set_modified(std::time::SystemTime::now()));
        return Ok(file);
    }
    std::fs::create_dir_all(&cache)
        .map_err(|e| Failure::File { path: cache.clone(), message: e.to_string() })?;
    compile(path, &file)?;
    evict(&cache, &file);
    Ok(file)
}

fn compile(manifest: &Path, file: &Path) -> Result<(), Failure> {
    let bthc = std::env::current_exe()
        .ok()
        .map(|exe| exe.with_file_name(format!("bthc{}", std::env::consts::EXE_SUFFIX)))
        .filter(|bthc| bthc.is_file());
    let by_hand = format!("run: bthc compile {} -o scene.bth, then play scene.bth", manifest.display());
    let failed =
        |message: String| Failure::Manifest { path: manifest.into(), message, hint: by_hand.clone() };
    let bthc = bthc.ok_or_else(|| {
        failed("the scene is not compiled yet, and there is no bthc beside this program".to_owned())
    })?;
    let mut command = Command::new(&bthc);
    command.arg("compile").arg(manifest).arg("-o").arg(file).arg("--quiet");
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(failed(format!("{} ended with {status}", bthc.display()))),
        Err(e) => Err(failed(format!("{} cannot be started: {e}", bthc.display()))),
    }
}

fn cache_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    set("BTH_CACHE")
        .or_else(|| set("XDG_CACHE_HOME").map(|p| p.join("bth")))
        .or_else(|| set("HOME").map(|p| p.join(".cache/bth")))
        .or_else(|| set("LOCALAPPDATA").map(|p| p.join("bth")))
}

/// Hash of all that the compiled file depends on: the version, the scene, and the content of its sources.
fn key(manifest: &Manifest, folder: &Path) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
    };
    add(env!("CARGO_PKG_VERSION").as_bytes());
    add(manifest.to_toml().as_bytes());
    let mut paths: Vec<&str> = manifest.objects.iter().map(|o| o.source.path()).collect();
    paths.sort_unstable();
    paths.dedup();
    for path in paths {
        let path = folder.join(path);
        add(&digest(&path));
        buffers(&path).iter().for_each(|buffer| add(&digest(buffer)));
    }
    hasher.finalize().to_hex().to_string()
}

/// Hash of a file's content; of none, which an object that nobody sees may be, zeros.
fn digest(path: &Path) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let read = std::fs::File::open(path).and_then(|file| hasher.update_reader(file).map(|_| ()));
    if read.is_ok() { *hasher.finalize().as_bytes() } else { [0; 32] }
}

/// Files beside a .gltf document that hold its buffers.
fn buffers(path: &Path) -> Vec<PathBuf> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        return Vec::new();
    }
    let document =
        std::fs::read(path).ok().and_then(|b| serde_json::from_slice::<serde_json::Value>(&b).ok());
    let uris = document.as_ref().and_then(|d| d["buffers"].as_array());
    let names = uris.into_iter().flatten().filter_map(|b| b["uri"].as_str());
    names.filter(|n| !n.starts_with("data:")).map(|name| path.with_file_name(name)).collect()
}

/// Removes the files that were used longest ago, but not this one, until the rest is small enough.
fn evict(cache: &Path, keep: &Path) {
    let Ok(entries) = std::fs::read_dir(cache) else { return };
    let mut files: Vec<_> = entries
        .flatten()
        .filter(|e| e.path().extension().is_some_and(|x| x == "bth"))
        .filter_map(|e| e.metadata().ok().and_then(|m| Some((m.modified().ok()?, m.len(), e.path()))))
        .collect();
    files.sort();
    let mut total: u64 = files.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, bytes, path) in files {
        if total <= MOST_BYTES {
            return;
        }
        // What another process removed meanwhile is gone all the same.
        if path != keep && std::fs::remove_file(&path).is_ok() {
            total -= bytes;
        }
    }
}
