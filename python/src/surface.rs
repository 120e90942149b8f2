//! The surface at hits: positions, normals, texture coordinates, vertex colours, groups, materials
//! and opacity.

use crate::errors::no_geometry;
use crate::numbers::CHUNK;
use crate::output::{numbers, split_off};
use crate::scene::NativeScene;
use bth::rays::{Hit, PrimitiveRef};
use numpy::ndarray::ArrayView1;
use numpy::{PyReadonlyArray1, PyReadwriteArray1};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use std::ops::Range;

/// Points of triangles: barycentric coordinates, instances and triangles.
#[derive(FromPyObject)]
pub(crate) struct PointArrays<'py> {
    #[pyo3(item(0))]
    u: PyReadonlyArray1<'py, f32>,
    #[pyo3(item(1))]
    v: PyReadonlyArray1<'py, f32>,
    #[pyo3(item(2))]
    instance: PyReadonlyArray1<'py, u32>,
    #[pyo3(item(3))]
    triangle: PyReadonlyArray1<'py, u32>,
}

/// Points of triangles that may be shared between threads.
#[derive(Clone, Copy)]
struct Points<'a> {
    u: ArrayView1<'a, f32>,
    v: ArrayView1<'a, f32>,
    instance: ArrayView1<'a, u32>,
    triangle: ArrayView1<'a, u32>,
}

impl PointArrays<'_> {
    fn points(&self) -> PyResult<Points<'_>> {
        let points = Points {
            u: self.u.as_array(),
            v: self.v.as_array(),
            instance: self.instance.as_array(),
            triangle: self.triangle.as_array(),
        };
        let count = points.len();
        match points.u.len() == count && points.v.len() == count && points.triangle.len() == count {
            true => Ok(points),
            false => Err(PyValueError::new_err("u, v, instance and triangle differ in length")),
        }
    }
}

impl Points<'_> {
    fn len(&self) -> usize {
        self.instance.len()
    }

    /// The triangle of a row; `None` where the array says so.
    fn primitive(&self, row: usize) -> Option<PrimitiveRef> {
        let primitive = PrimitiveRef { instance: self.instance[row], triangle: self.triangle[row] };
        (primitive != PrimitiveRef::NONE).then_some(primitive)
    }

    fn hit(&self, row: usize) -> Option<Hit> {
        self.primitive(row).map(|primitive| Hit { t: 0.0, u: self.u[row], v: self.v[row], primitive })
    }

    /// Fails unless the scene has all the triangles and, if it is needed, their geometry.
    fn check(&self, scene: &bth::Scene, needs_geometry: bool) -> PyResult<()> {
        for row in 0..self.len() {
            let Some(PrimitiveRef { instance, triangle }) = self.primitive(row) else { continue };
            if instance >= scene.instance_count() {
                let message = format!("instance {instance} of {}", scene.instance_count());
                return Err(PyIndexError::new_err(message));
            }
            let object = scene.object(scene.object_of(instance));
            if triangle >= object.header.triangles {
                let message = format!("triangle {triangle} of {}", object.header.triangles);
                return Err(PyIndexError::new_err(message));
            }
            if needs_geometry && !object.has_corners() {
                return Err(no_geometry());
            }
        }
        Ok(())
    }
}

/// The arrays that are asked for, each `None` or as long as there are points, times the numbers of
/// one. Their contents remain for points of no triangle, and where the file has nothing to
/// say.
#[derive(FromPyObject)]
pub(crate) struct SurfaceArrays<'py> {
    #[pyo3(item)]
    position: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    object_position: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    geometric_normal: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    object_geometric_normal: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    shading_normal: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    object_shading_normal: Option<PyReadwriteArray1<'py, f64>>,
    #[pyo3(item)]
    texcoord: Option<PyReadwriteArray1<'py, f32>>,
    #[pyo3(item)]
    second_texcoord: Option<PyReadwriteArray1<'py, f32>>,
    #[pyo3(item)]
    vertex_color: Option<PyReadwriteArray1<'py, f32>>,
    #[pyo3(item)]
    object: Option<PyReadwriteArray1<'py, u32>>,
    #[pyo3(item)]
    group: Option<PyReadwriteArray1<'py, u32>>,
    #[pyo3(item)]
    material: Option<PyReadwriteArray1<'py, u32>>,
    #[pyo3(item)]
    opacity: Option<PyReadwriteArray1<'py, u8>>,
}

/// Where the surfaces at some points go.
struct Columns<'a> {
    /// Position, geometric normal and shading normal, each in world space and in the space of the
    /// object.
    vectors: [Option<&'a mut [f64]>; 6],
    texcoord: Option<&'a mut [f32]>,
    second_texcoord: Option<&'a mut [f32]>,
    vertex_color: Option<&'a mut [f32]>,
    /// Object, group and material.
    parts: [Option<&'a mut [u32]>; 3],
    opacity: Option<&'a mut [u8]>,
}

/// An array that is asked for, with `count` numbers.
fn column<'a, T: numpy::Element>(
    array: &'a mut Option<PyReadwriteArray1<'_, T>>,
    count: usize,
) -> PyResult<Option<&'a mut [T]>> {
    array.as_mut().map(|array| numbers(array, count)).transpose()
}

impl SurfaceArrays<'_> {
    fn columns(&mut self, count: usize) -> PyResult<Columns<'_>> {
        Ok(Columns {
            vectors: [
                column(&mut self.position, count * 3)?,
                column(&mut self.object_position, count * 3)?,
                column(&mut self.geometric_normal, count * 3)?,
                column(&mut self.object_geometric_normal, count * 3)?,
                column(&mut self.shading_normal, count * 3)?,
                column(&mut self.object_shading_normal, count * 3)?,
            ],
            texcoord: column(&mut self.texcoord, count * 2)?,
            second_texcoord: column(&mut self.second_texcoord, count * 2)?,
            vertex_color: column(&mut self.vertex_color, count * 4)?,
            parts: [
                column(&mut self.object, count)?,
                column(&mut self.group, count)?,
                column(&mut self.material, count)?,
            ],
            opacity: column(&mut self.opacity, count)?,
        })
    }
}

/// Stores numbers at a row of an array that is asked for.
fn put<T: Copy, const N: usize>(array: &mut Option<&mut [T]>, row: usize, numbers: [T; N]) {
    if let Some(array) = array {
        array[row * N..][..N].copy_from_slice(&numbers);
    }
}

impl<'a> Columns<'a> {
    /// Returns true if what is asked for needs the positions of triangles, or their interpolated
    /// attributes.
    fn needs_surface(&self) -> bool {
        self.texcoord.is_some() || self.vectors.iter().any(Option::is_some)
    }

    /// Splits off the first rows.
    fn split_off(&mut self, rows: usize) -> Columns<'a> {
        Columns {
            vectors: self.vectors.each_mut().map(|v| v.as_mut().map(|v| split_off(v, rows * 3))),
            texcoord: self.texcoord.as_mut().map(|t| split_off(t, rows * 2)),
            second_texcoord: self.second_texcoord.as_mut().map(|t| split_off(t, rows * 2)),
            vertex_color: self.vertex_color.as_mut().map(|c| split_off(c, rows * 4)),
            parts: self.parts.each_mut().map(|p| p.as_mut().map(|p| split_off(p, rows))),
            opacity: self.opacity.as_mut().map(|o| split_off(o, rows)),
        }
    }

    /// Stores the surface at a hit of the scene.
    fn store(&mut self, scene: &bth::Scene, row: usize, hit: &Hit, with_surface: bool) {
        let object = scene.object_of(hit.primitive.instance);
        let group = scene.group_of(object, hit.primitive.triangle);
        let [objects, groups, materials] = &mut self.parts;
        put(objects, row, [object]);
        put(groups, row, [group]);
        if let Some(material) = scene.group_material(object, group) {
            put(materials, row, [material]);
        }
        if let Some(opacity) = &mut self.opacity {
            opacity[row] = scene.opacity(hit) as u8;
        }
        if self.vertex_color.is_some()
            && let Some(color) = scene.vertex_color(hit)
        {
            put(&mut self.vertex_color, row, color);
        }
        if self.second_texcoord.is_some()
            && let Some(uv) = scene.texture_coordinates(hit, 1)
        {
            put(&mut self.second_texcoord, row, uv);
        }
        let Some(surface) = with_surface.then(|| scene.surface(hit)).flatten() else { return };
        let vectors = [
            surface.position,
            surface.object_position,
            surface.geometric_normal,
            surface.object_geometric_normal,
            surface.normal,
            surface.object_normal,
        ];
        self.vectors.iter_mut().zip(vectors).for_each(|(column, vector)| put(column, row, vector));
        if let Some(uv) = surface.uv {
            put(&mut self.texcoord, row, uv);
        }
    }
}

/// The surface at points of triangles, into arrays.
#[pyfunction]
pub(crate) fn surface(
    py: Python<'_>,
    scene: &NativeScene,
    points: PointArrays<'_>,
    mut out: SurfaceArrays<'_>,
    threads: usize,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.points()?);
    let mut columns = out.columns(points.len())?;
    let with_surface = columns.needs_surface();
    crate::work::note_thread(py);
    py.detach(|| points.check(&*scene.read()?, with_surface))?;
    let jobs = crate::output::chunks(points.len(), |rows| columns.split_off(rows));
    scene.run(py, threads, jobs, |scene, (range, mut columns): (Range<usize>, Columns<'_>), _| {
        for (row, point) in range.enumerate() {
            if let Some(hit) = points.hit(point) {
                columns.store(scene, row, &hit, with_surface);
            }
        }
    })
}

/// The vertices of triangles in world space, nine numbers for each, into an array; rows of no
/// triangle are left as they are.
#[pyfunction]
pub(crate) fn triangle_positions(
    py: Python<'_>,
    scene: &NativeScene,
    points: PointArrays<'_>,
    mut out: PyReadwriteArray1<'_, f64>,
    threads: usize,
) -> PyResult<()> {
    let (scene, points) = (scene.get()?, points.points()?);
    crate::work::note_thread(py);
    py.detach(|| points.check(&*scene.read()?, true))?;
    let (rows, _) = numbers(&mut out, points.len() * 9)?.as_chunks_mut::<9>();
    let jobs: Vec<_> = rows.chunks_mut(CHUNK).zip((0..).step_by(CHUNK)).collect();
    scene.run(py, threads, jobs, |scene, (rows, first), _| {
        for (point, row) in (first..).zip(rows) {
            if let Some(corners) = points.primitive(point).and_then(|p| scene.triangle_in_world(p)) {
                row.copy_from_slice(corners.as_flattened());
            }
        }
    })
}
