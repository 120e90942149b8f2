//! The parts of a scene (instances, and the objects' groups and materials): their names and masks.

use crate::errors::{check_index, format_error};
use crate::scene::NativeScene;
use pyo3::prelude::*;

/// Names of objects; empty for those that have none.
#[pyfunction]
pub(crate) fn object_names(py: Python<'_>, scene: &NativeScene) -> PyResult<Vec<String>> {
    scene.with(py, |scene| (0..scene.object_count()).map(|o| scene.object_name(o).to_owned()).collect())
}

/// For each instance the name of its node; empty for those that have none.
#[pyfunction]
pub(crate) fn instance_names(py: Python<'_>, scene: &NativeScene) -> PyResult<Vec<String>> {
    scene.with(py, |scene| {
        (0..scene.instance_count()).map(|instance| scene.instance_name(instance).to_owned()).collect()
    })
}

/// Names of an object's groups, for each of them the index of its material, and names of the
/// object's materials.
#[pyfunction]
pub(crate) fn groups(
    py: Python<'_>,
    scene: &NativeScene,
    object: u32,
) -> PyResult<(Vec<String>, Vec<Option<u32>>, Vec<String>)> {
    scene.with(py, |scene| {
        check_index("object", object, scene.object_count())?;
        let groups = 0..scene.group_count(object);
        let names = groups.clone().map(|g| scene.group_name(object, g).to_owned()).collect();
        let materials = groups.map(|g| scene.group_material(object, g)).collect();
        let material_names =
            (0..scene.material_count(object)).map(|m| scene.material_name(object, m).to_owned()).collect();
        Ok((names, materials, material_names))
    })?
}

/// Masks of all instances, with groups of all rows.
#[pyfunction]
pub(crate) fn instance_masks(py: Python<'_>, scene: &NativeScene) -> PyResult<Vec<u32>> {
    scene.with(py, |scene| (0..scene.row_count()).map(|i| scene.instance_mask(i)).collect())
}

/// Masks of all groups of an object.
#[pyfunction]
pub(crate) fn group_masks(py: Python<'_>, scene: &NativeScene, object: u32) -> PyResult<Vec<u32>> {
    scene.with(py, |scene| {
        check_index("object", object, scene.object_count())?;
        Ok((0..scene.group_count(object)).map(|g| scene.group_mask(object, g)).collect())
    })?
}

/// Sets the mask of an instance.
#[pyfunction]
pub(crate) fn set_instance_mask(
    py: Python<'_>,
    scene: &NativeScene,
    instance: u32,
    mask: u32,
) -> PyResult<()> {
    scene.get()?.change(py, |scene| {
        check_index("instance", instance, scene.row_count())?;
        scene.set_instance_mask(instance, mask).map_err(|e| format_error(&e))
    })?
}

/// Sets the mask of some groups of an object, or of none if one of them does not exist.
#[pyfunction]
pub(crate) fn set_group_masks(
    py: Python<'_>,
    scene: &NativeScene,
    object: u32,
    groups: Vec<u32>,
    mask: u32,
) -> PyResult<()> {
    scene.get()?.change(py, |scene| {
        check_index("object", object, scene.object_count())?;
        let count = scene.group_count(object);
        groups.iter().try_for_each(|&group| check_index("group", group, count))?;
        let mut set = |&group: &u32| scene.set_group_mask(object, group, mask);
        groups.iter().try_for_each(&mut set).map_err(|e| format_error(&e))
    })?
}

/// Masks that lack a bit: pairs (instance, mask), and triples (object, group, mask).
type Masks = (Vec<(u32, u32)>, Vec<(u32, u32, u32)>);

/// The masks that are not the default, for [`set_masks`].
#[pyfunction]
pub(crate) fn masks(py: Python<'_>, scene: &NativeScene) -> PyResult<Masks> {
    scene.with(py, |scene| {
        let instances = (0..scene.row_count()).map(|i| (i, scene.instance_mask(i)));
        let groups = (0..scene.object_count()).flat_map(|object| {
            (0..scene.group_count(object)).map(move |group| (object, group, scene.group_mask(object, group)))
        });
        (
            instances.filter(|(_, mask)| *mask != u32::MAX).collect(),
            groups.filter(|(.., mask)| *mask != u32::MAX).collect(),
        )
    })
}

/// Sets masks, as [`masks`] returns them.
#[pyfunction]
pub(crate) fn set_masks(py: Python<'_>, scene: &NativeScene, masks: Masks) -> PyResult<()> {
    let (instances, groups) = masks;
    scene.get()?.change(py, |scene| {
        for (instance, mask) in instances {
            check_index("instance", instance, scene.row_count())?;
            scene.set_instance_mask(instance, mask).map_err(|e| format_error(&e))?;
        }
        for (object, group, mask) in groups {
            check_index("object", object, scene.object_count())?;
            check_index("group", group, scene.group_count(object))?;
            scene.set_group_mask(object, group, mask).map_err(|e| format_error(&e))?;
        }
        Ok(())
    })?
}
