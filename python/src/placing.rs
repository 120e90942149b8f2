//! Moving, adding, hiding and removing of instances, and adding of objects.

use crate::errors::{check_index, format_error};
use crate::scene::NativeScene;
use crate::state::{Matrix, Placed, flat};
use bth_format::Error;
use bth_format::layout::NONE;
use numpy::{PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// One matrix for each of `count` rows.
fn matrices(transforms: &PyReadonlyArray3<'_, f64>, count: usize) -> PyResult<Vec<Matrix>> {
    if transforms.shape() != [count, 3, 4] {
        return Err(PyValueError::new_err("expected a 3×4 matrix for each instance"));
    }
    let (rows, _) = transforms.as_slice()?.as_chunks::<12>();
    Ok(rows.to_vec())
}

/// Changes instances of a scene. Nothing is changed if that fails.
fn change<T: Send>(
    py: Python<'_>,
    scene: &NativeScene,
    instances: &[u32],
    change: impl FnOnce(&mut Placed) -> Result<T, Error> + Send,
) -> PyResult<T> {
    scene.get()?.change(py, |scene| {
        if let Some(missing) = instances.iter().find(|id| !scene.has(**id)) {
            let message = format!("instance {missing} of {}, or it was removed", scene.instance_count());
            return Err(PyIndexError::new_err(message));
        }
        if scene.has_groups() {
            let message = "this scene has groups, whose instances are not moved one by one (hint: bth.SceneBuilder of \
                Rust or C moves them)";
            return Err(PyValueError::new_err(message));
        }
        if scene.is_animated() {
            let message = "the tracks of its file move this scene (hint: compile it with animation=\"none\")";
            return Err(PyValueError::new_err(message));
        }
        scene.placed().and_then(change).map_err(|e| format_error(&e))
    })?
}

/// Moves instances.
#[pyfunction]
pub(crate) fn set_transforms(
    py: Python<'_>,
    scene: &NativeScene,
    instances: PyReadonlyArray1<'_, u32>,
    transforms: PyReadonlyArray3<'_, f64>,
) -> PyResult<()> {
    let (instances, new) = (instances.as_slice()?.to_vec(), matrices(&transforms, instances.len())?);
    change(py, scene, &instances, |placed| {
        let scene = placed.builder.scene();
        let old: Vec<Matrix> = instances.iter().map(|id| flat(&scene.instance(*id).to_world)).collect();
        placed.builder.set_transforms(&instances, &new)?;
        placed.commit(|builder| builder.set_transforms(&instances, &old))
    })
}

/// Adds the objects of another scene, without instances; returns the range of their indices.
#[pyfunction]
pub(crate) fn add_objects(py: Python<'_>, scene: &NativeScene, other: &NativeScene) -> PyResult<(u32, u32)> {
    // The two scenes are not held at once: two threads that add them to each other would wait for
    // ever.
    let added = other.with(py, |other| {
        if other.is_animated() {
            let message =
                "the tracks of its file move the added scene (hint: compile it with animation=\"none\")";
            return Err(PyValueError::new_err(message));
        }
        let mut added = bth::SceneBuilder::new();
        added.add(other);
        Ok(added)
    })??;
    change(py, scene, &[], |placed| {
        let first = placed.builder.add(added.scene());
        Ok((first, placed.builder.scene().object_count()))
    })
}

/// The files of the objects that were added to a scene, once for each time, in this order.
#[pyfunction]
pub(crate) fn added_files<'py>(py: Python<'py>, scene: &NativeScene) -> PyResult<Vec<Bound<'py, PyBytes>>> {
    let scene = scene.get()?;
    let read = scene.read_attached(py)?;
    let added = read.file().object_count()..read.object_count();
    let files = added.map(|object| read.file_of(object)).filter(|(_, row)| *row == 0);
    Ok(files.map(|(file, _)| PyBytes::new(py, file.bytes())).collect())
}

/// Adds instances of objects; returns their ids.
#[pyfunction]
pub(crate) fn add_instances(
    py: Python<'_>,
    scene: &NativeScene,
    objects: PyReadonlyArray1<'_, u32>,
    transforms: PyReadonlyArray3<'_, f64>,
) -> PyResult<Vec<u32>> {
    let (objects, new) = (objects.as_slice()?.to_vec(), matrices(&transforms, objects.len())?);
    scene.with(py, |scene| {
        objects.iter().try_for_each(|object| check_index("object", *object, scene.object_count()))
    })??;
    change(py, scene, &[], |placed| {
        let mut ids = Vec::new();
        let added = objects.iter().zip(&new).try_for_each(|(object, transform)| {
            ids.push(placed.builder.instance(*object, transform)?);
            Ok(())
        });
        let remove = |builder: &mut bth::SceneBuilder| ids.iter().try_for_each(|id| builder.remove(*id));
        if let Err(error) = added {
            remove(&mut placed.builder)?;
            placed.builder.commit()?;
            return Err(error);
        }
        placed.commit(remove)?;
        for &id in &ids {
            placed.nodes.resize(placed.nodes.len().max(id as usize + 1), NONE);
            placed.nodes[id as usize] = NONE;
        }
        Ok(ids)
    })
}

/// Removes instances.
#[pyfunction]
pub(crate) fn remove_instances(
    py: Python<'_>,
    scene: &NativeScene,
    instances: PyReadonlyArray1<'_, u32>,
) -> PyResult<()> {
    let mut instances = instances.as_slice()?.to_vec();
    instances.sort_unstable();
    instances.dedup();
    change(py, scene, &instances, |placed| {
        instances.iter().try_for_each(|id| placed.builder.remove(*id))?;
        instances.iter().for_each(|id| placed.nodes[*id as usize] = NONE);
        placed.commit(|_| Ok(()))
    })
}

/// Shows or hides instances.
#[pyfunction]
pub(crate) fn set_visible(
    py: Python<'_>,
    scene: &NativeScene,
    instances: PyReadonlyArray1<'_, u32>,
    visible: PyReadonlyArray1<'_, bool>,
) -> PyResult<()> {
    let (instances, new) = (instances.as_slice()?.to_vec(), visible.as_slice()?.to_vec());
    if instances.len() != new.len() {
        return Err(PyValueError::new_err("expected a truth value for each instance"));
    }
    change(py, scene, &instances, |placed| {
        let scene = placed.builder.scene();
        let old: Vec<bool> = instances.iter().map(|id| scene.instance(*id).visible).collect();
        let set = |builder: &mut bth::SceneBuilder, all: &[bool]| {
            instances.iter().zip(all).try_for_each(|(id, visible)| builder.set_visible(*id, *visible))
        };
        set(&mut placed.builder, &new)?;
        placed.commit(|builder| set(builder, &old))
    })
}
