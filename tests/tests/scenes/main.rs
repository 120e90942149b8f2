//! Scenes from end to end: import, compilation, animation and rays.
#![allow(clippy::print_stdout)] // a test that cannot run says so

mod flattened;
mod import;
mod motion;
mod poses;
mod sources;
mod support;
