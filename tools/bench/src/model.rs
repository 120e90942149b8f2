//! The models that are measured: files, folders of recorded rays, or models that `bth-scenes` makes
//! by name.

use crate::rays::recorded;
use anyhow::{Context, Result, anyhow, ensure};
use bth_import::{self, Mesh};
use bth_scenes::{catalogue, write};
use glam::DVec3;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A model, imported.
#[derive(Debug)]
pub struct Model {
    /// File name without folder and extension, or name of the generated model.
    pub name: String,
    /// What the compiler reads.
    pub path: PathBuf,
    /// Positions and triangles; the index of a triangle is its id in every tracer.
    pub mesh: Mesh,
    /// Holds the file of a generated model.
    _folder: Option<TempDir>,
}

impl Model {
    /// Imports a file or the model of a folder of recorded rays, or generates `NAME` or
    /// `NAME:FACES` of `bth-scenes list`.
    ///
    /// # Errors
    /// If there is neither, or the file cannot be imported or has no triangles.
    pub fn load(which: &str) -> Result<Model> {
        let path = Path::new(which);
        if path.exists() {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let file = if path.is_dir() { path.join(recorded::MODEL) } else { path.to_owned() };
            return Self::import(name, file, None);
        }
        let (name, faces) = match which.split_once(':') {
            Some((name, faces)) => (name, Some(faces)),
            None => (which, None),
        };
        let entry = catalogue::find(name)
            .ok_or_else(|| anyhow!("{which}: neither a file nor a model of `bth-scenes list`"))?;
        let faces = match faces {
            Some(text) => text.parse().ok().filter(|f| (1..=catalogue::MAX_FACES).contains(f)),
            None => Some(entry.faces),
        }
        .with_context(|| format!("{which}: expected a number of faces, 1 to {}", catalogue::MAX_FACES))?;
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("model.ply");
        write::file(&(entry.make)(faces), &path)?;
        Self::import(entry.name.to_owned(), path, Some(folder))
    }

    fn import(name: String, path: PathBuf, folder: Option<TempDir>) -> Result<Model> {
        let (mesh, _) = bth_import::import(&path, bth_import::Keep::None, &bth_compile::Silent)?;
        ensure!(!mesh.triangles.is_empty(), "{name}: no triangles");
        Ok(Model { name, path, mesh, _folder: folder })
    }

    /// A model that is in no file.
    pub(crate) fn in_memory(name: &str, mesh: Mesh) -> Model {
        Model { name: name.to_owned(), path: PathBuf::new(), mesh, _folder: None }
    }

    /// The model of a compiled file, with the triangles of its source.
    ///
    /// # Errors
    /// If the file holds a scene, no triangles, or not the triangles of its source.
    pub fn of_compiled(path: &Path, scene: &bth::Scene) -> Result<Model> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let is_scene = scene.description().is_some() || scene.object_count() != 1;
        ensure!(!is_scene, "{}: a compiled scene: expected a compiled model", path.display());
        let object = scene.object(0);
        let is_whole =
            object.header.triangles > 0 && object.triangles.len() == object.header.triangles as usize;
        ensure!(is_whole, "{}: expected the triangles of the source (no --no-geometry)", path.display());
        let (positions, triangles) = (object.positions.to_vec(), object.triangles.to_vec());
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        Ok(Model { name, path: path.to_owned(), mesh, _folder: None })
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.corners(triangle).map(position)
    }

    /// Unit normal of a triangle, on the side from which its corners run counterclockwise; zero if
    /// it has no area.
    pub fn normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Bounding box.
    pub fn bounds(&self) -> Bounds {
        let empty = Bounds { lower: DVec3::INFINITY, upper: DVec3::NEG_INFINITY };
        self.mesh
            .positions
            .iter()
            .map(|p| position(*p))
            .fold(empty, |bounds, p| Bounds { lower: bounds.lower.min(p), upper: bounds.upper.max(p) })
    }
}

/// A position in double precision.
pub fn position(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// An axis-aligned box, object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub lower: DVec3,
    /// Largest corner.
    pub upper: DVec3,
}

impl Bounds {
    /// Its middle.
    pub fn center(&self) -> DVec3 {
        (self.lower + self.upper) * 0.5
    }

    /// Length of its diagonal.
    pub fn diagonal(&self) -> f64 {
        (self.upper - self.lower).length()
    }

    /// Returns true if a point is inside or on it.
    pub fn holds(&self, p: DVec3) -> bool {
        p.cmpge(self.lower).all() && p.cmple(self.upper).all()
    }
}
