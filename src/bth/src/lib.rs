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

pub mod check;
pub mod error;
mod expansion;
pub mod file;
pub mod instances;
pub mod layout;
pub mod limits;
mod motion;
pub mod object;
pub mod rays;
mod scene;
mod simd;
#[cfg(test)]
mod testing;
mod trace;
mod unpack;
pub mod verify;

pub use error::{Code, Error};
pub use file::File;
pub use instances::Update;
pub use motion::InstanceView;
pub use scene::{Scene, from_bytes, map, open};
pub use simd::{Isa, IsaError};
pub use trace::{Hinted, Steps, Test};
