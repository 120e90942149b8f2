//! Scenes to measure: our own animations by name, manifests, and glTF files.

use crate::model::Model;
use crate::twist::{TWIST, twisted};
use anyhow::{Context, Result};
use bth::Scene;
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, MotionOptions, Structure};
use bth_import::gltf::scene::ImportOptions;
use bth_scene::Manifest;
use std::path::{Path, PathBuf};

/// Frames of a twist, besides the first.
const TWIST_FRAMES: i32 = 24;

/// A manifest, and the folder of its models.
pub(crate) struct Source {
    /// Name without folder and extension.
    pub(crate) name: String,
    pub(crate) manifest: Manifest,
    /// What paths of the manifest are relative to.
    pub(crate) folder: PathBuf,
    /// Keeps the files of a generated scene until the end.
    _models: Option<tempfile::TempDir>,
}

impl Source {
    /// Makes a scene of `bth-scenes list`, or of a model behind `twist:`, or reads a manifest or glTF file.
    ///
    /// # Errors
    /// If there is no such scene or file, or the files of a generated one cannot be written.
    pub(crate) fn load(name: &str) -> Result<Source> {
        if let Some(model) = name.strip_prefix("twist:") {
            return Source::twisting(&Model::load(model)?);
        }
        if let Some(animation) = bth_scenes::animations::find(name) {
            let scene = (animation.make)();
            let folder = tempfile::tempdir()?;
            for (path, model) in &scene.models {
                let path = folder.path().join(path);
                std::fs::create_dir_all(path.parent().context("models lie in a folder")?)?;
                bth_scenes::write::file(model, &path)?;
            }
            let (name, manifest) = (name.to_owned(), scene.manifest);
            return Ok(Source { name, manifest, folder: folder.path().into(), _models: Some(folder) });
        }
        let path = PathBuf::from(name);
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        let manifest = if extension.is_some_and(|extension| extension == "glb" || extension == "gltf") {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            bth_import::gltf::scene::import(&path, &file, &ImportOptions::default(), &Silent)?.0
        } else {
            bth_scene::read(&path).with_context(|| format!("no scene or manifest `{name}`"))?
        };
        let folder = path.parent().map_or_else(|| PathBuf::from("."), PathBuf::from);
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Source { name, manifest, folder, _models: None })
    }

    /// A scene of a model whose vertices a vertex cache twists.
    fn twisting(model: &Model) -> Result<Source> {
        let folder = tempfile::tempdir()?;
        let still = bth_scenes::Model {
            positions: model.mesh.positions.clone(),
            triangles: model.mesh.triangles.clone(),
        };
        bth_scenes::write::file(&still, &folder.path().join("model.ply"))?;
        // A PC2 file of a sample for each frame.
        let mut cache = b"POINTCACHE2\0".to_vec();
        cache.extend([1, i32::try_from(still.positions.len())?].iter().flat_map(|x| x.to_le_bytes()));
        cache.extend([0.0f32, 1.0].iter().flat_map(|x| x.to_le_bytes()));
        cache.extend((TWIST_FRAMES + 1).to_le_bytes());
        for frame in 0..=TWIST_FRAMES {
            let positions = twisted(model, TWIST * frame as f32 / TWIST_FRAMES as f32);
            cache.extend(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        }
        std::fs::write(folder.path().join("model.pc2"), cache)?;
        let text = format!(
            "version = 1\nframes = {{ first = 0, last = {TWIST_FRAMES}, rate = 24 }}\n\
             objects = [{{ name = \"model\", model = \"model.ply\", vertex_cache = \"model.pc2\" }}]\n\
             nodes = [{{ name = \"model\", object = \"model\" }}]\n"
        );
        let manifest = bth_scene::parse(&text, &folder.path().join("model.manifest"))?;
        let name = format!("{}, twisted", model.name);
        Ok(Source { name, manifest, folder: folder.path().into(), _models: Some(folder) })
    }

    /// At most so many frames, evenly spread over the range of the manifest.
    pub(crate) fn frames(&self, count: usize) -> Vec<i32> {
        let range = &self.manifest.frames;
        let (first, last) = (i64::from(range.first), i64::from(range.last));
        let count = (count as i64).min(last - first + 1);
        (0..count).map(|i| (first + (last - first) * (2 * i + 1) / (2 * count)) as i32).collect()
    }
}

/// Compiles a scene without tetrahedra.
pub(crate) fn compiled(source: &Source, motion: MotionOptions) -> Result<Scene> {
    let options = CompileOptions { structure: Structure::Bvh, motion, ..CompileOptions::default() };
    let name = Path::new(&source.name);
    let (compiled, _) =
        bth_compile::scene::compile(&source.manifest, &source.folder, name, &options, &Silent)?;
    bth::from_bytes(&compiled.bytes).context("a file that was just compiled")
}
