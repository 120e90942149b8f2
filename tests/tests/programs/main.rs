//! The programs `bthc` and `bth-play`, from the command line to the files they write.
// Tests say what they skip.
#![allow(clippy::print_stdout)]

mod cache;
mod compile;
mod costs;
mod errors;
mod inspect;
mod interrupt;
mod pipelines;
mod play;
mod previous;
#[cfg(unix)]
mod recipes;
mod scenes;
mod stress;
mod support;
mod trace;
mod window;
