//! Programs made for Embree 4, on bth: a library with the same functions, which can be preloaded or
//! take the place of `libembree4.so.4`. `docs/embree.md` says what it is for.
//!
//! | modules | |
//! |---|---|
//! | `abi` | structures and constants, from the public documentation |
//! | `exports` | the functions: handles and pointers in, errors to the device |
//! | `handles`, `device`, `buffer`, `geometry`, `transform`, `scene` | what programs make and set |
//! | `commit`, `mesh`, `world` | from that to scenes of bth: one object for all triangles, and instances |
//! | `trace`, `packets`, `points`, `interpolate` | queries |
//! | `fallback`, `twin` | another Embree 4, for what bth does not hold, geometry by geometry |
//! | `float_mode`, `statistics`, `error` | |
#![cfg(target_os = "linux")] // Finds another library by what the loader of Linux tells.

pub mod abi;
mod buffer;
mod commit;
mod device;
mod error;
pub mod exports;
mod fallback;
mod float_mode;
mod geometry;
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
