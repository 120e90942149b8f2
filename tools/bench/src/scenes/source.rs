//! Scenes to measure: our own animations by name, manifests, and glTF files.

use crate::structures::Compiled;
use anyhow::{Context, Result};
use bth_compile::Silent;
use bth_compile::pipeline::CompileOptions;
use bth_import::gltf::scene::ImportOptions;
use bth_random::Rng;
use bth_scene::Manifest;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A manifest, and the folder of its models.
pub(crate) struct Source {
    /// Name without folder and extension.
    pub(crate) name: String,
    pub(crate) manifest: Manifest,
    /// The folder of the manifest's paths.
    pub(crate) folder: PathBuf,
    /// Keeps the files of a generated scene until the end.
    _models: Option<tempfile::TempDir>,
}

impl Source {
    /// Makes a scene of `bth-scenes list`, `objects:N` or `instances:N`, or reads a manifest or
    /// glTF file.
    pub(crate) fn load(name: &str) -> Result<Source> {
        let count = |text: &str| text.parse().with_context(|| format!("{name}: expected a number"));
        if let Some(text) = name.strip_prefix("objects:") {
            return Source::objects(count(text)?);
        }
        if let Some(text) = name.strip_prefix("instances:") {
            return Source::instances(count(text)?);
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

    /// A scene of objects of different shapes, in rows.
    fn objects(count: u32) -> Result<Source> {
        let (folder, mut text) = (tempfile::tempdir()?, String::from("version = 1\n"));
        let mut model = bth_scenes::blob::blob(800);
        for i in 0..count {
            model.positions.iter_mut().for_each(|p| p[0] *= 1.0 + 1.0 / 1024.0);
            bth_scenes::write::file(&model, &folder.path().join(format!("{i}.ply")))?;
            let place = [3 * (i % 40), 0, 3 * (i / 40)];
            writeln!(text, "[[objects]]\nname = \"o{i}\"\nmodel = \"{i}.ply\"")?;
            writeln!(text, "[[nodes]]\nname = \"n{i}\"\nobject = \"o{i}\"\ntranslation = {place:?}")?;
        }
        Source::parsed(format!("{count} objects"), &text, folder)
    }

    /// A scene of instances of one small object that drift through a cube with room for eight times
    /// as many.
    fn instances(count: u32) -> Result<Source> {
        let folder = tempfile::tempdir()?;
        bth_scenes::write::file(&bth_scenes::blob::blob(80), &folder.path().join("blob.ply"))?;
        let mut text = String::from(
            "version = 1\nframes = { first = 0, last = 24, rate = 24 }\n\
             [[objects]]\nname = \"blob\"\nmodel = \"blob.ply\"\n",
        );
        let (mut rng, side) = (Rng::new(1), 2.0 * f64::from(count).cbrt());
        for i in 0..count {
            let from = [(); 3].map(|()| rng.unit_f64() * side);
            let to = from.map(|x| x + rng.unit_f64() - 0.5);
            writeln!(text, "[[nodes]]\nname = \"n{i}\"\nobject = \"blob\"")?;
            writeln!(text, "[[tracks]]\nnode = \"n{i}\"\nproperty = \"translation\"")?;
            writeln!(text, "times = [0, 1]\nvalues = [{from:?}, {to:?}]")?;
        }
        Source::parsed(format!("{count} instances"), &text, folder)
    }

    /// A scene of a manifest's text; `folder` has its models.
    fn parsed(name: String, text: &str, folder: tempfile::TempDir) -> Result<Source> {
        let manifest = bth_scene::parse(text, &folder.path().join("scene.manifest"))?;
        Ok(Source { name, manifest, folder: folder.path().into(), _models: Some(folder) })
    }

    /// Compiles the scene.
    pub(crate) fn compile(&self, options: &CompileOptions) -> Result<Compiled> {
        let (start, name) = (Instant::now(), Path::new(&self.name));
        let (compiled, _) =
            bth_compile::scene::compile(&self.manifest, &self.folder, name, options, &Silent)?;
        Ok(Compiled { bytes: compiled.bytes, seconds: start.elapsed().as_secs_f64() })
    }

    /// At most `count` frames, evenly spread over the range of the manifest.
    pub(crate) fn frames(&self, count: usize) -> Vec<i32> {
        let range = &self.manifest.frames;
        let (first, last) = (i64::from(range.first), i64::from(range.last));
        let count = (count as i64).min(last - first + 1);
        (0..count).map(|i| (first + (last - first) * (2 * i + 1) / (2 * count)) as i32).collect()
    }
}
