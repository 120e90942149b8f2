//! Interpolation of what vertices have, over triangles, quads and grids.
#![allow(unsafe_code)] // Reads buffers and writes arrays of the program.

use crate::abi::*;
use crate::buffer::View;
use crate::geometry::Geometry;

/// A point of a triangle of vertices, and how its coordinates there change with the coordinates in
/// the primitive.
struct Point {
    corners: [usize; 3],
    u: f32,
    v: f32,
    /// Derivatives of u and v of the triangle by u and v of the primitive.
    scale: [f32; 2],
}

/// Interpolates for one point. The derivatives of second order are 0.
///
/// # Safety
/// The structure and its arrays are as the documentation of `rtcInterpolate` asks.
pub(crate) unsafe fn interpolate(geometry: &Geometry, arguments: &InterpolateArguments) {
    let state = geometry.state();
    let source = state.view(arguments.buffer, arguments.slot);
    let items = state.view(if geometry.kind == GRID { BUFFER_GRID } else { BUFFER_INDEX }, 0);
    let (Some(source), Some(items)) = (source, items) else { return };
    let row = arguments.primitive as usize;
    if row >= items.count {
        return;
    }
    // SAFETY: the row exists, and it has the words of its format.
    let point = unsafe { point(geometry.kind, items, row, arguments.u, arguments.v) };
    let Point { corners: [a, b, c], u, v, scale } = point;
    if [a, b, c].iter().any(|corner| *corner >= source.count) {
        return;
    }
    let [value, by_u, by_v, second @ ..] = arguments.out;
    let store = |array: *mut f32, i: usize, number: f32| {
        if !array.is_null() {
            // SAFETY: by contract the array has this element.
            unsafe { *array.add(i) = number };
        }
    };
    for i in 0..arguments.count as usize {
        let [a, b, c] = [a, b, c].map(|corner| source.float(corner, i));
        store(value, i, (1.0 - u - v) * a + u * b + v * c);
        store(by_u, i, scale[0] * (b - a));
        store(by_v, i, scale[1] * (c - a));
        second.iter().for_each(|array| store(*array, i, 0.0));
    }
}

/// The triangle at a point of a primitive.
///
/// # Safety
/// The row exists, and the buffer has the format that the kind of geometry asks for.
unsafe fn point(kind: u32, items: &View, row: usize, u: f32, v: f32) -> Point {
    if kind == TRIANGLE {
        // SAFETY: by contract the row exists and has three words.
        let corners = unsafe { items.words::<3>(row) }.map(|corner| corner as usize);
        return Point { corners, u, v, scale: [1.0; 2] };
    }
    let (quad, u, v, size) = if kind == QUAD {
        // SAFETY: by contract the row exists and has four words.
        (unsafe { items.words::<4>(row) }.map(|corner| corner as usize), u, v, [1.0; 2])
    } else {
        // SAFETY: by contract the row exists and has three words.
        let [start, stride, size] = unsafe { items.words::<3>(row) }.map(|word| word as usize);
        let cells = [(size & 0xFFFF).max(2) - 1, (size >> 16).max(2) - 1];
        let place = |x: f32, cells: usize| {
            let x = x.clamp(0.0, 1.0) * cells as f32;
            let cell = (x as usize).min(cells - 1);
            (cell, x - cell as f32)
        };
        let ((x, u), (y, v)) = (place(u, cells[0]), place(v, cells[1]));
        let first = start + stride * y + x;
        let quad = [first, first + 1, first + stride + 1, first + stride];
        (quad, u, v, cells.map(|cells| cells as f32))
    };
    let [a, b, c, d] = quad;
    if u + v <= 1.0 {
        return Point { corners: [a, b, d], u, v, scale: size };
    }
    Point { corners: [c, d, b], u: 1.0 - u, v: 1.0 - v, scale: size.map(|x| -x) }
}

/// Interpolates for many points, each by itself.
///
/// # Safety
/// The structure and its arrays are as the documentation of `rtcInterpolateN` asks.
pub(crate) unsafe fn many(arguments: &InterpolateManyArguments, mut one: impl FnMut(&InterpolateArguments)) {
    let (count, many) = (arguments.count as usize, arguments.many as usize);
    // Rows that are padded as the documentation asks.
    let mut rows = vec![[0.0f32; 4]; arguments.out.len() * count.div_ceil(4)];
    for i in 0..many {
        // SAFETY: by contract the arrays have `many` elements, or `valid` is null.
        let (is_valid, primitive, u, v) = unsafe {
            let valid = arguments.valid.is_null() || *arguments.valid.add(i) != 0;
            (valid, *arguments.primitives.add(i), *arguments.u.add(i), *arguments.v.add(i))
        };
        if !is_valid {
            continue;
        }
        let row = |k: usize| 4 * k * count.div_ceil(4);
        let first: *mut f32 = rows.as_mut_ptr().cast();
        let out = std::array::from_fn(|k| match arguments.out[k].is_null() {
            true => std::ptr::null_mut(),
            // SAFETY: the row lies in `rows`.
            false => unsafe { first.add(row(k)) },
        });
        let &InterpolateManyArguments { geometry, buffer, slot, count: values, .. } = arguments;
        one(&InterpolateArguments { geometry, primitive, u, v, buffer, slot, out, count: values });
        for (k, target) in arguments.out.iter().enumerate().filter(|(_, target)| !target.is_null()) {
            for j in 0..count {
                // SAFETY: the row lies in `rows`, and by contract the array has this element.
                unsafe { *target.add(j * many + i) = *first.add(row(k) + j) };
            }
        }
    }
}
