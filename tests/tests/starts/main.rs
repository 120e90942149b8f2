//! Rays that start on triangles: all queries agree with the exact oracle, with each other, and to
//! the bit on every instruction set.

mod check;
mod closed;
mod near;
mod objects;
mod random;
mod scenes;
mod unusable;
mod visible;
