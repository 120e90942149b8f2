//! Runtime of BTH files: opens a compiled file and traces rays, zero-copy.
//!
//! ```no_run
//! use bth::rays::{Ray, Surface};
//!
//! let scene = bth::open("bunny.bth")?;
//! let ray = Ray { origin: [0.0, 0.1, 1.0], tmin: 0.0, direction: [0.0, 0.0, -1.0], tmax: f32::INFINITY };
//! let hit = scene.nearest(&ray, Surface::NONE);
//! if hit.is_hit() {
//!     println!("triangle {} at t = {}", hit.surface.triangle, hit.t);
//! }
//! # Ok::<(), bth::Error>(())
//! ```
#![warn(missing_docs)]
// Iterators and closures over lanes would be compiled without the instruction set that the lanes need.
#![allow(clippy::needless_range_loop)]

mod bvh;
mod instances;
mod intersect;
mod motion;
mod object;
mod query;
pub mod rays;
mod scene;
mod simd;
mod tets;

pub use bth_format::{Code, Error};
pub use instances::Update;
pub use motion::{InstanceView, check_first_frame};
pub use object::Hinted;
pub use query::Steps;
pub use scene::{Scene, from_bytes, map, open};
pub use simd::{Isa, IsaError};
