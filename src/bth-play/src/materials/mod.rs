//! Materials of the scene: textures decoded, and how the surface at a hit looks.

mod look;
mod texels;

pub(crate) use look::{Look, SceneMaterials};
