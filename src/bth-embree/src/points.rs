//! Point queries: the program is shown the primitives near a point, and shrinks the radius.
#![allow(unsafe_code)] // Calls functions of the program, whose structures it points to.

use crate::abi::*;
use crate::committed::Committed;
use crate::fallback::has_instance_arrays;
use crate::float_mode::ExactMode;
use crate::handles::Shared;
use crate::scene::Scene;
use crate::statistics::{Kind, Who, counted};
use crate::world::Place;
use bth::rays::PrimitiveRef;
use std::ffi::c_void;

/// A point query as the program makes it.
#[derive(Clone, Copy)]
pub(crate) struct Asked {
    pub(crate) query: *mut PointQuery,
    pub(crate) context: *mut PointQueryContext,
    pub(crate) function: Option<PointQueryFunction>,
    pub(crate) user: *mut c_void,
}

/// Shows the primitives near a point; returns true if the program changed the radius.
///
/// The closest triangle is shown first. The program then most often shrinks the radius to its
/// distance, so that few others are left.
///
/// # Safety
/// The structures are as the documentation of `rtcPointQuery` asks.
pub(crate) unsafe fn query(scene: &Shared<Scene>, asked: Asked) -> bool {
    let Some(committed) = scene.committed() else { return false };
    // SAFETY: the contract is the same.
    let changed = counted(Kind::PointQueries, Who::Bth, 1, || unsafe { in_own(committed, asked) });
    if committed.rest.0.is_null() {
        return changed;
    }
    let more = counted(Kind::PointQueries, Who::Fallback, 1, || {
        let Some(fallback) = &scene.device.fallback else { return false };
        let Asked { query, context, function, user } = asked;
        // SAFETY: the scene of the other library lives; the structures are as it asks.
        unsafe { (fallback.functions.rtcPointQuery)(committed.rest.0, query, context, function, user) }
    });
    changed || more
}

/// Shows the primitives that bth holds.
///
/// # Safety
/// The contract of [`query`].
unsafe fn in_own(committed: &Committed, asked: Asked) -> bool {
    let scene = match &committed.world {
        Some(world) => &world.scene,
        None => match &committed.own.scene {
            Some(scene) => scene,
            None => return false,
        },
    };
    let mode = ExactMode::enter();
    // SAFETY: by contract the query is valid; the program may write to it during its function only.
    let (point, radius) = unsafe { ((*asked.query).point, || (*asked.query).radius) };
    let Some(closest) = scene.closest(point, radius()) else { return false };
    let mut shown = Vec::new();
    // SAFETY: the contract is the same.
    let mut changed = mode.outside(|| unsafe { show(committed, closest.primitive, asked, &mut shown) });
    let mut near = Vec::new();
    scene.triangles_in_sphere(point, radius(), &mut near);
    for primitive in near {
        // SAFETY: the contract is the same.
        changed |= mode.outside(|| unsafe { show(committed, primitive, asked, &mut shown) });
    }
    changed
}

/// Shows the primitive of a triangle, unless it was shown.
///
/// # Safety
/// The contract of [`query`].
unsafe fn show(
    committed: &Committed,
    triangle: PrimitiveRef,
    asked: Asked,
    shown: &mut Vec<(u32, u32, u32)>,
) -> bool {
    let place = committed.world.as_ref().map(|world| &world.places[triangle.instance as usize]);
    let mesh = place.map_or(&committed.own, |place| &place.mesh);
    let surface = mesh.surface(triangle.triangle, 0.0, 0.0);
    let name = (triangle.instance, surface.part.id, surface.primitive);
    // The triangles of a quad or a cell follow each other; the first may come again.
    if shown.first() == Some(&name) || shown.last() == Some(&name) {
        return false;
    }
    shown.truncate(1);
    shown.push(name);
    let place = place.filter(|place| place.instance != INVALID_ID);
    // SAFETY: by contract the context is valid or null.
    let similarity = unsafe { enter(asked.context, place) };
    let mut arguments = PointQueryArguments {
        query: asked.query,
        user: asked.user,
        primitive: surface.primitive,
        geometry: surface.part.id,
        context: asked.context,
        similarity,
    };
    let own = surface.part.geometry.point_query.get();
    // SAFETY: it is null or a function of this kind, which the program set.
    let own = unsafe { std::mem::transmute::<*const c_void, Option<PointQueryFunction>>(own) };
    let mut changed = false;
    for function in asked.function.into_iter().chain(own) {
        // SAFETY: the function is the program's and is called as documented.
        changed |= unsafe { function(&mut arguments) };
    }
    // SAFETY: as above.
    unsafe { enter(asked.context, None) };
    changed
}

/// Writes the instance to the context; returns the factor of lengths if its transform is a
/// similarity, else 0.
///
/// # Safety
/// The context is valid, or null.
unsafe fn enter(context: *mut PointQueryContext, place: Option<&Place>) -> f32 {
    let stack_size = usize::from(has_instance_arrays());
    // SAFETY: by contract it is valid or null.
    let Some(context) = (unsafe { context.as_mut() }) else { return 1.0 };
    let Some(place) = place else {
        context.instance = INVALID_ID;
        context.rest[0] = INVALID_ID;
        context.rest[stack_size] = 0;
        return 1.0;
    };
    context.instance = place.instance;
    context.rest[0] = place.instance_primitive;
    context.rest[stack_size] = 1;
    let (to_instance, similarity) = inverse(&place.to_world);
    context.to_world = columns(&place.to_world);
    context.to_instance = columns(&to_instance);
    similarity
}

/// The 16 numbers of a matrix by columns.
fn columns(rows: &[f32; 12]) -> [f32; 16] {
    std::array::from_fn(|i| match (i % 4, i / 4) {
        (3, column) => f32::from(u8::from(column == 3)),
        (row, column) => rows[4 * row + column],
    })
}

/// How far the columns of a similarity may be from orthogonal and from equal lengths, relative to
/// the largest square of a length: four units in the last place of f32, since a rotation that is
/// rounded to f32 is off by less.
const SIMILARITY_ERROR: f64 = 4.0 * f32::EPSILON as f64;

/// The inverse of a transform in f64, rounded, and its factor of lengths if it is a similarity as
/// far as f32 can tell, else 0.
fn inverse(rows: &[f32; 12]) -> ([f32; 12], f32) {
    let m = rows.map(f64::from);
    let column = |k: usize| [m[k], m[4 + k], m[8 + k]];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let [x, y, z, origin] = [0, 1, 2, 3].map(column);
    let determinant = dot(x, cross(y, z));
    let linear = [cross(y, z), cross(z, x), cross(x, y)].map(|row| row.map(|v| v / determinant));
    let mut inverse = [0.0; 12];
    for row in 0..3 {
        for k in 0..3 {
            inverse[4 * row + k] = linear[row][k] as f32;
        }
        inverse[4 * row + 3] = -dot(linear[row], origin) as f32;
    }
    let squares = [x, y, z].map(|v| dot(v, v));
    let tolerance = SIMILARITY_ERROR * squares[0].max(squares[1]).max(squares[2]);
    let is_similarity = [dot(x, y), dot(y, z), dot(z, x), squares[0] - squares[1], squares[1] - squares[2]]
        .iter()
        .all(|difference| difference.abs() <= tolerance);
    (inverse, if is_similarity { (1.0 / squares[0].sqrt()) as f32 } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_a_similarity_has_its_factor() {
        let (found, similarity) = inverse(&[0.0, -2.0, 0.0, 3.0, 2.0, 0.0, 0.0, 4.0, 0.0, 0.0, 2.0, 5.0]);
        assert_eq!(found, [0.0, 0.5, 0.0, -2.0, -0.5, 0.0, 0.0, 1.5, 0.0, 0.0, 0.5, -2.5]);
        assert_eq!(similarity, 0.5);
        let sheared = [1.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        assert_eq!(inverse(&sheared).1, 0.0);
    }
}
