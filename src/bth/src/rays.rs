//! Rays, hits and surfaces: what callers pass in and get back.
//!
//! These types are those of the C interface (`bth.h`), bit for bit.

use bth_format::layout::NONE;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A ray, world space: the points `origin + t * direction` with `tmin <= t <= tmax`.
/// The direction need not be normalized; t is in units of it.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Ray {
    /// Start point.
    pub origin: [f32; 3],
    /// Least t of a hit.
    pub tmin: f32,
    /// Direction, any length but zero.
    pub direction: [f32; 3],
    /// Greatest t of a hit; may be infinite.
    pub tmax: f32,
}

impl Ray {
    /// Rays as rows of the bits of their floats.
    pub(crate) fn rows(rays: &[Ray]) -> &[[u32; 8]] {
        <[[u32; 8]]>::ref_from_bytes(rays.as_bytes()).expect("a ray is eight words")
    }
}

/// A triangle of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Surface {
    /// Instance in the scene; 0 in the file of a single object.
    pub instance: u32,
    /// Face of the source file, after fan triangulation.
    pub triangle: u32,
}

impl Surface {
    /// No surface: a miss, or a ray that starts nowhere in particular.
    pub const NONE: Surface = Surface { instance: NONE, triangle: NONE };
}

/// Nearest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Hit {
    /// Distance in units of the direction; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second vertex, 0 to 1.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex, 0 to 1.
    pub v: f32,
    /// What was hit.
    pub surface: Surface,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, surface: Surface::NONE };

    /// Whether something was hit.
    pub fn is_hit(&self) -> bool {
        self.t < f32::INFINITY
    }
}

const _: () = assert!(size_of::<Ray>() == 32 && size_of::<Surface>() == 8 && size_of::<Hit>() == 20);
