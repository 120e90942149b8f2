//! Shading: camera rays of a batch of samples become colours, by the mode of the program.

mod bsdf;
mod context;
mod geometry;
mod ground;
mod lights;
mod path_tracer;
mod shader;
mod sky;
mod studio;
mod surface;
mod surface_modes;
mod visibility;

pub(crate) use context::{Counters, FrameContext, Sample, Shaded};
pub(crate) use shader::Shader;
