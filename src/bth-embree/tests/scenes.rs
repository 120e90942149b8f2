//! Scenes of meshes, quads, grids and instances through the interface of Embree, compared with
//! every triangle in exact arithmetic.
#![cfg(target_os = "linux")]
#![allow(unsafe_code)] // Calls the interface as programs do.

use bth::rays::Ray as BthRay;
use bth_embree::exports::{device::*, geometry::*, rays::*, scene::*};
use bth_oracle::nearest;
use bth_random::Rng;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

const TRIANGLE: u32 = 0;
const QUAD: u32 = 1;
const GRID: u32 = 2;
const INSTANCE: u32 = 121;
const INSTANCE_ARRAY: u32 = 122;
const INDEX: u32 = 0;
const VERTEX: u32 = 1;
const GRIDS: u32 = 8;
const TRANSFORM: u32 = 23;
const UINT3: u32 = 0x5003;
const UINT4: u32 = 0x5004;
const FLOAT3: u32 = 0x9003;
const ROWS_3X4: u32 = 0x9134;
const FORMAT_GRID: u32 = 0xA001;
const ROBUST: u32 = 4;
const FILTER_IN_ARGUMENTS: u32 = 8;
const NONE: u32 = u32::MAX;

/// A ray with its hit, as programs declare it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    tnear: f32,
    direction: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
    instance_primitive: u32,
}

impl RayHit {
    fn new(origin: [f32; 3], direction: [f32; 3]) -> RayHit {
        RayHit {
            origin,
            tnear: 0.0,
            direction,
            time: 0.0,
            tfar: f32::INFINITY,
            mask: NONE,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instance: NONE,
            instance_primitive: NONE,
        }
    }

    fn name(&self) -> [u32; 4] {
        [self.geometry, self.primitive, self.instance, self.instance_primitive]
    }
}

/// A device without another library behind it.
fn device() -> *mut c_void {
    // SAFETY: the tests of this file all set the same value, before any device is made.
    unsafe {
        std::env::set_var("BTH_EMBREE_FALLBACK", "none");
        rtcNewDevice(null())
    }
}

fn trace(scene: *mut c_void, mut ray: RayHit) -> RayHit {
    // SAFETY: the scene lives and was committed.
    unsafe { rtcIntersect1(scene, (&raw mut ray).cast(), null_mut()) };
    ray
}

fn is_occluded(scene: *mut c_void, mut ray: RayHit) -> bool {
    // SAFETY: the scene lives and was committed.
    unsafe { rtcOccluded1(scene, (&raw mut ray).cast(), null_mut()) };
    ray.tfar == f32::NEG_INFINITY
}

/// A triangle that the oracle tests, in world space, with the name that hits in it have.
struct Known {
    corners: [[f32; 3]; 3],
    name: [u32; 4],
}

/// A scene with what it is expected to hold.
struct Made {
    scene: *mut c_void,
    known: Vec<Known>,
}

fn corner(rng: &mut Rng) -> [f32; 3] {
    // Few values, so that rays go through vertices, along edges and in planes.
    std::array::from_fn(|_| rng.below(9) as f32 - 4.0)
}

/// Adds a geometry with vertices and items to a scene.
unsafe fn add<T>(
    (device, scene): (*mut c_void, *mut c_void),
    (kind, buffer, format): (u32, u32, u32),
    vertices: &[[f32; 3]],
    items: &[T],
    id: u32,
) {
    // SAFETY: handles live; the vertices and items outlive the commit of the scene.
    unsafe {
        let geometry = rtcNewGeometry(device, kind);
        let count = vertices.len();
        rtcSetSharedGeometryBuffer(geometry, VERTEX, 0, FLOAT3, vertices.as_ptr().cast(), 0, 12, count);
        let data = rtcSetNewGeometryBuffer(geometry, buffer, 0, format, size_of::<T>(), items.len());
        std::ptr::copy_nonoverlapping(items.as_ptr(), data.cast(), items.len());
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, id);
        rtcReleaseGeometry(geometry);
    }
}

/// A scene of triangles, quads and a grid.
fn make(device: *mut c_void, rng: &mut Rng, flags: u32) -> Made {
    let vertices: Vec<[f32; 3]> = (0..24).map(|_| corner(rng)).collect();
    let index = |rng: &mut Rng| rng.below(26) as u32;
    let triangles: Vec<[u32; 3]> = (0..12).map(|_| [0; 3].map(|_: u32| index(rng))).collect();
    let quads: Vec<[u32; 4]> = (0..8).map(|_| [0; 4].map(|_: u32| index(rng))).collect();
    // Two grids of 3 x 2 and 2 x 2 vertices: start, stride, width and height.
    let grids = [[1u32, 5, 3 | 2 << 16], [7, 4, 2 | 2 << 16]];
    let mut known = Vec::new();
    let mut note = |rows: [u32; 3], geometry: u32, primitive: u32| {
        if let [Some(a), Some(b), Some(c)] = rows.map(|row| vertices.get(row as usize)) {
            known.push(Known { corners: [*a, *b, *c], name: [geometry, primitive, NONE, NONE] });
        }
    };
    for (row, triangle) in (0..).zip(&triangles) {
        note(*triangle, 3, row);
    }
    let mut note_quad = |[a, b, c, d]: [u32; 4], geometry: u32, primitive: u32| {
        if [a, b, c, d].iter().all(|row| (*row as usize) < vertices.len()) {
            note([a, b, d], geometry, primitive);
            note([c, d, b], geometry, primitive);
        }
    };
    for (row, quad) in (0..).zip(&quads) {
        note_quad(*quad, 7, row);
    }
    for (row, [start, stride, size]) in (0..).zip(grids) {
        for x in 0..(size & 0xFFFF) - 1 {
            let first = start + x;
            note_quad([first, first + 1, first + stride + 1, first + stride], 0, row);
        }
    }
    // SAFETY: the device lives, and the buffers are used by the commit only.
    let scene = unsafe {
        let scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, flags);
        add((device, scene), (TRIANGLE, INDEX, UINT3), &vertices, &triangles, 3);
        add((device, scene), (QUAD, INDEX, UINT4), &vertices, &quads, 7);
        add((device, scene), (GRID, GRIDS, FORMAT_GRID), &vertices, &grids, 0);
        rtcCommitScene(scene);
        assert_eq!(rtcGetDeviceError(device), 0);
        scene
    };
    Made { scene, known }
}

fn ray(rng: &mut Rng) -> RayHit {
    let origin = corner(rng).map(|x| 2.0 * x);
    let target = corner(rng);
    let direction = std::array::from_fn(|k| target[k] - origin[k]);
    let ray = RayHit::new(origin, direction);
    match rng.below(4) {
        0 => RayHit { tnear: 0.5, tfar: 2.0, ..ray },
        _ => ray,
    }
}

/// Compares answers with the oracle. Returns the number of hits.
fn compare(made: &Made, rng: &mut Rng, count: usize, robust: bool) -> usize {
    let corners: Vec<[[f32; 3]; 3]> = made.known.iter().map(|known| known.corners).collect();
    let mut hits = 0;
    for _ in 0..count {
        let ray = ray(rng);
        let tmin = if robust { ray.tnear } else { ray.tnear.next_up() };
        let asked = BthRay { origin: ray.origin, tmin, direction: ray.direction, tmax: ray.tfar };
        let expected = if ray.direction == [0.0; 3] { None } else { nearest(&corners, asked) };
        let found = trace(made.scene, ray);
        assert_eq!(is_occluded(made.scene, ray), expected.is_some(), "{ray:?}");
        let Some(expected) = expected else {
            assert_eq!(found, ray);
            continue;
        };
        hits += 1;
        assert_eq!(found.tfar, expected.t_f64() as f32, "{ray:?}");
        let names: Vec<[u32; 4]> =
            expected.triangles.iter().map(|row| made.known[*row as usize].name).collect();
        assert!(names.contains(&found.name()), "{ray:?} {found:?} {names:?}");
    }
    hits
}

#[test]
fn rays_hit_triangles_quads_and_grids() {
    let device = device();
    let mut hits = 0;
    for seed in 0..12 {
        let mut rng = Rng::new(seed);
        let robust = seed % 2 == 0;
        let made = make(device, &mut rng, if robust { ROBUST } else { 0 });
        hits += compare(&made, &mut rng, 200, robust);
        // SAFETY: the reference is ours.
        unsafe { rtcReleaseScene(made.scene) };
    }
    assert!(hits > 1000, "{hits}");
}

#[test]
fn rays_hit_instances_and_arrays_of_them() {
    let device = device();
    let mut hits = 0;
    for seed in 0..12 {
        let mut rng = Rng::new(100 + seed);
        let inner = make(device, &mut rng, ROBUST);
        let outer = make(device, &mut rng, ROBUST);
        // Exact in f32: the oracle gets images that are not rounded.
        let transforms: Vec<[f32; 12]> = (0..3)
            .map(|i| {
                let mut rows = [0.0; 12];
                for axis in 0..3 {
                    rows[4 * axis + (axis + i) % 3] = if rng.below(2) == 0 { 1.0 } else { -2.0 };
                    rows[4 * axis + 3] = rng.below(5) as f32 - 2.0;
                }
                rows
            })
            .collect();
        let mut known = outer.known;
        let mut place = |rows: &[f32; 12], instance: u32, number: u32| {
            for one in &inner.known {
                let corners = one.corners.map(|p| {
                    std::array::from_fn(|row| {
                        let m = &rows[4 * row..4 * row + 4];
                        m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3]
                    })
                });
                known.push(Known { corners, name: [one.name[0], one.name[1], instance, number] });
            }
        };
        // SAFETY: handles live; the transforms outlive the scenes.
        let scene = unsafe {
            let instance = rtcNewGeometry(device, INSTANCE);
            rtcSetGeometryInstancedScene(instance, inner.scene);
            rtcSetGeometryTransform(instance, 0, ROWS_3X4, transforms[0].as_ptr().cast());
            rtcCommitGeometry(instance);
            let array = rtcNewGeometry(device, INSTANCE_ARRAY);
            rtcSetGeometryInstancedScene(array, inner.scene);
            let data = transforms[1..].as_ptr().cast();
            rtcSetSharedGeometryBuffer(array, TRANSFORM, 0, ROWS_3X4, data, 0, 48, 2);
            rtcCommitGeometry(array);
            rtcAttachGeometryByID(outer.scene, instance, 11);
            rtcAttachGeometryByID(outer.scene, array, 12);
            rtcCommitScene(outer.scene);
            assert_eq!(rtcGetDeviceError(device), 0);
            outer.scene
        };
        place(&transforms[0], 11, 0);
        place(&transforms[1], 12, 0);
        place(&transforms[2], 12, 1);
        hits += compare(&Made { scene, known }, &mut rng, 100, true);
    }
    assert!(hits > 600, "{hits}");
}

/// A square of two triangles with a mask, at a height.
unsafe fn square(device: *mut c_void, scene: *mut c_void, z: f32, mask: u32, id: u32) -> *mut c_void {
    let vertices = [[0.0, 0.0, z], [2.0, 0.0, z], [2.0, 2.0, z], [0.0, 2.0, z]];
    let rows = [[0u32, 1, 2], [0, 2, 3]];
    // SAFETY: handles live, and new buffers have room for what is copied.
    unsafe {
        let geometry = rtcNewGeometry(device, TRIANGLE);
        let to = rtcSetNewGeometryBuffer(geometry, VERTEX, 0, FLOAT3, 16, 4).cast::<[f32; 4]>();
        vertices.iter().enumerate().for_each(|(i, v)| *to.add(i) = [v[0], v[1], v[2], 0.0]);
        let to = rtcSetNewGeometryBuffer(geometry, INDEX, 0, UINT3, 12, 2).cast::<[u32; 3]>();
        std::ptr::copy_nonoverlapping(rows.as_ptr(), to, 2);
        rtcSetGeometryMask(geometry, mask);
        rtcSetGeometryEnableFilterFunctionFromArguments(geometry, true);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, id);
        geometry
    }
}

/// `RTCIntersectArguments`.
#[repr(C)]
struct Arguments {
    flags: u32,
    features: u32,
    context: *mut Context,
    filter: unsafe extern "C" fn(*const FilterArguments),
    callback: *const c_void,
}

/// `RTCRayQueryContext`, and what a program puts behind it.
#[repr(C)]
struct Context {
    instance: u32,
    instance_primitive: u32,
    calls: Vec<(u32, u32, f32)>,
    rejects: u32,
}

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
struct FilterArguments {
    valid: *mut i32,
    user: *mut c_void,
    context: *mut Context,
    ray: *mut f32,
    hit: *mut [u32; 9],
    count: u32,
}

unsafe extern "C" fn filter(arguments: *const FilterArguments) {
    // SAFETY: the library gives valid arguments, and the context is the one that was passed.
    unsafe {
        let (arguments, context) = (&*arguments, &mut *(*arguments).context);
        assert_eq!(arguments.count, 1);
        let hit = *arguments.hit;
        context.calls.push((hit[6], context.instance, *arguments.ray.add(8)));
        if hit[6] == context.rejects {
            *arguments.valid = 0;
        }
    }
}

#[test]
fn masks_and_filters_decide() {
    let device = device();
    // SAFETY: handles live.
    unsafe {
        let inner = rtcNewScene(device);
        rtcSetSceneFlags(inner, FILTER_IN_ARGUMENTS);
        for (id, z) in [(0, 3.0), (1, 2.0), (2, 1.0)] {
            rtcReleaseGeometry(square(device, inner, z, 1 << id, id));
        }
        rtcCommitScene(inner);
        let outer = rtcNewScene(device);
        rtcSetSceneFlags(outer, FILTER_IN_ARGUMENTS);
        let instance = rtcNewGeometry(device, INSTANCE);
        rtcSetGeometryInstancedScene(instance, inner);
        rtcSetGeometryMask(instance, 7);
        rtcCommitGeometry(instance);
        rtcAttachGeometryByID(outer, instance, 5);
        rtcCommitScene(outer);
        assert_eq!(rtcGetDeviceError(device), 0);
        let down = RayHit::new([0.5, 0.25, 9.0], [0.0, 0.0, -1.0]);
        for (scene, id) in [(inner, NONE), (outer, 5)] {
            let at = |mask: u32| trace(scene, RayHit { mask, ..down }).geometry;
            assert_eq!([at(7), at(6), at(4), at(8)], [0, 1, 2, NONE]);
            assert!(is_occluded(scene, RayHit { mask: 4, ..down }));
            assert!(!is_occluded(scene, RayHit { mask: 8, ..down }));
            let mut context =
                Context { instance: NONE, instance_primitive: NONE, calls: Vec::new(), rejects: 0 };
            let mut arguments =
                Arguments { flags: 0, features: NONE, context: &mut context, filter, callback: null() };
            let mut found = down;
            rtcIntersect1(scene, (&raw mut found).cast(), (&raw mut arguments).cast());
            assert_eq!((found.geometry, found.instance, found.tfar), (1, id, 7.0));
            assert_eq!(found.normal, [0.0, 0.0, 4.0]);
            // Each hit is shown once.
            let mut shown: Vec<u32> = context.calls.iter().map(|call| call.0).collect();
            assert!(context.calls.iter().all(|call| call.1 == id), "{:?}", context.calls);
            shown.sort_unstable();
            shown.dedup();
            assert_eq!(shown.len(), context.calls.len());
            assert_eq!(context.instance, NONE);
            let mut any = RayHit { mask: 1, ..down };
            rtcOccluded1(scene, (&raw mut any).cast(), (&raw mut arguments).cast());
            assert_eq!(any.tfar, f32::INFINITY);
        }
    }
}

/// `RTCPointQuery`.
#[repr(C, align(16))]
struct PointQuery {
    point: [f32; 3],
    time: f32,
    radius: f32,
}

/// The first fields of `RTCPointQueryFunctionArguments`.
#[repr(C, align(16))]
struct PointArguments {
    query: *mut PointQuery,
    user: *mut Vec<u32>,
    primitive: u32,
    geometry: u32,
}

unsafe extern "C" fn point(arguments: *mut PointArguments) -> bool {
    // SAFETY: the library gives valid arguments, and the pointer that was passed.
    unsafe {
        let arguments = &mut *arguments;
        (*arguments.user).push(arguments.geometry);
        // The distance to squares at z = 3, 2 and 1 from a point above them.
        let distance = (*arguments.query).point[2] - (3 - arguments.geometry) as f32;
        let shrinks = distance < (*arguments.query).radius;
        if shrinks {
            (*arguments.query).radius = distance;
        }
        shrinks
    }
}

#[test]
fn point_queries_show_the_closest_first() {
    let device = device();
    // SAFETY: handles live; structures are aligned as the documentation asks.
    unsafe {
        let scene = rtcNewScene(device);
        for (id, z) in [(0, 3.0), (1, 2.0), (2, 1.0)] {
            rtcReleaseGeometry(square(device, scene, z, 1, id));
        }
        rtcCommitScene(scene);
        #[repr(align(16))]
        struct PointContext([u32; 64]);
        let mut context = PointContext([0; 64]);
        let mut shown: Vec<u32> = Vec::new();
        let mut query = PointQuery { point: [1.25, 1.0, 5.0], time: 0.0, radius: f32::INFINITY };
        type Function = unsafe extern "C" fn(*mut bth_embree::abi::PointQueryArguments) -> bool;
        let function = std::mem::transmute::<*const (), Function>(point as *const ());
        let user = (&raw mut shown).cast();
        let changed = rtcPointQuery(
            scene,
            (&raw mut query).cast(),
            context.0.as_mut_ptr().cast(),
            Some(function),
            user,
        );
        assert!(changed);
        assert_eq!((query.radius, shown), (2.0, vec![0]));
    }
}

#[test]
fn a_geometry_that_takes_the_place_of_an_empty_one_is_hit() {
    let device = device();
    // Larger ids are in no table that would hold the geometry.
    const ID: u32 = 1 << 21;
    // SAFETY: handles live.
    unsafe {
        let scene = rtcNewScene(device);
        for _ in 0..8 {
            let empty = rtcNewGeometry(device, TRIANGLE);
            rtcCommitGeometry(empty);
            rtcAttachGeometryByID(scene, empty, ID);
            rtcReleaseGeometry(empty);
            rtcCommitScene(scene);
            rtcDetachGeometry(scene, ID);
            // The allocator may give it the address of the other, which is gone.
            rtcReleaseGeometry(square(device, scene, 1.0, 1, ID));
            rtcCommitScene(scene);
            let down = RayHit::new([0.5, 0.25, 9.0], [0.0, 0.0, -1.0]);
            assert_eq!(trace(scene, down).geometry, ID);
            rtcDetachGeometry(scene, ID);
        }
    }
}

#[test]
fn what_is_wrong_is_refused() {
    let device = device();
    // SAFETY: handles live or are null.
    unsafe {
        let geometry = rtcNewGeometry(device, TRIANGLE);
        let refused = |code: u32| {
            assert_eq!(rtcGetDeviceError(device), code);
            let text = std::ffi::CStr::from_ptr(rtcGetDeviceLastErrorMessage(device));
            assert!(!text.is_empty());
        };
        assert!(rtcSetNewGeometryBuffer(geometry, INDEX, 0, UINT4, 16, 1).is_null());
        refused(3);
        rtcSetNewGeometryBuffer(geometry, VERTEX, 1, FLOAT3, 12, 1);
        refused(2);
        rtcSetNewGeometryBuffer(geometry, VERTEX, 0, FLOAT3, 13, 1);
        refused(3);
        rtcSetGeometryTimeStepCount(geometry, 0);
        refused(2);
        let scene = rtcNewScene(device);
        rtcAttachGeometryByID(scene, geometry, 4);
        rtcAttachGeometryByID(scene, geometry, 4);
        refused(3);
        rtcCommitScene(scene);
        refused(3);
        assert!(rtcNewGeometry(device, 77).is_null());
        refused(2);
        // Curves, which nobody answers here.
        let curves = rtcNewGeometry(device, 24);
        rtcSetNewGeometryBuffer(curves, INDEX, 0, 0x5001, 4, 1);
        rtcCommitGeometry(curves);
        let hairy = rtcNewScene(device);
        rtcAttachGeometry(hairy, curves);
        rtcCommitScene(hairy);
        refused(1);
        rtcCommitScene(null_mut());
        assert_eq!(rtcGetDeviceError(null_mut()), 2);
        assert_eq!(rtcAttachGeometry(scene, geometry), 0);
        assert_eq!(rtcAttachGeometry(scene, geometry), 1);
    }
}
