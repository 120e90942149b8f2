//! Shading: camera rays of a batch of samples become colours, by the mode of the program.

mod context;
mod geometry;
mod lights;
mod path_tracer;
mod shader;
mod studio;
mod surface_modes;
mod visibility;

pub(crate) use context::{Counters, FrameContext, Sample};
pub(crate) use shader::Shader;
