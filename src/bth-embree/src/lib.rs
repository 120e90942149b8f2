//! Programs made for Embree 4, on bth: a library with the same functions, which can be preloaded or
//! take the place of `libembree4.so.4`. `docs/embree.md` says what it is for.
//!
//! | modules | |
//! |---|---|
//! | `abi` | structures and constants, from the public documentation |
//! | `exports` | the functions: handles and pointers in, errors to the device |
//! | `handles`, `device`, `buffer`, `geometry`, `transform`, `scene` | what programs make and set |
//! | `mesh`, `world` | from that to scenes of bth: one object for all triangles, and instances |
//! | `committed`, `commit` | what rays are traced through, and how it is made |
//! | `trace`, `packets`, `points`, `interpolate` | queries |
//! | `fallback`, `twin`, `geometry_twin` | another Embree 4, for what bth does not hold |
//! | `float_mode`, `statistics`, `error` | |
#![cfg(target_os = "linux")] // Finds another library by what the loader of Linux tells.

pub mod abi;
mod buffer;
mod commit;
mod committed;
mod device;
mod error;
pub mod exports;
mod fallback;
mod float_mode;
mod geometry;
mod geometry_twin;
mod handles;
mod interpolate;
mod mesh;
mod packets;
mod points;
mod scene;
mod statistics;
mod trace;
mod transform;
mod twin;
mod world;
