//! The programs `bthc` and `bth-play`, from the command line to the files they write.

mod compile;
mod errors;
mod inspect;
mod interrupt;
mod messy;
mod play;
mod support;
mod trace;
