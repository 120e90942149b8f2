//! Scenes from end to end: import, compilation, animation and rays.
#![allow(clippy::print_stdout)] // Tests that cannot run print why.

mod built;
mod deform;
mod deformers;
mod flattened;
mod groups;
mod import;
mod made_gltf;
mod morphs;
mod motion;
mod poses;
mod rigid_parts;
mod sequences;
mod sources;
mod support;
mod trees;
