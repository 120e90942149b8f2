//! Rays, hits and the triangles of instances, as they are passed to and returned from queries. The
//! types have the same layout as in the C interface (`bth.h`).

use bth_format::layout::NONE;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A ray in world space: the points `origin + t * direction` with `tmin <= t <= tmax`. The
/// direction need not be normalized; t is in units of its length.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Ray {
    /// Point at t = 0, finite.
    pub origin: [f32; 3],
    /// Smallest t of a hit; may be negative or infinite. No hit's t is infinite: what lies beyond
    /// the range of `f32` is not hit.
    pub tmin: f32,
    /// Direction of any length except zero, finite.
    pub direction: [f32; 3],
    /// Largest t of a hit; may be infinite.
    pub tmax: f32,
}

/// Rays in a cache line.
pub(crate) const RAYS_PER_CACHE_LINE: usize = 64 / size_of::<Ray>();

impl Ray {
    /// A ray from `origin` without an end: `tmin` is 0 and `tmax` infinite.
    pub const fn new(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray { origin, tmin: 0.0, direction, tmax: f32::INFINITY }
    }

    /// The same line with the hits of another range of t.
    pub const fn with_range(self, tmin: f32, tmax: f32) -> Ray {
        Ray { tmin, tmax, ..self }
    }

    /// The point `origin + t * direction`, computed in `f64` and rounded to `f32`.
    pub fn at(&self, t: f32) -> [f32; 3] {
        std::array::from_fn(|k| {
            (f64::from(self.origin[k]) + f64::from(t) * f64::from(self.direction[k])) as f32
        })
    }

    /// For each ray the bits of its eight numbers, in the order of the fields.
    pub(crate) fn rows(rays: &[Ray]) -> &[[u32; 8]] {
        <[[u32; 8]]>::ref_from_bytes(rays.as_bytes()).ok().expect("a ray is eight words")
    }
}

/// A triangle of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct PrimitiveRef {
    /// Index of the instance in the scene. In a file without scene sections it is the index of the
    /// object.
    pub instance: u32,
    /// Index of the triangle in the source file, after fan triangulation of its faces.
    pub triangle: u32,
}

impl PrimitiveRef {
    /// No triangle: the value in a miss, and the hint of a ray with unknown start.
    pub const NONE: PrimitiveRef = PrimitiveRef { instance: NONE, triangle: NONE };

    /// The triangle, if it is one of the given instance; else `NONE`.
    #[inline(always)]
    pub(crate) fn triangle_of(self, instance: u32) -> u32 {
        if self.instance == instance { self.triangle } else { NONE }
    }
}

/// A point of a surface, at which a ray may start: the point with these weights of a triangle of an
/// instance.
///
/// It is the exact point a + u(b - a) + v(c - a) of the triangle's stored vertices a, b and c in
/// the space of the object, not rounded. Weights of hits are rounded; where u + v exceeds 1, the
/// start is the point (ub + vc) / (u + v) of the edge from b to c. So a start always lies on its
/// triangle.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Start {
    /// The triangle.
    pub primitive: PrimitiveRef,
    /// Barycentric weight of the triangle's second vertex, from 0 to 1.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex, from 0 to 1. u + v is at most 1, but for
    /// rounding (2^-22).
    pub v: f32,
}

impl Start {
    /// No point: a ray that starts here hits nothing.
    pub const NONE: Start = Start { primitive: PrimitiveRef::NONE, u: 0.0, v: 0.0 };

    /// The ray that leaves this point in a direction.
    pub const fn ray(self, direction: [f32; 3]) -> StartRay {
        StartRay { start: self, direction, tmax: f32::INFINITY }
    }
}

/// A ray that starts on a surface: the points `S + t * direction` with t > 0 and `t <= tmax`, where
/// S is the exact point of its start.
///
/// It never hits the surface that it leaves, nor another one through S, and never skips a wall,
/// however near: t > 0 is decided exactly. It needs no offset and no `tmin`. t is in units of the
/// length of the direction.
///
/// A ray whose start is not a point of a visible instance hits nothing;
/// [`Scene::check_start`](crate::Scene::check_start) says why.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct StartRay {
    /// Where the ray starts.
    pub start: Start,
    /// Direction in world space, of any length except zero, finite.
    pub direction: [f32; 3],
    /// Largest t of a hit; may be infinite.
    pub tmax: f32,
}

impl StartRay {
    /// The ray that leaves a hit in a direction.
    pub const fn from_hit(hit: &Hit, direction: [f32; 3]) -> StartRay {
        hit.start().ray(direction)
    }

    /// The same ray with another end.
    pub const fn with_tmax(self, tmax: f32) -> StartRay {
        StartRay { tmax, ..self }
    }

    /// For each ray the words of instance, triangle, u, v, direction and `tmax`.
    pub(crate) fn rows(rays: &[StartRay]) -> &[[u32; 8]] {
        <[[u32; 8]]>::ref_from_bytes(rays.as_bytes()).ok().expect("a ray is eight words")
    }
}

/// Nearest hit of a ray, or a miss.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Hit {
    /// Distance in units of the length of the ray's direction, rounded to f32; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex, from 0 to 1.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex, from 0 to 1.
    pub v: f32,
    /// The triangle, or [`PrimitiveRef::NONE`] for a miss.
    pub primitive: PrimitiveRef,
}

impl Hit {
    /// The result for a ray that hits nothing.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: PrimitiveRef::NONE };

    /// The result for a ray that hits something, where only that is asked.
    pub(crate) const SOME: Hit = Hit { t: 0.0, ..Hit::MISS };

    /// The point of the surface that was hit, at which another ray may start; [`Start::NONE`] for a
    /// miss.
    pub const fn start(&self) -> Start {
        Start { primitive: self.primitive, u: self.u, v: self.v }
    }

    /// Returns true if the ray hits a triangle.
    pub fn is_hit(&self) -> bool {
        self.t < f32::INFINITY
    }
}

/// A ray in f64: the points `origin + t * direction` with t from `tmin` to `tmax`.
///
/// All queries take it. They decide about its own numbers, exactly, and choose the nearest hit by
/// its exact t. Hits that they return have t, u and v rounded to f32;
/// [`Scene::hit_f64`](crate::Scene::hit_f64) returns the f64 numbers of a hit. A ray whose origin
/// leaves the range of f32 in the space of an object, or whose direction is beyond 2^±164, does not
/// hit it.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Ray64 {
    /// Point at t = 0, finite.
    pub origin: [f64; 3],
    /// Smallest t of a hit; may be negative or infinite.
    pub tmin: f64,
    /// Direction of any length except zero, finite.
    pub direction: [f64; 3],
    /// Largest t of a hit; may be infinite.
    pub tmax: f64,
}

impl Ray64 {
    /// A ray from `origin` without an end: `tmin` is 0 and `tmax` infinite.
    pub const fn new(origin: [f64; 3], direction: [f64; 3]) -> Ray64 {
        Ray64 { origin, tmin: 0.0, direction, tmax: f64::INFINITY }
    }

    /// The same line with the hits of another range of t.
    pub const fn with_range(self, tmin: f64, tmax: f64) -> Ray64 {
        Ray64 { tmin, tmax, ..self }
    }

    /// The point `origin + t * direction`.
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + t * self.direction[k])
    }

    /// The ray with each number rounded to f32.
    pub(crate) fn narrow(&self) -> Ray {
        let &Ray64 { origin, tmin, direction, tmax } = self;
        let [origin, direction] = [origin, direction].map(|v| v.map(|x| x as f32));
        Ray { origin, tmin: tmin as f32, direction, tmax: tmax as f32 }
    }
}

impl From<Ray> for Ray64 {
    fn from(ray: Ray) -> Ray64 {
        let [origin, direction] = [ray.origin, ray.direction].map(|v| v.map(f64::from));
        Ray64 { origin, tmin: ray.tmin.into(), direction, tmax: ray.tmax.into() }
    }
}

/// The numbers of a hit in f64.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Hit64 {
    /// Distance in units of the length of the ray's direction, with a relative error of at most
    /// 2^-40; infinite for a miss.
    pub t: f64,
    /// Barycentric weight of the triangle's second vertex, from 0 to 1, with an error of at most
    /// 2^-28.
    pub u: f64,
    /// The same of the triangle's third vertex.
    pub v: f64,
    /// The triangle, or [`PrimitiveRef::NONE`] for a miss.
    pub primitive: PrimitiveRef,
}

impl Hit64 {
    /// The result for a ray that hits nothing.
    pub const MISS: Hit64 = Hit64 { t: f64::INFINITY, u: 0.0, v: 0.0, primitive: PrimitiveRef::NONE };

    /// Returns true if the ray hits a triangle.
    pub fn is_hit(&self) -> bool {
        self.t < f64::INFINITY
    }
}

const _: () = assert!(size_of::<Ray64>() == 64 && size_of::<Hit64>() == 32);
const _: () = assert!(size_of::<Ray>() == 32 && size_of::<StartRay>() == 32);
const _: () = assert!(size_of::<Start>() == 16 && size_of::<PrimitiveRef>() == 8 && size_of::<Hit>() == 20);
