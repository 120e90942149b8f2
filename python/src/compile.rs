//! The compiler: files and arrays to scenes.

use crate::caching::{cache, store};
use crate::errors::{compile_error, format_error};
use crate::numbers::Vectors;
use crate::options::{Keywords, options};
use crate::scene::NativeScene;
use crate::work;
use bth_cache::Store;
use bth_compile::cached::Cache;
use bth_compile::memory::{self, Instance, PositionRows, SceneNames, TriangleMesh};
use bth_compile::pipeline::CompileOptions;
use bth_compile::scene::{CachePolicy, SceneSource};
use bth_compile::{Monitor, write};
use bth_import::Looks;
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{self, ImportOptions};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Progress of a compilation, which another thread looks at.
#[derive(Default)]
struct Progress {
    cancelled: AtomicBool,
    stage: Mutex<(&'static str, Option<u64>)>,
    done: AtomicU64,
    warnings: Mutex<Vec<String>>,
}

impl Monitor for Progress {
    fn stage(&self, name: &'static str, total: Option<u64>) {
        *work::lock(&self.stage) = (name, total);
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    fn warn(&self, message: &str) {
        work::lock(&self.warnings).push(message.to_owned());
    }
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|wanted| e.eq_ignore_ascii_case(wanted)))
}

fn gltf_options(keywords: &Keywords<'_, '_>) -> PyResult<ImportOptions> {
    let animation = match keywords.value::<String>("animation")?.as_deref() {
        None => Chosen::First,
        Some("all") => Chosen::All,
        Some("none") => Chosen::None,
        Some(name) => Chosen::One(name.to_owned()),
    };
    let rate = keywords.value("rate")?.unwrap_or(24.0);
    if !(f64::is_finite(rate) && rate > 0.0) {
        return Err(PyValueError::new_err(format!("rate: expected a number above 0, got {rate}")));
    }
    Ok(ImportOptions {
        scene: keywords.value("scene")?,
        animation,
        rate,
        deform: !keywords.value("at_rest")?.unwrap_or(false),
        rigid_parts: keywords.value("rigid_parts")?.unwrap_or(false),
        strict: keywords.value("strict")?.unwrap_or(false),
    })
}

/// Runs a compilation on threads of the pool; calls `progress` with stage, units done and units in
/// all.
pub(crate) fn monitored<T: Send>(
    py: Python<'_>,
    keywords: &Keywords<'_, '_>,
    compile: impl FnOnce(&dyn Monitor) -> bth_compile::Result<T> + Send,
) -> PyResult<T> {
    let monitor = Progress::default();
    let progress: Option<Py<PyAny>> = keywords.get("progress")?.map(Bound::unbind);
    let threads = keywords.within("threads", 0..=4096)?.unwrap_or(0) as usize;
    let warn = |py: Python<'_>| -> PyResult<()> {
        for message in std::mem::take(&mut *work::lock(&monitor.warnings)) {
            crate::caching::warn(py, &message)?;
        }
        Ok(())
    };
    let look = |py: Python<'_>| -> PyResult<()> {
        if let Some(progress) = &progress {
            let (stage, total) = *work::lock(&monitor.stage);
            progress.call1(py, (stage, monitor.done.load(Ordering::Relaxed), total))?;
        }
        Ok(())
    };
    let work = || -> Result<T, Failure> {
        if threads == 0 {
            return work::pool().install(|| compile(&monitor)).map_err(Failure::Compile);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map_err(|e| Failure::Threads(e.to_string()))?
            .install(|| compile(&monitor))
            .map_err(Failure::Compile)
    };
    let result = work::run_cancellable(py, &monitor.cancelled, work, look)?;
    warn(py)?;
    result.map_err(|failure| match failure {
        Failure::Compile(e) => compile_error(e),
        Failure::Threads(e) => PyValueError::new_err(format!("threads: cannot start {threads}: {e}")),
    })
}

enum Failure {
    Compile(bth_compile::Error),
    Threads(String),
}

/// Compiles a model or a scene from a file. Returns the bytes of the compiled file.
#[pyfunction]
pub(crate) fn compile_path(
    py: Python<'_>,
    path: PathBuf,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<NativeScene> {
    let keywords = Keywords(keywords);
    let options = options(&keywords)?;
    let store = store(&keywords, true)?;
    let gltf = gltf_options(&keywords)?;
    let flatten = keywords.value("flatten")?.unwrap_or(false);
    let output: Option<PathBuf> = keywords.value("output")?;
    if options.costs.rays.is_some() && is_scene(&path, flatten) {
        let message = format!("rays: an option for one model, and {} is a scene", path.display());
        return Err(PyValueError::new_err(message));
    }
    if let Some(output) = output.as_deref().filter(|output| output.is_file()) {
        let inputs = py.detach(|| inputs(&path, options.looks()));
        refuse_input(output, &inputs)?;
    }
    let bytes = monitored(py, &keywords, |monitor| {
        let content = compile_file(&path, flatten, &gltf, &options, store.as_ref(), monitor)?;
        deliver(content, output.as_deref())
    })?;
    let scene = py.detach(|| bth::from_bytes(&bytes));
    scene.map(NativeScene::new).map_err(|e| format_error(&e))
}

/// The error of the compiler for one of a manifest.
fn manifest_error(error: bth_scene::Error) -> bth_compile::Error {
    let (path, message) = (error.path.clone(), format!("{}:{}: {}", error.line, error.column, error.message));
    match error.code {
        bth_scene::error::code::READ => bth_compile::Error::File { code: error.code, path, message },
        code => bth_compile::Error::Input {
            code,
            place: bth_compile::Place::File(path),
            message,
            hint: error.hint,
        },
    }
}

/// Compiles triangles: float32 or float64 positions and uint32 indices, three a row.
#[pyfunction]
pub(crate) fn compile_mesh(
    py: Python<'_>,
    positions: Vectors<'_>,
    triangles: PyReadonlyArray2<'_, u32>,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<NativeScene> {
    let keywords = Keywords(keywords);
    let options = options(&keywords)?;
    let store = store(&keywords, false)?;
    let output: Option<PathBuf> = keywords.value("output")?;
    let mesh = triangle_mesh(&positions, &triangles)?;
    let opened = monitored(py, &keywords, |monitor| {
        if store.is_none() && output.is_none() {
            return memory::open(mesh, &options, monitor).map(Ok);
        }
        let cache = store.as_ref().map_or_else(Cache::none, |store| Cache::new(store, "mesh"));
        let compiled = bth_compile::pipeline::compile_cached(mesh, &options, &cache, &|_| true, monitor)?;
        let content = compiled.content.ok_or_else(no_content)?;
        deliver(content, output.as_deref()).map(|bytes| bth::from_bytes(&bytes))
    })?;
    opened.map(NativeScene::new).map_err(|e| format_error(&e))
}

fn no_content() -> bth_compile::Error {
    bth_compile::Error::Internal { code: "BTH-X082", message: "the compiler returned no file".to_owned() }
}

/// The bytes of a compiled file, which are also written to `output`.
fn deliver(content: write::Content, output: Option<&Path>) -> bth_compile::Result<Vec<u8>> {
    let bytes = content.bytes()?.into_owned();
    if let Some(output) = output {
        write::write_content(output, content)?;
    }
    Ok(bytes)
}

/// Compiles a scene: pairs of positions and triangles, for each instance its mesh and the 3×4
/// matrix that places it, and names of meshes and instances.
#[pyfunction]
pub(crate) fn compile_scene(
    py: Python<'_>,
    meshes: Vec<(Vectors<'_>, PyReadonlyArray2<'_, u32>)>,
    instances: PyReadonlyArray1<'_, u32>,
    transforms: PyReadonlyArray3<'_, f64>,
    names: (Option<Vec<String>>, Option<Vec<String>>),
    keywords: &Bound<'_, PyDict>,
) -> PyResult<NativeScene> {
    let keywords = Keywords(keywords);
    let options = options(&keywords)?;
    let store = store(&keywords, false)?;
    let output: Option<PathBuf> = keywords.value("output")?;
    let meshes = meshes.iter().map(|(p, t)| triangle_mesh(p, t)).collect::<PyResult<Vec<_>>>()?;
    let transforms = transforms.as_array();
    if transforms.shape() != [instances.len(), 3, 4] {
        return Err(PyValueError::new_err("expected a 3×4 matrix for each instance"));
    }
    let placed = |(row, &mesh): (usize, &u32)| Instance {
        mesh,
        to_world: std::array::from_fn(|i| std::array::from_fn(|k| transforms[[row, i, k]])),
    };
    let instances: Vec<Instance> = instances.as_array().iter().enumerate().map(placed).collect();
    let bytes = monitored(py, &keywords, |monitor| {
        let cache = store.as_ref().map_or_else(Cache::none, |store| Cache::new(store, "scene"));
        let names = SceneNames { meshes: names.0.as_deref(), instances: names.1.as_deref() };
        let compiled = memory::compile_named_scene(&meshes, &instances, names, &options, &cache, monitor)?;
        deliver(compiled.content.ok_or_else(no_content)?, output.as_deref())
    })?;
    let scene = py.detach(|| bth::from_bytes(&bytes));
    scene.map(NativeScene::new).map_err(|e| format_error(&e))
}

/// A mesh in arrays, three numbers a row.
fn triangle_mesh<'a>(
    positions: &'a Vectors<'_>,
    triangles: &'a PyReadonlyArray2<'_, u32>,
) -> PyResult<TriangleMesh<'a>> {
    let contiguous = |_| PyValueError::new_err("expected contiguous arrays of positions and triangles");
    let positions = match positions {
        Vectors::Single(a) => PositionRows::F32(a.as_slice().map_err(contiguous)?.as_chunks::<3>().0),
        Vectors::Double(a) => PositionRows::F64(a.as_slice().map_err(contiguous)?.as_chunks::<3>().0),
    };
    let (triangles, _) = triangles.as_slice().map_err(contiguous)?.as_chunks::<3>();
    Ok(TriangleMesh { positions, triangles })
}

/// The files that a compilation of a file reads, itself among them.
#[pyfunction]
pub(crate) fn source_files(py: Python<'_>, path: PathBuf) -> Vec<PathBuf> {
    py.detach(|| inputs(&path, Looks::default()))
}

fn inputs(path: &Path, looks: Looks) -> Vec<PathBuf> {
    let files = match has_extension(path, &["manifest", "toml"]) {
        true => bth_scene::read(path).ok().map(|manifest| bth_compile::scene::files(&manifest, path, looks)),
        false => Some(bth_compile::source::files(path, looks)),
    };
    // A source that cannot be read is reported when it is compiled.
    files.and_then(Result::ok).unwrap_or_else(|| vec![path.to_owned()])
}

/// Fails if an output, which is a file already, would replace one of these files.
fn refuse_input(output: &Path, inputs: &[PathBuf]) -> PyResult<()> {
    let Ok(real) = output.canonicalize() else { return Ok(()) };
    match inputs.iter().find(|input| input.canonicalize().is_ok_and(|input| input == real)) {
        None => Ok(()),
        Some(input) => Err(PyValueError::new_err(format!(
            "output: {} would replace {}, which is read (hint: name another output)",
            output.display(),
            input.display()
        ))),
    }
}

/// Returns true if a file is compiled as a scene.
fn is_scene(path: &Path, flatten: bool) -> bool {
    has_extension(path, &["manifest", "toml"]) || bth_import::is_scene(path) && !flatten
}

/// Compiles a file as the program does: glTF, FBX and 3MF files and manifests are scenes.
fn compile_file(
    path: &Path,
    flatten: bool,
    gltf: &ImportOptions,
    options: &CompileOptions,
    store: Option<&Store>,
    monitor: &dyn Monitor,
) -> bth_compile::Result<write::Content> {
    let cache = cache(store, path);
    let content = if is_scene(path, flatten) {
        let manifest = match has_extension(path, &["manifest", "toml"]) {
            true => bth_scene::read(path).map_err(manifest_error)?,
            false => scene::import(path, scene::file_name(path)?, gltf, monitor)?.0,
        };
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let source = SceneSource { folder, name: path };
        let policy = CachePolicy { whole: false, needed: &|_| true };
        bth_compile::scene::compile_cached(&manifest, source, options, &cache, policy, monitor)?.content
    } else {
        bth_compile::pipeline::compile_cached(path, options, &cache, &|_| true, monitor)?.content
    };
    content.ok_or_else(no_content)
}
