//! Scenes from end to end: what is imported and compiled stands, moves and is hit as it should.
#![allow(clippy::print_stdout)] // a test that cannot run says so

mod flattened;
mod motion;
mod poses;
mod sources;
mod support;
