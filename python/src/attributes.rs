//! Shading attributes of objects that a file keeps.

use crate::scene::NativeScene;
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

/// Texture coordinates of the corners of an object's triangles, (triangles, 3, 2) as the source has
/// them; `None` where the file keeps none.
#[pyfunction]
pub(crate) fn texture_coordinates<'py>(
    py: Python<'py>,
    scene: &NativeScene,
    object: u32,
) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
    let scene = scene.get()?;
    crate::work::note_thread(py);
    let corners = py.detach(|| {
        let scene = scene.read()?;
        if object >= scene.object_count() {
            return Err(PyIndexError::new_err(format!("object {object} of {}", scene.object_count())));
        }
        let view = scene.object(object);
        if view.uvs.is_empty() || view.corners.is_empty() {
            return Ok(None);
        }
        let at = |(triangle, corner, axis): (usize, usize, usize)| {
            view.uvs[view.corners[triangle][corner] as usize][axis]
        };
        Ok(Some(Array3::from_shape_fn((view.corners.len(), 3, 2), at)))
    })?;
    Ok(corners.map(|corners| corners.into_pyarray(py)))
}
