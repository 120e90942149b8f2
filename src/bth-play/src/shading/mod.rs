//! Shading: camera rays of a batch of samples become colours, by the mode of the program.

mod ambient_occlusion;
mod chance;
mod context;
mod geometry;
mod lights;
mod occlusion_rays;
mod path_tracer;
mod room_lamp;
mod shader;
mod step_counts;
mod studio;
mod surface_colors;
mod visibility;

pub(crate) use context::{Counters, FrameContext, Sample, Steps};
pub(crate) use shader::Shader;
