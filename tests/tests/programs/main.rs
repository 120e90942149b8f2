//! The programs `bthc` and `bth-play`, from the command line to the files they write.
// Tests say what they skip.
#![allow(clippy::print_stdout)]

mod compile;
mod errors;
mod inspect;
mod interrupt;
mod play;
mod scenes;
mod support;
mod trace;
