//! Runtime of BTH files: opens compiled files and traces rays through them, without copying or
//! converting their sections.
//!
//! ```
//! use bth::rays::Ray;
//!
//! # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
//! // The unit cube as `bthc` compiles it. `bth::open("cube.bth")` maps a file.
//! let scene = bth::from_bytes(CUBE)?;
//! let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
//! let hit = scene.nearest(&ray).expect("it is above the cube");
//! assert_eq!((hit.t, ray.at(hit.t)), (1.0, [0.25, 0.5, 1.0]));
//! # Ok::<(), bth::Error>(())
//! ```
#![warn(missing_docs)]
// Kernels loop over lanes by index: iterators and closures could be compiled as functions without
// the kernel's instruction set.
#![allow(clippy::needless_range_loop)]
// What zerocopy tells about bytes that do not fit says less than the message, and its texts would
// be part of every program.
#![allow(clippy::ok_expect)]

mod animation;
mod batch;
mod builder;
mod bvh;
mod clock;
mod coherence;
mod enumerate;
mod fetch;
mod hits;
mod instances;
mod intersect;
mod masks;
mod materials;
mod nodes;
mod object;
mod objects;
mod parallel;
mod points;
mod query;
pub mod rays;
mod refit;
mod scene;
mod shortcuts;
#[doc(hidden)]
pub mod simd;
mod start_points;
mod starts;
mod surface;
mod trace;
mod trace_ray;
mod update;
mod visible;

pub use animation::DeformerPoses;
pub use batch::RayBatch;
pub use bth_format::layout::Opacity;
pub use bth_format::{Code, Error};
pub use builder::{Content, SceneBuilder};
pub use hits::{Accept, Crossings, Cull, Filter};
pub use instances::{InstancePath, Trees};
pub use materials::{Alpha, Gloss, Material, Texture, Wrap};
pub use points::{Closest, Closest64, Feature};
pub use query::Steps;
pub use scene::motion::{InstanceView, check_first_frame};
pub use scene::{Bounds, Scene, from_bytes, from_file, map, open};
pub use simd::{Isa, IsaError};
pub use surface::SurfacePoint;
pub use trace_ray::TraceRay;
pub use update::Update;
pub use visible::SegmentEnd;
