//! Scene manifests and models as input: `bthc`, in the folder of this program, compiles them into the cache, from which they
//! are mapped.

use crate::failure::Failure;
use bth_cache::{DEFAULT_CAP, Digest, Pin, Store};
use std::path::Path;
use std::process::{Command, Stdio};

/// Extensions of the files that `bthc` compiles.
const SOURCES: [&str; 8] = ["manifest", "toml", "gltf", "glb", "obj", "ply", "stl", "off"];

/// Whether a file must be compiled first, by its extension.
pub(crate) fn is_source(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|e| SOURCES.contains(&e.as_str()))
}

/// The compiled file of a scene or model in the cache, checked; compiled now if the cache lacks it. The cache does not evict it
/// while the returned pin lives. With `materials` it is compiled with these and with holes by alpha, or without where its
/// materials cannot be read.
///
/// # Errors
/// If the manifest is malformed, the source cannot be compiled, or the cache cannot be used.
pub(crate) fn compiled(source: &Path, cache: Option<&Path>, materials: bool) -> Result<Pin, Failure> {
    // Read here, too, since the errors of this reader have their own codes, with line and column.
    if source
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("manifest") || e.eq_ignore_ascii_case("toml"))
    {
        bth_scene::read(source)?;
    }
    let failed = |(message, exit): (String, u8)| Failure::Source {
        path: source.into(),
        message,
        exit,
        hint: format!("run: bthc compile {} -o scene.bth, then play scene.bth", source.display()),
    };
    let folder = cache.map(Path::to_owned).or_else(bth_cache::folder);
    let folder = folder.ok_or_else(|| {
        failed(("there is no folder for the cache; BTH_CACHE_DIR or --cache-dir names one".to_owned(), 3))
    })?;
    let store = Store::open(&folder, DEFAULT_CAP)
        .map_err(|e| Failure::File { path: folder.clone(), message: format!("cannot be the cache: {e}") })?;
    // An entry that is damaged, or evicted before it is pinned, is compiled again.
    for _ in 0..3 {
        let key = match compile(source, &folder, materials) {
            Err((_, 3 | 4)) if materials => {
                let plain = compile(source, &folder, false).map_err(&failed)?;
                let what = "its materials cannot be read, as above; it is shown without them";
                crate::messages::warn(&format!("{}: {what}", source.display()));
                plain
            }
            key => key.map_err(&failed)?,
        };
        let pin = store.find_id(&key).and_then(|record| store.pin(&record));
        store.take_notes().iter().for_each(|note| crate::messages::warn(note));
        if let Some(pin) = pin {
            return Ok(pin);
        }
    }
    Err(failed(("the compiled file does not stay in the cache".to_owned(), 3)))
}

/// Runs `bthc` to compile into the cache. Returns the key of the entry, or what failed and the exit code for it.
fn compile(source: &Path, cache: &Path, materials: bool) -> Result<Digest, (String, u8)> {
    let bthc = std::env::current_exe()
        .ok()
        .map(|exe| exe.with_file_name(format!("bthc{}", std::env::consts::EXE_SUFFIX)))
        .filter(|bthc| bthc.is_file());
    let Some(bthc) = bthc else {
        return Err(("it is not compiled yet, and there is no bthc beside this program".to_owned(), 3));
    };
    let mut command = Command::new(&bthc);
    command.arg("compile").arg(source).arg("--in-cache").arg("--cache-dir").arg(cache).arg("--json");
    if materials {
        command.args(["--materials", "--alpha", "mask"]);
    }
    let output = command.stdin(Stdio::null()).stderr(Stdio::inherit()).output();
    let output = match output {
        Ok(output) => output,
        Err(e) => return Err((format!("{} cannot be started: {e}", bthc.display()), 3)),
    };
    if !output.status.success() {
        let exit = if output.status.code() == Some(4) { 4 } else { 3 };
        return Err((format!("{} ended with {}", bthc.display(), output.status), exit));
    }
    let json: Option<serde_json::Value> = serde_json::from_slice(&output.stdout).ok();
    let key = json.as_ref().and_then(|json| Digest::parse(json["cache"]["key"].as_str()?));
    key.ok_or_else(|| (format!("{} did not name the entry of the compiled file", bthc.display()), 3))
}
