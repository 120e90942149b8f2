//! The class of scenes: opening, closing, what a scene consists of, and its time.

use crate::errors::{check_index, format_error, no_geometry, write_error};
use crate::shared::{Handle, OpenScene};
use crate::state::State;
use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::Arc;

/// A scene that is open until it is closed or freed.
#[pyclass(frozen, module = "bth._native", name = "Scene")]
pub(crate) struct NativeScene(pub(crate) Handle);

/// Opens a compiled file. `mapped` maps it instead of reading it, and checks less.
#[pyfunction]
pub(crate) fn open(py: Python<'_>, path: PathBuf, mapped: bool) -> PyResult<NativeScene> {
    let scene = py.detach(|| if mapped { map(&path) } else { bth::open(&path) });
    scene.map(NativeScene::new).map_err(|e| format_error(&e))
}

#[allow(unsafe_code)]
fn map(path: &std::path::Path) -> Result<bth::Scene, bth::Error> {
    // SAFETY: the documentation of `bth.open` passes the requirement that nobody changes the file
    // on to the caller, who has to ask for mapping.
    unsafe { bth::map(path) }
}

/// Opens the bytes of a compiled file.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, bytes: &[u8]) -> PyResult<NativeScene> {
    let scene = py.detach(|| bth::from_bytes(bytes));
    scene.map(NativeScene::new).map_err(|e| format_error(&e))
}

impl NativeScene {
    pub(crate) fn new(scene: bth::Scene) -> NativeScene {
        NativeScene(Handle::new(scene))
    }

    /// Calls `read` with the scene and without the interpreter's lock.
    pub(crate) fn with<T: Send>(&self, py: Python<'_>, read: impl FnOnce(&State) -> T + Send) -> PyResult<T> {
        let scene = self.0.get()?;
        crate::work::note_thread(py);
        py.detach(|| Ok(read(&*scene.read()?)))
    }

    pub(crate) fn get(&self) -> PyResult<Arc<OpenScene>> {
        self.0.get()
    }
}

/// Transforms, objects and visibility of instances.
type Placements<'py> = (Bound<'py, PyArray3<f64>>, Vec<u32>, Vec<bool>);

/// Positions and triangles.
type Geometry<'py> = (Bound<'py, PyAny>, Bound<'py, PyArray2<u32>>);

#[pymethods]
impl NativeScene {
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.0.close());
    }

    #[getter]
    fn closed(&self) -> bool {
        self.0.is_closed()
    }

    /// The bytes of the compiled file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let scene = self.get()?;
        let read = scene.read_attached(py)?;
        Ok(PyBytes::new(py, read.file().bytes()))
    }

    /// Writes the compiled file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let write = |scene: &State| bth_files::replace(&path, |file| file.write_all(scene.file().bytes()));
        self.with(py, write)?.map_err(|error| write_error(&path, &error))
    }

    /// Counts and facts.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (file_bytes, resident, objects, instances, mapped, id, triangles, frames) =
            self.with(py, |scene| {
                let triangles: Vec<u32> =
                    (0..scene.object_count()).map(|o| scene.object(o).header.triangles).collect();
                let frames = scene
                    .file()
                    .scene()
                    .map(|d| (d.scene[0].first_frame, d.scene[0].last_frame, d.scene[0].rate));
                (
                    scene.file().bytes().len(),
                    scene.resident_bytes(),
                    scene.object_count(),
                    scene.instance_count(),
                    scene.file().is_mapped(),
                    scene.file().content_id(),
                    triangles,
                    frames,
                )
            })?;
        let facts = PyDict::new(py);
        facts.set_item("file_bytes", file_bytes)?;
        facts.set_item("resident_bytes", resident)?;
        facts.set_item("objects", objects)?;
        facts.set_item("instances", instances)?;
        facts.set_item("mapped", mapped)?;
        facts.set_item("content_id", PyBytes::new(py, &id))?;
        facts.set_item("triangles", triangles)?;
        facts.set_item("frames", frames)?;
        Ok(facts)
    }

    fn seconds(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |scene| scene.seconds())
    }

    /// Sets the time.
    fn set_seconds(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let updated = self.get()?.change(py, |scene| scene.set_seconds(seconds))?;
        updated.map_err(|e| format_error(&e))
    }

    /// True if Python has placed instances.
    #[getter]
    fn placed(&self, py: Python<'_>) -> PyResult<bool> {
        self.with(py, |scene| scene.is_placed())
    }

    /// True if an object's surface has no boundary; `None` where the file has no triangles.
    fn is_closed(&self, py: Python<'_>, object: u32) -> PyResult<Option<bool>> {
        self.with(py, |scene| {
            check_index("object", object, scene.object_count())?;
            Ok(scene.is_closed(object))
        })?
    }

    /// Number of vertices of an object that can be given new positions.
    fn vertex_count(&self, py: Python<'_>, object: u32) -> PyResult<Option<usize>> {
        self.with(py, |scene| {
            check_index("object", object, scene.object_count())?;
            Ok(scene.vertex_count(object))
        })?
    }

    /// Gives an object new positions, rows of three; returns the expected cost of rays relative to
    /// the cost in the compiled pose.
    fn set_positions(
        &self,
        py: Python<'_>,
        object: u32,
        positions: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<f64> {
        let (rows, _) = positions.as_slice()?.as_chunks::<3>();
        let rows = rows.to_vec();
        self.get()?.change(py, |scene| {
            check_index("object", object, scene.object_count())?;
            scene.set_positions(object, &rows).map_err(|e| format_error(&e))
        })?
    }

    /// As `set_positions`, at a share of the way from `open` to `close`.
    fn set_positions_between(
        &self,
        py: Python<'_>,
        object: u32,
        open: PyReadonlyArray2<'_, f32>,
        close: PyReadonlyArray2<'_, f32>,
        share: f64,
    ) -> PyResult<f64> {
        let [open, close] =
            [open.as_slice()?, close.as_slice()?].map(|rows| rows.as_chunks::<3>().0.to_vec());
        self.get()?.change(py, |scene| {
            check_index("object", object, scene.object_count())?;
            scene.set_positions_between(object, [&open, &close], share).map_err(|e| format_error(&e))
        })?
    }

    /// Indices of the objects whose positions differ from the file.
    fn deformed(&self, py: Python<'_>) -> PyResult<Vec<u32>> {
        self.with(py, |scene| scene.deformed().collect())
    }

    /// For each instance the 3×4 matrix that transforms its object's space to world space, its
    /// object, and whether it is visible.
    fn placements<'py>(&self, py: Python<'py>) -> PyResult<Placements<'py>> {
        let (matrices, objects, visible) = self.with(py, |scene| {
            let count = scene.instance_count();
            let mut matrices = Array3::zeros((count as usize, 3, 4));
            let (mut objects, mut visible) = (Vec::new(), Vec::new());
            for i in 0..count {
                let view = scene.instance(i);
                for (row, numbers) in view.to_world.iter().enumerate() {
                    for (column, number) in numbers.iter().enumerate() {
                        matrices[[i as usize, row, column]] = *number;
                    }
                }
                objects.push(view.object);
                visible.push(view.visible);
            }
            (matrices, objects, visible)
        })?;
        Ok((matrices.into_pyarray(py), objects, visible))
    }

    /// Lower and upper end of a box that contains all visible instances.
    fn bounds(&self, py: Python<'_>) -> PyResult<Option<bth::Bounds>> {
        self.with(py, |scene| scene.bounds())
    }

    /// Lower and upper end of a box in world space that contains an instance, if it is visible.
    fn instance_bounds(&self, py: Python<'_>, instance: u32) -> PyResult<Option<bth::Bounds>> {
        self.with(py, |scene| {
            check_index("instance", instance, scene.instance_count())?;
            Ok(scene.instance_bounds(instance))
        })?
    }

    /// The rows on the way to an instance, that in the world first.
    fn instance_path(&self, py: Python<'_>, instance: u32) -> PyResult<Vec<u32>> {
        self.with(py, |scene| {
            check_index("instance", instance, scene.instance_count())?;
            Ok(scene.instance_path(instance).to_vec())
        })?
    }

    /// Lower and upper end of a box of an object in its own space, if anything of it can be hit.
    fn object_bounds(&self, py: Python<'_>, object: u32) -> PyResult<Option<bth::Bounds>> {
        self.with(py, |scene| {
            check_index("object", object, scene.object_count())?;
            Ok(scene.object_bounds(object))
        })?
    }

    /// Positions, in f32 or f64 as the file has them, and triangles of an object, if it has them.
    fn geometry<'py>(&self, py: Python<'py>, object: u32) -> PyResult<Geometry<'py>> {
        let (single, double, triangles) = self.with(py, |scene| {
            check_index("object", object, scene.object_count())?;
            let view = scene.object(object);
            if view.triangles.is_empty() && view.header.triangles > 0 {
                return Err(no_geometry());
            }
            let double = (!view.exact.is_empty()).then(|| rows(view.exact.positions()));
            let single = if double.is_some() { &[] } else { view.positions };
            Ok((rows(single), double, rows(view.triangles)))
        })??;
        let positions = match double {
            Some(double) => double.into_pyarray(py).into_any(),
            None => single.into_pyarray(py).into_any(),
        };
        Ok((positions, triangles.into_pyarray(py)))
    }
}

/// A copy of rows of three numbers.
fn rows<T: Copy>(rows: &[[T; 3]]) -> Array2<T> {
    Array2::from_shape_vec((rows.len(), 3), rows.as_flattened().to_vec()).expect("three a row")
}
