//! The programs `bthc`, `bth-play` and `bth-scenes`, from the command line to the files that they
//! write.
// Tests print what they skip.
#![allow(clippy::print_stdout)]

mod cache;
mod compile;
mod costs;
mod errors;
mod inspect;
mod interrupt;
mod known_rays;
mod made_models;
mod materials;
#[cfg(target_os = "linux")]
mod memory;
mod mistakes;
#[cfg(target_os = "linux")]
mod paging;
mod pictures;
mod pipelines;
mod play;
mod play_files;
#[cfg(unix)]
mod recipes;
mod scenes;
mod schema;
mod shutter;
mod stress;
mod support;
mod trace;
mod window;
